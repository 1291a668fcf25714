//! Lookup of a camera by name.

use super::{
    Network,
    discovery::{address, near},
};
use boresight_capture::{
    listed,
    v4l2::{Camera, discover},
};
use boresight_geometry::device::Fault;

/// Camera by `name`.
///
/// # Errors
///
/// The fault and its details: no answer, several with this name, or it can't be opened.
pub fn find(name: &str) -> Result<Camera, (Fault, String)> {
    let mut network = Network::of(name);
    let found = discover(&mut network);
    match (found.cameras.as_slice(), found.others.as_slice()) {
        ([camera], []) => Ok(camera.clone()),
        ([], [other]) => Err((other.why, other.detail.clone())),
        ([], []) if address(name).is_some() => Err((Fault::Unreachable, name.into())),
        ([], []) => {
            let there: Vec<String> = near().into_iter().map(|seen| seen.node.known_as).collect();
            let there = if there.is_empty() {
                "no camera answers on the network".into()
            } else {
                format!("there is {}", listed(&there, ", "))
            };
            Err((Fault::NotFound, format!("{name}; {there}")))
        }
        (cameras, others) => {
            let nodes = cameras.iter().map(|c| &c.node).chain(others.iter().map(|o| &o.node));
            let names: Vec<String> = nodes.map(|node| node.path.display().to_string()).collect();
            Err((Fault::Twin, listed(&names, " or ")))
        }
    }
}
