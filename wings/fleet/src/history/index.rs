//! Entries as lines of JSON, each a row as printed by `batch gather`.

use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
};

use super::entry::{Counted, Entry};
use crate::batch::{ROW_SCHEMA, Row};
use boresight_files::{
    FileError, FileLock, Links, Overwrite, TEXT_LIMIT, read_text, save_streamed,
};

/// Error of the index.
#[derive(Debug, thiserror::Error)]
pub enum IndexError {
    /// A file can't be read or written.
    #[error("could not use the index")]
    File(#[from] FileError),
    /// A row can't be written.
    #[error("could not write the index")]
    Row(#[from] serde_json::Error),
    /// A line of another program, or a damaged line.
    #[error("line {line} isn't a line of an index ({reason}): {path:?}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// Mistake in the line.
        reason: String,
        /// Path of the file.
        path: PathBuf,
    },
}

/// Every calibration of every camera. Derived from session folders: nothing is lost with it.
#[derive(Debug, Default)]
pub struct Index {
    /// Rows by session, each with the line.
    rows: BTreeMap<String, (Entry, String)>,
}

impl Index {
    /// Reads the index at `path`; an empty one if missing.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn open(path: &Path) -> Result<Self, IndexError> {
        let mut index = Self::default();
        let text = match read_text(path, TEXT_LIMIT, Links::Followed) {
            Err(err) if err.is_missing() => return Ok(index),
            text => text?,
        };
        for (number, line) in (1..).zip(text.lines()) {
            let wrong =
                |reason: String| IndexError::Line { line: number, reason, path: path.into() };
            let row: Counted = serde_json::from_str(line).map_err(|err| wrong(err.to_string()))?;
            if row.schema != ROW_SCHEMA {
                return Err(wrong(format!("its schema is {:?}, not {ROW_SCHEMA:?}", row.schema)));
            }
            index.put(Entry::of(row), || Ok(line.to_owned()))?;
        }
        Ok(index)
    }

    /// Replaces the rows below `roots` in the index at `path` by `rows`, and keeps additions of
    /// other programs at the same time. Sessions below the roots without a row, deleted or damaged,
    /// leave the index. Returns their number.
    ///
    /// # Errors
    ///
    /// [`IndexError`]; the index is then unchanged.
    pub fn add_to(path: &Path, rows: &[Row], roots: &[PathBuf]) -> Result<usize, IndexError> {
        let _lock = FileLock::wait_for(path)?;
        let mut index = Self::open(path)?;
        let before = index.rows.len();
        let is_kept = |session: &str| {
            rows.iter().any(|row| row.session == session)
                || !roots.iter().any(|root| Path::new(session).starts_with(root))
        };
        index.rows.retain(|session, _| is_kept(session));
        let gone = before - index.rows.len();
        index.add(rows)?;
        index.save(path, Overwrite::Allowed)?;
        Ok(gone)
    }

    /// Adds rows, replacing those of equal sessions.
    ///
    /// # Errors
    ///
    /// Never for rows: all of their fields have a form in JSON.
    pub fn add(&mut self, rows: &[Row]) -> Result<(), IndexError> {
        rows.iter()
            .try_for_each(|row| self.put(Entry::of(row.into()), || Ok(serde_json::to_string(row)?)))
    }

    /// Adds an entry for a row. Failed work, and work without a calibration, has none.
    fn put(
        &mut self,
        entry: Option<Entry>,
        line: impl FnOnce() -> Result<String, IndexError>,
    ) -> Result<(), IndexError> {
        if let Some(entry) = entry {
            self.rows.insert(entry.session.clone(), (entry, line()?));
        }
        Ok(())
    }

    /// Writes the index to `path`, in the order of [`Self::all`]: the same calibrations give the
    /// same bytes.
    ///
    /// # Errors
    ///
    /// [`IndexError::File`]; the file is then unchanged.
    pub fn save(&self, path: &Path, overwrite: Overwrite) -> Result<(), IndexError> {
        let mut rows: Vec<&(Entry, String)> = self.rows.values().collect();
        rows.sort_by(|(a, _), (b, _)| a.order().cmp(&b.order()));
        save_streamed(path, overwrite, |out| {
            let mut write = |(_, line): &(Entry, String)| writeln!(out, "{line}");
            rows.into_iter().try_for_each(&mut write).map_err(FileError::writing(path))
        })?;
        Ok(())
    }

    /// Every entry, by camera, size of the picture, time and session.
    pub fn all(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = self.rows.values().map(|(entry, _)| entry.clone()).collect();
        entries.sort_by(|a, b| a.order().cmp(&b.order()));
        entries
    }

    /// Entries of the named camera, in the same order.
    pub fn of_camera(&self, camera: &str) -> Vec<Entry> {
        self.all().into_iter().filter(|entry| entry.camera == camera).collect()
    }

    /// Names of the cameras with `part` in the name, sorted.
    pub fn cameras_with(&self, part: &str) -> Vec<String> {
        let mut names: Vec<String> = self.all().into_iter().map(|entry| entry.camera).collect();
        names.dedup();
        names.retain(|name| name.contains(part));
        names
    }

    /// True if the index has a session in or below `root`.
    pub fn has_below(&self, root: &Path) -> bool {
        self.rows.keys().any(|session| Path::new(session).starts_with(root))
    }

    /// Cameras with a newest usable calibration before `limit`, or without any, with time; the
    /// oldest first. Calibrations dated after `now` have a wrong clock and don't count.
    pub fn due(&self, limit: &str, now: &str) -> Vec<(String, Option<String>)> {
        let mut newest: BTreeMap<&str, Option<&str>> = BTreeMap::new();
        for (entry, _) in self.rows.values() {
            let own = newest.entry(&entry.camera).or_default();
            if entry.is_usable() && entry.created.as_str() <= now {
                *own = (*own).max(Some(&entry.created));
            }
        }
        let mut due: Vec<_> = newest
            .into_iter()
            .filter(|(_, newest)| newest.is_none_or(|newest| newest < limit))
            .map(|(camera, newest)| (camera.to_owned(), newest.map(str::to_owned)))
            .collect();
        due.sort_by(|a, b| (&a.1, &a.0).cmp(&(&b.1, &b.0)));
        due
    }
}
