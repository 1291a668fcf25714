//! A session that Python feeds with frames.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

use boresight::{
    app::session::result::{calibration_file, save_result},
    detection::{Detector, DetectorParams, Search, Track},
    frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize},
    ghost::Card,
    instruction::Instruction,
    pipeline::Recorder,
    recording::{Header, SessionFolder},
    session::{Command, Decision, Input, Observation, Outcome, Session as Fold},
    text,
};
use nalgebra::Point2;
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
    recorder: Option<Recorder>,
}

impl State {
    /// Decides about `input`, records it, and says what is known then.
    fn handle(&mut self, input: &Input) -> anyhow::Result<String> {
        let decision = self.session.handle(input);
        if let Some(recorder) = &mut self.recorder {
            recorder.record(&self.session, input, &decision)?;
        }
        Ok(snapshot(&self.session, decision)?)
    }
}

/// The state of a guided session, and its folder if it's recorded.
#[pyclass(frozen)]
pub(crate) struct Session {
    image_size: ImageSize,
    state: Mutex<State>,
    header: Header,
    folder: Option<PathBuf>,
}

#[pymethods]
impl Session {
    #[new]
    fn new(
        board: Named,
        image_size: (u32, u32),
        settings: Vec<String>,
        record: Option<PathBuf>,
        source: &str,
    ) -> PyResult<Self> {
        let image_size = ImageSize { width_px: image_size.0, height_px: image_size.1 };
        let config = config(&board, &settings)?;
        let setup = config.session(image_size).map_err(|err| raised(&err.into()))?;
        let header = Header::new(source, image_size, config);
        let folder = record.as_deref().map(|path| SessionFolder::create(path, &header));
        let recorder = folder.transpose().map_err(|err| raised(&err.into()))?;
        let state = State {
            session: Fold::new(setup),
            detector: Detector::new(DetectorParams::default()),
            track: Track::default(),
            frames: 0,
            recorder: recorder.map(Recorder::by_hand),
        };
        Ok(Self { image_size, state: Mutex::new(state), header, folder: record })
    }

    /// Decides about one frame. `nanos` is when it was captured; a still picture has no neighbours
    /// in time.
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
            let captured_at = CaptureTime { nanos };
            let near = state.track.predict(kind, captured_at);
            let search = Search { near: near.as_ref(), ..Search::FULL };
            let board = state.session.setup().board;
            let seen = state.detector.search(&image, &board, search);
            let State { track, detector, .. } = &mut *state;
            let recognise = || detector.recognise(&image, Some(&board), &|| true);
            let seen = track.or_other(kind, captured_at, seen, recognise);
            state.track.add(kind, captured_at, &seen);
            let frame_id = FrameId(state.frames);
            let image_size = self.image_size;
            if let Some(recorder) = &mut state.recorder {
                let name = name.clone();
                recorder.keep(Arc::new(Frame { id: frame_id, captured_at, kind, name, image }));
            }
            state.frames += 1;
            let seen = Observation { frame_id, captured_at, kind, name, image_size, seen };
            state.handle(&Input::Observed(seen))
        })
        .map_err(|err| raised(&err))
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
        state.handle(&Input::Command(command)).map_err(|err| raised(&err))
    }

    /// Ends the session. A recorded one gets its result, and its folder is closed.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let work = || -> anyhow::Result<()> {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let (Some(folder), true) = (&self.folder, state.recorder.is_some()) else {
                return Ok(());
            };
            state.handle(&Input::Stop)?;
            state.recorder = None;
            let result = calibration_file(&state.session, &self.header);
            save_result(folder, &state.session, &result)?;
            Ok(())
        };
        py.detach(work).map_err(|err| raised(&err))
    }

    /// The calibration so far, as `boresight.calibration/1`.
    fn calibration(&self, py: Python<'_>) -> PyResult<String> {
        py.detach(|| {
            let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            let result = calibration_file(&state.session, &self.header);
            result.to_json().map(|value| value.to_string())
        })
        .map_err(|err| raised(&err.into()))
    }
}

/// What a session's window would show, as JSON.
fn snapshot(session: &Fold, decision: Decision) -> serde_json::Result<String> {
    let decided = serde_json::to_value(decision)?;
    let snapshot = session.snapshot(decision);
    let points = |px: &mut dyn Iterator<Item = Point2<f64>>| -> Vec<[f64; 2]> {
        px.map(|px| [px.x, px.y]).collect()
    };
    let said = match &decision.outcome {
        Outcome::Refused { refusal } => Some(text::refusal(refusal)),
        outcome => text::outcome(outcome, &snapshot, false),
    };
    let board = session.setup().board;
    let target = snapshot.target.as_ref().map(|target| {
        let card = Card::new(&target.ghost_px, &board, &snapshot.lens);
        let rim = card.and_then(|card| card.rim()).unwrap_or_default();
        let count = rim.len();
        // Closed.
        let rim = &mut rim.into_iter().map(|(px, _)| px).cycle().take(count + count.min(1));
        let arrow = card.map(|card| card.arrow()).unwrap_or_default();
        json!({
            "corners_px": points(&mut target.ghost_px.iter().copied()),
            "card_px": points(rim),
            "arrow_px": points(&mut arrow.into_iter()),
            "tilt_deg": target.tilt_rad.to_degrees(),
            "direction_deg": target.tilt_azimuth_rad.to_degrees(),
            "leaves_picture": target.leaves_picture,
        })
    });
    let live = snapshot.live.as_deref();
    let corners = live.and_then(|live| {
        let mut px = points(&mut live.corners_px.as_ref().ok()?.iter().copied());
        live.unseen.iter().for_each(|&unseen| px[unseen] = [f64::NAN; 2]);
        Some(px)
    });
    let value = json!({
        "advice": Instruction::of(&snapshot).sentence(false),
        "said": said,
        "target": target,
        "corners_px": corners,
        "paused": snapshot.paused,
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
