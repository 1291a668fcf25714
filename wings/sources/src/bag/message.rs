//! Topics and messages of a bag, of any file format.

use crate::RosImageType;

/// A topic of a bag.
pub(super) struct Topic {
    pub(super) name: String,
    /// Type of the messages in the bag's words.
    pub(super) type_name: String,
    /// Kind of the pictures; `None` for other messages than pictures in CDR.
    pub(super) kind: Option<RosImageType>,
}

impl Topic {
    pub(super) fn new(name: String, type_name: String, encoding: &str) -> Self {
        let kind = RosImageType::named(&type_name).filter(|_| encoding == "cdr");
        Self { name, type_name, kind }
    }
}

/// A message of the chosen topic.
pub(super) struct Message {
    /// Time of recording.
    pub(super) log_nanos: u64,
    pub(super) data: Vec<u8>,
}
