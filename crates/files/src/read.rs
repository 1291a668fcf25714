//! Reads files of bounded size.

use std::{
    fs::File,
    io::{BufRead, BufReader, Read},
    path::{Path, PathBuf},
};

use super::{
    FileError,
    patient::Patient,
    plain::{file_or_nothing, options, other_than_file},
};

/// Size limit of a text read whole: settings, scenes, corner tables, calibrations.
pub const TEXT_LIMIT: u64 = 256 << 20;

/// Treatment of a symbolic link at the path itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    /// Follow links: a person named the file.
    Followed,
    /// Refuse links: the file is a session's.
    Refused,
}

/// Opens a file to read. Never waits: a FIFO or a device is refused.
///
/// # Errors
///
/// [`FileError::Read`] or [`FileError::NotAFile`].
pub fn open(path: &Path, links: Links) -> Result<File, FileError> {
    let reading = FileError::reading(path);
    // Look at the entry first: opening a device can have effects.
    if links == Links::Refused {
        file_or_nothing(path)?;
    } else {
        let kind = path.metadata().map_err(&reading)?.file_type();
        if let Some(what) = other_than_file(kind) {
            return Err(FileError::NotAFile { what, path: path.to_path_buf() });
        }
    }
    let file = options(links == Links::Refused).read(true).open(path).map_err(&reading)?;
    // Check the open file, not the entry, which may have been replaced meanwhile.
    match other_than_file(file.metadata().map_err(&reading)?.file_type()) {
        None => Ok(file),
        Some(what) => Err(FileError::NotAFile { what, path: path.to_path_buf() }),
    }
}

/// Reads a file of at most `limit_bytes`.
///
/// # Errors
///
/// As [`open`], and [`FileError::TooLarge`].
pub fn read(path: &Path, limit_bytes: u64, links: Links) -> Result<Vec<u8>, FileError> {
    let reading = FileError::reading(path);
    let file = open(path, links)?;
    let too_large = || FileError::TooLarge { limit_bytes, path: path.to_path_buf() };
    let size = file.metadata().map_err(&reading)?.len();
    if size > limit_bytes {
        return Err(too_large());
    }
    let mut bytes = Vec::with_capacity(size as usize);
    // The file may grow while being read.
    Patient::new(file)
        .take(limit_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(&reading)?;
    if bytes.len() as u64 > limit_bytes { Err(too_large()) } else { Ok(bytes) }
}

/// Reads a text of at most `limit_bytes`; a byte-order mark is left out.
///
/// # Errors
///
/// As [`read`], and [`FileError::NotText`].
pub fn read_text(path: &Path, limit_bytes: u64, links: Links) -> Result<String, FileError> {
    let mut bytes = read(path, limit_bytes, links)?;
    if bytes.starts_with(b"\xef\xbb\xbf") {
        bytes.drain(..3);
    }
    String::from_utf8(bytes).map_err(|_| FileError::NotText { path: path.to_path_buf() })
}

/// The lines of a file, in order, in a common buffer.
#[derive(Debug)]
pub struct LineReader {
    reader: BufReader<Patient<File>>,
    limit_bytes: u64,
    path: PathBuf,
}

impl LineReader {
    /// Opens the file at `path`. A line longer than `limit_bytes` comes in pieces without a line
    /// break.
    ///
    /// # Errors
    ///
    /// As [`open`].
    pub fn open(path: &Path, limit_bytes: u64, links: Links) -> Result<Self, FileError> {
        let reader = BufReader::with_capacity(1 << 16, Patient::new(open(path, links)?));
        Ok(Self { reader, limit_bytes, path: path.to_path_buf() })
    }

    /// Reads the next line into `line`, including the line break; false at the end of the file.
    ///
    /// # Errors
    ///
    /// [`FileError::Read`].
    pub fn read(&mut self, line: &mut Vec<u8>) -> Result<bool, FileError> {
        line.clear();
        let got = (&mut self.reader).take(self.limit_bytes).read_until(b'\n', line);
        Ok(got.map_err(FileError::reading(&self.path))? > 0)
    }
}
