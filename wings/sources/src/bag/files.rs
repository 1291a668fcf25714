//! The files of a bag.

use std::{
    io::{BufReader, Read, Write},
    path::Path,
};

use super::{
    db3::Db3,
    mcap::Mcap,
    message::{MESSAGE_LIMIT, Message, Topic, most_unpacked},
};
use boresight_files::{FileError, Links, Unnamed, open};

const ZSTD: &[u8] = &[0x28, 0xB5, 0x2F, 0xFD];
const SQLITE: &[u8] = b"SQLite format 3\0";

/// A file of a bag.
pub(super) enum Storage {
    Mcap(Box<Mcap>),
    Db3(Db3),
}

impl Storage {
    /// Opens the file at `path` by its contents.
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let words = |err: FileError| match std::error::Error::source(&err) {
            Some(cause) => format!("{err}: {cause}"),
            None => err.to_string(),
        };
        let (mut plain, mut unpacked) = (path.to_path_buf(), None);
        let mut start = start_of(path).map_err(words)?;
        if start.starts_with(ZSTD) {
            let file = unpack(path).map_err(words)?;
            plain = file.path();
            start = start_of(&plain).map_err(words)?;
            unpacked = Some(file);
        }
        if start == SQLITE {
            if let Some(whole) = whole_pages(&plain).map_err(words)? {
                unpacked = Some(whole);
            }
            return match unpacked {
                Some(file) => file.opened(Db3::open).map_err(words)?,
                None => Db3::open(&plain),
            }
            .map(Self::Db3);
        }
        Mcap::open(&plain, unpacked).map(|mcap| Self::Mcap(Box::new(mcap)))
    }

    /// Lists all topics. `Err` if none can be found.
    pub(super) fn topics(&self) -> Result<Vec<Topic>, String> {
        match self {
            Self::Mcap(mcap) => mcap.topics(),
            Self::Db3(db) => db.topics(),
        }
    }

    /// Chooses the topic to read.
    pub(super) fn choose(&mut self, topic: &str) -> Result<(), String> {
        match self {
            Self::Mcap(mcap) => mcap.choose(topic),
            Self::Db3(db) => return db.choose(topic),
        }
        Ok(())
    }

    /// The next message of the topic in the order of recording; `Ok(None)` at the end of a whole
    /// file.
    pub(super) fn next(&mut self) -> Result<Option<Message>, String> {
        match self {
            Self::Mcap(mcap) => mcap.next(),
            Self::Db3(db) => db.next(),
        }
    }
}

/// Unpacks a message of a database with compressed messages; others are unchanged.
pub(super) fn plain_message(data: Vec<u8>) -> Vec<u8> {
    if !data.starts_with(ZSTD) {
        return data;
    }
    // The reader of messages reports a failed unpacking as no message.
    let mut plain = Vec::new();
    let unpacked = zstd::Decoder::new(&*data)
        .and_then(|decoder| decoder.take(MESSAGE_LIMIT).read_to_end(&mut plain));
    if unpacked.is_ok() { plain } else { Vec::new() }
}

/// True if the file at `path` is packed as a whole.
pub(super) fn is_packed(path: &Path) -> Result<bool, FileError> {
    Ok(start_of(path)?.starts_with(ZSTD))
}

/// The first bytes of the file at `path`.
fn start_of(path: &Path) -> Result<Vec<u8>, FileError> {
    let mut start = Vec::new();
    let read = open(path, Links::Followed)?.take(SQLITE.len() as u64).read_to_end(&mut start);
    read.map_err(FileError::reading(path))?;
    Ok(start)
}

/// A copy of the database at `path` without a page cut by the end, if any: SQLite would take zeros
/// for the rest of the page, and so of a picture.
fn whole_pages(path: &Path) -> Result<Option<Unnamed>, FileError> {
    let reading = FileError::reading(path);
    let mut database = open(path, Links::Followed)?;
    let bytes = database.metadata().map_err(&reading)?.len();
    let mut header = [0; 18];
    if database.read_exact(&mut header).is_err() {
        return Ok(None);
    }
    // 1 stands for 65536, and nothing below 512 is allowed.
    let page_bytes = match u16::from_be_bytes([header[16], header[17]]) {
        1 => 1 << 16,
        bytes => u64::from(bytes).max(512),
    };
    if bytes % page_bytes == 0 {
        return Ok(None);
    }
    let mut whole = Unnamed::new()?;
    let copied = std::io::copy(
        &mut header.as_slice().chain(database).take(bytes / page_bytes * page_bytes),
        whole.file(),
    );
    copied.map_err(FileError::writing(&tempfile::env::temp_dir()))?;
    Ok(Some(whole))
}

/// Unpacks the file at `path` into the system's temporary files, as far as whole.
fn unpack(path: &Path) -> Result<Unnamed, FileError> {
    let reading = FileError::reading(path);
    let packed = open(path, Links::Followed)?;
    let limit_bytes = most_unpacked(packed.metadata().map_err(&reading)?.len());
    let mut decoder =
        zstd::Decoder::with_buffer(BufReader::new(packed)).map_err(&reading)?.take(limit_bytes + 1);
    let mut plain = Unnamed::new()?;
    let (mut piece, mut all) = (vec![0; 1 << 17], 0);
    loop {
        let count = match decoder.read(&mut piece) {
            // A broken tail: the loss shows in the file itself.
            Err(err) if err.kind() == std::io::ErrorKind::UnexpectedEof => 0,
            read => read.map_err(&reading)?,
        };
        if count == 0 {
            return Ok(plain);
        }
        all += count as u64;
        if all > limit_bytes {
            return Err(FileError::TooLarge { limit_bytes, path: path.into() });
        }
        // A full disk isn't the bag's fault.
        let place = tempfile::env::temp_dir();
        plain.file().write_all(&piece[..count]).map_err(FileError::writing(&place))?;
    }
}
