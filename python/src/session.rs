//! A session that Python feeds with frames.

use std::sync::{Mutex, PoisonError};

use boresight::{
    calibration::{
        NotCalibrated,
        files::{CalibrationFile, ViewName},
    },
    detection::{Detector, DetectorParams, Search, Track},
    frame::{CaptureTime, FrameId, FrameKind, ImageSize},
    session::{Command, Decision, Input, Observation, Session as Fold},
    text,
};
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use serde_json::json;

use crate::{
    calibration::config,
    error::{raised, wrong},
    picture::{Named, picture},
};

struct State {
    session: Fold,
    detector: Detector,
    track: Track,
    frames: u64,
}

/// The state of a guided session. Nothing is stored.
#[pyclass(frozen)]
pub(crate) struct Session {
    image_size: ImageSize,
    state: Mutex<State>,
}

#[pymethods]
impl Session {
    #[new]
    fn new(
        py: Python<'_>,
        board: Named,
        image_size: (u32, u32),
        settings: Vec<String>,
    ) -> PyResult<Self> {
        let image_size = ImageSize { width_px: image_size.0, height_px: image_size.1 };
        let setup = config(py, &board, &settings)?
            .session(image_size)
            .map_err(|err| raised(&err.into()))?;
        let state = State {
            session: Fold::new(setup),
            detector: Detector::new(DetectorParams::default()),
            track: Track::default(),
            frames: 0,
        };
        Ok(Self { image_size, state: Mutex::new(state) })
    }

    /// Decides about one frame. `nanos` is when it was captured; a still picture has no neighbours in time.
    fn feed(
        &self,
        py: Python<'_>,
        image: PyReadonlyArray2<'_, u8>,
        nanos: u64,
        still: bool,
        name: String,
    ) -> PyResult<String> {
        let image = picture(&image)?;
        if ImageSize::of(&image) != self.image_size {
            return Err(wrong("the frame doesn't have the session's image_size"));
        }
        let kind = if still { FrameKind::Photograph } else { FrameKind::Video };
        py.detach(|| {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let State { session, detector, track, frames } = &mut *state;
            let captured_at = CaptureTime { nanos };
            let near = track.predict(kind, captured_at);
            let search = Search { near: near.as_ref(), keep_on: &|| true };
            let board = session.setup().board;
            let seen = detector.search(&image, &board, search);
            track.add(kind, captured_at, &seen);
            let observation = Observation {
                frame_id: FrameId(*frames),
                captured_at,
                kind,
                name,
                image_size: self.image_size,
                seen,
            };
            *frames += 1;
            let decision = session.handle(&Input::Observed(observation));
            snapshot(session, decision)
        })
        .map_err(|err| raised(&err.into()))
    }

    /// Applies a command of the person: `undo`, `restore`, `pause`, `resume` or `force`.
    fn command(&self, name: &str) -> PyResult<String> {
        let command = match name {
            "undo" => Command::UndoLast,
            "restore" => Command::Restore,
            "pause" => Command::Pause,
            "resume" => Command::Resume,
            "force" => Command::ForceNext,
            _ => return Err(wrong("a command is undo, restore, pause, resume or force")),
        };
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let decision = state.session.handle(&Input::Command(command));
        snapshot(&state.session, decision).map_err(|err| raised(&err.into()))
    }

    /// The calibration so far, as `boresight.calibration/1`.
    fn calibration(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| {
            let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let session = &state.session;
            let names: Vec<ViewName> = session
                .accepted()
                .iter()
                .map(|view| ViewName { name: view.picture_name(), reason: None })
                .collect();
            let result = session
                .calibration()
                .map(|calibration| calibration.as_ref())
                .ok_or(session.not_calibrated().unwrap_or(&NotCalibrated::NoViews));
            let board = session.setup().board;
            let file =
                CalibrationFile::of(result, self.image_size, &board, &names, text::FINDING_WORDS);
            file.to_json().map(|value| value.to_string())
        })
        .map_err(|err| raised(&err.into()))
    }
}

fn snapshot(session: &Fold, decision: Decision) -> serde_json::Result<String> {
    let decided = serde_json::to_value(decision)?;
    let snapshot = session.snapshot(decision);
    let pose = snapshot.target.as_ref().map(|_| text::prompt(snapshot.shown.prompt));
    let value = json!({
        "advice": text::prompt(snapshot.shown.prompt),
        "asks_for_pose": pose.is_some(),
        "decision": decided,
        "views": session.accepted().len(),
        "views_to_go": snapshot.views_to_go,
        "progress": format!("{:?}", session.progress()).to_lowercase(),
        "pp_px": [snapshot.pp_px.x, snapshot.pp_px.y],
        "f_px": [snapshot.lens.f_px.x, snapshot.lens.f_px.y],
        "verdict": session.calibration().map(|calibration| calibration.verdict.code()),
    });
    Ok(value.to_string())
}
