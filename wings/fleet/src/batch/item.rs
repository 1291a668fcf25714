//! A session or recorded bag as a line of a manifest.

use std::{io::Read, path::Path};

use serde::{Deserialize, Serialize};

use boresight_app::RESULT_FILE;
use boresight_capture::{bag_files, is_bag};
use boresight_files::{FileError, Links, Patient, TEXT_LIMIT, open, read};

/// File whose presence makes a folder a session.
pub(super) const HEADER: &str = "session.toml";
/// Journal of a session.
pub(super) const JOURNAL: &str = "journal.jsonl";
/// Largest valid header, in bytes.
pub(super) const HEADER_LIMIT: u64 = 1 << 20;
/// Maximum bytes of a journal or bag in the hash: of a longer bag the first, of a longer journal
/// only the length. No session of a day reaches it.
pub(super) const JOURNAL_LIMIT: u64 = 1 << 30;

/// A line of a manifest: one session, or a recorded bag that becomes one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Item {
    /// The session's folder or the bag: an absolute path, or `s3://BUCKET/PREFIX`.
    pub session: String,
    /// Hash of what the session holds: `session.toml`, the journal, whose lines hold the checksums
    /// of the pictures, and the result; of a bag, its files.
    pub content: String,
    /// Length of the journal, or of the bag.
    pub bytes: u64,
}

/// Hashed contents of a session's files: their bytes, or the stable name of the read error.
pub(super) struct Content {
    /// All of `session.toml`.
    pub(super) header: Result<Vec<u8>, &'static str>,
    /// Length of the journal, and the hash, zeros beyond [`JOURNAL_LIMIT`].
    pub(super) journal: Result<(u64, [u8; 32]), &'static str>,
    /// All of the result; without a result, the name of its absence.
    pub(super) result: Result<Vec<u8>, &'static str>,
}

impl Content {
    /// Item for the session named `session` with the given contents.
    pub(super) fn item(self, session: String) -> Item {
        let mut hash = hmac_sha256::Hash::new();
        for whole in [self.header, self.result] {
            match whole {
                Ok(file) => {
                    hash.update((file.len() as u64).to_le_bytes());
                    hash.update(file);
                }
                Err(code) => hash.update(code),
            }
        }
        let mut bytes = 0;
        match self.journal {
            Ok((length, all)) => {
                bytes = length;
                hash.update(length.to_le_bytes());
                hash.update(all);
            }
            Err(code) => hash.update(code),
        }
        Item { session, content: hex(&hash.finalize()[..16]), bytes }
    }
}

impl Item {
    /// Present item for the session in the folder `session`, or the bag at the path; `None` if the
    /// name isn't UTF-8. An unreadable file counts by its error, to give every session a row.
    pub fn of(session: &Path) -> Option<Self> {
        let name = session.to_str()?.to_owned();
        if is_bag(session) {
            return Some(of_bag(session, name));
        }
        let header = read(&session.join(HEADER), HEADER_LIMIT, Links::Refused);
        let result = read(&session.join(RESULT_FILE), TEXT_LIMIT, Links::Refused);
        let content = Content {
            header: header.map_err(|err| err.code()),
            journal: journal(&session.join(JOURNAL)).map_err(|err| err.code()),
            result: result.map_err(|err| err.code()),
        };
        Some(content.item(name))
    }
}

/// Item for the bag at `path`, named `session`. An unreadable file counts by its error.
fn of_bag(path: &Path, session: String) -> Item {
    let (mut hash, mut bytes) = (hmac_sha256::Hash::new(), 0);
    for file in bag_files(path).unwrap_or_default() {
        match hash_of(&file) {
            Ok((length, all)) => {
                bytes += length;
                hash.update(length.to_le_bytes());
                hash.update(all);
            }
            Err(err) => hash.update(err.code()),
        }
    }
    Item { session, content: hex(&hash.finalize()[..16]), bytes }
}

/// Length of the journal at `path`, and hash. A journal without an end isn't read to be refused.
fn journal(path: &Path) -> Result<(u64, [u8; 32]), FileError> {
    let length = open(path, Links::Refused)?.metadata().map_err(FileError::reading(path))?.len();
    if length > JOURNAL_LIMIT { Ok((length, [0; 32])) } else { hash_of(path) }
}

/// Length of the file at `path`, and hash.
fn hash_of(path: &Path) -> Result<(u64, [u8; 32]), FileError> {
    let reading = FileError::reading(path);
    let file = open(path, Links::Refused)?;
    let length = file.metadata().map_err(&reading)?.len();
    let (mut hash, mut part) = (hmac_sha256::Hash::new(), vec![0; 1 << 16]);
    let mut file = Patient::new(file.take(JOURNAL_LIMIT));
    loop {
        match file.read(&mut part) {
            Ok(0) => return Ok((length, hash.finalize())),
            Ok(count) => hash.update(&part[..count]),
            Err(err) if err.kind() == std::io::ErrorKind::Interrupted => {}
            Err(err) => return Err(reading(err)),
        }
    }
}

/// Hexadecimal digits of `bytes`.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::{
        fs::{self, OpenOptions},
        io::Write,
    };

    use super::*;

    #[test]
    fn a_journal_without_an_end_is_not_read() {
        let place = boresight_files::Scratch::new().expect("a folder");
        fs::write(place.path().join(HEADER), "").expect("written");
        let with = |start: &[u8], length: u64| {
            let path = place.path().join(JOURNAL);
            let file = OpenOptions::new().create(true).truncate(true).write(true).open(path);
            let mut file = file.expect("made");
            file.write_all(start).expect("written");
            file.set_len(length).expect("sparse");
            Item::of(place.path()).expect("UTF-8")
        };
        let (long, other) = (with(b"a", 30 << 30), with(b"b", 30 << 30));
        assert_eq!((&long, long.bytes), (&other, 30 << 30));
        assert_ne!(long.content, with(b"a", (30 << 30) + 1).content);
        assert_ne!(with(b"a", 9).content, with(b"b", 9).content);
    }
}
