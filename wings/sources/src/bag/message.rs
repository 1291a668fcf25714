//! Topics and messages of a bag, of any file format.

use image::GrayImage;

use super::foxglove::FoxgloveType;
use crate::{RosImageType, RosImages};
use boresight_capture::{Decompressor, RosFlaw};

/// Most bytes of a message.
pub(super) const MESSAGE_LIMIT: u64 = 1 << 28;

/// Most bytes that come of `packed_bytes`: far more than of any recording.
pub(super) fn most_unpacked(packed_bytes: u64) -> u64 {
    (64 << 20) + packed_bytes.saturating_mul(100)
}

/// A topic of a bag.
pub(super) struct Topic {
    pub(super) name: String,
    /// Type of the messages in the bag's words.
    pub(super) type_name: String,
    /// Kind of the pictures; `None` for other messages than pictures.
    pub(super) kind: Option<Kind>,
}

impl Topic {
    pub(super) fn new(name: String, type_name: String, encoding: &str) -> Self {
        let ros = RosImageType::named(&type_name).filter(|_| encoding == "cdr").map(Kind::Ros);
        let foxglove = || FoxgloveType::named(&type_name, encoding).map(Kind::Foxglove);
        let kind = ros.or_else(foxglove);
        Self { name, type_name, kind }
    }
}

/// Kind of messages with pictures.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Messages of ROS 2, in CDR.
    Ros(RosImageType),
    Foxglove(FoxgloveType),
}

impl Kind {
    /// True for messages of ROS 2.
    pub(super) fn is_of_ros(self) -> bool {
        match self {
            Self::Ros(_) => true,
            Self::Foxglove(kind) => kind.is_of_ros(),
        }
    }
}

/// Reader of the pictures of a topic.
pub(super) enum Pictures {
    Ros(Box<RosImages>),
    Foxglove(FoxgloveType, Box<Decompressor>),
}

impl Pictures {
    pub(super) fn new(kind: Kind) -> Self {
        match kind {
            Kind::Ros(kind) => Self::Ros(Box::new(RosImages::new(kind))),
            Kind::Foxglove(kind) => Self::Foxglove(kind, Box::default()),
        }
    }

    /// Time in nanoseconds, if stated, and picture in `message`.
    pub(super) fn read(&mut self, message: &[u8]) -> Result<(Option<u64>, GrayImage), RosFlaw> {
        match self {
            Self::Ros(images) => {
                images.read(message).map(|(header, image)| (header.stamp_nanos, image))
            }
            Self::Foxglove(kind, decompressor) => kind.read(message, decompressor),
        }
    }
}

/// A message of the chosen topic.
pub(super) struct Message {
    /// Time of recording.
    pub(super) log_nanos: u64,
    pub(super) data: Vec<u8>,
}
