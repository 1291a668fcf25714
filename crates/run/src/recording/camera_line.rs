//! Camera events in the journal.

use serde::{Deserialize, Serialize};

use boresight_geometry::{
    device::{CameraEvent, Control, ControlChange, Fault, Lock, Locks, Mode, PixelLayout},
    frame::{CaptureTime, ImageSize},
};

/// Mirror of [`CameraEvent`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum CameraLine {
    /// See [`CameraEvent::Started`].
    Started {
        /// The mode.
        mode: ModeLine,
    },
    /// See [`CameraEvent::Lost`].
    Lost {
        /// Its stable code.
        fault: FaultLine,
        /// Details.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        detail: String,
    },
    /// See [`CameraEvent::Returned`].
    Returned {
        /// The mode.
        mode: ModeLine,
        /// Pictures from then on are good.
        good_from_nanos: u64,
    },
    /// See [`CameraEvent::Doubtful`].
    Doubtful {
        /// Its stable code.
        fault: FaultLine,
        /// Details.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        detail: String,
    },
    /// See [`CameraEvent::Dispelled`].
    Dispelled {
        /// Its stable code.
        fault: FaultLine,
    },
    /// See [`CameraEvent::Locked`].
    Locked {
        /// Each control that is not unknown.
        locks: Vec<(ControlLine, LockLine)>,
    },
    /// See [`CameraEvent::ControlChanged`].
    ControlChanged {
        /// Which.
        control: ControlLine,
        /// Locked value.
        from: i64,
        /// Value now.
        to: i64,
        /// When it last was as it should be.
        good_until_nanos: u64,
    },
    /// See [`CameraEvent::ControlRestored`].
    ControlRestored {
        /// Which.
        control: ControlLine,
        /// Pictures from then on are good.
        good_from_nanos: u64,
    },
    /// See [`CameraEvent::ControlSet`].
    ControlSet {
        /// Which.
        control: ControlLine,
        /// How it stands now.
        lock: LockLine,
        /// Pictures from then on are with it.
        good_from_nanos: u64,
    },
    /// See [`CameraEvent::Counted`].
    Counted {
        /// Frames that were lost.
        dropped: u64,
        /// Frames that were damaged.
        rejected: u64,
    },
}

/// A fault by its stable code.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(try_from = "String", into = "&'static str")]
pub struct FaultLine(Fault);

impl TryFrom<String> for FaultLine {
    type Error = String;

    fn try_from(code: String) -> Result<Self, String> {
        Fault::from_code(&code).map(Self).ok_or_else(|| format!("there is no fault {code:?}"))
    }
}

impl From<FaultLine> for &'static str {
    fn from(line: FaultLine) -> Self {
        line.0.code()
    }
}

/// Mirror of [`Mode`].
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ModeLine {
    size: [u32; 2],
    layout: LayoutLine,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    interval_secs: Option<(u32, u32)>,
}

/// Mirror of [`PixelLayout`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names are those of the mirrored type")]
pub enum LayoutLine {
    Grey,
    Yuyv,
    Nv12,
    Mjpeg,
    Decoded,
    Y10,
    Y12,
    Y16,
    Rgb,
    Bgr,
    Bayer,
}

/// Mirror of [`Control`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "the names are those of the mirrored type")]
pub enum ControlLine {
    Focus,
    Zoom,
    Exposure,
    Gain,
    WhiteBalance,
}

/// Mirror of [`Lock`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs, reason = "the names are those of the mirrored type")]
pub enum LockLine {
    Unknown,
    Absent,
    Free,
    Locked { value: i64 },
    Ignored { set: i64, read: i64 },
}

impl From<&CameraEvent> for CameraLine {
    fn from(event: &CameraEvent) -> Self {
        match event {
            CameraEvent::Started { mode } => Self::Started { mode: (*mode).into() },
            CameraEvent::Lost { fault, detail } => {
                Self::Lost { fault: FaultLine(*fault), detail: detail.clone() }
            }
            CameraEvent::Returned { mode, good_from } => {
                Self::Returned { mode: (*mode).into(), good_from_nanos: good_from.nanos }
            }
            CameraEvent::Doubtful { fault, detail } => {
                Self::Doubtful { fault: FaultLine(*fault), detail: detail.clone() }
            }
            CameraEvent::Dispelled { fault } => Self::Dispelled { fault: FaultLine(*fault) },
            CameraEvent::Locked { locks } => {
                let line =
                    |control| (ControlLine::from(control), LockLine::from(locks.of(control)));
                Self::Locked { locks: Control::ALL.map(line).into() }
            }
            CameraEvent::ControlChanged(change) => Self::ControlChanged {
                control: change.control.into(),
                from: change.from,
                to: change.to,
                good_until_nanos: change.good_until.nanos,
            },
            CameraEvent::ControlRestored { control, good_from } => Self::ControlRestored {
                control: (*control).into(),
                good_from_nanos: good_from.nanos,
            },
            CameraEvent::ControlSet { control, lock, good_from } => Self::ControlSet {
                control: (*control).into(),
                lock: (*lock).into(),
                good_from_nanos: good_from.nanos,
            },
            CameraEvent::Counted { dropped, rejected } => {
                Self::Counted { dropped: *dropped, rejected: *rejected }
            }
        }
    }
}

