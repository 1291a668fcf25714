//! The words of the camera's controls in the window.

use crate::device::{Control, Lock};

/// Name of a control.
pub fn name(control: Control) -> String {
    super::camera::capital(super::camera::control(control))
}

/// What it does, and what setting it means.
pub fn tip(control: Control) -> &'static str {
    match control {
        Control::Focus => {
            "Distance at which the lens is sharp, in the camera's own unit. It moves the principal point and the focal length: set it before the first view; afterwards nothing is taken until it is back."
        }
        Control::Zoom => {
            "Zoom, in the camera's own unit. It changes the focal length: set it before the first view; afterwards nothing is taken until it is back."
        }
        Control::Exposure => {
            "Exposure time, in the camera's own unit, mostly 0.1 ms. Shorter blurs less; nothing is taken until the picture has settled."
        }
        Control::Gain => {
            "Amplification, in the camera's own unit. More is brighter and noisier; nothing is taken until the picture has settled."
        }
        Control::WhiteBalance => {
            "Colour temperature, mostly in kelvin; nothing is taken until the picture has settled."
        }
    }
}

/// How a control stands, as read back; `asked` is on its way to the camera.
pub fn state(lock: Lock, asked: Option<i64>) -> String {
    match (asked, lock) {
        (Some(asked), _) => format!("setting to {asked}"),
        (None, lock) => super::camera::lock(lock),
    }
}

/// The button that undoes a change.
pub fn back(first: i64) -> String {
    format!("back to {first}")
}

/// The button that sets a control to what the views were taken with.
pub fn set_back(control: Control, value: i64) -> String {
    format!("Set the {} back to {value}", super::camera::control(control))
}

/// What it does.
pub fn back_tip(control: Control, first: i64) -> String {
    format!(
        "Set the {} as it was at the start of the session: {first}.",
        super::camera::control(control)
    )
}
