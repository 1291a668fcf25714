//! Recorded bags by name, and flaws of bags and their messages.

use std::path::{Path, PathBuf};

use crate::integrity::Flaw;

/// Reason of a bag without pictures, or without more.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BagFlaw {
    /// The bytes can't be read.
    #[error("this bag can't be read ({0})")]
    Unreadable(String),
    /// No topic has pictures in messages of ROS 2 or Foxglove.
    #[error("this bag has no topic with pictures; it has {}", listed(.0, ", "))]
    NoPictures(Vec<String>),
    /// Several topics have pictures.
    #[error("this bag has several topics with pictures:\n  {}", listed(.0, "\n  "))]
    Several(Vec<String>),
    /// There are no pictures on the topic.
    #[error("this bag has no pictures on {asked}; it has some on {}", listed(.have, ", "))]
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

/// Most names listed for a person: in a file and on a network, anybody may add some.
const LISTED: usize = 30;

/// The first of `topics` or other names with `between` them, and the number of the rest.
pub fn listed(topics: &[String], between: &str) -> String {
    let first = topics[..topics.len().min(LISTED)].join(between);
    match topics.len() {
        0 => "none at all".into(),
        count if count > LISTED => format!("{first}{between}and {} more", count - LISTED),
        _ => first,
    }
}

impl BagFlaw {
    /// The flaw of a bag without anything read.
    #[must_use]
    pub fn at_the_start(self) -> Self {
        match self {
            Self::Damaged { count: 0, how } => Self::Unreadable(how),
            other => other,
        }
    }
}

/// Reason for a message without a picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosFlaw {
    /// The bytes end too early, or aren't such a message.
    #[error("the message is cut off, or has a different type")]
    Message,
    /// The pixels are in an unsupported format.
    #[error("pictures in {0:?} can't be read")]
    Encoding(String),
    /// The picture isn't whole.
    #[error("the picture isn't whole")]
    Picture(Flaw),
}

impl From<Flaw> for RosFlaw {
    fn from(flaw: Flaw) -> Self {
        Self::Picture(flaw)
    }
}

/// Endings of a bag's files.
const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];
/// File in the folder of a bag.
const METADATA: &str = "metadata.yaml";

fn is_bag_file(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).map(str::to_ascii_lowercase);
    name.is_some_and(|name| ENDINGS.iter().any(|ending| name.ends_with(ending))) && path.is_file()
}

/// True if `path` is a bag by name: a file, or a folder made by ROS 2.
pub fn is_bag(path: &Path) -> bool {
    let holds_one = || {
        let mut entries = path.read_dir().into_iter().flatten().flatten();
        entries.any(|entry| is_bag_file(&entry.path()))
    };
    is_bag_file(path) || (path.join(METADATA).is_file() && holds_one())
}

/// The files of the bag at `path` in the order of their numbers.
///
/// # Errors
///
/// If the folder can't be listed.
pub fn bag_files(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files = Vec::new();
    for entry in path.read_dir()? {
        files.push(entry?.path());
    }
    files.retain(|file| is_bag_file(file));
    // `bag_10` follows `bag_9`.
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_thousand_names_are_a_few_and_a_number() {
        let names: Vec<String> = (0..3000).map(|number| format!("gige:{number}")).collect();
        let said = listed(&names, ", ");
        assert!(
            said.starts_with("gige:0, gige:1, ") && said.ends_with(", and 2970 more"),
            "{said}"
        );
        assert_eq!(listed(&names[..2], " or "), "gige:0 or gige:1");
    }
}
