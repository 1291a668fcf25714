//! Result of a session, for people and for machines.

use std::path::{Path, PathBuf};

use crate::{Announcer, CORNERS_FILE, Exit, RESULT_FILE, announce_result, session::export};
use boresight_calibrate::{Calibration, NotCalibrated};
use boresight_files::{Overwrite, save};
use boresight_formats::{CalibrationFile, CameraEntry, ViewName};
use boresight_geometry::device::{Control, Lock};
use boresight_guide::{
    guidance::Progress,
    session::{AcceptedView, CameraState, Session},
};
use boresight_present::text;
use boresight_run::recording::Header;

/// Result of a session.
pub struct Conclusion {
    /// Exit status.
    pub exit: Exit,
    /// The file to write.
    pub result: CalibrationFile,
}

/// Announces the result of `session`, with `header` in the session's folder.
pub fn conclude(session: &Session, header: &Header, announcer: &Announcer) -> Conclusion {
    announcer.say(&text::session_news::ending(session));
    let result = calibration_file(session, header);
    let exit = announce_result(result_of(session), &result, announcer);
    for (worker, reason) in session.failures() {
        announcer.say(&format!("The {worker} failed: {reason}"));
    }
    let has_failed = session.progress() == Progress::Collecting && !session.failures().is_empty();
    Conclusion { exit: if has_failed { Exit::Failed } else { exit }, result }
}

/// Writes `result` into the folder of `session`, and beside it the corners of the views as a table
/// for other programs. Both follow from the journal and may be replaced. Returns the result's file.
///
/// # Errors
///
/// If a file can't be written.
pub fn save_result(
    folder: &Path,
    session: &Session,
    result: &CalibrationFile,
) -> anyhow::Result<PathBuf> {
    let file = folder.join(RESULT_FILE);
    let json = serde_json::to_string_pretty(&result.to_json()?)?;
    save(&file, json.as_bytes(), Overwrite::Allowed)?;
    if !session.accepted().is_empty() {
        let table = export::corners_of(session);
        save(&folder.join(CORNERS_FILE), table.as_bytes(), Overwrite::Allowed)?;
    }
    Ok(file)
}

/// Calibration file of a session so far, with `header` in the session's folder.
pub fn calibration_file(session: &Session, header: &Header) -> CalibrationFile {
    let views: Vec<ViewName> = session.accepted().iter().map(view_name).collect();
    let setup = session.setup();
    let result = result_of(session);
    let (size, words) = (setup.image_size, text::FINDING_WORDS);
    from_session(CalibrationFile::of(result, size, &setup.board, &views, words), session, header)
}

/// Adds to `file`, a calibration from the views of `session`, the source, the camera and the
/// goal in `header`: they let a check identify the camera.
pub fn from_session(file: CalibrationFile, session: &Session, header: &Header) -> CalibrationFile {
    CalibrationFile {
        source: Some(header.source.clone()),
        replaces: Some(header.against.clone()),
        camera: Some(camera(session.camera())),
        typical_goal_px: Some(header.config.guidance.stop_projection_sigma_px),
        ..file
    }
}

fn result_of(session: &Session) -> Result<&Calibration, &NotCalibrated> {
    match session.calibration() {
        Some(calibration) => Ok(calibration.as_ref()),
        None => Err(session.not_calibrated().unwrap_or(&NotCalibrated::NoViews)),
    }
}

/// Mode and locked controls of a live camera; `None` for every other source.
fn camera(camera: &CameraState) -> Option<CameraEntry> {
    let mode = camera.mode?;
    let locked = |control: Control| match camera.locks.of(control) {
        Lock::Locked { value } => Some(value),
        Lock::Unknown | Lock::Absent | Lock::Free | Lock::Ignored { .. } => None,
    };
    Some(CameraEntry {
        format: mode.layout.name().into(),
        rate_hz: mode.rate_hz(),
        focus: locked(Control::Focus),
        zoom: locked(Control::Zoom),
        exposure: locked(Control::Exposure),
        gain: locked(Control::Gain),
        white_balance: locked(Control::WhiteBalance),
    })
}

/// Name of an accepted view in the session.
pub(crate) fn view_name(accepted: &AcceptedView) -> ViewName {
    ViewName {
        name: accepted.picture_name(),
        number: Some(accepted.number.0 as usize + 1),
        reason: None,
    }
}
