//! The ground state of one guided session, and the only code that changes it.
//!
//! The program is a fold: [`Session::handle`] applies one [`Input`] and says what it decided. It
//! reads no clock, file, thread or random number, so that a recording of the inputs, handled again,
//! gives the same decisions bit for bit.

mod camera;
mod decision;
mod input;
mod judging;
mod snapshot;

pub use camera::{CameraState, Stream};
pub use decision::{Decision, Outcome};
pub use input::{Command, Input, Observation};
pub use snapshot::{LiveView, Measured, PairSummary, Snapshot, ViewSummary, lateral_offset_px};

use std::sync::Arc;

use crate::{
    board::Checkerboard,
    calibration::{Calibration, CalibrationParams, FindingCode, NotCalibrated, Verdict, calibrate},
    device::CameraEvent,
    frame::{CaptureTime, FrameId, ImageSize},
    geometry::Corner,
    guidance::{
        Advice, GuidanceParams, Hold, LensEstimate, Progress, Refusal, Role, Target, View,
        final_progress, forecast, measure, next_target, progress, stop::Precision,
    },
};

/// What a session is about. Fixed from its first input to its last.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionSetup {
    /// The board.
    pub board: Checkerboard,
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// Limits of the planner.
    pub guidance: GuidanceParams,
    /// Settings of the solver.
    pub calibration: CalibrationParams,
}

/// An accepted view.
#[derive(Clone, Debug, PartialEq)]
pub struct AcceptedView {
    /// Number in order of acceptance; never reused.
    pub id: u32,
    /// File name of the picture, or empty.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// What was measured.
    pub view: View,
}

impl AcceptedView {
    /// What to call its picture: its file name, or where the session stores it.
    pub fn picture_name(&self) -> String {
        if self.name.is_empty() { self.view.frame_id.stored_name() } else { self.name.clone() }
    }
}

/// One calibration in progress.
#[derive(Clone, Debug)]
pub struct Session {
    setup: Arc<SessionSetup>,
    accepted: Vec<AcceptedView>,
    /// Views taken back, newest last, with where they stood.
    removed: Vec<(usize, AcceptedView)>,
    next_view: u32,
    lens_estimate: LensEstimate,
    calibration: Option<Result<Arc<Calibration>, NotCalibrated>>,
    target: Option<Target>,
    target_serial: u32,
    hold: Option<Hold>,
    hold_name: String,
    last_seen: Option<(CaptureTime, Vec<Corner>)>,
    live: Option<Arc<LiveView>>,
    views: Arc<[ViewSummary]>,
    pairs: Arc<[PairSummary]>,
    views_to_go: Option<usize>,
    progress: Progress,
    source_ended: bool,
    paused: bool,
    force_next: bool,
    failures: Vec<(String, String)>,
    camera: CameraState,
}

impl Session {
    /// An empty session.
    pub fn new(setup: SessionSetup) -> Self {
        let lens_estimate = LensEstimate::guess(setup.image_size);
        let target = next_target(&[], &setup.board, &lens_estimate, None, &setup.guidance);
        let views_to_go = forecast(&[], None, &setup.guidance);
        Self {
            setup: Arc::new(setup),
            accepted: Vec::new(),
            removed: Vec::new(),
            next_view: 0,
            lens_estimate,
            calibration: None,
            target,
            target_serial: 0,
            hold: None,
            hold_name: String::new(),
            last_seen: None,
            live: None,
            views: Arc::new([]),
            pairs: Arc::new([]),
            views_to_go,
            progress: Progress::Collecting,
            source_ended: false,
            paused: false,
            force_next: false,
            failures: Vec::new(),
            camera: CameraState::default(),
        }
    }

