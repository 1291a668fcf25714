//! Picture from a source, with number and capture time.

use std::fmt;

use image::GrayImage;
use nalgebra::Point2;

/// Number of a frame within a source, in capture order. Gaps are lost frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameId(pub u64);

impl FrameId {
    /// Path of the stored picture, relative to the session's folder.
    pub fn stored_name(self) -> String {
        format!("frames/{:08}.png", self.0)
    }
}

/// Capture time by the driver's monotonic clock, with an arbitrary zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CaptureTime {
    /// Nanoseconds since the clock's zero.
    pub nanos: u64,
}

impl CaptureTime {
    /// Seconds from `earlier` to `self`; negative if `earlier` is in fact later.
    ///
    /// ```
    /// # use boresight_geometry::frame::CaptureTime;
    /// let [first, second] = [0, 33_000_000].map(|nanos| CaptureTime { nanos });
    /// assert_eq!(second.secs_since(first), 0.033);
    /// ```
    pub fn secs_since(self, earlier: Self) -> f64 {
        if self.nanos >= earlier.nanos {
            (self.nanos - earlier.nanos) as f64 * 1e-9
        } else {
            -((earlier.nanos - self.nanos) as f64 * 1e-9)
        }
    }
}

/// Kind of source: a stream, or single pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameKind {
    /// A frame of a stream: the board may be moving, and stillness is judged over several frames.
    Video,
    /// A single picture, such as a file in a folder: motion shows only as blur.
    Photograph,
}

/// Width and height of a picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageSize {
    /// Pixels in a row.
    pub width_px: u32,
    /// Pixels in a column.
    pub height_px: u32,
}

impl ImageSize {
    /// Centre of the picture in pixels; (0, 0) is the *centre* of the top-left pixel.
    ///
    /// ```
    /// # use boresight_geometry::frame::ImageSize;
    /// # use nalgebra::Point2;
    /// // (0, 0) is the centre of the first pixel.
    /// let size = ImageSize { width_px: 1280, height_px: 720 };
    /// assert_eq!(size.centre_px(), Point2::new(639.5, 359.5));
    /// assert!(size.contains(&Point2::new(0.0, 719.0)));
    /// ```
    pub fn centre_px(self) -> Point2<f64> {
        Point2::new((f64::from(self.width_px) - 1.0) / 2.0, (f64::from(self.height_px) - 1.0) / 2.0)
    }

    /// True if `px` lies in the picture, up to the centres of the outermost pixels.
    ///
    /// ```
    /// # use boresight_geometry::frame::ImageSize;
    /// # use nalgebra::Point2;
    /// let size = ImageSize { width_px: 1280, height_px: 720 };
    /// assert!(size.contains(&Point2::new(1279.0, 0.0)));
    /// assert!(!size.contains(&Point2::new(1279.5, 0.0)));
    /// ```
    pub fn contains(self, px: &Point2<f64>) -> bool {
        (0.0..=f64::from(self.width_px) - 1.0).contains(&px.x)
            && (0.0..=f64::from(self.height_px) - 1.0).contains(&px.y)
    }

    /// Size of `image`.
    pub fn of(image: &GrayImage) -> Self {
        Self { width_px: image.width(), height_px: image.height() }
    }
}

/// Formats the size as `1280x720`.
impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width_px, self.height_px)
    }
}

/// Focal length of a picture by the scene behind the board, relative to another picture of a camera
/// that stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneScale {
    /// Logarithm of the ratio of the focal lengths.
    pub log_focal: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// Picture with number, time and kind.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Number within the source.
    pub id: FrameId,
    /// Capture time of the frame.
    pub captured_at: CaptureTime,
    /// Single picture or part of a stream.
    pub kind: FrameKind,
    /// Name for display: a file name, or empty for a stream.
    pub name: String,
    /// Brightness, 8 bits per pixel.
    pub image: GrayImage,
}
