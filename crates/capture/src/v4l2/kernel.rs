//! Camera requests to the operating system, by meaning.
//!
//! Two implementations: [`super::linux`] makes the system calls; `simulation::kernel` is a model
//! with strict rules of buffer ownership and faults on demand. All answers of a driver are
//! untrusted.

use std::{
    fmt,
    path::{Path, PathBuf},
    time::Duration,
};

/// The system's number for an error.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Errno(pub i32);

impl Errno {
    /// The system's message for the number.
    pub fn words(self) -> String {
        std::io::Error::from_raw_os_error(self.0).to_string()
    }
}

impl fmt::Debug for Errno {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words())
    }
}

/// An open device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Handle(pub i32);

/// A video node in sysfs. Texts come from the device and may hold anything.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// Path, such as `/dev/video0`.
    pub path: PathBuf,
    /// Place of the device: the folder in sysfs, below `/sys/devices`.
    pub place: String,
    /// Index of the node among the device's nodes.
    pub index: u32,
    /// USB vendor and product number.
    pub usb_id: Option<(u16, u16)>,
    /// USB serial number; cheap cameras share a number or have none.
    pub serial: String,
    /// Names under `/dev/v4l/by-id` and `/dev/v4l/by-path` of the node.
    pub links: Vec<PathBuf>,
    /// Permanent name of the device, with the prefix of its backend; empty if named by its place.
    pub known_as: String,
}

/// Answer to a query for capabilities.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Capability {
    /// Name of the driver.
    pub driver: String,
    /// Name of the camera.
    pub card: String,
    /// Capabilities of the node, not of the whole device.
    pub node_caps: u32,
}

/// The node captures pictures.
pub const CAP_VIDEO_CAPTURE: u32 = 0x0000_0001;
/// The node streams.
pub const CAP_STREAMING: u32 = 0x0400_0000;

/// A four-character code.
pub type FourCc = [u8; 4];

/// Sizes of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameSizes {
    /// A single size: width and height in pixels.
    Discrete(u32, u32),
    /// A range of sizes, in pixels.
    Stepwise {
        /// Least, largest and step of the width.
        width: (u32, u32, u32),
        /// Least, largest and step of the height.
        height: (u32, u32, u32),
    },
}

/// Time from frame to frame as a fraction of a second. Either part may be 0.
pub type Fraction = (u32, u32);

/// Format of the pictures in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Pixels in a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Four-character code of the pixel format.
    pub fourcc: FourCc,
    /// Bytes from row to row; 0 if compressed or unstated.
    pub bytes_per_line: u32,
    /// Bytes of the largest picture; often misreported by drivers.
    pub size_image: u32,
}

/// A buffer handed back by the driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filled {
    /// Index of the buffer.
    pub index: u32,
    /// Bytes of the frame; the rest of the buffer is from older frames.
    pub bytes_used: u32,
    /// See `FLAG_ERROR`, `TIMESTAMP_MASK`.
    pub flags: u32,
    /// Number of the frame; wraps.
    pub sequence: u32,
    /// Driver's timestamp.
    pub nanos: u64,
}

/// Flag of the driver for bad contents.
pub const FLAG_ERROR: u32 = 0x40;
/// Mask of the bits for a timestamp's clock.
pub const TIMESTAMP_MASK: u32 = 0xe000;
/// The monotonic clock.
pub const TIMESTAMP_MONOTONIC: u32 = 0x2000;

/// Reason for the end of a wait.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Readiness {
    /// A buffer is ready.
    pub readable: bool,
    /// The device reports an error.
    pub error: bool,
}

/// Range of a control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlRange {
    /// Least value, in the driver's unit.
    pub min: i64,
    /// Largest value, in the driver's unit.
    pub max: i64,
    /// Step between values, in the driver's unit.
    pub step: i64,
    /// Value at the start.
    pub default: i64,
    /// True if the control can be set.
    pub writable: bool,
}

/// The system calls of a camera. `Err` carries the system's number.
///
/// All devices are opened so that taking a buffer never waits.
#[allow(missing_docs, reason = "each is the V4L2 or POSIX call of that meaning")]
pub trait Kernel: Send {
    /// Name for `--backend`.
    fn backend(&self) -> &'static str {
        "v4l"
    }
    /// Video nodes present now.
    fn nodes(&mut self) -> Vec<Node>;
    fn open(&mut self, path: &Path) -> Result<Handle, Errno>;
    fn close(&mut self, device: Handle);
    fn capability(&mut self, device: Handle) -> Result<Capability, Errno>;
    fn pixel_format(&mut self, device: Handle, index: u32) -> Result<FourCc, Errno>;
    fn frame_sizes(&mut self, device: Handle, of: FourCc, index: u32) -> Result<FrameSizes, Errno>;
    /// A range of intervals is given by the shortest.
    fn frame_interval(
        &mut self,
        device: Handle,
        of: (FourCc, u32, u32),
        index: u32,
    ) -> Result<Fraction, Errno>;
    fn set_format(&mut self, device: Handle, wanted: Format) -> Result<Format, Errno>;
    fn set_interval(&mut self, device: Handle, wanted: Fraction) -> Result<Fraction, Errno>;
    /// A count of 0 frees all.
    fn request_buffers(&mut self, device: Handle, count: u32) -> Result<u32, Errno>;
    /// Maps a buffer; returns the length in bytes.
    fn map(&mut self, device: Handle, index: u32) -> Result<usize, Errno>;
    fn unmap_all(&mut self, device: Handle);
    fn queue(&mut self, device: Handle, index: u32) -> Result<(), Errno>;
    fn dequeue(&mut self, device: Handle) -> Result<Filled, Errno>;
    fn stream_on(&mut self, device: Handle) -> Result<(), Errno>;
    fn stream_off(&mut self, device: Handle) -> Result<(), Errno>;
    fn wait(&mut self, device: Handle, patience: Duration) -> Result<Readiness, Errno>;
    /// Contents of a mapped buffer owned by the program; `None` for another buffer, or a shorter
    /// one.
    fn bytes(&mut self, device: Handle, index: u32, len: usize) -> Option<&[u8]>;
    fn control_range(&mut self, device: Handle, id: u32) -> Result<ControlRange, Errno>;
    fn control(&mut self, device: Handle, id: u32) -> Result<i64, Errno>;
    fn set_control(&mut self, device: Handle, id: u32, value: i64) -> Result<(), Errno>;
    /// Programs with the node open, as far as visible to the user.
    fn holders(&mut self, path: &Path) -> Vec<String>;
    /// The monotonic clock, and the computer's time asleep since the start.
    fn clock(&mut self) -> Clock;
    /// Lets time pass.
    fn pause(&mut self, time: Duration);
}

/// Readings of the system's clocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// Monotonic time in nanoseconds. It doesn't run while the computer sleeps. Drivers' timestamps
    /// use this clock.
    pub monotonic_nanos: u64,
    /// Time asleep, in nanoseconds.
    pub slept_nanos: u64,
}
