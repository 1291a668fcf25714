//! A copy of a bag with the calibration in it: a `sensor_msgs/msg/CameraInfo` for every picture, with its stamp, as a
//! calibrated camera's driver would have sent it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    io::BufWriter,
    path::Path,
};

use mcap::{
    Attachment, McapError, WriteOptions, Writer,
    records::{MessageHeader, Record},
};

use super::{
    BagFlaw, bag_files,
    files::{Storage, is_packed, plain_message},
    mcap::{Records, words},
    source::chosen,
};
use crate::{CaptureError, RosHeader};
use boresight_files::FileError;

const TYPE: &str = "sensor_msgs/msg/CameraInfo";
/// The definition of the type, as bags keep it.
const DEFINITION: &str = include_str!("camera_info.msg");

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopiedBag {
    /// The topic of the calibration.
    pub topic: String,
    /// Messages on it.
    pub messages: u64,
    /// Why the rest of the bag isn't in the copy; `None` if all of it is.
    pub left_out: Option<String>,
}

/// Why there's no copy.
#[derive(Debug, thiserror::Error)]
pub enum NotCopied {
    /// The bag can't be read.
    #[error(transparent)]
    Bag(CaptureError),
    /// The copy can't be written.
    #[error(transparent)]
    Write(FileError),
}

/// Writes a copy of the bag's file `from` to the new file `to`, with the message that `info` makes for the header of each
/// picture on `topic`, or on the only topic with pictures. Messages that stand on the calibration's topic already are
/// left out.
///
/// # Errors
///
/// [`NotCopied`] if the bag can't be read, or if the copy can't be written or exists already.
pub fn copy_with(
    from: &Path,
    to: &Path,
    topic: Option<&str>,
    info: &mut dyn FnMut(RosHeader<'_>) -> Vec<u8>,
) -> Result<CopiedBag, NotCopied> {
    let failed = |flaw| NotCopied::Bag(CaptureError::Bag { flaw, path: from.into() });
    let unreadable = |how| failed(BagFlaw::Unreadable(how));
    let unread = |source| NotCopied::Bag(CaptureError::Read { source, path: from.into() });
    let unwritten = |source: std::io::Error| {
        let path = to.into();
        NotCopied::Write(match source.kind() {
            std::io::ErrorKind::AlreadyExists => FileError::Exists { path },
            _ => FileError::Write { source, path },
        })
    };
    let files = bag_files(from).map_err(unread)?;
    let [file] = files.as_slice() else {
        return Err(unreadable(format!("it has {} files: name one of them", files.len())));
    };
    let packed = is_packed(file).map_err(|err| unreadable(err.to_string()))?;
    if packed {
        return Err(unreadable("it's packed as a whole: unpack it with zstd -d".into()));
    }
    let (images, _) = chosen(&files, topic).map_err(failed)?;
    let own = topic_beside(&images);
    let folder = to.parent().filter(|folder| !folder.as_os_str().is_empty());
    let place = tempfile::tempdir_in(folder.unwrap_or(Path::new("."))).map_err(unwritten)?;
    let draft = place.path().join("bag");
    let mut copy = Copy { images: &images, own: &own, info, messages: 0 };
    let left_out = match Storage::open(file).map_err(unreadable)? {
        Storage::Mcap(_) => copy.mcap(file, &draft).map_err(|err| unreadable(words(&err)))?,
        Storage::Db3(_) => {
            copy.db3(file, &draft).map_err(|err| unreadable(super::db3::words(&err)))?;
            None
        }
    };
    let messages = copy.messages;
    // Never over another file: the name is taken first.
    File::create_new(to).and_then(|_| std::fs::rename(&draft, to)).map_err(unwritten)?;
    Ok(CopiedBag { topic: own, messages, left_out })
}

/// The topic of the calibration beside that of the pictures, as ROS wants it.
fn topic_beside(images: &str) -> String {
    let images = images.strip_suffix("/compressed").unwrap_or(images);
    format!("{}/camera_info", images.rsplit_once('/').map_or("", |(space, _)| space))
}

struct Copy<'a> {
    /// The topic of the pictures.
    images: &'a str,
    /// The topic of the calibration.
    own: &'a str,
    info: &'a mut dyn FnMut(RosHeader<'_>) -> Vec<u8>,
    messages: u64,
}

