//! Faults of a camera, each with a stable code.

/// Fault of a camera. The messages are in `text`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fault {
    /// There is no camera with the given name, or none at all.
    NotFound,
    /// The system does not let this user open the camera.
    NotPermitted,
    /// Another program uses the camera.
    Busy,
    /// The node takes no pictures: it is for metadata or output.
    NotACamera,
    /// The camera is virtual: another program feeds it.
    Virtual,
    /// The camera is an infrared camera, or the pictures are alternately lit and dark.
    Infrared,
    /// Another camera is in the expected camera's place.
    OtherCamera,
    /// Two cameras cannot be told apart.
    Twin,
    /// The camera offers no usable picture format or size.
    NoFormat,
    /// The driver grants another mode than the requested mode.
    OtherMode,
    /// The USB bus has no bandwidth left for the camera.
    NoBandwidth,
    /// Transfers fail: cable, hub or power.
    Transfer,
    /// No first picture came.
    NoFirstFrame,
    /// Pictures came, then stopped.
    Stalled,
    /// The camera was unplugged.
    Unplugged,
    /// The host was suspended.
    Suspended,
    /// The driver breaks the interface's rules.
    DriverBroken,
    /// Most pictures arrive damaged.
    DamagedFrames,
    /// The same picture arrives again and again.
    Frozen,
    /// The pictures are black.
    Dark,
    /// Far fewer pictures arrive than the mode promises.
    Slow,
    /// A control was set, but reads another value.
    ControlIgnored,
    /// Focus or zoom moved without a command.
    GeometryMoved,
    /// Focus, zoom and exposure are neither locked nor watched.
    Unwatched,
    /// The program for reading the stream is not installed.
    NoReader,
    /// The program for reading the stream ended or failed.
    ReaderFailed,
    /// A network stream ended or went silent.
    StreamLost,
    /// The network camera requires another user name or password.
    NotLoggedIn,
    /// The network camera has no stream at this address.
    NoSuchStream,
    /// Nothing answers at the address.
    Unreachable,
    /// The command for sending the pictures can't be started.
    NoCommand,
    /// The command for sending the pictures ended or failed.
    CommandEnded,
    /// No picture comes through a pipe.
    NoPictures,
    /// Data from a pipe can't be read as pictures.
    NotPictures,
    /// The pictures have another size than the session's.
    OtherSize,
    /// A picture of a folder can't be read, and is left out.
    BrokenPicture,
    /// There is no publisher of pictures on this topic of ROS 2.
    NoSuchTopic,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 37] = [
        Self::NotFound,
        Self::NotPermitted,
        Self::Busy,
        Self::NotACamera,
        Self::Virtual,
        Self::Infrared,
        Self::OtherCamera,
        Self::Twin,
        Self::NoFormat,
        Self::OtherMode,
        Self::NoBandwidth,
        Self::Transfer,
        Self::NoFirstFrame,
        Self::Stalled,
        Self::Unplugged,
        Self::Suspended,
        Self::DriverBroken,
        Self::DamagedFrames,
        Self::Frozen,
        Self::Dark,
        Self::Slow,
        Self::ControlIgnored,
        Self::GeometryMoved,
        Self::Unwatched,
        Self::NoReader,
        Self::ReaderFailed,
        Self::StreamLost,
        Self::NotLoggedIn,
        Self::NoSuchStream,
        Self::Unreachable,
        Self::NoCommand,
        Self::CommandEnded,
        Self::NoPictures,
        Self::NotPictures,
        Self::OtherSize,
        Self::BrokenPicture,
        Self::NoSuchTopic,
    ];

    /// Stable name, for recordings, machines and support.
    pub fn code(self) -> &'static str {
        match self {
            Self::NotFound => "CAM-NONE",
            Self::NotPermitted => "CAM-PERM",
            Self::Busy => "CAM-BUSY",
            Self::NotACamera => "CAM-META",
            Self::Virtual => "CAM-LOOP",
            Self::Infrared => "CAM-IR",
            Self::OtherCamera => "CAM-OTHER",
            Self::Twin => "CAM-TWIN",
            Self::NoFormat => "FMT-NONE",
            Self::OtherMode => "FMT-OTHER",
            Self::NoBandwidth => "USB-BW",
            Self::Transfer => "USB-PROTO",
            Self::NoFirstFrame => "STR-START",
            Self::Stalled => "STR-STALL",
            Self::Unplugged => "DEV-UNPLUG",
            Self::Suspended => "DEV-SUSPEND",
            Self::DriverBroken => "DEV-DRIVER",
            Self::DamagedFrames => "FRM-BAD",
            Self::Frozen => "FRM-FROZEN",
            Self::Dark => "FRM-DARK",
            Self::Slow => "FMT-FPS",
            Self::ControlIgnored => "CTL-LIE",
            Self::GeometryMoved => "CTL-MOVED",
            Self::Unwatched => "CTL-BLIND",
            Self::NoReader => "FFM-NONE",
            Self::ReaderFailed => "FFM-END",
            Self::StreamLost => "NET-LOST",
            Self::NotLoggedIn => "NET-LOGIN",
            Self::NoSuchStream => "NET-PATH",
            Self::Unreachable => "NET-REACH",
            Self::NoCommand => "PIPE-NONE",
            Self::CommandEnded => "PIPE-END",
            Self::NoPictures => "PIPE-SILENT",
            Self::NotPictures => "PIPE-FORMAT",
            Self::OtherSize => "PIPE-SIZE",
            Self::BrokenPicture => "PIC-BAD",
            Self::NoSuchTopic => "ROS-TOPIC",
        }
    }

    /// Fault with a stable name.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.code() == code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_stands_for_one_fault() {
        for fault in Fault::ALL {
            assert_eq!(Fault::from_code(fault.code()), Some(fault));
        }
        assert_eq!(Fault::from_code("CAM-X"), None);
    }
}
