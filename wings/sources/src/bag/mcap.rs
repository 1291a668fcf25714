//! Messages in MCAP, <https://mcap.dev/spec>.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    io::{BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use mcap::{
    McapError,
    records::{Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use super::message::{MESSAGE_LIMIT, Message, Topic, most_unpacked};
use boresight_files::{Links, Unnamed, open};

/// Most bytes of a record, and of an unpacked chunk.
const RECORD_LIMIT: usize = MESSAGE_LIMIT as usize;
/// Most bytes read at once: a record may state more than the file has.
const AT_ONCE: usize = 1 << 20;
/// Most records of a file beyond one for each of its bytes.
const MOST_RECORDS: u64 = 1_000_000;

/// A file of MCAP.
pub(super) struct Mcap {
    path: PathBuf,
    records: Records,
    wanted: String,
    /// Channels of the wanted topic.
    channels: BTreeSet<u16>,
    /// Number of delivered messages.
    passed: u64,
    /// Number of messages to skip after a restart.
    skip: u64,
    /// True while reading a chunk cut by the file's end.
    reads_cut_chunk: bool,
    /// Keeps an unpacked file.
    _unpacked: Option<Unnamed>,
}

impl Mcap {
    pub(super) fn open(path: &Path, unpacked: Option<Unnamed>) -> Result<Self, String> {
        Ok(Self {
            path: path.into(),
            records: Records::open(path, true)?,
            wanted: String::new(),
            channels: BTreeSet::new(),
            passed: 0,
            skip: 0,
            reads_cut_chunk: false,
            _unpacked: unpacked,
        })
    }

    pub(super) fn choose(&mut self, topic: &str) {
        self.wanted = topic.into();
    }

    pub(super) fn topics(&self) -> Result<Vec<Topic>, String> {
        let listed = Records::listed(&self.path).and_then(|records| topics_of(records).ok());
        match listed.filter(|topics| !topics.is_empty()) {
            Some(topics) => Ok(topics),
            // A file without its end, or without a list there.
            None => topics_of(Records::open(&self.path, false)?),
        }
    }

    pub(super) fn next(&mut self) -> Result<Option<Message>, String> {
        loop {
            let record = match self.records.next() {
                // Messages of a chunk are read after checking its checksum. A chunk cut by the
                // file's end has none; its whole messages are good all the same.
                Err(McapError::UnexpectedEof) if !self.reads_cut_chunk => {
                    (self.reads_cut_chunk, self.skip) = (true, self.passed);
                    self.records = Records::open(&self.path, false)?;
                    continue;
                }
                record => record.map_err(|err| words(&err))?,
            };
            match record {
                None => return Ok(None),
                Some(Record::Channel(channel)) if channel.topic == self.wanted => {
                    self.channels.insert(channel.id);
                }
                Some(Record::Message { header, data })
                    if self.channels.contains(&header.channel_id) =>
                {
                    if self.skip > 0 {
                        self.skip -= 1;
                        continue;
                    }
                    self.passed += 1;
                    let (log_nanos, data) = (header.log_time, data.into_owned());
                    return Ok(Some(Message { log_nanos, data }));
                }
                // No message follows.
                Some(Record::DataEnd(_)) => return Ok(None),
                Some(_) => {}
            }
        }
    }
}

/// The topics of `records`; an error after the first one is their end.
fn topics_of(mut records: Records) -> Result<Vec<Topic>, String> {
    let (mut schemas, mut topics) = (BTreeMap::new(), BTreeMap::new());
    loop {
        match records.next() {
            Ok(Some(Record::Schema { header, .. })) => {
                schemas.insert(header.id, header.name);
            }
            Ok(Some(Record::Channel(channel))) => {
                let type_name = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                topics.entry(channel.topic.clone()).or_insert_with(|| {
                    Topic::new(channel.topic, type_name, &channel.message_encoding)
                });
            }
            Ok(Some(_)) => {}
            Err(err) if topics.is_empty() => return Err(words(&err)),
            Ok(None) | Err(_) => return Ok(topics.into_values().collect()),
        }
    }
}

/// The records of a file, including those of chunks.
pub(super) struct Records {
    file: Box<dyn Read + Send>,
    reader: LinearReader,
    /// Numbers of bytes read, of records, and of bytes in them.
    read: u64,
    count: u64,
    unpacked: u64,
}

impl Records {
    /// Records from the file's start; with `checks`, those of a chunk only after checking the
    /// checksum.
    pub(super) fn open(path: &Path, checks: bool) -> Result<Self, String> {
        let file = open(path, Links::Followed).map_err(|err| err.to_string())?;
        Ok(Self::of(file, LinearReaderOptions::default().with_prevalidate_chunk_crcs(checks)))
    }

    /// Records of the list at the file's end; `None` without one.
    fn listed(path: &Path) -> Option<Self> {
        let mut file = open(path, Links::Followed).ok()?;
        // Code and length of the last record, start of the list, and other 20 bytes.
        let mut end = [0; 37];
        file.seek(SeekFrom::End(-(end.len() as i64))).ok()?;
        file.read_exact(&mut end).ok()?;
        let start = u64::from_le_bytes(*end[9..].first_chunk()?);
        if end[0] != op::FOOTER || start == 0 {
            return None;
        }
        file.seek(SeekFrom::Start(start)).ok()?;
        Some(Self::of(file, LinearReaderOptions::default().with_skip_start_magic(true)))
    }

    fn of(file: File, options: LinearReaderOptions) -> Self {
        let file = Box::new(BufReader::with_capacity(1 << 18, file));
        let reader = LinearReader::new_with_options(options.with_record_length_limit(RECORD_LIMIT));
        Self { file, reader, read: 0, count: 0, unpacked: 0 }
    }

    /// The next record; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Record<'static>>, McapError> {
        loop {
            match self.reader.next_event() {
                None => return Ok(None),
                Some(Err(err)) => return Err(err),
                Some(Ok(LinearReadEvent::ReadRequest(count))) => {
                    let read = self.file.read(self.reader.insert(count.min(AT_ONCE)))?;
                    self.read += read as u64;
                    self.reader.notify_read(read);
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    self.count += 1;
                    self.unpacked += data.len() as u64;
                    let is_bomb = self.count > MOST_RECORDS + self.read
                        || self.unpacked > most_unpacked(self.read);
                    if is_bomb {
                        return Err(McapError::Io(std::io::Error::other(
                            "it unpacks to far more than a recording",
                        )));
                    }
                    if !has_contents(opcode) {
                        continue;
                    }
                    texts_fit(opcode, data).ok_or(McapError::UnexpectedEof)?;
                    return mcap::parse_record(opcode, data)
                        .map(|record| Some(record.into_owned()));
                }
            }
        }
    }
}

