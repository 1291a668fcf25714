//! Topics and messages of a bag, whatever file they come from.

use crate::RosImageType;

/// A topic of a bag.
pub(super) struct Topic {
    pub(super) name: String,
    /// Type of its messages as the bag calls it.
    pub(super) type_name: String,
    /// Kind of its pictures; `None` if its messages aren't pictures in CDR.
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
    /// When it was recorded.
    pub(super) log_nanos: u64,
    pub(super) data: Vec<u8>,
}
