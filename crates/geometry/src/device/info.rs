use super::{Control, Mode};

/// Facts about a live camera when its session begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraInfo {
    /// Name, as the camera says it; may hold anything.
    pub name: String,
    /// USB vendor and product number.
    pub usb_id: Option<(u16, u16)>,
    /// USB serial number; empty if there is none.
    pub serial: String,
    /// Place where the camera is plugged in, in the system's words; empty if not known.
    pub place: String,
    /// Through what it is read, as `--backend` calls it.
    pub backend: &'static str,
    /// The granted mode.
    pub mode: Mode,
    /// The controls that matter, before the session locked them.
    pub controls: Vec<ControlBefore>,
}

/// State of a control before the session locked it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlBefore {
    /// The control concerned.
    pub control: Control,
    /// Value in the driver's unit; `None` if it can't be read.
    pub value: Option<i64>,
    /// True if the camera moved it by itself; `None` if it has no such automatic.
    pub automatic: Option<bool>,
    /// Driver's numbers and values of the control and of the controls that move it, in the order in which they are put
    /// back; empty if not known.
    pub exact: Vec<(u32, i64)>,
}