/// True for records that are more than lists of others.
fn has_contents(opcode: u8) -> bool {
    let (first, more) = (op::HEADER..=op::MESSAGE, [op::ATTACHMENT, op::METADATA, op::DATA_END]);
    first.contains(&opcode) && opcode != op::FOOTER || more.contains(&opcode)
}

/// `None` if a text of a record is longer than the record: the library makes room for the stated
/// length before it reads, up to 4 GB, and a system may end the program for that.
fn texts_fit(opcode: u8, data: &[u8]) -> Option<()> {
    let (before, texts, has_map) = match opcode {
        op::HEADER => (0, 2, false),
        op::SCHEMA => (2, 2, false),
        op::CHANNEL => (4, 2, true),
        op::ATTACHMENT => (16, 2, false),
        op::METADATA => (0, 1, true),
        _ => return Some(()),
    };
    let mut rest = data.get(before..)?;
    for _ in 0..texts {
        (_, rest) = text(rest)?;
    }
    let mut map = if has_map { text(rest)?.0 } else { &[] };
    while !map.is_empty() {
        (_, map) = text(map)?;
    }
    Some(())
}

/// The bytes behind their length, and the rest.
fn text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

/// Description of the error for a person.
pub(super) fn words(err: &McapError) -> String {
    match err {
        McapError::UnexpectedEof => "the file is cut off".into(),
        McapError::BadMagic => "it's neither MCAP nor a database of ROS 2".into(),
        McapError::BadChunkCrc { .. } => "a checksum is wrong".into(),
        McapError::Io(err) => err.to_string(),
        McapError::UnsupportedCompression(how) => format!("its compression is {how:?}"),
        _ => "its bytes make no sense".into(),
    }
}
