//! Pictures in messages of ROS 2: `sensor_msgs/msg/Image` and `sensor_msgs/msg/CompressedImage` in
//! CDR, from topics, bags and MCAP files.
//!
//! Layout of the messages: <https://docs.ros.org/en/jazzy/p/sensor_msgs/>; of their bytes: OMG
//! DDSI-RTPS 2.5, section 10.

use image::GrayImage;

use boresight_capture::{Decompressor, PICTURE_LIMIT_PX, Pixels, RosFlaw};
use boresight_geometry::frame::ImageSize;

/// Type of a message with a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RosImageType {
    /// `sensor_msgs/msg/Image`.
    Image,
    /// `sensor_msgs/msg/CompressedImage`, with a JPEG or PNG.
    Compressed,
}

impl RosImageType {
    /// Type by its name in ROS 2 or, like `sensor_msgs::msg::dds_::Image_`, in DDS; `None` for
    /// other messages.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "sensor_msgs/msg/Image" | "sensor_msgs::msg::dds_::Image_" => Some(Self::Image),
            "sensor_msgs/msg/CompressedImage" | "sensor_msgs::msg::dds_::CompressedImage_" => {
                Some(Self::Compressed)
            }
            _ => None,
        }
    }

    /// Name of the type in ROS 2.
    pub fn name(self) -> &'static str {
        match self {
            Self::Image => "sensor_msgs/msg/Image",
            Self::Compressed => "sensor_msgs/msg/CompressedImage",
        }
    }

    /// Name of the type in DDS.
    pub fn dds_name(self) -> &'static str {
        match self {
            Self::Image => "sensor_msgs::msg::dds_::Image_",
            Self::Compressed => "sensor_msgs::msg::dds_::CompressedImage_",
        }
    }
}

/// Header of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RosHeader<'a> {
    /// Time of the picture, in nanoseconds; `None` if unstated by the camera's driver.
    pub stamp_nanos: Option<u64>,
    /// Name of the camera's coordinate frame.
    pub frame_id: &'a str,
}

impl<'a> RosHeader<'a> {
    /// Header at the beginning of `message`; `None` if there is none.
    pub fn of(message: &'a [u8]) -> Option<Self> {
        Cdr::of(message)?.header()
    }
}

/// Reads the messages of a topic.
#[derive(Clone, Debug)]
pub struct RosImages {
    kind: RosImageType,
    decompressor: Decompressor,
}

impl RosImages {
    /// A reader of messages of the given type.
    pub fn new(kind: RosImageType) -> Self {
        Self { kind, decompressor: Decompressor::default() }
    }

    /// The picture in the bytes of a message, from its encapsulation header on, as brightness.
    ///
    /// # Errors
    ///
    /// [`RosFlaw`]. The next message may well be good.
    pub fn read<'a>(&mut self, message: &'a [u8]) -> Result<(RosHeader<'a>, GrayImage), RosFlaw> {
        match self.kind {
            RosImageType::Image => image(message),
            RosImageType::Compressed => self.compressed(message),
        }
    }

    fn compressed<'a>(&mut self, message: &'a [u8]) -> Result<(RosHeader<'a>, GrayImage), RosFlaw> {
        let mut cdr = Cdr::of(message).ok_or(RosFlaw::Message)?;
        let parts = (|| Some((cdr.header()?, cdr.text()?, cdr.bytes()?)))();
        let (header, format, data) = parts.ok_or(RosFlaw::Message)?;
        // Depth is packed behind its own header.
        if format.contains("compressedDepth") {
            return Err(RosFlaw::Encoding(format.into()));
        }
        Ok((header, self.decompressor.picture(data)?))
    }
}

fn image(message: &[u8]) -> Result<(RosHeader<'_>, GrayImage), RosFlaw> {
    let mut cdr = Cdr::of(message).ok_or(RosFlaw::Message)?;
    let parts = (|| {
        let (header, height_px, width_px) = (cdr.header()?, cdr.whole()?, cdr.whole()?);
        let (encoding, higher_first) = (cdr.text()?, cdr.byte()? != 0);
        Some((
            header,
            ImageSize { width_px, height_px },
            encoding,
            higher_first,
            cdr.whole()?,
            cdr.bytes()?,
        ))
    })();
    let (header, size, encoding, higher_first, step, data) = parts.ok_or(RosFlaw::Message)?;
    Ok((header, unpacked(encoding, higher_first, size, step, data)?))
}

/// Brightness of the pixels in `data`, in ROS's `encoding`, with rows of `step` bytes.
pub(super) fn unpacked(
    encoding: &str,
    higher_first: bool,
    size: ImageSize,
    step: u32,
    data: &[u8],
) -> Result<GrayImage, RosFlaw> {
    let unknown = || RosFlaw::Encoding(encoding.chars().take(40).collect());
    let pixels = Pixels::named(encoding).ok_or_else(unknown)?;
    let pixels = if higher_first { pixels.higher_byte_first() } else { pixels };
    if size.width_px.max(size.height_px) > PICTURE_LIMIT_PX {
        return Err(RosFlaw::Message);
    }
    Ok(pixels.unpack(data, size, step as usize)?)
}

