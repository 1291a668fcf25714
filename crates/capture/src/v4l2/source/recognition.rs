//! Recognition of a returning camera, and of the requested mode.

use super::super::{
    discovery::{Camera, Found, Identity, discover_those},
    kernel::Kernel,
    stream::Loss,
};
use crate::{CameraMode, layout};
use boresight_geometry::device::{Fault, Mode};

/// The connected camera with the given identity.
///
/// # Errors
///
/// The fault and its details: it's away, another one is there, or two fit equally well.
pub fn found_again(kernel: &mut dyn Kernel, identity: &Identity) -> Result<Camera, Loss> {
    let found = discover_those(kernel, |node| identity.may_be(node));
    same(&found, identity)
}

/// The camera with the given identity among the connected cameras.
fn same(found: &Found, identity: &Identity) -> Result<Camera, Loss> {
    let mut fitting: Vec<_> =
        found.cameras.iter().filter_map(|c| identity.fit(c).map(|fit| (fit, c))).collect();
    fitting.sort_by_key(|(fit, _)| std::cmp::Reverse(*fit));
    match fitting.as_slice() {
        [(_, one)] => Ok((*one).clone()),
        [(best, one), (next, _), ..] if best > next => Ok((*one).clone()),
        [(_, one), ..] => Err((Fault::Twin, one.stable_name())),
        [] => {
            let other = found.cameras.iter().find(|camera| identity.is_place_of(camera));
            match (other, found.others.first()) {
                (Some(other), _) => {
                    Err((Fault::OtherCamera, format!("{}, {}", other.name, other.stable_name())))
                }
                // The node is there again, but may not be opened yet, or another program has it.
                (None, Some(other)) if matches!(other.why, Fault::Busy | Fault::NotPermitted) => {
                    Err((other.why, other.detail.clone()))
                }
                (None, _) => Err((Fault::NotFound, String::new())),
            }
        }
    }
}

/// Difference of the granted mode from the requested mode, if any.
pub(super) fn other_than_asked(offer: &CameraMode, mode: &Mode) -> Option<String> {
    let asked =
        Mode { size: offer.size, layout: layout(offer.fourcc)?, interval_secs: offer.interval };
    let rates = asked.rate_hz().zip(mode.rate_hz());
    let other_rate = rates.is_some_and(|(a, b)| (a - b).abs() > 0.02 * a);
    let named = |mode: &Mode| {
        let rate = mode.rate_hz().map_or(String::new(), |hz| format!(" at {hz:.0} fps"));
        format!("{} {}{rate}", mode.size, mode.layout.name())
    };
    ((asked.size, asked.layout) != (mode.size, mode.layout) || other_rate)
        .then(|| format!("asked for {}, granted {}", named(&asked), named(mode)))
}
