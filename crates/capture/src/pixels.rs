//! Pixel formats by their names in ROS, ffmpeg and GStreamer, and the pictures in their bytes.
//!
//! Whatever the format, its bytes are put in the order of a camera's layout, so brightness is the
//! same through every source; see `pixel_format`.

use std::borrow::Cow;

use image::GrayImage;

use super::{
    Unpacker,
    integrity::{Flaw, raw},
    pixel_format::shallow,
};
use boresight_geometry::{device::PixelLayout, frame::ImageSize};

/// A pixel format: the place of brightness in the bytes of a picture, and the planes beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixels {
    layout: PixelLayout,
    order: Order,
    planes: Planes,
}

/// Conversion of the bytes into `layout`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Kept,
    /// The two bytes of each pair change places.
    Swapped,
    /// The last of four bytes is left out.
    WithoutFourth,
    /// Each sample of 16 bits, the lower byte first, becomes a sample of 8.
    Deep,
    /// The same with the higher byte first.
    DeepSwapped,
}

/// Planes of colour after the plane of brightness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Planes {
    No,
    /// Two of half the width and half the height, or a common plane with both in turn.
    Quarter,
    /// Two of half the width.
    Half,
    /// Two of a quarter of the width.
    Narrow,
    /// Two of the same size.
    Full,
    /// Three: transparency, too.
    Alpha,
}

type Form = (PixelLayout, Order, Planes);

const GREY: Form = (PixelLayout::Grey, Order::Kept, Planes::No);
const DEEP_GREY: Form = (PixelLayout::Y16, Order::Kept, Planes::No);
const MOSAIC: Form = (PixelLayout::Bayer, Order::Kept, Planes::No);
const DEEP_MOSAIC: Form = (PixelLayout::Bayer, Order::Deep, Planes::No);

const fn with(form: Form, planes: Planes) -> Form {
    (form.0, form.1, planes)
}

/// Names in small letters, and the form of each.
const NAMES: [(&[&str], Form); 24] = [
    (&["mono8", "8uc1", "gray", "gray8", "grey", "y800", "y8", "mono"], GREY),
    (&["mono16", "16uc1", "gray16le", "gray16_le", "gray16", "y16"], DEEP_GREY),
    (&["gray16be", "gray16_be"], (PixelLayout::Y16, Order::Swapped, Planes::No)),
    (&["gray10le", "gray10_le16", "gray10", "y10"], (PixelLayout::Y10, Order::Kept, Planes::No)),
    (&["gray12le", "gray12_le16", "gray12", "y12"], (PixelLayout::Y12, Order::Kept, Planes::No)),
    (&["rgb8", "rgb24", "rgb", "rgb3"], (PixelLayout::Rgb, Order::Kept, Planes::No)),
    // OpenCV's order.
    (&["bgr8", "bgr24", "bgr", "bgr3", "8uc3"], (PixelLayout::Bgr, Order::Kept, Planes::No)),
    (&["rgba8", "rgba", "rgbx", "rgb0"], (PixelLayout::Rgb, Order::WithoutFourth, Planes::No)),
    (
        &["bgra8", "bgra", "bgrx", "bgr0", "8uc4"],
        (PixelLayout::Bgr, Order::WithoutFourth, Planes::No),
    ),
    (&["rgb16", "rgb48le", "rgb48"], (PixelLayout::Rgb, Order::Deep, Planes::No)),
    (&["bgr16", "bgr48le", "bgr48", "16uc3"], (PixelLayout::Bgr, Order::Deep, Planes::No)),
    (&["yuv422_yuy2", "yuyv422", "yuyv", "yuy2"], (PixelLayout::Yuyv, Order::Kept, Planes::No)),
    (&["yuv422", "uyvy422", "uyvy"], (PixelLayout::Yuyv, Order::Swapped, Planes::No)),
    (
        &["yuv420p", "yuvj420p", "yuv420", "i420", "yv12", "nv12", "nv21", "yu12"],
        with(GREY, Planes::Quarter),
    ),
    (&["yuv422p", "yuvj422p", "y42b", "nv16"], with(GREY, Planes::Half)),
    (&["yuv411p", "y41b"], with(GREY, Planes::Narrow)),
    (&["yuv444p", "yuvj444p", "y444", "nv24"], with(GREY, Planes::Full)),
    (&["yuv420p10le", "yuv420p10", "i420_10le"], (PixelLayout::Y10, Order::Kept, Planes::Quarter)),
    (&["yuv420p12le", "yuv420p12", "i420_12le"], (PixelLayout::Y12, Order::Kept, Planes::Quarter)),
    (&["yuv422p10le", "yuv422p10", "i422_10le"], (PixelLayout::Y10, Order::Kept, Planes::Half)),
    (&["yuv444p10le", "yuv444p10", "y444_10le"], (PixelLayout::Y10, Order::Kept, Planes::Full)),
    (
        &[
            "bayer_rggb8",
            "bayer_bggr8",
            "bayer_gbrg8",
            "bayer_grbg8",
            "rggb",
            "bggr",
            "gbrg",
            "grbg",
            "bayer",
        ],
        MOSAIC,
    ),
    (&["bayer_rggb16", "bayer_bggr16", "bayer_gbrg16", "bayer_grbg16"], DEEP_MOSAIC),
    (&["bayer_rggb16le", "bayer_bggr16le", "bayer_gbrg16le", "bayer_grbg16le"], DEEP_MOSAIC),
];

