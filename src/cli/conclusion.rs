//! What came of a session, for people and for machines.

use serde_json::{Value, json};

use super::{
    Exit,
    json::{self, ViewName},
    outcome::tell,
    say,
};
use crate::{
    calibration::{Calibration, NotCalibrated},
    device::{Control, Lock},
    guidance::Progress,
    recording::Header,
    session::{AcceptedView, CameraState, Session},
    text,
};

/// Result of a session.
pub(super) struct Conclusion {
    /// The exit code that it deserves: good only if the plan is complete, too.
    pub(super) exit: Exit,
    /// `boresight.calibration/1`.
    pub(super) report: Value,
}

/// Tells the person what came of `session`, whose folder has `header`.
pub(super) fn conclude(session: &Session, header: &Header) -> Conclusion {
    say(text::progress(session.progress()));
    let exit = tell(result(session));
    let report = calibration_json(session, header);
    for (worker, reason) in session.failures() {
        say(&format!("The {worker} failed: {reason}"));
    }
    let exit = match session.progress() {
        Progress::Complete => exit,
        Progress::Collecting if !session.failures().is_empty() => Exit::Failed,
        Progress::Collecting | Progress::Exhausted => Exit::NotTrustworthy,
    };
    Conclusion { exit, report }
}

/// `boresight.calibration/1` of what a session, whose folder has `header`, has so far.
pub(super) fn calibration_json(session: &Session, header: &Header) -> Value {
    let names: Vec<ViewName> = session.accepted().iter().map(name).collect();
    let setup = session.setup();
    let mut report = json::calibration(result(session), setup.image_size, &setup.board, &names);
    report["source"] = json!(header.source);
    report["replaces"] = json!(header.against);
    report["camera"] = camera(session.camera());
    report
}

fn result(session: &Session) -> Result<&Calibration, &NotCalibrated> {
    match session.calibration() {
        Some(calibration) => Ok(calibration.as_ref()),
        None => Err(session.not_calibrated().unwrap_or(&NotCalibrated::NoViews)),
    }
}

/// Mode and locked controls of a live camera; null for every other source.
fn camera(camera: &CameraState) -> Value {
    let Some(mode) = camera.mode else { return Value::Null };
    let locked = |control: Control| match camera.locks.of(control) {
        Lock::Locked { value } => Some(value),
        Lock::Unknown | Lock::Absent | Lock::Free | Lock::Ignored { .. } => None,
    };
    json!({
        "format": mode.layout.name(), "rate_hz": mode.rate_hz(),
        "focus": locked(Control::Focus), "zoom": locked(Control::Zoom),
        "exposure": locked(Control::Exposure), "gain": locked(Control::Gain),
        "white_balance": locked(Control::WhiteBalance),
    })
}

fn name(accepted: &AcceptedView) -> ViewName {
    ViewName { name: accepted.picture_name(), reason: None }
}
