//! The append-only log of a session.

use std::path::Path;

use super::{
    envelope::{Glance, enveloped, glance, glimpse},
    error::{Damage, RecordingError},
    format::{Line, Stored},
    journal_text::JournalText,
    lines::{LINE_LIMIT, Lines},
};
use boresight_files::{Appending, LineReader, Links};
use boresight_guide::session::{Decision, Input};

/// The open journal.
#[derive(Debug)]
pub struct Journal {
    file: Appending,
    text: JournalText,
    /// Length in bytes to cut the file to before the first line is appended.
    cut_to: Option<u64>,
}

/// Contents of a journal.
#[derive(Clone, Debug, Default)]
pub struct JournalContents {
    /// Whole lines of the journal, in order.
    pub lines: Lines,
    /// Stored pictures of the lines, in order.
    pub stored: Vec<Stored>,
    /// Number of times the session was resumed.
    pub resumed: usize,
    /// Bytes up to the end of the last whole line.
    pub whole_bytes: u64,
    /// True if the end was cut and is left out: part of a line, or lines not synced yet.
    pub cut: bool,
    /// CRC-32 of the `session.toml` behind the journal; `None` in older recordings and without a
    /// line.
    pub header_crc32: Option<String>,
}

impl Journal {
    /// Creates an empty journal at `path`, for a session with the given checksum of the header. An
    /// existing empty journal is reused.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`].
    pub(super) fn create(path: &Path, header_crc32: String) -> Result<Self, RecordingError> {
        let is_empty = path.symlink_metadata().is_ok_and(|there| there.len() == 0);
        let file = if is_empty { Appending::open(path)? } else { Appending::create(path)? };
        Ok(Self { file, text: JournalText::after(0, header_crc32), cut_to: None })
    }

    /// Opens `path` for appending after the known `contents`. A cut end is dropped with the first
    /// line; until then nothing is changed.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`].
    pub(super) fn append_to(
        path: &Path,
        contents: &JournalContents,
        header_crc32: String,
    ) -> Result<Self, RecordingError> {
        Ok(Self {
            file: Appending::open(path)?,
            text: JournalText::after(contents.lines.len() as u64, header_crc32),
            cut_to: contents.cut.then_some(contents.whole_bytes),
        })
    }

    /// Appends an input with its decision in a single write; `sync` makes it outlast a power cut.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`]; the line may then be cut; the next opening drops it.
    pub fn append(
        &mut self,
        input: &Input,
        decision: &Decision,
        stored: Option<Stored>,
        sync: bool,
    ) -> Result<(), RecordingError> {
        let line = self.text.line(input, decision, stored).map_err(|err| self.unwritten(err))?;
        self.append_text(&line)?;
        if sync { self.sync() } else { Ok(()) }
    }

    /// Appends a given line.
    ///
    /// # Errors
    ///
    /// As [`Self::append`].
    pub(super) fn append_line(&mut self, line: Line) -> Result<(), RecordingError> {
        let line = self.text.enclosed(line).map_err(|err| self.unwritten(err))?;
        self.append_text(&line)
    }

    fn append_text(&mut self, line: &[u8]) -> Result<(), RecordingError> {
        if let Some(whole_bytes) = self.cut_to.take() {
            self.file.cut(whole_bytes)?;
        }
        self.file.append(line)?;
        self.text.kept();
        Ok(())
    }

    /// Returns when every line outlasts a power cut.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`].
    pub(super) fn sync(&mut self) -> Result<(), RecordingError> {
        self.file.sync()?;
        self.text.synced();
        Ok(())
    }

    fn unwritten(&self, err: serde_json::Error) -> RecordingError {
        let path = self.file.path().to_path_buf();
        boresight_files::FileError::Write { source: err.into(), path }.into()
    }

    /// Reads a journal. A cut end is left out and reported.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`], or [`RecordingError::Damaged`] for the first damaged line.
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
    /// [`RecordingError::File`].
    pub fn read_until_damage(path: &Path) -> Result<JournalContents, RecordingError> {
        Self::scan(path).map(|(contents, _)| contents)
    }

    /// Passes through the journal once: checksums, numbers and pictures. The walks through
    /// [`Lines`] read the rest.
    fn scan(path: &Path) -> Result<(JournalContents, Option<Damage>), RecordingError> {
        let mut contents = JournalContents::default();
        let mut damage = None;
        let mut count = 0;
        let mut reader = LineReader::open(path, LINE_LIMIT, Links::Refused)?;
        let mut line = Vec::new();
        while reader.read(&mut line)? {
            let due = count as u64;
            let whole = line.strip_suffix(b"\n");
            match (&damage, whole) {
                (None, None) if (line.len() as u64) < LINE_LIMIT => contents.cut = true,
                (None, None) => {
                    let reason = "it is longer than any line".to_owned();
                    damage = Some(Damage { line: count + 1, reason });
                    contents.cut = false;
                    break;
                }
                (None, Some(text)) => match glance(text, due) {
                    Ok(Glance { stored, is_resumed, header_crc32, .. }) => {
                        count += 1;
                        contents.stored.extend(stored);
                        contents.resumed += usize::from(is_resumed);
                        contents.header_crc32 = contents.header_crc32.take().or(header_crc32);
                        contents.whole_bytes += line.len() as u64;
                    }
                    Err(reason) => {
                        damage = Some(Damage { line: count + 1, reason });
                        // No text has a zero: the file system never got these bytes. A hole may
                        // have taken the end of a line, and joined the next whole line to it.
                        contents.cut = text.contains(&0) && synced_after_hole(text) <= Some(due);
                    }
                },
                // The hole is a cut only if no later line states that this one was synced.
                (Some(_), Some(text)) => {
                    contents.cut &= synced_after_hole(text) <= Some(due);
                }
                (Some(_), None) => {}
            }
        }
        contents.lines = Lines::of(path, count);
        let damage = damage.filter(|_| !contents.cut);
        Ok((contents, damage))
    }
}

/// Number of synced lines stated by the whole line after the last zero, if any.
fn synced_after_hole(text: &[u8]) -> Option<u64> {
    let later = text.rsplit(|byte| *byte == 0).next()?;
    enveloped(later).and_then(glimpse).ok()?.synced
}
