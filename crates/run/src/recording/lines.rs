//! The lines of a journal, read on demand.

use std::path::{Path, PathBuf};

use super::{
    envelope::{self, Unread},
    error::{Damage, RecordingError},
    format::Line,
};
use boresight_files::{LineReader, Links};

/// Length limit of a line, in bytes: ten times the largest board's.
pub(super) const LINE_LIMIT: u64 = 16 << 20;

/// The whole lines of a journal, oldest first. Each walk reads from the file, so memory doesn't
/// grow with the session.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    path: PathBuf,
    count: usize,
}

impl Lines {
    /// The first `count` lines of the journal at `path`.
    pub(super) fn of(path: &Path, count: usize) -> Self {
        Self { path: path.to_path_buf(), count }
    }

    /// Number of lines.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True without lines.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Walks through the lines from the first.
    pub fn iter(&self) -> LinesWalk {
        LinesWalk { lines: self.clone(), next: 0, reader: None, text: Vec::new() }
    }
}

impl IntoIterator for &Lines {
    type Item = Result<Line, RecordingError>;
    type IntoIter = LinesWalk;

    fn into_iter(self) -> LinesWalk {
        self.iter()
    }
}

/// A walk through [`Lines`]. Ends after an error: [`RecordingError::File`],
/// [`RecordingError::Damaged`] or [`RecordingError::Newer`].
#[derive(Debug)]
pub struct LinesWalk {
    lines: Lines,
    /// Number of the next line, from 0.
    next: usize,
    reader: Option<LineReader>,
    text: Vec<u8>,
}

impl LinesWalk {
    fn read(&mut self) -> Result<Line, RecordingError> {
        let path = &self.lines.path;
        let reader = match &mut self.reader {
            Some(reader) => reader,
            none => none.insert(LineReader::open(path, LINE_LIMIT, Links::Refused)?),
        };
        let damaged = |reason: String| RecordingError::Damaged {
            damage: Damage { line: self.next + 1, reason },
            path: path.clone(),
        };
        if !reader.read(&mut self.text)? {
            return Err(damaged("it has gone".into()));
        }
        let line = envelope::parse(self.text.trim_ascii_end(), self.next as u64);
        line.map_err(|unread| match unread {
            Unread::Damaged(reason) => damaged(reason),
            Unread::Newer(reason) => {
                RecordingError::Newer { line: self.next + 1, reason, path: path.clone() }
            }
        })
    }
}

impl Iterator for LinesWalk {
    type Item = Result<Line, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next >= self.lines.count {
            return None;
        }
        let line = self.read();
        self.next = if line.is_ok() { self.next + 1 } else { self.lines.count };
        Some(line)
    }
}
