//! Flaws of bags.

use crate::RosFlaw;

/// Reason of a bag without pictures, or without more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BagFlaw {
    /// The bytes can't be read.
    #[error("this bag can't be read ({0})")]
    Unreadable(String),
    /// No topic has pictures in messages of ROS 2.
    #[error("this bag has no topic with pictures; it has {}", listed(.0))]
    NoPictures(Vec<String>),
    /// Several topics have pictures.
    #[error("this bag has several topics with pictures:\n  {}", .0.join("\n  "))]
    Several(Vec<String>),
    /// There are no pictures on the topic.
    #[error("this bag has no pictures on {asked}; it has some on {}", .have.join(", "))]
    NoSuchTopic {
        /// The requested topic.
        asked: String,
        /// The topics with pictures.
        have: Vec<String>,
    },
    /// No message has a readable picture.
    #[error("no message of {topic} can be read: {flaw}")]
    NoPicture {
        /// The topic.
        topic: String,
        /// Flaw of the first message.
        flaw: RosFlaw,
    },
    /// The topic has no message.
    #[error("{0} has no messages")]
    Silent(String),
    /// The bag can't be read after the last picture.
    #[error("this bag is damaged after picture {count} ({how}); all before it is good")]
    Damaged {
        /// Number of pictures read.
        count: u64,
        /// Kind of damage.
        how: String,
    },
    /// Some messages have no whole picture.
    #[error("{torn} of {count} pictures in this bag are damaged and were left out")]
    Torn {
        /// Number of messages without a whole picture.
        torn: u64,
        /// Number of all messages.
        count: u64,
    },
}

fn listed(topics: &[String]) -> String {
    if topics.is_empty() { "none at all".into() } else { topics.join(", ") }
}

#[cfg(feature = "bags")]
impl BagFlaw {
    /// The flaw of a bag without anything read.
    pub(super) fn at_the_start(self) -> Self {
        match self {
            Self::Damaged { count: 0, how } => Self::Unreadable(how),
            other => other,
        }
    }
}
