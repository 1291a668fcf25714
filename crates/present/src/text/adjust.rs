//! The words of the camera's controls in the window.

use boresight_geometry::device::{Control, Lock};

/// Name of a control.
pub fn name(control: Control) -> String {
    super::camera::capital(super::camera::control(control))
}

/// Effect of a control, and of setting the control.
pub fn tip(control: Control) -> &'static str {
    match control {
        Control::Focus => {
            "Distance at which the lens is sharp, in camera units. It moves the principal point and the focal length, so set it before the first view. A later change pauses capture until you set it back."
        }
        Control::Zoom => {
            "Zoom, in camera units. It changes the focal length, so set it before the first view. A later change pauses capture until you set it back."
        }
        Control::Exposure => {
            "Exposure time, in camera units, usually 0.1 ms. A shorter exposure blurs less. Capture pauses until the picture settles."
        }
        Control::Gain => {
            "Amplification, in camera units. Higher is brighter and noisier. Capture pauses until the picture settles."
        }
        Control::WhiteBalance => {
            "Colour temperature, usually in kelvin. Capture pauses until the picture settles."
        }
    }
}

/// State of a control, as read back; `asked` is on the way to the camera.
pub fn state(lock: Lock, asked: Option<i64>) -> String {
    match (asked, lock) {
        (Some(asked), _) => format!("setting to {asked}"),
        (None, lock) => super::camera::lock(lock),
    }
}

/// Button to undo a change.
pub fn back(first: i64) -> String {
    format!("reset to {first}")
}

/// Button to reset a control to the value used for the views.
pub fn set_back(control: Control, value: i64) -> String {
    format!("Set the {} back to {value}", super::camera::control(control))
}

/// Tooltip of the button.
pub fn back_tip(control: Control, first: i64) -> String {
    format!(
        "Set the {} back to its value at the start of the session: {first}.",
        super::camera::control(control)
    )
}
