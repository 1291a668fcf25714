use super::{Control, Mode};

/// Facts about a live camera at the start of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraInfo {
    /// Name reported by the camera; arbitrary text.
    pub name: String,
    /// USB vendor and product number.
    pub usb_id: Option<(u16, u16)>,
    /// USB serial number; empty if there is none.
    pub serial: String,
    /// Place where the camera is plugged in, in the system's words; empty if not known.
    pub place: String,
    /// Backend, as named by `--backend`.
    pub backend: &'static str,
    /// The granted mode.
    pub mode: Mode,
    /// Relevant controls, before locking by the session.
    pub controls: Vec<ControlBefore>,
}

/// State of a control before locking by the session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControlBefore {
    /// The control concerned.
    pub control: Control,
    /// Value in the driver's unit; `None` if it can't be read.
    pub value: Option<i64>,
    /// True if the camera adjusted the control automatically; `None` if there is no such automatic.
    pub automatic: Option<bool>,
    /// Driver's numbers and values of the control and of dependent controls, in the order of
    /// restoring; empty if not known.
    pub exact: Vec<(u32, i64)>,
}
