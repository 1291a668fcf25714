//! The entries in SQLite.

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use rusqlite::{Connection, Row, params};

use super::entry::Entry;
use boresight_calibrate::StatedLens;

/// Version of the tables.
const VERSION: i64 = 1;
const TABLES: &str = "
CREATE TABLE IF NOT EXISTS calibration (
    session TEXT PRIMARY KEY, camera TEXT NOT NULL, model TEXT NOT NULL, created TEXT NOT NULL,
    width INTEGER NOT NULL, height INTEGER NOT NULL, verdict TEXT NOT NULL,
    f REAL, cx REAL, cy REAL, v_f REAL, v_f_cx REAL, v_f_cy REAL, v_cx REAL, v_cx_cy REAL, v_cy REAL
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS by_camera ON calibration (camera, width, height, created, session);
CREATE INDEX IF NOT EXISTS usable ON calibration (camera, created)
    WHERE f IS NOT NULL AND verdict != 'untrustworthy';
";
/// Every camera once: from each to the next, so that a camera's many calibrations aren't looked at.
const EACH_CAMERA: &str = "
WITH RECURSIVE each_camera (camera) AS (
    SELECT min(camera) FROM calibration
    UNION ALL
    SELECT (SELECT min(camera) FROM calibration AS next WHERE next.camera > each_camera.camera)
    FROM each_camera WHERE each_camera.camera IS NOT NULL
)";
const COLUMNS: &str = "session, camera, model, created, width, height, verdict, \
                       f, cx, cy, v_f, v_f_cx, v_f_cy, v_cx, v_cx_cy, v_cy";
const IN_ORDER: &str = "ORDER BY camera, width, height, created, session";

/// Why the index can't be used.
#[derive(Debug, thiserror::Error)]
pub enum IndexError {
    /// SQLite says no.
    #[error("could not use the index: {0}")]
    Database(#[from] rusqlite::Error),
    /// Another version made it.
    #[error("another version of boresight made this index; delete it and add the sessions again")]
    OtherVersion,
}

/// Every calibration of every camera. Derived from session folders: nothing is lost with it.
#[derive(Debug)]
pub struct Index {
    database: Connection,
}

impl Index {
    /// Opens the index at `path`, or makes an empty one.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn open(path: &Path) -> Result<Self, IndexError> {
        let database = Connection::open(path)?;
        let version: i64 = database.query_row("PRAGMA user_version", [], |row| row.get(0))?;
        match version {
            0 => {
                database.execute_batch(TABLES)?;
                database.pragma_update(None, "user_version", VERSION)?;
            }
            VERSION => {}
            _ => return Err(IndexError::OtherVersion),
        }
        Ok(Self { database })
    }

    /// Adds entries, all or none; one that is there already is replaced. Returns how many.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn add(&mut self, entries: impl Iterator<Item = Entry>) -> Result<usize, IndexError> {
        let transaction = self.database.transaction()?;
        let mut count = 0;
        {
            let mut insert = transaction.prepare(&format!(
                "INSERT OR REPLACE INTO calibration ({COLUMNS}) \
                 VALUES (?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16)"
            ))?;
            for entry in entries {
                let lens = |i: usize| entry.lens.map(|lens| lens.f_pp_px[i]);
                let v = |i, j| entry.lens.map(|lens| lens.covariance_px2[(i, j)]);
                let [width, height] = entry.image_size;
                insert.execute(params![
                    entry.session,
                    entry.camera,
                    entry.model,
                    entry.created,
                    width,
                    height,
                    entry.verdict,
                    lens(0),
                    lens(1),
                    lens(2),
                    v(0, 0),
                    v(0, 1),
                    v(0, 2),
                    v(1, 1),
                    v(1, 2),
                    v(2, 2),
                ])?;
                count += 1;
            }
        }
        transaction.commit()?;
        Ok(count)
    }

    /// Every entry, by camera and time.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn all(&self) -> Result<Vec<Entry>, IndexError> {
        let mut query =
            self.database.prepare(&format!("SELECT {COLUMNS} FROM calibration {IN_ORDER}"))?;
        let rows = query.query_map([], entry)?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    /// The entries of the camera of that name, by time.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn of_camera(&self, camera: &str) -> Result<Vec<Entry>, IndexError> {
        let text = format!("SELECT {COLUMNS} FROM calibration WHERE camera = ?1 {IN_ORDER}");
        let mut query = self.database.prepare(&text)?;
        let rows = query.query_map([camera], entry)?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    /// The names of the cameras that hold `part`, sorted.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn cameras_with(&self, part: &str) -> Result<Vec<String>, IndexError> {
        let mut query = self.database.prepare(&format!(
            "{EACH_CAMERA} SELECT camera FROM each_camera WHERE instr(camera, ?1) > 0 ORDER BY camera"
        ))?;
        let rows = query.query_map([part], |row| row.get(0))?;
        Ok(rows.collect::<Result<_, _>>()?)
    }

    /// Cameras whose newest usable calibration began before `limit`, or that have none, with the time of the newest; the
    /// oldest first.
    ///
    /// # Errors
    ///
    /// [`IndexError`].
    pub fn due(&self, limit: &str) -> Result<Vec<(String, Option<String>)>, IndexError> {
        let mut query = self.database.prepare(&format!(
            "{EACH_CAMERA}, newest AS (
                 SELECT camera, (
                     SELECT max(created) FROM calibration AS own WHERE own.camera = each_camera.camera
                         AND own.f IS NOT NULL AND own.verdict != 'untrustworthy'
                 ) AS created
                 FROM each_camera WHERE camera IS NOT NULL
             )
             SELECT camera, created FROM newest WHERE created IS NULL OR created < ?1 ORDER BY created, camera"
        ))?;
        let rows = query.query_map([limit], |row| Ok((row.get(0)?, row.get(1)?)))?;
        Ok(rows.collect::<Result<_, _>>()?)
    }
}

fn entry(row: &Row<'_>) -> rusqlite::Result<Entry> {
    let number = |i: usize| row.get::<_, Option<f64>>(i);
    let [f, x, y] = [number(7)?, number(8)?, number(9)?];
    let v = [number(10)?, number(11)?, number(12)?, number(13)?, number(14)?, number(15)?];
    let lens = match (f, x, y, v) {
        (
            Some(f),
            Some(x),
            Some(y),
            [Some(ff), Some(fx), Some(fy), Some(xx), Some(xy), Some(yy)],
        ) => Some(StatedLens {
            f_pp_px: Vector3::new(f, x, y),
            covariance_px2: Matrix3::new(ff, fx, fy, fx, xx, xy, fy, xy, yy),
        }),
        _ => None,
    };
    Ok(Entry {
        session: row.get(0)?,
        camera: row.get(1)?,
        model: row.get(2)?,
        created: row.get(3)?,
        image_size: [row.get(4)?, row.get(5)?],
        verdict: row.get(6)?,
        lens,
    })
}
