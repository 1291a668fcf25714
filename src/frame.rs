//! One picture from a source, and when it was taken.

use image::GrayImage;
use nalgebra::Point2;

/// Number of a frame within its source, in capture order. Gaps are frames that were lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId(pub u64);

impl FrameId {
    /// Where a session's folder holds the picture of this frame.
    pub fn stored_name(self) -> String {
        format!("frames/{:08}.png", self.0)
    }
}

/// When a frame was taken, by the driver's monotonic clock. Its zero is arbitrary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CaptureTime {
    /// Nanoseconds since the clock's zero.
    pub nanos: u64,
}

impl CaptureTime {
    /// Seconds from `earlier` to `self`; negative if `earlier` is in fact later.
    pub fn secs_since(self, earlier: Self) -> f64 {
        if self.nanos >= earlier.nanos {
            (self.nanos - earlier.nanos) as f64 * 1e-9
        } else {
            -((earlier.nanos - self.nanos) as f64 * 1e-9)
        }
    }
}

/// Whether neighbouring frames show the same moment of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// One of a stream: the board may be moving, stillness is judged over several frames.
    Video,
    /// A picture for itself, such as a file in a folder: what moved has blurred.
    Photograph,
}

/// Width and height of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageSize {
    /// Pixels in a row.
    pub width_px: u32,
    /// Pixels in a column.
    pub height_px: u32,
}

impl ImageSize {
    /// The middle of the picture, where pixel (0, 0) is the *centre* of the top-left pixel.
    pub fn centre_px(self) -> Point2<f64> {
        Point2::new((f64::from(self.width_px) - 1.0) / 2.0, (f64::from(self.height_px) - 1.0) / 2.0)
    }

    /// Size of `image`.
    pub fn of(image: &GrayImage) -> Self {
        Self { width_px: image.width(), height_px: image.height() }
    }
}

/// One picture and its circumstances.
#[derive(Clone, Debug)]
pub struct Frame {
    /// See [`FrameId`].
    pub id: FrameId,
    /// See [`CaptureTime`].
    pub captured_at: CaptureTime,
    /// See [`FrameKind`].
    pub kind: FrameKind,
    /// What to call the picture: a file name, or empty for a stream.
    pub name: String,
    /// Brightness, 8 bit.
    pub image: GrayImage,
}
