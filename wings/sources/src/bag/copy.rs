//! Copy of a bag with the calibration in it: a `sensor_msgs/msg/CameraInfo` for every picture, with
//! its stamp, as if sent by a calibrated camera's driver.

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
    files::{Storage, is_packed, plain_message},
    mcap::{Records, words},
    source::chosen,
};
use crate::RosHeader;
use boresight_capture::{BagFlaw, CaptureError, bag_files};
use boresight_files::FileError;
use boresight_geometry::panic_message::caught;

const TYPE: &str = "sensor_msgs/msg/CameraInfo";
/// Definition of the type, as kept in bags.
const DEFINITION: &str = include_str!("camera_info.msg");

/// Result of copying.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopiedBag {
    /// Topic of the calibration.
    pub topic: String,
    /// Number of messages on the topic.
    pub messages: u64,
    /// Reason for leaving out the rest of the bag; `None` if all was copied.
    pub left_out: Option<String>,
}

/// Reason for a missing copy.
#[derive(Debug, thiserror::Error)]
pub enum NotCopied {
    /// The bag can't be read.
    #[error(transparent)]
    Bag(CaptureError),
    /// The copy can't be written.
    #[error(transparent)]
    Write(FileError),
}

/// Copies the bag's file `from` to the new file `to`, with a message from `info` for the header of
/// each picture on `topic`, or on the only topic with pictures. Existing messages on the
/// calibration's topic are left out.
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
    caught(|| copy(from, to, topic, info)).unwrap_or_else(|reason| {
        let name = from.display().to_string();
        Err(NotCopied::Bag(CaptureError::GaveUp { reason, name }))
    })
}

fn copy(
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
    let (images, kind) = chosen(&files, topic).map_err(failed)?;
    if !kind.is_of_ros() {
        return Err(unreadable("its pictures are none of ROS 2, so need no CameraInfo".into()));
    }
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
    // Never overwrite another file: the name is taken first.
    File::create_new(to).and_then(|_| std::fs::rename(&draft, to)).map_err(unwritten)?;
    Ok(CopiedBag { topic: own, messages, left_out })
}

/// Topic of the calibration beside the pictures' topic, by ROS's convention.
fn topic_beside(images: &str) -> String {
    let images = images.strip_suffix("/compressed").unwrap_or(images);
    format!("{}/camera_info", images.rsplit_once('/').map_or("", |(space, _)| space))
}

struct Copy<'a> {
    /// Topic of the pictures.
    images: &'a str,
    /// Topic of the calibration.
    own: &'a str,
    info: &'a mut dyn FnMut(RosHeader<'_>) -> Vec<u8>,
    messages: u64,
}

impl Copy<'_> {
    /// Message for the picture in the message `data`; `None` if `data` has no header.
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
                                    // The last numbers: those to come may take any other.
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
                // In a bag of packed messages, all are packed.
                let info = if plain == data { info } else { packed(info) };
                insert.execute((own, timestamp, info))?;
            }
        }
        all.commit()
    }
}

fn packed(message: Vec<u8>) -> Vec<u8> {
    // Packed in memory, where nothing fails.
    zstd::encode_all(&*message, 0).unwrap_or(message)
}
