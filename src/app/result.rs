//! What a session found, for people and for machines.

use serde_json::{Value, json};

use super::{
    Announcer, Exit, announce_result,
    json::{self, ViewName},
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
pub struct Conclusion {
    /// The exit status that it deserves: good only if the plan is complete.
    pub exit: Exit,
    /// `boresight.calibration/1`.
    pub result: Value,
}

/// Announces what `session`, whose folder has `header`, found.
pub fn conclude(session: &Session, header: &Header, announcer: &Announcer) -> Conclusion {
    announcer.say(text::progress(session.progress()));
    let exit = announce_result(result_of(session), &header.source, announcer);
    let result = calibration_json(session, header);
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

/// `boresight.calibration/1` of what a session, whose folder has `header`, has so far.
pub fn calibration_json(session: &Session, header: &Header) -> Value {
    let names: Vec<ViewName> = session.accepted().iter().map(name).collect();
    let setup = session.setup();
    let mut report = json::calibration(result_of(session), setup.image_size, &setup.board, &names);
    report["source"] = json!(header.source);
    report["replaces"] = json!(header.against);
    report["camera"] = camera(session.camera());
    report
}

fn result_of(session: &Session) -> Result<&Calibration, &NotCalibrated> {
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