impl Pixels {
    /// Format by its name in ROS, ffmpeg or GStreamer; `None` if unreadable.
    pub fn named(name: &str) -> Option<Self> {
        let name = name.trim().to_ascii_lowercase();
        let found = NAMES.iter().find(|(names, _)| names.contains(&name.as_str()));
        found.map(|(_, (layout, order, planes))| Self {
            layout: *layout,
            order: *order,
            planes: *planes,
        })
    }

    /// Format of a YUV4MPEG2 stream with the colour space `tag`, such as `420jpeg` or `mono10`;
    /// `None` if unreadable.
    pub fn of_yuv4mpeg(tag: &str) -> Option<Self> {
        let tag = tag.to_ascii_lowercase();
        let (planes, rest) = if let Some(rest) = tag.strip_prefix("mono") {
            (Planes::No, rest)
        } else {
            let planes = match tag.get(..3)? {
                "420" => Planes::Quarter,
                "422" => Planes::Half,
                "411" => Planes::Narrow,
                "444" if tag.starts_with("444alpha") => Planes::Alpha,
                "444" => Planes::Full,
                _ => return None,
            };
            (planes, tag[3..].strip_prefix('p').unwrap_or_default())
        };
        let layout = match rest.trim_start_matches("aldv") {
            "" => PixelLayout::Grey,
            "10" => PixelLayout::Y10,
            "12" => PixelLayout::Y12,
            "16" => PixelLayout::Y16,
            _ => return None,
        };
        Some(Self { layout, order: Order::Kept, planes })
    }

    /// The same format with the higher byte of each sample first; formats of single bytes have no
    /// such order.
    #[must_use]
    pub fn higher_byte_first(self) -> Self {
        let order = match (self.order, self.layout) {
            (Order::Kept, PixelLayout::Y10 | PixelLayout::Y12 | PixelLayout::Y16) => Order::Swapped,
            (Order::Deep, _) => Order::DeepSwapped,
            (other, _) => other,
        };
        Self { order, ..self }
    }

    /// Layout of a camera with the same brightness.
    pub fn layout(self) -> PixelLayout {
        self.layout
    }

    /// Bytes of a row of `width_px` pixels, in the plane of brightness if there are several.
    pub fn row_bytes(self, width_px: u32) -> usize {
        let width = width_px as usize;
        match (self.order, self.layout) {
            // Two pixels share their colour.
            (_, PixelLayout::Yuyv) => 4 * width.div_ceil(2),
            (Order::WithoutFourth, _) => 4 * width,
            (Order::Deep | Order::DeepSwapped, layout) => 2 * layout.bytes_per_pixel() * width,
            (_, layout) => layout.bytes_per_pixel() * width,
        }
    }

    /// Bytes of a picture of `size` with all planes, without gaps; `None` if beyond any memory.
    pub fn picture_bytes(self, size: ImageSize) -> Option<usize> {
        let (width, height) = (size.width_px, size.height_px);
        let plane = |width: u32, height: u32| self.row_bytes(width).checked_mul(height as usize);
        let colour = match self.planes {
            Planes::No => Some(0),
            Planes::Quarter => plane(2 * width.div_ceil(2), height.div_ceil(2)),
            Planes::Half => plane(2 * width.div_ceil(2), height),
            Planes::Narrow => plane(2 * width.div_ceil(4), height),
            Planes::Full => plane(width, height)?.checked_mul(2),
            Planes::Alpha => plane(width, height)?.checked_mul(3),
        };
        plane(width, height)?.checked_add(colour?)
    }

