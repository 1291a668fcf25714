//! Pictures in messages of Foxglove: `RawImage` and `CompressedImage` in protobuf, JSON or CDR,
//! <https://docs.foxglove.dev/docs/visualization/message-schemas/introduction>.

use base64::{Engine, engine::general_purpose::STANDARD};
use image::GrayImage;
use serde_json::Value;

use crate::ros_image::{Cdr, unpacked};
use boresight_capture::{Decompressor, RosFlaw};
use boresight_geometry::frame::ImageSize;

/// Type of a message, and its serialization.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FoxgloveType {
    is_raw: bool,
    wire: Wire,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wire {
    Protobuf,
    Json,
    Cdr,
}

impl FoxgloveType {
    /// Type by the names of the schema and of the serialization; `None` for other messages.
    pub(super) fn named(schema: &str, encoding: &str) -> Option<Self> {
        let is_raw = match schema {
            "foxglove.RawImage" | "foxglove_msgs/msg/RawImage" => true,
            "foxglove.CompressedImage" | "foxglove_msgs/msg/CompressedImage" => false,
            _ => return None,
        };
        let wire = match encoding {
            "protobuf" => Wire::Protobuf,
            "json" => Wire::Json,
            "cdr" => Wire::Cdr,
            _ => return None,
        };
        Some(Self { is_raw, wire })
    }

    /// True for messages of ROS 2, whose header is that of `sensor_msgs`.
    pub(super) fn is_of_ros(self) -> bool {
        self.wire == Wire::Cdr
    }

    /// Time in nanoseconds, if stated, and picture in `message`.
    pub(super) fn read(
        self,
        message: &[u8],
        decompressor: &mut Decompressor,
    ) -> Result<(Option<u64>, GrayImage), RosFlaw> {
        let parts = match self.wire {
            Wire::Protobuf => protobuf(message, self.is_raw),
            Wire::Json => json(message),
            Wire::Cdr => cdr(message, self.is_raw),
        };
        let parts = parts.ok_or(RosFlaw::Message)?;
        let image = if self.is_raw { raw(&parts)? } else { decompressor.picture(&parts.data)? };
        Ok((Some(parts.nanos).filter(|nanos| *nanos > 0), image))
    }
}

/// Contents of a message; those of the other type are empty.
#[derive(Default)]
struct Parts {
    nanos: u64,
    size: [u32; 2],
    encoding: String,
    step: u32,
    data: Vec<u8>,
}

fn raw(parts: &Parts) -> Result<GrayImage, RosFlaw> {
    let encoding = match parts.encoding.as_str() {
        "8UC1" => "mono8",
        "8UC3" => "bgr8",
        "16UC1" => "mono16",
        "yuv422" => "uyvy",
        "yuv422_yuy2" => "yuyv",
        other => other,
    };
    let [width_px, height_px] = parts.size;
    unpacked(encoding, false, ImageSize { width_px, height_px }, parts.step, &parts.data)
}

fn nanos(secs: u64, nanos: u64) -> Option<u64> {
    secs.checked_mul(1_000_000_000)?.checked_add(nanos)
}

fn cdr(message: &[u8], is_raw: bool) -> Option<Parts> {
    let mut cdr = Cdr::of(message)?;
    let header = cdr.header()?;
    let mut parts = Parts { nanos: header.stamp_nanos.unwrap_or(0), ..Parts::default() };
    if is_raw {
        parts.size = [cdr.whole()?, cdr.whole()?];
        parts.encoding = cdr.text()?.into();
        parts.step = cdr.whole()?;
    }
    parts.data = cdr.bytes()?.to_vec();
    Some(parts)
}

fn json(message: &[u8]) -> Option<Parts> {
    let tree: Value = serde_json::from_slice(message).ok()?;
    let whole = |name: &str| tree[name].as_u64().and_then(|number| u32::try_from(number).ok());
    let time = &tree["timestamp"];
    let nsec = time["nsec"].as_u64().or(time["nanos"].as_u64()).unwrap_or(0);
    Some(Parts {
        nanos: nanos(time["sec"].as_u64().unwrap_or(0), nsec)?,
        size: [whole("width").unwrap_or(0), whole("height").unwrap_or(0)],
        encoding: tree["encoding"].as_str().unwrap_or_default().into(),
        step: whole("step").unwrap_or(0),
        data: STANDARD.decode(tree["data"].as_str()?).ok()?,
    })
}

/// A field of a protobuf message.
enum Field<'a> {
    Number(u64),
    Bytes(&'a [u8]),
}

fn protobuf(message: &[u8], is_raw: bool) -> Option<Parts> {
    let mut parts = Parts::default();
    let mut rest = message;
    while let Some((number, field)) = field(&mut rest)? {
        match (number, field) {
            (1, Field::Bytes(mut time)) => {
                let (mut secs, mut parts_of_one) = (0, 0);
                while let Some((number, value)) = self::field(&mut time)? {
                    match (number, value) {
                        (1, Field::Number(value)) => secs = value,
                        (2, Field::Number(value)) => parts_of_one = value,
                        _ => {}
                    }
                }
                parts.nanos = nanos(secs, parts_of_one)?;
            }
            (2 | 3, Field::Number(side)) if is_raw => {
                parts.size[number as usize - 2] = u32::try_from(side).ok()?;
            }
            (4, Field::Bytes(name)) if is_raw => {
                parts.encoding = String::from_utf8(name.into()).ok()?;
            }
            (5, Field::Number(step)) if is_raw => parts.step = u32::try_from(step).ok()?,
            (6, Field::Bytes(data)) if is_raw => parts.data = data.into(),
            (2, Field::Bytes(data)) if !is_raw => parts.data = data.into(),
            _ => {}
        }
    }
    Some(parts)
}

/// Takes the next field from `rest`; `Some(None)` at the end.
fn field<'a>(rest: &mut &'a [u8]) -> Option<Option<(u64, Field<'a>)>> {
    if rest.is_empty() {
        return Some(None);
    }
    let key = varint(rest)?;
    let take = |rest: &mut &'a [u8], count: usize| {
        let (taken, after) = rest.split_at_checked(count)?;
        *rest = after;
        Some(taken)
    };
    let value = match key & 7 {
        0 => Field::Number(varint(rest)?),
        1 => Field::Number(u64::from_le_bytes(take(rest, 8)?.try_into().ok()?)),
        2 => {
            let count = usize::try_from(varint(rest)?).ok()?;
            Field::Bytes(take(rest, count)?)
        }
        5 => Field::Number(u32::from_le_bytes(take(rest, 4)?.try_into().ok()?).into()),
        _ => return None,
    };
    Some(Some((key >> 3, value)))
}

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (byte, after) = rest.split_first()?;
        *rest = after;
        value |= u64::from(byte & 0x7F) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}