impl Copy<'_> {
    /// The message for the picture in the message `data`; `None` if that has no header.
    fn info_of(&mut self, data: &[u8]) -> Option<Vec<u8>> {
        let header = RosHeader::of(data)?;
        self.messages += 1;
        Some((self.info)(header))
    }

    fn mcap(&mut self, from: &Path, to: &Path) -> Result<Option<String>, McapError> {
        let no = |how: String| McapError::Io(std::io::Error::other(how));
        let mut records = Records::open(from, true).map_err(no)?;
        let mut options = WriteOptions::new();
        let first = match records.next()? {
            Some(Record::Header(header)) => {
                options = options.profile(header.profile).library(header.library);
                None
            }
            other => other,
        };
        let mut writer = Writer::with_options(BufWriter::new(File::create_new(to)?), options)?;
        let (mut pictures, mut replaced) = (BTreeSet::new(), BTreeSet::new());
        let mut own = None;
        let mut record = if first.is_some() { Ok(first) } else { records.next() };
        let left_out = loop {
            match record {
                Ok(Some(record)) => match record {
                    Record::Schema { header, data } => {
                        writer.add_schema_with_id(
                            header.id,
                            &header.name,
                            &header.encoding,
                            &data,
                        )?;
                    }
                    Record::Channel(channel) if channel.topic == self.own => {
                        replaced.insert(channel.id);
                    }
                    Record::Channel(channel) => {
                        if channel.topic == self.images {
                            pictures.insert(channel.id);
                        }
                        writer.add_channel_with_id(
                            channel.id,
                            channel.schema_id,
                            &channel.topic,
                            &channel.message_encoding,
                            &channel.metadata,
                        )?;
                    }
                    Record::Message { header, data } if !replaced.contains(&header.channel_id) => {
                        writer.write_to_known_channel(&header, &data)?;
                        if pictures.contains(&header.channel_id)
                            && let Some(info) = self.info_of(&data)
                        {
                            let channel_id = match own {
                                Some(id) => id,
                                None => {
                                    // The last numbers: those that follow may take any other.
                                    let (id, none) = (u16::MAX, BTreeMap::new());
                                    writer.add_schema_with_id(
                                        id,
                                        TYPE,
                                        "ros2msg",
                                        DEFINITION.as_bytes(),
                                    )?;
                                    writer.add_channel_with_id(id, id, self.own, "cdr", &none)?;
                                    *own.insert(id)
                                }
                            };
                            writer.write_to_known_channel(
                                &MessageHeader { channel_id, ..header },
                                &info,
                            )?;
                        }
                    }
                    Record::Attachment { header, data, .. } => writer.attach(&Attachment {
                        log_time: header.log_time,
                        create_time: header.create_time,
                        name: header.name,
                        media_type: header.media_type,
                        data,
                    })?,
                    Record::Metadata(metadata) => writer.write_metadata(&metadata)?,
                    Record::DataEnd(_) => break None,
                    _ => {}
                },
                Ok(None) => break None,
                Err(err) => break Some(words(&err)),
            }
            record = records.next();
        };
        writer.finish()?;
        Ok(left_out)
    }

    fn db3(&mut self, from: &Path, to: &Path) -> rusqlite::Result<()> {
        let from = rusqlite::Connection::open_with_flags(
            from,
            rusqlite::OpenFlags::SQLITE_OPEN_READ_ONLY | rusqlite::OpenFlags::SQLITE_OPEN_NO_MUTEX,
        )?;
        from.execute("VACUUM INTO ?1", [to.to_string_lossy()])?;
        drop(from);
        let mut db = rusqlite::Connection::open(to)?;
        let all = db.transaction()?;
        all.execute(
            "DELETE FROM messages WHERE topic_id IN (SELECT id FROM topics WHERE name = ?1)",
            [self.own],
        )?;
        all.execute("DELETE FROM topics WHERE name = ?1", [self.own])?;
        let mut columns = Vec::new();
        all.pragma(None, "table_info", "topics", |row| {
            columns.push(row.get::<_, String>(1)?);
            Ok(())
        })?;
        // Newer versions of ROS 2 have a hash of the definition, which may be empty.
        let known = [
            "name",
            "type",
            "serialization_format",
            "offered_qos_profiles",
            "type_description_hash",
        ];
        let known: Vec<&str> = known
            .into_iter()
            .filter(|known| columns.iter().any(|column| column == known))
            .collect();
        let values = [self.own, TYPE, "cdr", "", ""];
        let marks = vec!["?"; known.len()].join(", ");
        all.execute(
            &format!("INSERT INTO topics ({}) VALUES ({marks})", known.join(", ")),
            rusqlite::params_from_iter(&values[..known.len()]),
        )?;
        let own = all.last_insert_rowid();
        let has_definitions = all.query_row(
            "SELECT count(*) FROM sqlite_schema WHERE name = 'message_definitions'",
            [],
            |row| row.get::<_, i64>(0),
        )? > 0;
        if has_definitions {
            all.execute(
                "INSERT INTO message_definitions (topic_type, encoding, encoded_message_definition, type_description_hash) \
                 SELECT ?1, 'ros2msg', ?2, '' WHERE NOT EXISTS (SELECT 1 FROM message_definitions WHERE topic_type = ?1)",
                [TYPE, DEFINITION],
            )?;
        }
        let last: i64 =
            all.query_row("SELECT coalesce(max(id), 0) FROM messages", [], |row| row.get(0))?;
        {
            let mut pictures = all.prepare(
                "SELECT timestamp, data FROM messages WHERE id <= ?1 AND topic_id IN \
                 (SELECT id FROM topics WHERE name = ?2) ORDER BY id",
            )?;
            let mut insert = all
                .prepare("INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)")?;
            let mut rows = pictures.query((last, self.images))?;
            while let Some(row) = rows.next()? {
                let (timestamp, data): (i64, Vec<u8>) = (row.get(0)?, row.get(1)?);
                let plain = plain_message(data.clone());
                let Some(info) = self.info_of(&plain) else { continue };
                // In a bag of packed messages, every one is.
                let info = if plain == data { info } else { packed(info) };
                insert.execute((own, timestamp, info))?;
            }
        }
        all.commit()
    }
}

fn packed(message: Vec<u8>) -> Vec<u8> {
    // It's packed in memory, where nothing fails.
    zstd::encode_all(&*message, 0).unwrap_or(message)
}
