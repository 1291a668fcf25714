//! Takes over the index that earlier versions kept in SQLite.

use std::path::Path;

use super::sqlite::{COLUMNS, Database, Value};
use crate::batch::{Item, Row, StatedRow};

/// The version that is read, and its table.
const VERSION: u32 = 1;
const TABLE: &str = "CREATE TABLE calibration (
    session TEXT PRIMARY KEY, camera TEXT NOT NULL, model TEXT NOT NULL, created TEXT NOT NULL,
    width INTEGER NOT NULL, height INTEGER NOT NULL, verdict TEXT NOT NULL,
    f REAL, cx REAL, cy REAL, v_f REAL, v_f_cx REAL, v_f_cy REAL, v_cx REAL, v_cx_cy REAL, v_cy REAL
) WITHOUT ROWID";

/// Why a database isn't taken over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotTaken {
    /// Another program's, or another version's.
    #[error("this database isn't an index of boresight")]
    Other,
    /// The index contradicts itself, or a program was stopped while it wrote.
    #[error("this index is damaged; name another one and add the sessions again")]
    Damaged,
}

/// The rows of the index in `bytes`, which are at `path`.
pub(super) fn rows_of(bytes: &[u8], path: &Path) -> Result<Vec<Row>, NotTaken> {
    let database = Database::of(bytes, VERSION).ok_or(NotTaken::Other)?;
    let mut root = None;
    let looked = database.walk(1, &mut |values| {
        let is_text = |at: usize, text: &str| {
            matches!(values.get(at), Some(Value::Text(found))
                if found.split_whitespace().eq(text.split_whitespace()))
        };
        if is_text(0, "table") && is_text(4, TABLE) {
            root = values.get(3).and_then(Value::whole);
        }
        Some(())
    });
    let root = root.filter(|_| looked.is_some()).ok_or(NotTaken::Other)?;
    let mut journal = path.as_os_str().to_owned();
    journal.push("-journal");
    if Path::new(&journal).metadata().is_ok_and(|unfinished| unfinished.len() > 0) {
        return Err(NotTaken::Damaged);
    }
    let mut rows = Vec::new();
    let read = database.walk(root, &mut |values| {
        rows.push(row(values)?);
        Some(())
    });
    read.map(|()| rows).ok_or(NotTaken::Damaged)
}

fn row(values: &[Value<'_>]) -> Option<Row> {
    let text = |at: usize| match values.get(at)? {
        Value::Text(text) => Some((*text).to_owned()),
        _ => None,
    };
    let number = |at: usize| values.get(at).and_then(Value::number);
    // What the session held isn't known any more.
    let item = Item { session: text(0)?, content: String::new(), bytes: 0 };
    let numbers: Option<Vec<f64>> = (7..COLUMNS).map(number).collect();
    let stated = numbers.as_deref().and_then(|numbers| match *numbers {
        [f_px, x, y, ff, fx, fy, xx, xy, yy] => Some(StatedRow {
            f_px,
            pp_px: [x, y],
            covariance_px2: [[ff, fx, fy], [fx, xx, xy], [fy, xy, yy]],
        }),
        _ => None,
    });
    let mut row = Row::recorded(&item);
    row.source = text(1);
    row.model = text(2).filter(|model| !model.is_empty());
    row.created = text(3);
    row.image_size = Some([values.get(4)?.whole()?, values.get(5)?.whole()?]);
    row.verdict = text(6);
    row.recorded_verdict.clone_from(&row.verdict);
    row.stated = stated;
    Some(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Written by SQLite 3.40.1 in Python: 36 calibrations, two with long names, and 20 on pages of 512 bytes.
    const USUAL: &[u8] = include_bytes!("../../../../fixtures/history/index.sqlite");
    const SMALL_PAGES: &[u8] = include_bytes!("../../../../fixtures/history/small-pages.sqlite");

    fn rows(bytes: &[u8]) -> Result<Vec<Row>, NotTaken> {
        rows_of(bytes, Path::new("no-such-file"))
    }

    #[test]
    fn every_calibration_of_an_old_index_is_read() {
        for (bytes, count) in [(USUAL, 36), (SMALL_PAGES, 20)] {
            let mut rows = rows(bytes).expect("an index");
            rows.sort_by(|a, b| a.created.cmp(&b.created));
            assert_eq!(rows.len(), count);
            for (number, row) in rows.iter().enumerate() {
                assert!(row.session.starts_with("/data/sessions/"), "{}", row.session);
                assert!(row.session.ends_with(&format!("{number:04}")), "{}", row.session);
                let source = format!("usb:0000:0001:{:05}", number % 5);
                assert_eq!(row.source.as_deref(), Some(source.as_str()));
                let model = (number % 5 > 0).then_some("Camera é");
                assert_eq!((row.model.as_deref(), row.image_size), (model, Some([400, 300])));
                let stated = (number % 7 != 3).then(|| StatedRow {
                    f_px: 350.0 + number as f64,
                    pp_px: [200.25, 150.5],
                    covariance_px2: [
                        [0.25, 0.0, -0.007_812_5],
                        [0.0, 0.16, 0.001],
                        [-0.007_812_5, 0.001, 0.09],
                    ],
                });
                assert_eq!(row.stated, stated, "{number}");
            }
        }
        assert!(rows(USUAL).expect("an index").iter().any(|row| row.session.len() > 1300));
    }

    #[test]
    fn other_databases_are_refused() {
        let mut other = USUAL.to_vec();
        other[63] = 0;
        assert_eq!(rows(&other), Err(NotTaken::Other));
        let at = USUAL.windows(12).position(|part| part == b"session TEXT").expect("its table");
        let mut other = USUAL.to_vec();
        other[at] = b'x';
        assert_eq!(rows(&other), Err(NotTaken::Other));
        assert_eq!(rows(b"SQLite format 3\0"), Err(NotTaken::Other));
    }

    /// Bytes all over it, and ends: an answer, in an instant.
    #[test]
    fn damaged_databases_are_read_in_bounded_time() {
        for at in (0..SMALL_PAGES.len()).step_by(5) {
            for byte in [0, 0xff] {
                let mut damaged = SMALL_PAGES.to_vec();
                damaged[at] = byte;
                assert!(rows(&damaged).map_or(0, |rows| rows.len()) < 2000);
            }
        }
        for length in (0..SMALL_PAGES.len()).step_by(64) {
            let _ = rows(&SMALL_PAGES[..length]);
        }
    }
}
