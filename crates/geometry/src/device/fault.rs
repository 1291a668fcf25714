//! Faults of a camera, each with a stable code.

use crate::coded::coded;

coded! {
    /// Fault of a camera. The messages are in `text`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Fault {
        /// There is no camera with the given name, or none at all.
        NotFound = "CAM-NONE",
        /// The system does not let this user open the camera.
        NotPermitted = "CAM-PERM",
        /// Another program uses the camera.
        Busy = "CAM-BUSY",
        /// The node takes no pictures: it is for metadata or output.
        NotACamera = "CAM-META",
        /// The camera is virtual: another program feeds it.
        Virtual = "CAM-LOOP",
        /// The camera is an infrared camera, or the pictures are alternately lit and dark.
        Infrared = "CAM-IR",
        /// Another camera is in the expected camera's place.
        OtherCamera = "CAM-OTHER",
        /// Two cameras cannot be told apart.
        Twin = "CAM-TWIN",
        /// The camera offers no usable picture format or size.
        NoFormat = "FMT-NONE",
        /// The driver grants another mode than the requested mode.
        OtherMode = "FMT-OTHER",
        /// The USB bus has no bandwidth left for the camera.
        NoBandwidth = "USB-BW",
        /// Transfers fail: cable, hub or power.
        Transfer = "USB-PROTO",
        /// No first picture came.
        NoFirstFrame = "STR-START",
        /// Pictures came, then stopped.
        Stalled = "STR-STALL",
        /// The camera was unplugged.
        Unplugged = "DEV-UNPLUG",
        /// The host was suspended.
        Suspended = "DEV-SUSPEND",
        /// The driver breaks the interface's rules.
        DriverBroken = "DEV-DRIVER",
        /// Most pictures arrive damaged.
        DamagedFrames = "FRM-BAD",
        /// The same picture arrives again and again.
        Frozen = "FRM-FROZEN",
        /// The pictures are black.
        Dark = "FRM-DARK",
        /// Far fewer pictures arrive than the mode promises.
        Slow = "FMT-FPS",
        /// A control was set, but reads another value.
        ControlIgnored = "CTL-LIE",
        /// Focus or zoom moved without a command.
        GeometryMoved = "CTL-MOVED",
        /// Focus, zoom and exposure are neither locked nor watched.
        Unwatched = "CTL-BLIND",
        /// The program for reading the stream is not installed.
        NoReader = "FFM-NONE",
        /// The program for reading the stream ended or failed.
        ReaderFailed = "FFM-END",
        /// A network stream ended or went silent.
        StreamLost = "NET-LOST",
        /// The network camera requires another user name or password.
        NotLoggedIn = "NET-LOGIN",
        /// The network camera has no stream at this address.
        NoSuchStream = "NET-PATH",
        /// Nothing answers at the address.
        Unreachable = "NET-REACH",
        /// The command for sending the pictures can't be started.
        NoCommand = "PIPE-NONE",
        /// The command for sending the pictures ended or failed.
        CommandEnded = "PIPE-END",
        /// No picture comes through a pipe.
        NoPictures = "PIPE-SILENT",
        /// Data from a pipe can't be read as pictures.
        NotPictures = "PIPE-FORMAT",
        /// The pictures have another size than the session's.
        OtherSize = "PIPE-SIZE",
        /// A picture of a folder can't be read, and is left out.
        BrokenPicture = "PIC-BAD",
        /// There is no publisher of pictures on this topic of ROS 2.
        NoSuchTopic = "ROS-TOPIC",
    }
    /// Every fault.
    ALL
    /// Stable name, for recordings, machines and support.
    code
}

impl Fault {
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