    /// The picture of `size` in `bytes`, with rows `bytes_per_row` apart, or without gaps if 0.
    ///
    /// # Errors
    ///
    /// [`Flaw`] if the bytes are too few, or if the picture has no pixels.
    pub fn unpack(
        self,
        bytes: &[u8],
        size: ImageSize,
        bytes_per_row: usize,
    ) -> Result<GrayImage, Flaw> {
        if size.width_px.min(size.height_px) == 0 {
            return Err(Flaw::Empty);
        }
        let row_bytes = self.row_bytes(size.width_px);
        let step = bytes_per_row.max(row_bytes);
        raw(bytes.len(), size.height_px as usize, step)?;
        let rows = || bytes.chunks(step).take(size.height_px as usize).map(|row| &row[..row_bytes]);
        let deep = |of: fn([u8; 2]) -> u16| {
            let sample = move |pair: &[u8; 2]| shallow::<16>(of(*pair).to_le_bytes());
            rows().flat_map(|row| row.as_chunks().0).map(sample).collect()
        };
        let (bytes, step) = match self.order {
            Order::Kept => (Cow::Borrowed(bytes), step),
            Order::Swapped => {
                let swapped = rows().flat_map(|row| row.as_chunks().0).flat_map(|[a, b]| [*b, *a]);
                (swapped.collect(), row_bytes)
            }
            Order::WithoutFourth => {
                let three =
                    rows().flat_map(|row| row.as_chunks().0).flat_map(|[a, b, c, _]| [*a, *b, *c]);
                (three.collect(), 0)
            }
            Order::Deep => (Cow::Owned(deep(u16::from_le_bytes)), 0),
            Order::DeepSwapped => (Cow::Owned(deep(u16::from_be_bytes)), 0),
        };
        let step = u32::try_from(step).map_err(|_| Flaw::Short)?;
        Unpacker::new(self.layout, size, step).unpack(&bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 4, height_px: 2 };

    #[test]
    fn a_picture_is_the_same_in_every_order_of_its_bytes() {
        let grey: Vec<u8> = vec![0, 40, 80, 120, 160, 200, 240, 255];
        let pixels = |bytes: &[u8], of: fn(u8) -> Vec<u8>| -> Vec<u8> {
            bytes.iter().flat_map(|grey| of(*grey)).collect()
        };
        let cases: [(&str, Vec<u8>); 9] = [
            ("mono8", grey.clone()),
            ("RGB8", pixels(&grey, |v| vec![v; 3])),
            ("bgra8", pixels(&grey, |v| vec![v, v, v, 7])),
            ("mono16", pixels(&grey, |v| (u16::from(v) * 257).to_le_bytes().into())),
            ("rgb16", pixels(&grey, |v| (u16::from(v) * 257).to_le_bytes().repeat(3))),
            ("yuv422_yuy2", pixels(&grey, |v| vec![v, 128])),
            ("yuv422", pixels(&grey, |v| vec![128, v])),
            ("yuv420p", [grey.clone(), vec![128; 4]].concat()),
            ("yuv444p", [grey.clone(), vec![128; 16]].concat()),
        ];
        for (name, bytes) in cases {
            let pixels = Pixels::named(name).expect("known");
            assert_eq!(pixels.picture_bytes(SIZE), Some(bytes.len()), "{name}");
            assert_eq!(pixels.unpack(&bytes, SIZE, 0).expect("whole").as_raw(), &grey, "{name}");
            let short = pixels.unpack(&bytes[..pixels.row_bytes(4) * 2 - 1], SIZE, 0);
            assert!(short.is_err(), "{name}");
            for (width_px, height_px) in [(0, 2), (4, 0)] {
                let none = pixels.unpack(&bytes, ImageSize { width_px, height_px }, 0);
                assert_eq!(none, Err(Flaw::Empty), "{name}");
            }
            // Rows with a gap after them.
            let row = pixels.row_bytes(4);
            let gaps: Vec<u8> =
                bytes[..2 * row].chunks(row).flat_map(|row| [row, &[9; 3]].concat()).collect();
            let unpacked = pixels.unpack(&gaps, SIZE, row + 3).expect("whole");
            assert_eq!(unpacked.as_raw(), &grey, "{name}");
        }
        let swapped: Vec<u8> =
            grey.iter().flat_map(|v| ((u16::from(*v) * 257) ^ 3).to_be_bytes()).collect();
        let high = Pixels::named("mono16").expect("known").higher_byte_first();
        assert_eq!(high.unpack(&swapped, SIZE, 0).expect("whole").as_raw(), &grey);
        assert_eq!(Pixels::named("32FC1"), None);
    }

    #[test]
    fn deep_mosaics_are_averaged_as_others_are() {
        let deep = Pixels::named("bayer_rggb16").expect("known");
        let bytes: Vec<u8> = [51_u16 * 257; 8].iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(deep.unpack(&bytes, SIZE, 0).expect("whole").into_raw(), [51; 8]);
        let high: Vec<u8> = [51_u16 * 256; 8].iter().flat_map(|v| v.to_be_bytes()).collect();
        let high = deep.higher_byte_first().unpack(&high, SIZE, 0).expect("whole");
        assert_eq!(high.into_raw(), [51; 8]);
    }

    #[test]
    fn names_mean_one_format_each() {
        let mut seen = std::collections::BTreeSet::new();
        for name in NAMES.iter().flat_map(|(names, _)| *names) {
            assert!(seen.insert(name), "{name} twice");
        }
    }

    #[test]
    fn odd_sizes_have_the_bytes_that_ffmpeg_writes() {
        let size = ImageSize { width_px: 5, height_px: 3 };
        for (name, bytes) in [
            ("gray", 15),
            ("yuv420p", 15 + 12),
            ("yuyv422", 36),
            ("yuv422p", 15 + 18),
            ("nv12", 27),
        ] {
            let pixels = Pixels::named(name).expect("known");
            assert_eq!(pixels.picture_bytes(size), Some(bytes), "{name}");
        }
        let huge = ImageSize { width_px: u32::MAX, height_px: u32::MAX };
        assert_eq!(Pixels::named("yuv444p").expect("known").picture_bytes(huge), None);
    }
}
