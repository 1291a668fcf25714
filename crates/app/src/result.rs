//! Result of a session, for people and for machines.

use super::{Announcer, Exit, announce_result};
use boresight_calibrate::{Calibration, NotCalibrated};
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
    /// The exit status that it deserves: good only if the plan is complete.
    pub exit: Exit,
    /// The file to write.
    pub result: CalibrationFile,
}

/// Announces what `session`, whose folder has `header`, found.
pub fn conclude(session: &Session, header: &Header, announcer: &Announcer) -> Conclusion {
    announcer.say(text::progress(session.progress()));
    let exit = announce_result(result_of(session), &header.source, announcer);
    let result = calibration_file(session, header);
    for (worker, reason) in session.failures() {
        announcer.say(&format!("The {worker} failed: {reason}"));
    }
    let exit = match session.progress() {
        Progress::Complete => exit,
        Progress::Collecting if !session.failures().is_empty() => Exit::Failed,
        Progress::Collecting | Progress::Exhausted => Exit::NotTrustworthy,
    };
    Conclusion { exit, result }
}

/// The calibration file of what a session, whose folder has `header`, has so far.
pub fn calibration_file(session: &Session, header: &Header) -> CalibrationFile {
    let views: Vec<ViewName> = session.accepted().iter().map(name).collect();
    let setup = session.setup();
    let result = result_of(session);
    CalibrationFile {
        source: Some(header.source.clone()),
        replaces: Some(header.against.clone()),
        camera: Some(camera(session.camera())),
        ..CalibrationFile::of(result, setup.image_size, &setup.board, &views, text::FINDING_WORDS)
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

fn name(accepted: &AcceptedView) -> ViewName {
    ViewName { name: accepted.picture_name(), reason: None }
}
