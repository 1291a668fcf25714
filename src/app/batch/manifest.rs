//! The sessions of a batch, one a line.

use std::{
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::{
    app::{RESULT_FILE, session_folders::session_folders},
    files::{FileError, LineReader, Links, open, read},
};

const HEADER: &str = "session.toml";
const JOURNAL: &str = "journal.jsonl";
/// The largest header that counts.
const HEADER_LIMIT: u64 = 1 << 20;
/// Bytes at the end of a journal that count. They hold the numbers of the last decision.
const END_BYTES: u64 = 2048;
/// The longest line of a manifest.
const LINE_LIMIT: u64 = 1 << 16;

/// A line of a manifest: one session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Item {
    /// The session's folder, an absolute path.
    pub session: String,
    /// Hash of what the session holds: all of `session.toml`; length and end of the journal, whose lines are numbered
    /// and only appended; length of the result.
    pub content: String,
    /// Length of the journal.
    pub bytes: u64,
}

/// Why a manifest can't be read.
#[derive(Debug, thiserror::Error)]
pub enum ManifestError {
    /// The file can't be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// A line is no item.
    #[error(
        "line {line} is no line of a manifest ({reason}); write it again with `boresight batch plan`: {path:?}"
    )]
    Line {
        /// Its number, from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
        /// The file.
        path: PathBuf,
    },
}

impl Item {
    /// The session in the folder `session`, as it is now; `None` if the name isn't UTF-8. What can't be read counts
    /// by its error, so that every session becomes a row.
    pub fn of(session: &Path) -> Option<Self> {
        let name = session.to_str()?.to_owned();
        let mut hash = hmac_sha256::Hash::new();
        match read(&session.join(HEADER), HEADER_LIMIT, Links::Refused) {
            Ok(header) => {
                hash.update((header.len() as u64).to_le_bytes());
                hash.update(header);
            }
            Err(err) => hash.update(err.code()),
        }
        let mut bytes = 0;
        match end_of(&session.join(JOURNAL)) {
            Ok((length, end)) => {
                bytes = length;
                hash.update(length.to_le_bytes());
                hash.update(end);
            }
            Err(err) => hash.update(err.code()),
        }
        let result = session.join(RESULT_FILE).symlink_metadata();
        hash.update(result.map_or(0, |there| there.len() + 1).to_le_bytes());
        Some(Self { session: name, content: hex(&hash.finalize()[..16]), bytes })
    }
}

/// Length and last bytes of the file at `path`.
fn end_of(path: &Path) -> Result<(u64, Vec<u8>), FileError> {
    let reading = FileError::reading(path);
    let mut file = open(path, Links::Refused)?;
    let length = file.metadata().map_err(&reading)?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(END_BYTES))).map_err(&reading)?;
    let mut end = Vec::with_capacity(END_BYTES as usize);
    file.take(END_BYTES).read_to_end(&mut end).map_err(&reading)?;
    Ok((length, end))
}

/// Digits of `bytes`.
pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Finds the sessions in and below each of `roots`, in the order of their paths, and hands each to `found`. Links below
/// a root aren't followed. Returns the folders that were left out because their names aren't UTF-8.
///
/// # Errors
///
/// If a root is no folder, or `found` fails.
pub fn plan(
    roots: &[PathBuf],
    found: &mut dyn FnMut(&Item) -> anyhow::Result<()>,
) -> anyhow::Result<Vec<PathBuf>> {
    let mut left_out = Vec::new();
    for root in roots {
        session_folders(root, &mut |folder| match Item::of(folder) {
            Some(item) => found(&item),
            None => {
                left_out.push(folder.to_path_buf());
                Ok(())
            }
        })?;
    }
    Ok(left_out)
}

/// The items of a manifest, read one after the other.
#[derive(Debug)]
pub struct Manifest {
    lines: LineReader,
    path: PathBuf,
    number: u64,
    line: Vec<u8>,
}

impl Manifest {
    /// Opens the manifest at `path`.
    ///
    /// # Errors
    ///
    /// [`ManifestError::File`].
    pub fn open(path: &Path) -> Result<Self, ManifestError> {
        let lines = LineReader::open(path, LINE_LIMIT, Links::Followed)?;
        Ok(Self { lines, path: path.to_path_buf(), number: 0, line: Vec::new() })
    }

    fn read(&mut self) -> Result<Option<Item>, ManifestError> {
        if !self.lines.read(&mut self.line)? {
            return Ok(None);
        }
        self.number += 1;
        let wrong = |reason: String| ManifestError::Line {
            line: self.number,
            reason,
            path: self.path.clone(),
        };
        if self.line.last() != Some(&b'\n') {
            return Err(wrong("its end is missing".into()));
        }
        serde_json::from_slice(&self.line).map(Some).map_err(|err| wrong(err.to_string()))
    }
}

impl Iterator for Manifest {
    type Item = Result<Item, ManifestError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}
