//! Lines of a store: inputs with a number and a checksum, and the references in use from there on.

use std::path::{Path, PathBuf};

use anyhow::bail;
use hmac_sha256::Hash;
use serde::{Deserialize, Serialize};

use boresight_files::{LineReader, Links};
use boresight_watch::Input;

/// Maximum bytes of a line: `learned` holds every learning picture.
const LINE_LIMIT: u64 = 1 << 20;
/// End of a line: the checksum of everything before.
const BEFORE_SUM: &str = ",\"sum\":\"";
const AFTER_SUM: &str = "\"}";
/// Maximum number of lines written at once: a picture, and what was learned with it.
const AT_ONCE: usize = 2;

/// The references in use.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct InUse {
    /// Boxes of text and logos: left, top, right, bottom, px.
    #[cfg_attr(feature = "schemas", schemars(with = "Vec<[u32; 4]>"))]
    pub text: Vec<[u32; 4]>,
    /// True once the learning days are over.
    pub is_learned: bool,
    /// Names of the references in `references/`.
    pub references: Vec<String>,
}

/// A line of `watch.jsonl`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StoreLine {
    /// What happened.
    #[serde(flatten)]
    pub input: Input,
    /// The references in use from here on, if others than before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub in_use: Option<InUse>,
    /// Number of the line, from 0; earlier versions wrote none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seq: Option<usize>,
    /// Start of the SHA-256 of the line before this field, hexadecimal; earlier versions wrote none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sum: Option<String>,
}

/// Reason for an unreadable line.
#[derive(Debug)]
pub(super) enum Unread {
    /// The line isn't as written.
    Damaged(String),
    /// The line isn't as written: the file system never got its bytes.
    Hole,
    /// The line is as written, with contents unknown to the program's version.
    Newer(String),
}

/// Error of a line of a later version of the program.
#[derive(Debug, thiserror::Error)]
#[error("line {line} of {path:?} was written by a newer boresight: {what}")]
pub(super) struct WrittenByNewer {
    line: usize,
    path: PathBuf,
    what: String,
}

/// First digits of a checksum.
pub(super) fn sum_of(parts: &[&[u8]]) -> String {
    let mut hash = Hash::new();
    parts.iter().for_each(|part| hash.update(part));
    hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}

impl StoreLine {
    /// Text of the line numbered `seq`, with a line break.
    ///
    /// # Errors
    ///
    /// If a number can't be written.
    pub(super) fn text(self, seq: usize) -> anyhow::Result<String> {
        let mut text = serde_json::to_string(&Self { seq: Some(seq), sum: None, ..self })?;
        text.pop();
        let sum = sum_of(&[text.as_bytes()]);
        Ok(format!("{text}{BEFORE_SUM}{sum}{AFTER_SUM}\n"))
    }

    fn parsed(text: &[u8]) -> Result<Self, Unread> {
        // No text has a zero.
        if text.contains(&0) {
            return Err(Unread::Hole);
        }
        let parsed = serde_json::from_slice::<Self>(text);
        let stated = text.strip_suffix(AFTER_SUM.as_bytes()).and_then(|text| {
            let (text, sum) = text.split_at_checked(text.len().checked_sub(16)?)?;
            Some((text.strip_suffix(BEFORE_SUM.as_bytes())?, sum))
        });
        let is_whole = stated.map(|(text, sum)| sum_of(&[text]).as_bytes() == sum);
        match (parsed, is_whole) {
            (_, Some(false)) => Err(Unread::Damaged("its checksum doesn't match".into())),
            (Ok(Self { sum: Some(_), .. }), None) => {
                Err(Unread::Damaged("its checksum isn't at its end".into()))
            }
            (Ok(line), _) if !line.input.is_sound() => {
                Err(Unread::Damaged("it has numbers that no picture gives".into()))
            }
            (Ok(line), _) => Ok(line),
            (Err(err), Some(true)) => Err(Unread::Newer(err.to_string())),
            (Err(err), None) if err.to_string().starts_with("unknown variant") => {
                Err(Unread::Newer(err.to_string()))
            }
            (Err(err), None) => Err(Unread::Damaged(err.to_string())),
        }
    }
}

/// Whole lines of a store.
#[derive(Debug, Default)]
pub(super) struct Lines {
    /// The lines, in order.
    pub(super) lines: Vec<StoreLine>,
    /// Size in bytes.
    pub(super) bytes: u64,
    /// True if the end was cut while being written.
    pub(super) was_cut: bool,
}

impl Lines {
    /// Reads the lines at `path`; each from the start, with its size in bytes.
    ///
    /// # Errors
    ///
    /// If the file can't be read.
    pub(super) fn each(path: &Path) -> anyhow::Result<Vec<(Result<StoreLine, Unread>, u64)>> {
        let mut reader = LineReader::open(path, LINE_LIMIT, Links::Refused)?;
        let (mut line, mut all, mut has_sums) = (Vec::new(), Vec::new(), false);
        while reader.read(&mut line)? {
            let mut parsed = match line.strip_suffix(b"\n") {
                Some(text) => StoreLine::parsed(text),
                None if (line.len() as u64) < LINE_LIMIT => Err(Unread::Hole),
                None => Err(Unread::Damaged("it is longer than any line".into())),
            };
            if let Ok(line) = &parsed {
                if has_sums && line.sum.is_none() {
                    parsed = Err(Unread::Damaged("it has no checksum".into()));
                } else {
                    has_sums = line.sum.is_some();
                }
            }
            all.push((parsed, line.len() as u64));
        }
        Ok(all)
    }

    /// Reads the lines at `path`. A cut end is left out and reported.
    ///
    /// # Errors
    ///
    /// If the file can't be read, or isn't whole: the message names the line.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let all = Self::each(path)?;
        let (count, mut lines) = (all.len(), Self::default());
        for (n, (parsed, bytes)) in all.into_iter().enumerate() {
            let number = n + 1;
            match parsed {
                Ok(line) if line.seq.is_none_or(|seq| seq == n) => {
                    lines.lines.push(line);
                    lines.bytes += bytes;
                }
                Ok(_) => bail!("line {number} of {path:?} isn't the one that was due"),
                // What was written last was never told to anybody.
                Err(Unread::Hole) if n + AT_ONCE >= count => {
                    lines.was_cut = true;
                    break;
                }
                Err(Unread::Hole) => bail!("line {number} of {path:?} is damaged: it has a hole"),
                Err(Unread::Damaged(why)) => bail!("line {number} of {path:?} is damaged: {why}"),
                Err(Unread::Newer(what)) => {
                    bail!(WrittenByNewer { line: number, path: path.to_path_buf(), what })
                }
            }
        }
        Ok(lines)
    }

    /// References of the newest line that names some.
    pub(super) fn in_use(&self) -> Option<&InUse> {
        self.lines.iter().rev().find_map(|line| line.in_use.as_ref())
    }

    /// Number of times that references were learned or forgotten.
    pub(super) fn learned(&self) -> u64 {
        let is_it = |line: &&StoreLine| {
            matches!(line.input, Input::Learned { .. } | Input::Accepted { .. })
        };
        self.lines.iter().filter(is_it).count() as u64
    }
}