    /// Applies one input and says what it decided.
    pub fn handle(&mut self, input: &Input) -> Decision {
        let (frame, outcome, advice) = match input {
            Input::Observed(observation) => {
                let (outcome, advice) = self.observe(observation);
                (Some(observation.frame_id.0), outcome, advice)
            }
            Input::Command(command) => (None, self.obey(*command), None),
            Input::Camera(event) => (None, self.note(event), None),
            Input::WorkerFailed { worker, reason } => {
                self.failures.push((worker.clone(), reason.clone()));
                (None, Outcome::Noted, None)
            }
            Input::Resumed => {
                self.source_ended = false;
                // What failed then is over; who fails now says so.
                self.failures.clear();
                self.camera = CameraState::default();
                self.forget_motion();
                (None, Outcome::Noted, None)
            }
            Input::SourceEnded => {
                self.source_ended = true;
                (None, Outcome::Noted, None)
            }
            Input::Stop => (None, Outcome::Noted, None),
        };
        let advice = advice.unwrap_or_else(|| {
            if self.target.is_none() {
                Advice::Finished
            } else if self.camera.may_take() {
                Advice::ShowBoard
            } else {
                Advice::Mend { refusal: Refusal::CameraNotReady }
            }
        });
        Decision {
            frame,
            outcome,
            advice,
            progress: self.progress,
            accepted: self.accepted.len(),
            target_serial: self.target_serial,
        }
    }

    /// Applies what the camera said. A view that was taken while focus or zoom may already have been
    /// another is taken back: the calibration is of one lens.
    fn note(&mut self, event: &CameraEvent) -> Outcome {
        let has_views = !(self.accepted.is_empty() && self.removed.is_empty());
        self.camera.apply(event, has_views);
        if !self.camera.may_take() {
            self.forget_motion();
            self.force_next = false;
        }
        let CameraEvent::ControlChanged(change) = event else { return Outcome::Noted };
        if !change.control.moves_geometry() {
            return Outcome::Noted;
        }
        let doubtful = |view: &View| view.captured_at > change.good_until;
        let taken_back = self.accepted.iter().rev().find(|taken| doubtful(&taken.view));
        let Some(view) = taken_back.map(|taken| taken.id) else { return Outcome::Noted };
        self.accepted.retain(|taken| !doubtful(&taken.view));
        self.solve();
        Outcome::Removed { view }
    }

    fn obey(&mut self, command: Command) -> Outcome {
        match command {
            Command::ForceNext => {
                self.force_next = true;
                Outcome::Noted
            }
            Command::Pause => {
                self.paused = true;
                self.hold = None;
                Outcome::Noted
            }
            Command::Resume => {
                self.paused = false;
                Outcome::Noted
            }
            Command::UndoLast => match self.accepted.last().map(|last| last.id) {
                Some(view) => self.remove(view),
                None => Outcome::Noted,
            },
            Command::Remove { view } => self.remove(view),
            Command::Restore => self.restore(),
        }
    }

    fn remove(&mut self, view: u32) -> Outcome {
        let Some(index) = self.accepted.iter().position(|accepted| accepted.id == view) else {
            return Outcome::Noted;
        };
        let removed = self.accepted.remove(index);
        self.removed.push((index, removed));
        self.solve();
        Outcome::Removed { view }
    }

    fn restore(&mut self) -> Outcome {
        let Some((index, accepted)) = self.removed.pop() else { return Outcome::Noted };
        let view = accepted.id;
        self.accepted.insert(index.min(self.accepted.len()), accepted);
        self.solve();
        Outcome::Restored { view }
    }

