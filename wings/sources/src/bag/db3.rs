//! Messages in the databases of ROS 2 (`.db3`), read by SQLite.

use std::path::Path;

use rusqlite::{Connection, OpenFlags, OptionalExtension, limits::Limit};

use super::message::{MESSAGE_LIMIT, Message, Topic};

const DAMAGED: &str = "the file is cut off or damaged";

/// A database.
pub(super) struct Db3 {
    db: Connection,
    topic: i64,
    /// Row of the newest message.
    last: i64,
}

impl Db3 {
    pub(super) fn open(path: &Path) -> Result<Self, String> {
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let usual = Connection::open_with_flags(path, flags).and_then(usable);
        // With another program's unfinished write beside the file, and no permission to write: read
        // the file only.
        let db = usual.or_else(|_| {
            let flags = flags | OpenFlags::SQLITE_OPEN_URI;
            Connection::open_with_flags(unchanging(path), flags).and_then(usable)
        });
        let db = db.map_err(|err| words(&err))?;
        Ok(Self { db, topic: 0, last: i64::MIN })
    }

    pub(super) fn topics(&self) -> Result<Vec<Topic>, String> {
        let rows = || -> rusqlite::Result<Vec<Topic>> {
            let mut rows =
                self.db.prepare("SELECT name, type, serialization_format FROM topics")?;
            let topic = |row: &rusqlite::Row<'_>| {
                Ok(Topic::new(row.get(0)?, row.get(1)?, &row.get::<_, String>(2)?))
            };
            rows.query_map([], topic)?.collect()
        };
        rows().map_err(|err| words(&err))
    }

    pub(super) fn choose(&mut self, topic: &str) -> Result<(), String> {
        let id =
            self.db.query_row("SELECT id FROM topics WHERE name = ?1", [topic], |row| row.get(0));
        // A file of a longer bag may lack the topic; then it has no messages of it.
        self.topic = id.optional().map_err(|err| words(&err))?.unwrap_or(-1);
        Ok(())
    }

    pub(super) fn next(&mut self) -> Result<Option<Message>, String> {
        // By row, the order of recording: an index may be missing at a broken end.
        const NEXT: &str = "SELECT id, timestamp, data FROM messages NOT INDEXED \
                            WHERE id > ?1 AND topic_id = ?2 ORDER BY id LIMIT 1";
        let message = self.db.query_row(NEXT, (self.last, self.topic), |row| {
            let log_nanos = u64::try_from(row.get::<_, i64>(1)?).unwrap_or(0);
            Ok((row.get(0)?, Message { log_nanos, data: row.get(2)? }))
        });
        let Some((id, message)) = message.optional().map_err(|err| words(&err))? else {
            return Ok(None);
        };
        // In a damaged file, rows may come again and again.
        if id <= self.last {
            return Err(DAMAGED.into());
        }
        self.last = id;
        Ok(Some(message))
    }
}

/// Lets SQLite read a file without its end, and checks if the file is readable.
fn usable(db: Connection) -> rusqlite::Result<Connection> {
    db.pragma_update(None, "writable_schema", true)?;
    db.set_limit(Limit::SQLITE_LIMIT_LENGTH, MESSAGE_LIMIT as i32)?;
    // A view computes its rows, of any number and size.
    const VIEWS: &str =
        "SELECT count(*) FROM sqlite_schema WHERE type = 'view' AND name IN ('topics', 'messages')";
    let views: i64 = db.query_row(VIEWS, [], |row| row.get(0))?;
    if views > 0 { Err(rusqlite::Error::InvalidQuery) } else { Ok(db) }
}

/// Address of an immutable file.
fn unchanging(path: &Path) -> String {
    let mut address = String::from("file:");
    for character in path.to_string_lossy().chars() {
        match character {
            '%' | '?' | '#' => address += &format!("%{:02X}", u32::from(character)),
            other => address.push(other),
        }
    }
    address + "?immutable=1"
}

/// Description of the error for a person.
pub(super) fn words(err: &rusqlite::Error) -> String {
    match err.sqlite_error_code() {
        Some(rusqlite::ErrorCode::DatabaseCorrupt) => DAMAGED.into(),
        Some(rusqlite::ErrorCode::NotADatabase) => "it isn't a database".into(),
        Some(rusqlite::ErrorCode::TooBig) => "a message is larger than any picture".into(),
        _ if *err == rusqlite::Error::InvalidQuery => {
            "its messages are computed, not stored".into()
        }
        _ => err.to_string(),
    }
}
