//! Pixel formats of machine-vision cameras (GenICam's PFNC names), and their frames in common
//! layouts: deep brightness as numbers of two bytes, the low one first; a deep Bayer mosaic in 8
//! bits.

use boresight_capture::v4l2::kernel::FourCc;

/// Place of a sample in the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Samples {
    /// As read, in the given number of bytes a pixel.
    Plain(usize),
    /// A number in two bytes, the low one first.
    Words,
    /// Numbers without gaps, the lowest bit first.
    Bits,
    /// Two numbers in three bytes: the high bits of the first, the low bits of both, the high bits
    /// of the second. GigE Vision's own packing.
    Pairs,
    /// Brightness behind each colour byte.
    AfterColour,
}

/// A readable pixel format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Format {
    /// The camera's name of the format.
    pub(super) name: String,
    /// Four-character code.
    pub(super) fourcc: FourCc,
    samples: Samples,
    /// Bits of a number.
    depth: u32,
    is_mosaic: bool,
}

impl Format {
    /// Format by name; `None` if unreadable.
    pub(super) fn named(name: &str) -> Option<Self> {
        let format = |fourcc: &FourCc, samples, depth, is_mosaic| {
            Some(Self { name: name.into(), fourcc: *fourcc, samples, depth, is_mosaic })
        };
        match name {
            "RGB8" | "RGB8Packed" => return format(b"RGB3", Samples::Plain(3), 8, false),
            "BGR8" | "BGR8Packed" => return format(b"BGR3", Samples::Plain(3), 8, false),
            "YUV422_8" | "YCbCr422_8" | "YUV422_YUYV_Packed" => {
                return format(b"YUYV", Samples::Plain(2), 8, false);
            }
            "YUV422Packed" | "YUV422_8_UYVY" => {
                return format(b"GREY", Samples::AfterColour, 8, false);
            }
            _ => {}
        }
        let (mosaic, rest) = match (name.strip_prefix("Mono"), name.strip_prefix("Bayer")) {
            (Some(rest), _) => (None, rest),
            (None, Some(rest)) => {
                let first: FourCc = match rest.get(..2)? {
                    "BG" => *b"BA81",
                    "GB" => *b"GBRG",
                    "GR" => *b"GRBG",
                    "RG" => *b"RGGB",
                    _ => return None,
                };
                (Some(first), rest.get(2..)?)
            }
            (None, None) => return None,
        };
        let (samples, depth) = match rest {
            "8" => (Samples::Plain(1), 8),
            "10" => (Samples::Words, 10),
            "12" => (Samples::Words, 12),
            "14" => (Samples::Words, 14),
            "16" => (Samples::Words, 16),
            "10p" => (Samples::Bits, 10),
            "12p" => (Samples::Bits, 12),
            "10Packed" => (Samples::Pairs, 10),
            "12Packed" => (Samples::Pairs, 12),
            _ => return None,
        };
        let grey = match depth {
            8 => *b"GREY",
            10 => *b"Y10 ",
            12 => *b"Y12 ",
            _ => *b"Y16 ",
        };
        format(&mosaic.unwrap_or(grey), samples, depth, mosaic.is_some())
    }

    /// Bits of a pixel on the network.
    pub(super) fn bits(&self) -> usize {
        match self.samples {
            Samples::Plain(bytes) => 8 * bytes,
            Samples::Words | Samples::AfterColour => 16,
            Samples::Bits => self.depth as usize,
            Samples::Pairs => 12,
        }
    }

    /// Least number of bytes of a picture as sent, with `padding` bytes after each row.
    pub(super) fn bytes_sent(&self, width: usize, height: usize, padding: usize) -> usize {
        match padding {
            0 => (width * height * self.bits()).div_ceil(8),
            _ => ((width * self.bits()).div_ceil(8) + padding) * height,
        }
    }

    /// Bytes of a picture as read.
    pub(super) fn bytes_read(&self, width: usize, height: usize) -> usize {
        let bytes = match self.samples {
            Samples::Plain(bytes) => bytes,
            Samples::AfterColour => 1,
            _ if self.is_mosaic => 1,
            Samples::Words | Samples::Bits | Samples::Pairs => 2,
        };
        width * height * bytes
    }

    /// Appends a picture as read. `sent` has [`Self::bytes_sent`] bytes at least; a shorter one
    /// gives fewer.
    pub(super) fn read(
        &self,
        sent: &[u8],
        (width, height): (usize, usize),
        padding: usize,
        read: &mut Vec<u8>,
    ) {
        // Without padding, a row may begin within a byte: all rows are one.
        let (width, rows, stride) = match padding {
            0 => (width * height, 1, sent.len().max(1)),
            _ => (width, height, (width * self.bits()).div_ceil(8) + padding),
        };
        for row in sent.chunks(stride).take(rows) {
            self.read_row(row, width, read);
        }
    }