impl From<CameraLine> for CameraEvent {
    fn from(line: CameraLine) -> Self {
        match line {
            CameraLine::Started { mode } => Self::Started { mode: mode.into() },
            CameraLine::Lost { fault, detail } => Self::Lost { fault: fault.0, detail },
            CameraLine::Returned { mode, good_from_nanos } => Self::Returned {
                mode: mode.into(),
                good_from: CaptureTime { nanos: good_from_nanos },
            },
            CameraLine::Doubtful { fault, detail } => Self::Doubtful { fault: fault.0, detail },
            CameraLine::Dispelled { fault } => Self::Dispelled { fault: fault.0 },
            CameraLine::Locked { locks: lines } => {
                let mut locks = Locks::default();
                for (control, lock) in lines {
                    locks.note(control.into(), lock.into());
                }
                Self::Locked { locks }
            }
            CameraLine::ControlChanged { control, from, to, good_until_nanos } => {
                let good_until = CaptureTime { nanos: good_until_nanos };
                Self::ControlChanged(ControlChange {
                    control: control.into(),
                    from,
                    to,
                    good_until,
                })
            }
            CameraLine::ControlRestored { control, good_from_nanos } => {
                let good_from = CaptureTime { nanos: good_from_nanos };
                Self::ControlRestored { control: control.into(), good_from }
            }
            CameraLine::ControlSet { control, lock, good_from_nanos } => Self::ControlSet {
                control: control.into(),
                lock: lock.into(),
                good_from: CaptureTime { nanos: good_from_nanos },
            },
            CameraLine::Counted { dropped, rejected } => Self::Counted { dropped, rejected },
        }
    }
}

impl From<Mode> for ModeLine {
    fn from(mode: Mode) -> Self {
        let layout = match mode.layout {
            PixelLayout::Grey => LayoutLine::Grey,
            PixelLayout::Yuyv => LayoutLine::Yuyv,
            PixelLayout::Nv12 => LayoutLine::Nv12,
            PixelLayout::Mjpeg => LayoutLine::Mjpeg,
            PixelLayout::Decoded => LayoutLine::Decoded,
            PixelLayout::Y10 => LayoutLine::Y10,
            PixelLayout::Y12 => LayoutLine::Y12,
            PixelLayout::Y16 => LayoutLine::Y16,
            PixelLayout::Rgb => LayoutLine::Rgb,
            PixelLayout::Bgr => LayoutLine::Bgr,
            PixelLayout::Bayer => LayoutLine::Bayer,
        };
        let size = [mode.size.width_px, mode.size.height_px];
        Self { size, layout, interval_secs: mode.interval_secs }
    }
}

impl From<ModeLine> for Mode {
    fn from(line: ModeLine) -> Self {
        let layout = match line.layout {
            LayoutLine::Grey => PixelLayout::Grey,
            LayoutLine::Yuyv => PixelLayout::Yuyv,
            LayoutLine::Nv12 => PixelLayout::Nv12,
            LayoutLine::Mjpeg => PixelLayout::Mjpeg,
            LayoutLine::Decoded => PixelLayout::Decoded,
            LayoutLine::Y10 => PixelLayout::Y10,
            LayoutLine::Y12 => PixelLayout::Y12,
            LayoutLine::Y16 => PixelLayout::Y16,
            LayoutLine::Rgb => PixelLayout::Rgb,
            LayoutLine::Bgr => PixelLayout::Bgr,
            LayoutLine::Bayer => PixelLayout::Bayer,
        };
        let size = ImageSize { width_px: line.size[0], height_px: line.size[1] };
        Self { size, layout, interval_secs: line.interval_secs }
    }
}

impl From<Control> for ControlLine {
    fn from(control: Control) -> Self {
        match control {
            Control::Focus => Self::Focus,
            Control::Zoom => Self::Zoom,
            Control::Exposure => Self::Exposure,
            Control::Gain => Self::Gain,
            Control::WhiteBalance => Self::WhiteBalance,
        }
    }
}

impl From<ControlLine> for Control {
    fn from(line: ControlLine) -> Self {
        match line {
            ControlLine::Focus => Self::Focus,
            ControlLine::Zoom => Self::Zoom,
            ControlLine::Exposure => Self::Exposure,
            ControlLine::Gain => Self::Gain,
            ControlLine::WhiteBalance => Self::WhiteBalance,
        }
    }
}

impl From<Lock> for LockLine {
    fn from(lock: Lock) -> Self {
        match lock {
            Lock::Unknown => Self::Unknown,
            Lock::Absent => Self::Absent,
            Lock::Free => Self::Free,
            Lock::Locked { value } => Self::Locked { value },
            Lock::Ignored { set, read } => Self::Ignored { set, read },
        }
    }
}

impl From<LockLine> for Lock {
    fn from(line: LockLine) -> Self {
        match line {
            LockLine::Unknown => Self::Unknown,
            LockLine::Absent => Self::Absent,
            LockLine::Free => Self::Free,
            LockLine::Locked { value } => Self::Locked { value },
            LockLine::Ignored { set, read } => Self::Ignored { set, read },
        }
    }
}
