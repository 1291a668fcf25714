//! The append-only log of a session.

use std::{
    fs::{File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};

use serde_json::value::RawValue;

use super::{
    error::{Damage, RecordingError},
    format::{Envelope, InputLine, Line, Stored},
};
use crate::session::{Decision, Input};

/// The open journal.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    next_seq: u64,
}

/// What a journal holds.
#[derive(Debug)]
pub struct JournalContents {
    /// Its lines in order.
    pub lines: Vec<Line>,
    /// Bytes up to the end of the last whole line.
    pub whole_bytes: u64,
    /// Whether a last line was cut and is left out.
    pub cut: bool,
}

impl Journal {
    /// Opens `path` for appending after the `contents` read from it; a cut last line is dropped.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Write`].
    pub fn append_to(path: &Path, contents: &JournalContents) -> Result<Self, RecordingError> {
        let failed = |source| RecordingError::Write { source, path: path.to_path_buf() };
        let file = OpenOptions::new().create(true).append(true).open(path).map_err(failed)?;
        if contents.cut {
            file.set_len(contents.whole_bytes).map_err(failed)?;
            file.sync_all().map_err(failed)?;
        }
        Ok(Self { file, path: path.to_path_buf(), next_seq: contents.lines.len() as u64 })
    }

    /// Appends one input with its decision in a single write; `sync` makes it outlast a power cut.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Write`]; the line may then be cut; the next opening drops it.
    pub fn append(
        &mut self,
        input: &Input,
        decision: &Decision,
        stored: Option<Stored>,
        sync: bool,
    ) -> Result<(), RecordingError> {
        let failed = |source| RecordingError::Write { source, path: self.path.clone() };
        let as_io = |err: serde_json::Error| failed(err.into());
        let decision = serde_json::value::to_raw_value(decision).map_err(as_io)?;
        let line = Line { input: InputLine::from(input), decision, stored };
        let body = serde_json::value::to_raw_value(&line).map_err(as_io)?;
        let crc32 = checksum(body.get().as_bytes());
        let envelope = Envelope { seq: self.next_seq, crc32, body };
        let mut bytes = serde_json::to_vec(&envelope).map_err(as_io)?;
        bytes.push(b'\n');
        self.file.write_all(&bytes).map_err(failed)?;
        if sync {
            self.file.sync_data().map_err(failed)?;
        }
        self.next_seq += 1;
        Ok(())
    }

    /// Reads a journal. A last line without its end is left out and reported as cut.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Read`], or [`RecordingError::Damaged`] for the first damaged line.
    pub fn read(path: &Path) -> Result<JournalContents, RecordingError> {
        let (contents, damage) = Self::scan(path)?;
        match damage {
            None => Ok(contents),
            Some(damage) => Err(RecordingError::Damaged { damage, path: path.to_path_buf() }),
        }
    }

    /// Reads a journal up to the first damaged line.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Read`].
    pub fn read_until_damage(path: &Path) -> Result<JournalContents, RecordingError> {
        Self::scan(path).map(|(contents, _)| contents)
    }

    fn scan(path: &Path) -> Result<(JournalContents, Option<Damage>), RecordingError> {
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(err) if err.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(source) => return Err(RecordingError::Read { source, path: path.to_path_buf() }),
        };
        let cut = !bytes.is_empty() && !bytes.ends_with(b"\n");
        let mut contents = JournalContents { lines: Vec::new(), whole_bytes: 0, cut };
        for (index, line) in bytes.split_inclusive(|byte| *byte == b'\n').enumerate() {
            let Some(text) = line.strip_suffix(b"\n") else { break };
            match parse(text, index as u64) {
                Ok(parsed) => contents.lines.push(parsed),
                Err(reason) => return Ok((contents, Some(Damage { line: index + 1, reason }))),
            }
            contents.whole_bytes += line.len() as u64;
        }
        Ok((contents, None))
    }
}

fn parse(text: &[u8], seq: u64) -> Result<Line, String> {
    let envelope: Envelope = serde_json::from_slice(text).map_err(|err| err.to_string())?;
    if envelope.crc32 != checksum(envelope.body.get().as_bytes()) {
        return Err("its checksum does not match".into());
    }
    if envelope.seq != seq {
        return Err(format!("it is number {}, number {seq} was due", envelope.seq));
    }
    let body: &RawValue = &envelope.body;
    serde_json::from_str(body.get()).map_err(|err| err.to_string())
}

/// CRC-32, hexadecimal.
pub(super) fn checksum(bytes: &[u8]) -> String {
    format!("{:08x}", crc32fast::hash(bytes))
}
