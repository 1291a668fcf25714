//! Which size, format and rate: what is offered, what is best, what is granted.

use super::{
    kernel::{Errno, Format, FourCc, Fraction, FrameSizes, Handle, Kernel},
    queue::again,
};
use crate::{
    device::{Mode, PixelLayout, Wanted},
    frame::ImageSize,
};

/// Most entries read from each of a driver's lists: a list without an end must not keep us.
const LONGEST_LIST: u32 = 256;
/// Slower modes are taken only when there is no other.
const LEAST_RATE_HZ: f64 = 15.0;
/// A faster mode brings more work than views.
const ENOUGH_RATE_HZ: f64 = 30.0;
/// Largest side that is believed.
const LARGEST_SIDE_PX: u32 = 8192;
/// Sizes tried where a driver offers a range.
const USUAL_SIZES: [(u32, u32); 7] =
    [(3840, 2160), (1920, 1080), (1600, 1200), (1280, 960), (1280, 720), (800, 600), (640, 480)];

/// A mode that a camera offers. Formats that cannot be read are listed, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Offer {
    /// Four-character code of the format.
    pub fourcc: FourCc,
    /// Size of the pictures.
    pub size: ImageSize,
    /// Time from picture to picture, if said.
    pub interval: Option<Fraction>,
}

/// A mode as granted, with what the driver says of its memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Granted {
    /// The mode.
    pub mode: Mode,
    /// Bytes from row to row, or 0.
    pub bytes_per_line: u32,
}

/// The layout of a format that can be read.
pub fn layout(fourcc: FourCc) -> Option<PixelLayout> {
    match &fourcc {
        b"GREY" => Some(PixelLayout::Grey),
        b"YUYV" => Some(PixelLayout::Yuyv),
        b"NV12" => Some(PixelLayout::Nv12),
        b"MJPG" | b"JPEG" => Some(PixelLayout::Mjpeg),
        _ => None,
    }
}

/// Everything that a camera offers. A list that fails ends there.
pub fn offers(kernel: &mut dyn Kernel, device: Handle) -> Result<Vec<Offer>, Errno> {
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

fn sizes(kernel: &mut dyn Kernel, device: Handle, fourcc: FourCc, found: &mut Vec<Offer>) {
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
    found: &mut Vec<Offer>,
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
        // 0/0 stands for "not known".
        let interval = (interval.0 > 0 && interval.1 > 0).then_some(interval);
        found.push(Offer { fourcc, size, interval });
    }
    if found.len() == before {
        found.push(Offer { fourcc, size, interval: None });
    }
}

/// The best of the offers that can be read: the largest that keeps 15 pictures per second, of those
/// the uncompressed one if it is about as fast, of those the one nearest to 30 pictures per second.
pub fn choose(offers: &[Offer], wanted: &Wanted) -> Option<Offer> {
    let rate = |offer: &Offer| offer.interval.map(|(n, d)| f64::from(d) / f64::from(n));
    let aim_hz = wanted.rate_hz.unwrap_or(ENOUGH_RATE_HZ);
    let score = |offer: &Offer| {
        let rate_hz = rate(offer);
        let fast_enough = match rate_hz {
            Some(rate_hz) if rate_hz >= 0.9 * LEAST_RATE_HZ.min(aim_hz) => 2,
            None => 1,
            Some(_) => 0,
        };
        let area = u64::from(offer.size.width_px) * u64::from(offer.size.height_px);
        let steady = rate_hz.is_none_or(|rate_hz| rate_hz >= 0.8 * aim_hz);
        let raw = layout(offer.fourcc) != Some(PixelLayout::Mjpeg);
        // Thousandths, so that scores can be ordered.
        let off = rate_hz.map_or(i64::MAX, |rate_hz| ((rate_hz - aim_hz).abs() * 1000.0) as i64);
        (fast_enough, area, steady, raw, -off)
    };
    offers
        .iter()
        .filter(|offer| {
            let readable = layout(offer.fourcc);
            readable.is_some()
                && wanted.layout.is_none_or(|wanted| readable == Some(wanted))
                && wanted.size.is_none_or(|size| size == offer.size)
        })
        .max_by_key(|offer| score(offer))
        .copied()
}

/// Asks for `offer` and reads back what is granted; `None` if that cannot be read.
pub fn grant(
    kernel: &mut dyn Kernel,
    device: Handle,
    offer: &Offer,
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
    // Rows that overlap or are absurdly far apart are a driver's mistake.
    let bytes_per_line =
        if format.bytes_per_line > 16 * format.width { 0 } else { format.bytes_per_line };
    let mode = Mode {
        size: ImageSize { width_px: format.width, height_px: format.height },
        layout,
        interval_secs: interval.filter(|(n, d)| *n > 0 && *d > 0),
    };
    Ok(Some(Granted { mode, bytes_per_line }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(fourcc: &FourCc, width_px: u32, height_px: u32, rate: u32) -> Offer {
        let interval = (rate > 0).then_some((1, rate));
        Offer { fourcc: *fourcc, size: ImageSize { width_px, height_px }, interval }
    }

    #[test]
    fn the_largest_mode_that_is_fast_enough_is_chosen() {
        let check = |offers: &[Offer], wanted: Wanted, best: usize| {
            assert_eq!(choose(offers, &wanted), Some(offers[best]), "{offers:?}");
        };
        let any = Wanted::default();
        check(&[offer(b"YUYV", 640, 480, 30), offer(b"MJPG", 1280, 720, 30)], any, 1);
        check(&[offer(b"YUYV", 1280, 720, 10), offer(b"MJPG", 1280, 720, 30)], any, 1);
        check(&[offer(b"YUYV", 1280, 720, 30), offer(b"MJPG", 1280, 720, 30)], any, 0);
        check(&[offer(b"YUYV", 1920, 1080, 5), offer(b"MJPG", 1280, 720, 15)], any, 1);
        check(&[offer(b"YUYV", 640, 480, 60), offer(b"YUYV", 640, 480, 30)], any, 1);
        check(&[offer(b"H264", 1920, 1080, 30), offer(b"GREY", 640, 480, 30)], any, 1);
        check(&[offer(b"YUYV", 640, 480, 5), offer(b"YUYV", 320, 240, 0)], any, 1);
        let size = Some(ImageSize { width_px: 640, height_px: 480 });
        let small = Wanted { size, ..any };
        check(&[offer(b"MJPG", 1280, 720, 30), offer(b"YUYV", 640, 480, 30)], small, 1);
        let slow = Wanted { rate_hz: Some(7.5), ..any };
        check(&[offer(b"YUYV", 640, 480, 30), offer(b"YUYV", 640, 480, 7)], slow, 1);
        let packed = Wanted { layout: Some(PixelLayout::Mjpeg), ..any };
        check(&[offer(b"YUYV", 640, 480, 30), offer(b"MJPG", 640, 480, 30)], packed, 1);
        assert_eq!(choose(&[offer(b"H264", 640, 480, 30)], &any), None);
    }
}
