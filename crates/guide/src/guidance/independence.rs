//! Independence: judges if a view's principal line adds anything to the accepted lines.

use std::f64::consts::PI;

use super::{
    params::{GuidanceParams, width_scale},
    refusal::Refusal,
    slots::direction_difference_rad,
    view::{LensEstimate, View},
};

/// Role of a view among the accepted ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", tag = "role")]
pub enum Role {
    /// The view's principal line is linearly independent of all accepted ones.
    NewDirection,
    /// The view is the opposed partner, 180° apart, of an accepted view without a partner.
    Partner {
        /// Index of the partner among the accepted views.
        of: usize,
    },
    /// The view's principal line depends on an accepted one, and the view tells something new.
    Further,
    /// The person forced the view; no limit was checked.
    Forced,
}

/// Number of views from which a principal line can be tested against the others. Source:
/// `docs/method.md`, section 3.6.
const CONSISTENCY_FROM_VIEWS: usize = 5;
/// Standard deviations beyond which a line contradicts the others. Source: `docs/method.md`,
/// section 3.6.
const CONSISTENCY_SIGMAS: f64 = 3.5;
/// Distance from the principal point, in a picture 1280 pixels wide, below which a line contradicts
/// nothing, even with a tiny standard deviation. Chosen for the error of a too simple lens model:
/// 2.2 px with eight views in reflected pairs. Source: `docs/method.md`, section 3.9.
const LENS_MODEL_FLOOR_PX: f64 = 2.0;
/// Least angle between independent principal lines, however well both are known.
const LEAST_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Angle to another line at which a line must differ significantly to count as known: half the
/// angle between slots.
const KNOWN_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;

/// Role of `view` among the `accepted` views: the two rules independent of gain. Source:
/// `docs/method.md`, sections 3.2, 3.3 and 3.6.
///
/// A view counts if and only if its principal line is independent of every accepted one, or if it
/// is the opposed partner of an accepted view without one. Two lines are independent if and only if
/// their angle ψ is significant: `ψ > independent_sigmas · √(sd φ₁² + sd φ₂²)`, and at least 5°.
///
/// # Errors
///
/// The [`Refusal`] with the measured and the required value.
pub fn role_of(
    view: &View,
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Result<Role, Refusal> {
    let (sigma_rad, most_rad) = (view.line.sigma_phi_rad(), KNOWN_RAD / params.independent_sigmas);
    if !(sigma_rad <= most_rad) {
        let wanted_rad = params.wanted_tilt_rad(lens_estimate.f_to_width());
        return Err(match view.tilt_rad {
            Some(tilt_rad) if tilt_rad > 0.5 * wanted_rad => {
                Refusal::Unclear { sigma_rad, wanted_rad: most_rad }
            }
            tilt => Refusal::TooFlat { tilt_rad: tilt.unwrap_or(0.0), wanted_rad },
        });
    }
    consistent(view, accepted, lens_estimate)?;
    let mut nearest: Option<(f64, f64)> = None;
    for (index, other) in accepted.iter().enumerate() {
        let opposed_rad =
            direction_difference_rad(view.tilt_azimuth_rad(), other.tilt_azimuth_rad() + PI).abs();
        if opposed_rad <= params.partner_slot_rad && lacks_partner(index, accepted) {
            return Ok(Role::Partner { of: index });
        }
        let sigma_rad = libm::hypot(view.line.sigma_phi_rad(), other.line.sigma_phi_rad());
        let angle_rad = view.line.angle_to(&other.line);
        let wanted_rad = LEAST_RAD.max(params.independent_sigmas * sigma_rad);
        if angle_rad <= wanted_rad && nearest.is_none_or(|(least, _)| angle_rad < least) {
            nearest = Some((angle_rad, wanted_rad));
        }
    }
    match nearest {
        Some((nearest_rad, wanted_rad)) => Err(Refusal::AlreadyCovered { nearest_rad, wanted_rad }),
        None => Ok(Role::NewDirection),
    }
}

/// Index of the opposed partner of the accepted view at `index`; either view may have been taken
/// first. `None` without a partner, or without a view at `index`. Settled at acceptance: a better
/// lens estimate doesn't undo it.
pub(crate) fn partner_of(index: usize, accepted: &[View]) -> Option<usize> {
    let view = accepted.get(index)?;
    accepted.iter().position(|other| {
        view.partner_frame == Some(other.frame_id) || other.partner_frame == Some(view.frame_id)
    })
}

/// True if the partner of the accepted view at `index` is missing.
pub(crate) fn lacks_partner(index: usize, accepted: &[View]) -> bool {
    accepted.get(index).is_some_and(|view| !view.is_further)
        && partner_of(index, accepted).is_none()
}

/// Refuses a line with `|z| > 3.5` once there are five views, where
/// `z = (n·P − c) / √(var + nᵀ C_P n + (a_res n·(m − P))²)`. Source: `docs/method.md`, section 3.6.
fn consistent(view: &View, accepted: &[View], lens_estimate: &LensEstimate) -> Result<(), Refusal> {
    if accepted.len() < CONSISTENCY_FROM_VIEWS || lens_estimate.covariance.is_none() {
        return Ok(());
    }
    let pp = lens_estimate.camera.pp_px;
    let normal = view.line.normal();
    let pull_px = lens_estimate.line_bias_per_px() * normal.dot(&(view.mean_px - pp));
    let variance = view.line.variance_of_distance(&pp)
        + (normal.transpose() * lens_estimate.pp_covariance_px2() * normal).x
        + pull_px * pull_px;
    let distance_px = view.line.distance_px(&pp).abs();
    let sigmas = distance_px / variance.max(1e-12).sqrt();
    let floor_px = LENS_MODEL_FLOOR_PX * width_scale(lens_estimate.image_size);
    if sigmas > CONSISTENCY_SIGMAS && distance_px > floor_px {
        return Err(Refusal::Inconsistent { sigmas, wanted: CONSISTENCY_SIGMAS });
    }
    Ok(())
}
