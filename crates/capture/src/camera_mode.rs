//! Choice of the best mode of a camera.

use std::collections::BTreeSet;

use boresight_geometry::{
    device::{PixelLayout, Wanted},
    frame::ImageSize,
};

/// Rate below which modes are taken only as a last resort.
const LEAST_RATE_HZ: f64 = 15.0;
/// Rate above which a mode brings more work than views.
const ENOUGH_RATE_HZ: f64 = 30.0;

/// A mode offered by a camera. Unreadable formats are listed, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraMode {
    /// Four-character code of the format.
    pub fourcc: [u8; 4],
    /// Size of the pictures.
    pub size: ImageSize,
    /// Time from picture to picture as a fraction of a second, if stated.
    pub interval: Option<(u32, u32)>,
}

/// Layout of a readable format.
pub fn layout(fourcc: [u8; 4]) -> Option<PixelLayout> {
    match &fourcc {
        b"GREY" => Some(PixelLayout::Grey),
        b"YUYV" => Some(PixelLayout::Yuyv),
        b"NV12" => Some(PixelLayout::Nv12),
        b"Y10 " => Some(PixelLayout::Y10),
        b"Y12 " => Some(PixelLayout::Y12),
        b"Y16 " => Some(PixelLayout::Y16),
        b"RGB3" => Some(PixelLayout::Rgb),
        b"BGR3" => Some(PixelLayout::Bgr),
        b"BA81" | b"GBRG" | b"GRBG" | b"RGGB" => Some(PixelLayout::Bayer),
        b"MJPG" | b"JPEG" => Some(PixelLayout::Mjpeg),
        _ => None,
    }
}

/// Best of the readable offers: the largest with at least 15 pictures per second; among those an
/// uncompressed one if about as fast, preferably with plain 8-bit brightness; among those the one
/// nearest to 30 pictures per second.
pub fn choose(offers: &[CameraMode], wanted: &Wanted) -> Option<CameraMode> {
    let rate = |offer: &CameraMode| offer.interval.map(|(n, d)| f64::from(d) / f64::from(n));
    let aim_hz = wanted.rate_hz.unwrap_or(ENOUGH_RATE_HZ);
    let score = |offer: &CameraMode| {
        let rate_hz = rate(offer);
        let fast_enough = match rate_hz {
            Some(rate_hz) if rate_hz >= 0.9 * LEAST_RATE_HZ.min(aim_hz) => 2,
            None => 1,
            Some(_) => 0,
        };
        let area = u64::from(offer.size.width_px) * u64::from(offer.size.height_px);
        let steady = rate_hz.is_none_or(|rate_hz| rate_hz >= 0.8 * aim_hz);
        let raw = match layout(offer.fourcc) {
            Some(PixelLayout::Mjpeg) | None => 0,
            Some(PixelLayout::Grey | PixelLayout::Yuyv | PixelLayout::Nv12) => 2,
            Some(_) => 1,
        };
        // Thousandths, to make scores comparable.
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

/// Offers of the camera `name`, for a message after [`choose`] found nothing.
pub fn not_offered(name: &str, offers: &[CameraMode], wanted: &Wanted) -> String {
    let readable = offers.iter().filter(|offer| layout(offer.fourcc).is_some());
    let sizes: BTreeSet<_> = readable.map(|it| (it.size.width_px, it.size.height_px)).collect();
    match wanted.size {
        Some(size) if !sizes.is_empty() => {
            let sizes = sizes.into_iter().rev();
            let sizes = sizes.map(|(width_px, height_px)| ImageSize { width_px, height_px });
            let sizes: Vec<String> = sizes.map(|size| size.to_string()).collect();
            format!("{name} has {}, not {size}", sizes.join(", "))
        }
        _ => name.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offer(fourcc: &[u8; 4], width_px: u32, height_px: u32, rate: u32) -> CameraMode {
        let interval = (rate > 0).then_some((1, rate));
        CameraMode { fourcc: *fourcc, size: ImageSize { width_px, height_px }, interval }
    }

    #[test]
    fn the_largest_mode_that_is_fast_enough_is_chosen() {
        let check = |offers: &[CameraMode], wanted: Wanted, best: usize| {
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
        check(&[offer(b"GREY", 640, 480, 30), offer(b"Y12 ", 640, 480, 30)], any, 0);
        check(&[offer(b"MJPG", 640, 480, 30), offer(b"RGGB", 640, 480, 30)], any, 1);
        let size = Some(ImageSize { width_px: 640, height_px: 480 });
        let small = Wanted { size, ..any };
        check(&[offer(b"MJPG", 1280, 720, 30), offer(b"YUYV", 640, 480, 30)], small, 1);
        let slow = Wanted { rate_hz: Some(7.5), ..any };
        check(&[offer(b"YUYV", 640, 480, 30), offer(b"YUYV", 640, 480, 7)], slow, 1);
        let packed = Wanted { layout: Some(PixelLayout::Mjpeg), ..any };
        check(&[offer(b"YUYV", 640, 480, 30), offer(b"MJPG", 640, 480, 30)], packed, 1);
        assert_eq!(choose(&[offer(b"H264", 640, 480, 30)], &any), None);
    }

    #[test]
    fn a_size_that_isnt_offered_is_told_beside_those_that_are() {
        let offers = [
            offer(b"MJPG", 640, 480, 30),
            offer(b"H264", 3840, 2160, 30),
            offer(b"YUYV", 1280, 720, 10),
        ];
        let size = Some(ImageSize { width_px: 800, height_px: 600 });
        let wanted = Wanted { size, ..Wanted::default() };
        assert_eq!(choose(&offers, &wanted), None);
        assert_eq!(not_offered("Cam", &offers, &wanted), "Cam has 1280x720, 640x480, not 800x600");
        assert_eq!(not_offered("Cam", &offers[1..2], &wanted), "Cam");
    }
}
