//! Recorded sessions.

use std::path::PathBuf;

use boresight::{
    app::{
        JournalReading, SavedSession,
        commands::redetect::redetect,
        session::{comparison, result::calibration_file},
    },
    recording::SessionFolder,
};
use pyo3::prelude::*;
use serde_json::json;

use crate::{calibration::older, error::raised};

/// What a session folder records: header, and the calibration of its views by this version.
#[pyfunction]
pub(crate) fn read_session(py: Python<'_>, session: PathBuf) -> PyResult<String> {
    let work = || {
        let saved = SavedSession::open(&session)?;
        let header = SessionFolder::header(&session)?;
        let result = calibration_file(&saved.session, &saved.header);
        let value = json!({
            "session": session.display().to_string(),
            "created": header.created,
            "source": header.source,
            "against": header.against,
            "image_size": header.image_size_px,
            "camera": header.camera.as_ref().map(|camera| json!({
                "name": camera.name(), "usb": camera.usb(), "serial": camera.serial(),
            })),
            "lines": saved.contents.lines.len(),
            "pictures": saved.contents.stored.len(),
            "cut": saved.contents.cut,
            "calibration": result.to_json()?,
        });
        Ok::<_, anyhow::Error>(value.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Makes every decision of a session again, as `boresight replay --json`.
#[pyfunction]
pub(crate) fn replay(
    py: Python<'_>,
    session: PathBuf,
    settings: Vec<String>,
    again: bool,
    threads: usize,
) -> PyResult<String> {
    let work = || {
        let mut journal = JournalReading::of(&session)?;
        let config = journal.header.config.with(&settings)?;
        if again {
            redetect(&mut journal, &config.board()?, threads.max(1), || ())?;
        }
        let (decided, crc32) = journal.decide_again_summed(&config, |_, _| ())?;
        let result = calibration_file(&decided.session, &journal.header);
        let count = journal.contents.lines.len();
        Ok::<_, anyhow::Error>(decided.to_json(&result, &session, count, &crc32)?.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}

/// Compares the views of a session with the calibration in a file. Returns `boresight.check/1`.
#[pyfunction]
pub(crate) fn check_session(
    py: Python<'_>,
    session: PathBuf,
    against: PathBuf,
    old: Option<&str>,
    limit_px: Option<f64>,
) -> PyResult<String> {
    let work = || {
        let saved = SavedSession::open(&session)?;
        let old = older(&against, old)?;
        let found = comparison::compare(&saved.session, &old, limit_px);
        let (_, action) = comparison::words(&found);
        let file = comparison::check_file(&against, &saved.header.source, &old, &found, &action);
        Ok::<_, anyhow::Error>(file.to_json()?.to_string())
    };
    py.detach(work).map_err(|err| raised(&err))
}
