use super::Fault;
use crate::frame::{CaptureTime, ImageSize};

/// Event of a live camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CameraEvent {
    /// The camera streams for the first time in this run.
    Started {
        /// The granted mode.
        mode: Mode,
    },
    /// Streaming stopped; reconnecting.
    Lost {
        /// The camera's fault.
        fault: Fault,
        /// Details: kernel error text, or the process holding the device; may be empty.
        detail: String,
    },
    /// The same camera streams again: identity, mode and controls were verified.
    Returned {
        /// The granted mode.
        mode: Mode,
        /// Pictures from then on are good.
        good_from: CaptureTime,
    },
    /// The pictures come, but are doubtful.
    Doubtful {
        /// The camera's fault.
        fault: Fault,
        /// Details; may be empty.
        detail: String,
    },
    /// A doubt no longer holds.
    Dispelled {
        /// The camera's fault.
        fault: Fault,
    },
    /// The controls have settled and were read back.
    Locked {
        /// State of each control.
        locks: Locks,
    },
    /// A locked control changed.
    ControlChanged(ControlChange),
    /// A changed control is back at the locked value, and the picture has settled.
    ControlRestored {
        /// The control concerned.
        control: Control,
        /// Pictures from then on are good.
        good_from: CaptureTime,
    },
    /// A control was set at the person's request, and the picture has settled.
    ControlSet {
        /// The control concerned.
        control: Control,
        /// State of the control as read back.
        lock: Lock,
        /// Pictures from then on have the new value.
        good_from: CaptureTime,
    },
    /// Frames lost before the detector, since the start of this run.
    Counted {
        /// Number lost by the driver or skipped for a newer frame.
        dropped: u64,
        /// Number damaged, and therefore skipped.
        rejected: u64,
    },
}

/// Change of a control, seen at a read-back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlChange {
    /// The control concerned.
    pub control: Control,
    /// Locked value, in the driver's unit.
    pub from: i64,
    /// Value read now, in the driver's unit.
    pub to: i64,
    /// Time at which the value was last right: later pictures may have another lens.
    pub good_until: CaptureTime,
}

/// Control locked in a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Control {
    /// Distance at which the lens is sharp.
    Focus,
    /// Focal length.
    Zoom,
    /// Exposure time.
    Exposure,
    /// Amplification.
    Gain,
    /// Colour temperature.
    WhiteBalance,
}

impl Control {
    /// Every control.
    pub const ALL: [Self; 5] =
        [Self::Focus, Self::Zoom, Self::Exposure, Self::Gain, Self::WhiteBalance];

    /// True if the calibration depends on the control.
    pub fn moves_geometry(self) -> bool {
        matches!(self, Self::Focus | Self::Zoom)
    }
}

/// Adjustable control, with values in the driver's unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Adjustable {
    /// The control concerned.
    pub control: Control,
    /// Least value, in the driver's unit.
    pub min: i64,
    /// Largest value, in the driver's unit.
    pub max: i64,
    /// Step, at least 1.
    pub step: i64,
}

/// State of a control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lock {
    /// Unknown so far.
    #[default]
    Unknown,
    /// The camera has no such control.
    Absent,
    /// The control cannot be locked, or is left free as requested.
    Free,
    /// The control is set and reads back as set.
    Locked {
        /// Value, in the driver's unit.
        value: i64,
    },
    /// The control was set and reads back another value.
    Ignored {
        /// Set value, in the driver's unit.
        set: i64,
        /// Read value, in the driver's unit.
        read: i64,
    },
}

/// State of every control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Locks {
    /// [`Control::Focus`].
    pub focus: Lock,
    /// [`Control::Zoom`].
    pub zoom: Lock,
    /// [`Control::Exposure`].
    pub exposure: Lock,
    /// [`Control::Gain`].
    pub gain: Lock,
    /// [`Control::WhiteBalance`].
    pub white_balance: Lock,
}