/// Bytes in the Common Data Representation: numbers are aligned to multiples of their size.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    higher_first: bool,
}

impl<'a> Cdr<'a> {
    pub(super) fn of(message: &'a [u8]) -> Option<Self> {
        let ([0, kind, ..], bytes) = message.split_first_chunk::<4>()? else { return None };
        // Plain, of the first and second version, which only differ for numbers of eight bytes.
        let higher_first = match kind {
            0 | 6 => true,
            1 | 7 => false,
            _ => return None,
        };
        Some(Self { bytes, at: 0, higher_first })
    }

    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        self.take(1).map(|byte| byte[0])
    }

    pub(super) fn whole(&mut self) -> Option<u32> {
        self.at = self.at.next_multiple_of(4);
        let bytes = *self.take(4)?.first_chunk()?;
        Some(if self.higher_first { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    pub(super) fn bytes(&mut self) -> Option<&'a [u8]> {
        let count = self.whole()?;
        self.take(count as usize)
    }

    /// A text, with a final byte 0 counted in the length.
    pub(super) fn text(&mut self) -> Option<&'a str> {
        let bytes = self.bytes()?;
        std::str::from_utf8(bytes.strip_suffix(&[0]).unwrap_or(bytes)).ok()
    }

    pub(super) fn header(&mut self) -> Option<RosHeader<'a>> {
        let (secs, nanos, frame_id) = (self.whole()?, self.whole()?, self.text()?);
        // Seconds are signed; no camera's time is before 1970.
        let secs = u64::try_from(secs.cast_signed()).ok()?;
        let stamp_nanos = Some(secs * 1_000_000_000 + u64::from(nanos)).filter(|nanos| *nanos > 0);
        Some(RosHeader { stamp_nanos, frame_id })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A message as serialised by a driver, in either order of bytes.
    fn message(encoding: &str, higher_first: bool, step: u32, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let whole = |bytes: &mut Vec<u8>, value: u32| {
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            bytes.extend(if higher_first { value.to_be_bytes() } else { value.to_le_bytes() });
        };
        let text = |bytes: &mut Vec<u8>, text: &str| {
            whole(bytes, text.len() as u32 + 1);
            bytes.extend(text.as_bytes());
            bytes.push(0);
        };
        whole(&mut bytes, 7);
        whole(&mut bytes, 5);
        text(&mut bytes, "camera");
        whole(&mut bytes, 2);
        whole(&mut bytes, 4);
        text(&mut bytes, encoding);
        bytes.push(u8::from(higher_first));
        whole(&mut bytes, step);
        whole(&mut bytes, data.len() as u32);
        bytes.extend(data);
        [&[0, u8::from(!higher_first), 0, 0], bytes.as_slice()].concat()
    }

    #[test]
    fn a_message_is_its_picture_in_either_order_of_bytes() {
        let grey = [0, 40, 80, 120, 160, 200, 240, 255];
        let mut reader = RosImages::new(RosImageType::Image);
        for higher_first in [false, true] {
            let plain = message("mono8", higher_first, 4, &grey);
            let (header, image) = reader.read(&plain).expect("whole");
            let wanted = RosHeader { stamp_nanos: Some(7_000_000_005), frame_id: "camera" };
            assert_eq!((header, image.into_raw()), (wanted, grey.to_vec()));
            let deep: Vec<u8> = grey
                .map(|v| u16::from(v) * 257)
                .iter()
                .flat_map(|v| if higher_first { v.to_be_bytes() } else { v.to_le_bytes() })
                .collect();
            let deep = message("mono16", higher_first, 8, &deep);
            assert_eq!(reader.read(&deep).expect("whole").1.into_raw(), grey);
        }
    }

    #[test]
    fn a_message_that_is_cut_anywhere_is_no_picture() {
        let whole = message("mono8", false, 4, &[9; 8]);
        let mut reader = RosImages::new(RosImageType::Image);
        assert!(reader.read(&whole).is_ok());
        for end in 0..whole.len() {
            assert_eq!(reader.read(&whole[..end]), Err(RosFlaw::Message), "{end}");
        }
        let short = message("mono8", false, 4, &[9; 7]);
        assert_eq!(
            reader.read(&short),
            Err(RosFlaw::Picture(boresight_capture::integrity::Flaw::Short))
        );
        let depth = message("32FC1", false, 16, &[9; 32]);
        assert_eq!(reader.read(&depth), Err(RosFlaw::Encoding("32FC1".into())));
        let mut compressed = RosImages::new(RosImageType::Compressed);
        assert!(compressed.read(&whole).is_err(), "of another type");
    }

    #[test]
    fn types_are_known_by_both_names() {
        for (name, kind) in [
            ("sensor_msgs/msg/Image", Some(RosImageType::Image)),
            ("sensor_msgs::msg::dds_::CompressedImage_", Some(RosImageType::Compressed)),
            ("sensor_msgs/msg/CameraInfo", None),
        ] {
            assert_eq!(RosImageType::named(name), kind);
        }
    }
}
