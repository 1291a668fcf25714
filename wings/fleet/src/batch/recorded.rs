//! Row of a session's own result, without new decisions.

use std::path::Path;

use anyhow::Context;

use super::{
    item::Item,
    job::{Action, Job},
    row::Row,
};
use boresight_app::RESULT_FILE;
use boresight_files::{Links, read_text};
use boresight_formats::CalibrationFile;
use boresight_run::recording::{Header, SessionFolder};

/// Largest readable result, in bytes.
pub(super) const RESULT_LIMIT: u64 = 16 << 20;

/// Row of the recorded result of the session in `folder`; `None` without a result.
///
/// # Errors
///
/// If a file of the session can't be read, or the folder's name isn't UTF-8.
pub fn recorded(folder: &Path) -> anyhow::Result<Option<Row>> {
    let result = match read_text(&folder.join(RESULT_FILE), RESULT_LIMIT, Links::Refused) {
        Err(err) if err.is_missing() => return Ok(None),
        result => result?,
    };
    let of_result = || format!("the session's result: {:?}", folder.join(RESULT_FILE));
    let result = serde_json::from_str(&result).with_context(of_result)?;
    let file = CalibrationFile::read(&result).with_context(of_result)?;
    let item = Item::of(folder).with_context(|| format!("its name isn't UTF-8: {folder:?}"))?;
    let mut row = Row::recorded(&item);
    describe(&mut row, &SessionFolder::header(folder)?);
    row.image_size = Some(file.image_size);
    row.calibrated(&file);
    anyhow::ensure!(row.verdict.is_some(), "the session's result has no verdict: {folder:?}");
    row.recorded_verdict.clone_from(&row.verdict);
    Ok(Some(row))
}

/// Copies the session's statements from the header.
pub(super) fn describe(row: &mut Row, header: &Header) {
    row.created = Some(header.created.clone());
    row.source = Some(header.source.clone());
    row.image_size = Some(header.image_size_px);
    if let Some(camera) = &header.camera {
        row.model = Some(camera.name().to_owned());
        row.usb = camera.usb().map(str::to_owned);
        row.serial = Some(camera.serial().to_owned()).filter(|serial| !serial.is_empty());
    }
}

impl Row {
    /// Empty row for the recorded result of `item`. Depends on no rule of the program.
    pub fn recorded(item: &Item) -> Self {
        let job = Job::new(Action::Recorded, "");
        Self::new(job.id_of(item).to_string(), &item.session, job.action)
    }
}