impl Lock {
    /// Value read from the camera, if any.
    pub fn value(self) -> Option<i64> {
        match self {
            Self::Locked { value } | Self::Ignored { read: value, .. } => Some(value),
            Self::Unknown | Self::Absent | Self::Free => None,
        }
    }
}

impl Locks {
    /// State of `control`.
    pub fn of(&self, control: Control) -> Lock {
        match control {
            Control::Focus => self.focus,
            Control::Zoom => self.zoom,
            Control::Exposure => self.exposure,
            Control::Gain => self.gain,
            Control::WhiteBalance => self.white_balance,
        }
    }

    /// Records the state of `control`.
    pub fn note(&mut self, control: Control, lock: Lock) {
        let place = match control {
            Control::Focus => &mut self.focus,
            Control::Zoom => &mut self.zoom,
            Control::Exposure => &mut self.exposure,
            Control::Gain => &mut self.gain,
            Control::WhiteBalance => &mut self.white_balance,
        };
        *place = lock;
    }
}

/// Layout of brightness in a frame's bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PixelLayout {
    /// A byte of brightness per pixel.
    Grey,
    /// Brightness and colour in turn.
    Yuyv,
    /// Brightness, then colour.
    Nv12,
    /// Ten bits per pixel, in two bytes, the lower byte first.
    Y10,
    /// Twelve bits per pixel, likewise.
    Y12,
    /// Sixteen bits per pixel, likewise.
    Y16,
    /// Red, green and blue, a byte each.
    Rgb,
    /// Blue, green and red, a byte each.
    Bgr,
    /// A byte per pixel behind a filter of red, green and blue squares, in any order.
    Bayer,
    /// A JPEG per frame.
    Mjpeg,
    /// Grey picture as delivered by the reading program.
    Decoded,
}

impl PixelLayout {
    /// Layouts offered by cameras.
    pub const OF_CAMERAS: [Self; 10] = [
        Self::Grey,
        Self::Yuyv,
        Self::Nv12,
        Self::Y10,
        Self::Y12,
        Self::Y16,
        Self::Rgb,
        Self::Bgr,
        Self::Bayer,
        Self::Mjpeg,
    ];

    /// Bytes between the brightness of adjacent pixels in a row; 1 in a JPEG, which has no rows.
    pub fn bytes_per_pixel(self) -> usize {
        match self {
            Self::Grey | Self::Nv12 | Self::Bayer | Self::Mjpeg | Self::Decoded => 1,
            Self::Yuyv | Self::Y10 | Self::Y12 | Self::Y16 => 2,
            Self::Rgb | Self::Bgr => 3,
        }
    }

    /// Name of the layout in a mode: the four-character code, if unique.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grey => "GREY",
            Self::Yuyv => "YUYV",
            Self::Nv12 => "NV12",
            Self::Y10 => "Y10",
            Self::Y12 => "Y12",
            Self::Y16 => "Y16",
            Self::Rgb => "RGB3",
            Self::Bgr => "BGR3",
            Self::Bayer => "BAYER",
            Self::Mjpeg => "MJPG",
            Self::Decoded => "decoded",
        }
    }
}

/// Size, format and rate of a camera's pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode {
    /// Size of the pictures.
    pub size: ImageSize,
    /// Format of the pictures.
    pub layout: PixelLayout,
    /// Interval between pictures as a fraction of a second; `None` if the driver does not say.
    pub interval_secs: Option<(u32, u32)>,
}

impl Mode {
    /// Pictures per second, if stated by the driver.
    pub fn rate_hz(&self) -> Option<f64> {
        self.interval_secs
            .filter(|(numerator, denominator)| *numerator > 0 && *denominator > 0)
            .map(|(numerator, denominator)| f64::from(denominator) / f64::from(numerator))
    }
}

/// Mode requested by a person.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Size; by default the largest fast enough.
    pub size: Option<ImageSize>,
    /// Pictures per second; by default about 30.
    pub rate_hz: Option<f64>,
    /// Format; by default an uncompressed one if fast enough.
    pub layout: Option<PixelLayout>,
}