    fn read_row(&self, row: &[u8], width: usize, read: &mut Vec<u8>) {
        let depth = self.depth as usize;
        let byte = |at: usize| row.get(at).copied().map_or(0, u32::from);
        match self.samples {
            Samples::Plain(bytes) => read.extend(row.iter().take(bytes * width)),
            Samples::AfterColour => read.extend(row.iter().skip(1).step_by(2).take(width)),
            Samples::Words => {
                (0..width).for_each(|x| self.put(byte(2 * x) | byte(2 * x + 1) << 8, read));
            }
            Samples::Bits => (0..width).for_each(|x| {
                let (at, shift) = (x * depth / 8, x * depth % 8);
                let bits = byte(at) | byte(at + 1) << 8 | byte(at + 2) << 16;
                self.put(bits >> shift & ((1 << depth) - 1), read);
            }),
            Samples::Pairs => (0..width).for_each(|x| {
                let (at, is_second) = (x / 2 * 3, x % 2);
                let low = byte(at + 1) >> (4 * is_second) & ((1 << (depth - 8)) - 1);
                self.put(byte(at + 2 * is_second) << (depth - 8) | low, read);
            }),
        }
    }

    fn put(&self, value: u32, read: &mut Vec<u8>) {
        let white = (1 << self.depth) - 1;
        let value = value.min(white);
        match (self.is_mosaic, self.depth) {
            (true, _) => read.push(((255 * value + white / 2) / white) as u8),
            // No layout has 14 bits: scale to the whole range of 16.
            (false, 14) => read.extend(((value << 2 | value >> 12) as u16).to_le_bytes()),
            (false, _) => read.extend((value as u16).to_le_bytes()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, sent: &[u8], size: (usize, usize), padding: usize) -> Vec<u8> {
        let format = Format::named(name).expect("a format");
        assert_eq!(sent.len(), format.bytes_sent(size.0, size.1, padding), "{name}");
        let mut read = Vec::new();
        format.read(sent, size, padding, &mut read);
        assert_eq!(read.len(), format.bytes_read(size.0, size.1), "{name}");
        read
    }

    fn words(values: &[u16]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    #[test]
    fn packed_numbers_are_those_of_the_standards_drawings() {
        // PFNC: the lowest bits first, without gaps.
        let p10 = [0b0000_0001, 0b0000_1000, 0b0011_0000, 0b1100_0000, 0b1111_1111];
        assert_eq!(read("Mono10p", &p10, (4, 1), 0), words(&[1, 2, 3, 1023]));
        assert_eq!(read("Mono12p", &[0xBC, 0x3A, 0x12], (2, 1), 0), words(&[0xABC, 0x123]));
        // GigE Vision: high bits, low bits of both, high bits.
        assert_eq!(read("Mono12Packed", &[0xAB, 0x3C, 0x12], (2, 1), 0), words(&[0xABC, 0x123]));
        assert_eq!(read("Mono10Packed", &[0xFF, 0x13, 0x80], (2, 1), 0), words(&[1023, 0x201]));
        assert_eq!(read("Mono12", &words(&[5, 4095]), (2, 1), 0), words(&[5, 4095]));
    }

    #[test]
    fn rows_may_begin_within_a_byte_or_end_with_padding() {
        let run = [0xBC, 0x3A, 0x12, 0xFF, 0x0F, 0x00, 0x01, 0x20, 0x00];
        let wanted = words(&[0xABC, 0x123, 0xFFF, 0, 1, 2]);
        assert_eq!(read("Mono12p", &run, (3, 2), 0), wanted);
        let padded = [0xBC, 0x3A, 0x12, 0xFF, 0x0F, 9, 9, 0x00, 0x10, 0x00, 0x02, 0x00, 9, 9];
        assert_eq!(read("Mono12p", &padded, (3, 2), 2), wanted);
        assert_eq!(read("Mono8", &[1, 2, 9, 3, 4, 9], (2, 2), 1), [1, 2, 3, 4]);
    }

    #[test]
    fn a_deep_mosaic_keeps_its_whole_range_in_eight_bits() {
        assert_eq!(read("BayerRG12", &words(&[0, 4095, 2048, 16]), (2, 2), 0), [0, 255, 128, 1]);
        assert_eq!(read("BayerGB16", &words(&[0, 65535]), (2, 1), 0), [0, 255]);
        assert_eq!(read("BayerBG8", &[7, 8], (2, 1), 0), [7, 8]);
        assert_eq!(read("Mono14", &words(&[0, 16383]), (2, 1), 0), words(&[0, 65535]));
        assert_eq!(read("YUV422Packed", &[1, 100, 2, 200], (2, 1), 0), [100, 200]);
        assert_eq!(Format::named("BayerRG10p").map(|format| format.fourcc), Some(*b"RGGB"));
        assert_eq!(Format::named("Coord3D_ABC32f"), None);
    }
}