    /// Recomputes everything that follows from the accepted views.
    fn solve(&mut self) {
        self.forget_motion();
        let corners: Vec<Vec<Corner>> =
            self.accepted.iter().map(|accepted| accepted.view.corners.clone()).collect();
        let setup = &self.setup;
        self.lens_estimate = LensEstimate::guess(setup.image_size);
        self.calibration = (!corners.is_empty()).then(|| {
            calibrate(&corners, &setup.board, setup.image_size, &setup.calibration).map(Arc::new)
        });
        if let Some(Ok(calibration)) = &self.calibration
            && corners.len() >= 2
        {
            self.lens_estimate.camera = calibration.camera;
            self.lens_estimate.covariance = Some(calibration.covariance);
        }
        for accepted in &mut self.accepted {
            let view = &accepted.view;
            let frame = (view.frame_id, view.captured_at);
            if let Ok(again) =
                measure(frame, &view.corners, view.blur_px, &setup.board, &self.lens_estimate)
            {
                accepted.view = View { partner_frame: view.partner_frame, ..again };
            }
        }
        let views: Vec<View> = self.accepted.iter().map(|accepted| accepted.view.clone()).collect();
        let precision = self.precision();
        self.progress = progress(&views, precision.as_ref(), &setup.guidance);
        self.target = None;
        if self.progress == Progress::Collecting {
            self.target = next_target(
                &views,
                &setup.board,
                &self.lens_estimate,
                precision.as_ref(),
                &setup.guidance,
            );
            if self.target.is_none() {
                self.progress = final_progress(precision.as_ref(), &setup.guidance);
            }
        }
        self.target_serial += 1;
        let calibration = self.calibration().cloned();
        (self.views, self.pairs) =
            snapshot::summaries(&self.accepted, &self.lens_estimate, calibration.as_deref());
        self.views_to_go = match self.progress {
            Progress::Collecting => forecast(&views, precision.as_ref(), &self.setup.guidance),
            Progress::Complete | Progress::Exhausted => None,
        };
    }

    fn precision(&self) -> Option<Precision> {
        let calibration = self.calibration()?;
        let pp = calibration.covariance.fixed_view::<2, 2>(2, 2);
        let mut others = calibration.findings.clone();
        others.retain(|finding| !matches!(finding.code, FindingCode::CoverageLow { .. }));
        Some(Precision {
            pp_sigma_px: pp[(0, 0)].max(pp[(1, 1)]).max(0.0).sqrt(),
            projection_sigma_px: calibration.projection_sd.mean_px,
            trusted: Verdict::of(&others) == Verdict::Good,
            covered: others.len() == calibration.findings.len(),
        })
    }

    fn forget_motion(&mut self) {
        self.hold = None;
        self.last_seen = None;
    }

    /// See [`SessionSetup`].
    pub fn setup(&self) -> &SessionSetup {
        &self.setup
    }

    /// The accepted views, oldest first.
    pub fn accepted(&self) -> &[AcceptedView] {
        &self.accepted
    }

    /// The calibration from the accepted views, if there is one.
    pub fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.calibration.as_ref().and_then(|result| result.as_ref().ok())
    }

    /// Why the accepted views give no calibration, if they do not.
    pub fn not_calibrated(&self) -> Option<&NotCalibrated> {
        self.calibration.as_ref().and_then(|result| result.as_ref().err())
    }

    /// The frame that would be taken if the hold were complete now. The recorder must keep its picture.
    pub fn frame_in_hand(&self) -> Option<FrameId> {
        self.hold.as_ref().map(|hold| hold.best.frame_id)
    }

    /// How far the session is.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// Where the wanted pose stands on the screen, and why.
    pub fn target(&self) -> Option<&Target> {
        self.target.as_ref()
    }

    /// Workers that failed, with the reason.
    pub fn failures(&self) -> &[(String, String)] {
        &self.failures
    }

    /// The live camera, if the source is one.
    pub fn camera(&self) -> &CameraState {
        &self.camera
    }

    /// What a window or a command line shows after `decision`.
    pub fn snapshot(&self, decision: Decision) -> Snapshot {
        Snapshot {
            setup: Arc::clone(&self.setup),
            decision,
            live: self.live.clone(),
            target: self.target.clone(),
            pp_px: self.calibration().map_or(self.setup.image_size.centre_px(), |c| c.camera.pp_px),
            pp_covariance_px2: self
                .lens_estimate
                .covariance
                .map(|_| self.lens_estimate.pp_covariance_px2()),
            lens: self.lens_estimate.camera,
            calibration: self.calibration().cloned(),
            views: Arc::clone(&self.views),
            pairs: Arc::clone(&self.pairs),
            removed: self.removed.last().map(|(_, accepted)| accepted.id),
            views_to_go: self.views_to_go,
            camera: self.camera.clone(),
            source_ended: self.source_ended,
            paused: self.paused,
            failures: self.failures.clone(),
        }
    }
}
