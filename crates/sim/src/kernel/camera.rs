//! Simulated camera: description, frames and faults.

use std::{collections::BTreeMap, path::PathBuf};

use boresight_capture::{
    layout,
    v4l2::kernel::{
        CAP_STREAMING, CAP_VIDEO_CAPTURE, Capability, ControlRange, Format, FourCc, Fraction,
        FrameSizes, Node,
    },
};
use boresight_geometry::device::PixelLayout;

/// Function that changes the frame of a number before sending.
type FrameFault = Box<dyn FnMut(u64, &mut SimFrame) + Send>;

/// Simulated camera. Every field may be changed at any time.
pub struct SimCamera {
    /// Video node, as in sysfs.
    pub node: Node,
    /// The driver's capabilities.
    pub capability: Capability,
    /// True while the camera is plugged in.
    pub present: bool,
    /// Formats with sizes and intervals.
    pub formats: Vec<(FourCc, Vec<FrameSizes>, Vec<Fraction>)>,
    /// Function from a requested format to the granted format.
    pub grants: Box<dyn FnMut(Format) -> Format + Send>,
    /// Interval granted for every request.
    pub grants_interval: Option<Fraction>,
    /// Size of each buffer in bytes.
    pub buffer_size: usize,
    /// Maximum number of buffers.
    pub most_buffers: u32,
    /// Time from the start of the stream to the first frame.
    pub start_nanos: u64,
    /// Factor by which frames are later than promised.
    pub slowness: f64,
    /// Number of the first frame of a stream.
    pub first_sequence: u32,
    /// Function from a frame number to the frame's bytes.
    pub picture: Box<dyn FnMut(u64) -> Vec<u8> + Send>,
    /// Faults of frames, applied in order.
    pub frame_faults: Vec<FrameFault>,
    /// Controls of the camera, by number.
    pub controls: BTreeMap<u32, SimControl>,
    /// Frames taken so far.
    pub taken: u64,
    /// Error of opening.
    pub open_fails: Option<i32>,
    /// Error of setting the format.
    pub set_format_fails: Option<i32>,
    /// Error of getting buffers.
    pub request_fails: Option<i32>,
    /// Error of starting.
    pub stream_on_fails: Option<i32>,
    /// Error of stopping.
    pub stream_off_fails: Option<i32>,
    /// Error of taking a buffer, with the number of failures.
    pub dequeue_fails: Option<(i32, u32)>,
    /// Error of handing a buffer over, with the number of failures.
    pub queue_fails: Option<(i32, u32)>,
    /// True if waits end with an error and nothing else.
    pub poll_error: bool,
    /// Duration of reading or setting a control.
    pub control_nanos: u64,
    /// Number of waits interrupted by a signal.
    pub interruptions: u32,
}

/// Control of a simulated camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SimControl {
    /// Range of values.
    pub range: ControlRange,
    /// Present value, in the driver's unit.
    pub value: i64,
    /// True if setting the control has an effect.
    pub obeys: bool,
}

/// Frame on the way into a buffer.
#[derive(Clone, Debug)]
pub struct SimFrame {
    /// Contents of the frame.
    pub bytes: Vec<u8>,
    /// Number of bytes claimed by the driver.
    pub bytes_used: u32,
    /// True if marked bad by the driver.
    pub error: bool,
    /// Sequence number of the frame.
    pub sequence: u32,
    /// Time stamp of the frame.
    pub nanos: u64,
    /// True if the buffer arrives.
    pub delivered: bool,
    /// Wrong buffer index reported by the driver.
    pub index: Option<u32>,
}

impl SimControl {
    /// Control with the range 0 to 255 at `value`.
    pub fn at(value: i64) -> Self {
        let range = ControlRange { min: 0, max: 255, step: 1, default: 128, writable: true };
        Self { range, value, obeys: true }
    }
}

impl SimCamera {
    /// Camera at `/dev/video<number>` with a single mode of `size` at 30 frames per second, no
    /// controls, and the serial number `serial`.
    pub fn new(
        number: u32,
        serial: &str,
        (fourcc, width, height): (FourCc, u32, u32),
        picture: impl FnMut(u64) -> Vec<u8> + Send + 'static,
    ) -> Self {
        let bytes_per_pixel = layout(fourcc).map_or(1, PixelLayout::bytes_per_pixel) as u32;
        let buffer_size = (width * height * bytes_per_pixel.max(2)) as usize;
        Self {
            node: Node {
                path: PathBuf::from(format!("/dev/video{number}")),
                place: format!("pci0000:00/usb1/1-{number}/1-{number}:1.0"),
                index: 0,
                usb_id: Some((0x0c45, 0x6366)),
                serial: serial.into(),
                links: Vec::new(),
                known_as: String::new(),
            },
            capability: Capability {
                driver: "uvcvideo".into(),
                card: "Simulated camera".into(),
                node_caps: CAP_VIDEO_CAPTURE | CAP_STREAMING,
            },
            present: true,
            formats: vec![(fourcc, vec![FrameSizes::Discrete(width, height)], vec![(1, 30)])],
            grants: Box::new(move |wanted| Format {
                bytes_per_line: if &fourcc == b"MJPG" { 0 } else { bytes_per_pixel * wanted.width },
                size_image: buffer_size as u32,
                ..wanted
            }),
            grants_interval: None,
            buffer_size,
            most_buffers: 32,
            start_nanos: 300_000_000,
            slowness: 1.0,
            first_sequence: 0,
            picture: Box::new(picture),
            frame_faults: Vec::new(),
            controls: BTreeMap::new(),
            taken: 0,
            open_fails: None,
            set_format_fails: None,
            request_fails: None,
            stream_on_fails: None,
            stream_off_fails: None,
            dequeue_fails: None,
            queue_fails: None,
            poll_error: false,
            control_nanos: 0,
            interruptions: 0,
        }
    }

    /// Adds `fault` to the frame faults.
    pub fn with_fault(mut self, fault: impl FnMut(u64, &mut SimFrame) + Send + 'static) -> Self {
        self.frame_faults.push(Box::new(fault));
        self
    }
}
