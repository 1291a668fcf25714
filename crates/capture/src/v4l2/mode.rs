//! Size, format and rate: offered modes, and the granted mode.

use super::{
    kernel::{Errno, Format, FourCc, FrameSizes, Handle, Kernel},
    queue::again,
};
use crate::{CameraMode, layout};
use boresight_geometry::{device::Mode, frame::ImageSize};

/// Most entries read from each of a driver's lists, as a bound on endless lists.
const LONGEST_LIST: u32 = 256;
/// Largest believable side of a picture.
const LARGEST_SIDE_PX: u32 = 8192;
/// Sizes tried in an offered range.
const USUAL_SIZES: [(u32, u32); 7] =
    [(3840, 2160), (1920, 1080), (1600, 1200), (1280, 960), (1280, 720), (800, 600), (640, 480)];

/// A granted mode, with the driver's memory layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Granted {
    /// The granted mode.
    pub mode: Mode,
    /// Bytes from row to row, or 0.
    pub bytes_per_line: u32,
}

/// All offers of a camera. A failing list ends early.
pub fn offers(kernel: &mut dyn Kernel, device: Handle) -> Result<Vec<CameraMode>, Errno> {
    let mut found = Vec::new();
    for index in 0..LONGEST_LIST {
        match again(|| kernel.pixel_format(device, index)) {
            Ok(fourcc) => sizes(kernel, device, fourcc, &mut found),
            Err(errno) if errno.0 == libc::EINVAL => break,
            Err(errno) if found.is_empty() => return Err(errno),
            Err(_) => break,
        }
    }
    Ok(found)
}

fn sizes(kernel: &mut dyn Kernel, device: Handle, fourcc: FourCc, found: &mut Vec<CameraMode>) {
    for index in 0..LONGEST_LIST {
        match again(|| kernel.frame_sizes(device, fourcc, index)) {
            Ok(FrameSizes::Discrete(width, height)) => {
                intervals(kernel, device, (fourcc, width, height), found);
            }
            Ok(FrameSizes::Stepwise { width, height }) => {
                let fits = |value: u32, (least, largest, step): (u32, u32, u32)| {
                    (least..=largest).contains(&value)
                        && (value - least).is_multiple_of(step.max(1))
                };
                let largest = (width.1, height.1);
                let usual = USUAL_SIZES.into_iter().filter(|size| *size != largest);
                for (w, h) in
                    usual.chain([largest]).filter(|(w, h)| fits(*w, width) && fits(*h, height))
                {
                    intervals(kernel, device, (fourcc, w, h), found);
                }
                return;
            }
            Err(_) => return,
        }
    }
}

fn intervals(
    kernel: &mut dyn Kernel,
    device: Handle,
    of: (FourCc, u32, u32),
    found: &mut Vec<CameraMode>,
) {
    let (fourcc, width_px, height_px) = of;
    let believable = |side: u32| (16..=LARGEST_SIDE_PX).contains(&side);
    if !believable(width_px) || !believable(height_px) {
        return;
    }
    let size = ImageSize { width_px, height_px };
    let before = found.len();
    for index in 0..LONGEST_LIST {
        let Ok(interval) = again(|| kernel.frame_interval(device, of, index)) else { break };
        // 0/0 means "not known".
        let interval = (interval.0 > 0 && interval.1 > 0).then_some(interval);
        found.push(CameraMode { fourcc, size, interval });
    }
    if found.len() == before {
        found.push(CameraMode { fourcc, size, interval: None });
    }
}

/// Asks for `offer` and reads back the granted mode; `None` if unreadable.
pub fn grant(
    kernel: &mut dyn Kernel,
    device: Handle,
    offer: &CameraMode,
) -> Result<Option<Granted>, Errno> {
    let wanted = Format {
        width: offer.size.width_px,
        height: offer.size.height_px,
        fourcc: offer.fourcc,
        bytes_per_line: 0,
        size_image: 0,
    };
    let format = again(|| kernel.set_format(device, wanted))?;
    let interval = match offer.interval {
        // A driver without rates keeps its own.
        Some(interval) => again(|| kernel.set_interval(device, interval)).ok(),
        None => None,
    };
    let believable = |side: u32| (16..=LARGEST_SIDE_PX).contains(&side);
    let Some(layout) =
        layout(format.fourcc).filter(|_| believable(format.width) && believable(format.height))
    else {
        return Ok(None);
    };
    // Rows overlapping or absurdly far apart are a driver's mistake.
    let bytes_per_line =
        if format.bytes_per_line > 16 * format.width { 0 } else { format.bytes_per_line };
    let mode = Mode {
        size: ImageSize { width_px: format.width, height_px: format.height },
        layout,
        interval_secs: interval.filter(|(n, d)| *n > 0 && *d > 0),
    };
    Ok(Some(Granted { mode, bytes_per_line }))
}
