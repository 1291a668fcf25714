//! The state of a session in three parts: see the table in [`super`].

use std::sync::Arc;

use super::{
    accepted::AcceptedView,
    camera::CameraState,
    decision::Decision,
    setup::SessionSetup,
    snapshot::{LiveView, PairSummary, Snapshot, ViewSummary, summaries},
    view_number::ViewNumber,
};
use crate::{
    calibration::{Calibration, FindingCode, NotCalibrated, Verdict, calibrate},
    frame::FrameId,
    geometry::Corner,
    guidance::{
        Hold, LensEstimate, MotionWindow, Precision, Progress, Target, View, final_progress,
        forecast, measure, next_target, progress,
    },
};

/// One calibration in progress.
#[derive(Clone, Debug)]
pub struct Session {
    pub(super) setup: Arc<SessionSetup>,
    pub(super) ground: Ground,
    pub(super) derived: Derived,
    pub(super) tracking: Tracking,
}

/// What inputs have established. Nothing in it can be computed from the rest.
#[derive(Clone, Debug, Default)]
pub(super) struct Ground {
    pub(super) accepted: Vec<AcceptedView>,
    /// Removed views that may be restored, newest last, each with its index among the accepted ones.
    pub(super) removed: Vec<(usize, AcceptedView)>,
    pub(super) next_number: ViewNumber,
    /// How often the accepted views have changed.
    pub(super) changes: u32,
    pub(super) paused: bool,
    pub(super) source_ended: bool,
    /// Workers that failed in this run, with the reason.
    pub(super) failures: Vec<(String, String)>,
    pub(super) camera: CameraState,
}

/// What follows from the setup and the accepted views alone.
#[derive(Clone, Debug)]
pub(super) struct Derived {
    pub(super) lens_estimate: LensEstimate,
    /// `None` without a view.
    pub(super) calibration: Option<Result<Arc<Calibration>, NotCalibrated>>,
    /// The accepted views, measured through the lens estimate.
    pub(super) measured: Vec<View>,
    pub(super) progress: Progress,
    pub(super) target: Option<Target>,
    pub(super) views_to_go: Option<usize>,
    pub(super) views: Arc<[ViewSummary]>,
    pub(super) pairs: Arc<[PairSummary]>,
}

/// What connects one frame with the next; lost without harm.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracking {
    pub(super) motion: MotionWindow,
    pub(super) hold: Option<Hold>,
    /// Take the next frame with a board, whatever it measures.
    pub(super) force_next: bool,
    /// What the newest frame showed.
    pub(super) live: Option<Arc<LiveView>>,
}

impl Tracking {
    /// Ends the hold: the next frame can't be compared with those before.
    pub(super) fn forget_motion(&mut self) {
        self.hold = None;
        self.motion.clear();
    }
}

impl Derived {
    pub(super) fn of(setup: &SessionSetup, accepted: &[AcceptedView]) -> Self {
        let SessionSetup { board, image_size, guidance, calibration: solver } = setup;
        let corners: Vec<Vec<Corner>> =
            accepted.iter().map(|accepted| accepted.view.corners.clone()).collect();
        let calibration = (!corners.is_empty())
            .then(|| calibrate(&corners, board, *image_size, solver).map(Arc::new));
        let solved = calibration.as_ref().and_then(|result| result.as_deref().ok());
        let lens_estimate = lens_estimate(setup, solved, accepted.len());
        let measured: Vec<View> =
            accepted.iter().map(|accepted| remeasured(accepted, setup, &lens_estimate)).collect();
        let precision = solved.map(precision);
        let mut progress = progress(&measured, precision.as_ref(), guidance);
        let target = (progress == Progress::Collecting)
            .then(|| next_target(&measured, board, &lens_estimate, precision.as_ref(), guidance))
            .flatten();
        if progress == Progress::Collecting && target.is_none() {
            progress = final_progress(precision.as_ref(), guidance);
        }
        let views_to_go = match progress {
            Progress::Collecting => forecast(&measured, precision.as_ref(), guidance),
            Progress::Complete | Progress::Exhausted => None,
        };
        let (views, pairs) = summaries(accepted, &measured, &lens_estimate, solved);
        Self { lens_estimate, measured, progress, target, views_to_go, views, pairs, calibration }
    }

    pub(super) fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.calibration.as_ref().and_then(|result| result.as_ref().ok())
    }
}

/// One view fixes no lens: it takes two before the calibration replaces the guess.
fn lens_estimate(setup: &SessionSetup, solved: Option<&Calibration>, views: usize) -> LensEstimate {
    let guess = LensEstimate::guess(setup.image_size);
    match solved {
        Some(calibration) if views >= 2 => LensEstimate {
            camera: calibration.camera,
            covariance: Some(calibration.covariance),
            ..guess
        },
        _ => guess,
    }
}

/// The view through the newest lens estimate; as it was accepted if that estimate doesn't reach so far out.
fn remeasured(accepted: &AcceptedView, setup: &SessionSetup, lens_estimate: &LensEstimate) -> View {
    let view = &accepted.view;
    let frame = (view.frame_id, view.captured_at);
    match measure(frame, &view.corners, view.blur_px, &setup.board, lens_estimate) {
        Ok(again) => View { partner_frame: view.partner_frame, ..again },
        Err(_) => view.clone(),
    }
}

fn precision(calibration: &Calibration) -> Precision {
    let pp = calibration.covariance.fixed_view::<2, 2>(2, 2);
    let mut others = calibration.findings.clone();
    others.retain(|finding| !matches!(finding.code, FindingCode::CoverageLow { .. }));
    Precision {
        pp_sigma_px: pp[(0, 0)].max(pp[(1, 1)]).max(0.0).sqrt(),
        projection_sigma_px: calibration.projection_sd.mean_px,
        goal_excess: calibration.acceptance.map(|judged| judged.excess()),
        trusted: Verdict::of(&others) == Verdict::Good,
        covered: others.len() == calibration.findings.len(),
    }
}

impl Session {
    /// A session without views.
    pub fn new(setup: SessionSetup) -> Self {
        let derived = Derived::of(&setup, &[]);
        let (ground, tracking) = (Ground::default(), Tracking::default());
        Self { setup: Arc::new(setup), ground, derived, tracking }
    }

    /// Recomputes what follows from the accepted views, after they changed.
    pub(super) fn replan(&mut self) {
        self.ground.changes += 1;
        self.tracking.forget_motion();
        self.derived = Derived::of(&self.setup, &self.ground.accepted);
    }

    /// See [`SessionSetup`].
    pub fn setup(&self) -> &SessionSetup {
        &self.setup
    }

    /// The accepted views in the order in which they stand in the calibration.
    pub fn accepted(&self) -> &[AcceptedView] {
        &self.ground.accepted
    }

    /// The calibration from the accepted views, if there is one.
    pub fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.derived.calibration()
    }

    /// Why the accepted views give no calibration; `None` if they do, or if there are none.
    pub fn not_calibrated(&self) -> Option<&NotCalibrated> {
        self.derived.calibration.as_ref().and_then(|result| result.as_ref().err())
    }

    /// The frame that would be taken if the hold were complete now. The recorder must keep its picture.
    pub fn frame_in_hand(&self) -> Option<FrameId> {
        self.tracking.hold.as_ref().map(|hold| hold.best.view.frame_id)
    }

    /// How far the session is.
    pub fn progress(&self) -> Progress {
        self.derived.progress
    }

    /// The pose asked for; `None` if the session is over.
    pub fn target(&self) -> Option<&Target> {
        self.derived.target.as_ref()
    }

    /// Workers that failed in this run, with the reason.
    pub fn failures(&self) -> &[(String, String)] {
        &self.ground.failures
    }

    /// The live camera, if the source is one.
    pub fn camera(&self) -> &CameraState {
        &self.ground.camera
    }

    /// What a window or a terminal shows after `decision`.
    pub fn snapshot(&self, decision: Decision) -> Snapshot {
        let Self { setup, ground, derived, tracking } = self;
        let lens = &derived.lens_estimate;
        Snapshot {
            setup: Arc::clone(setup),
            decision,
            live: tracking.live.clone(),
            target: derived.target.clone(),
            pp_px: derived.calibration().map_or(setup.image_size.centre_px(), |c| c.camera.pp_px),
            pp_covariance_px2: lens.covariance.map(|_| lens.pp_covariance_px2()),
            lens: lens.camera,
            calibration: derived.calibration().cloned(),
            views: Arc::clone(&derived.views),
            pairs: Arc::clone(&derived.pairs),
            removed: ground.removed.last().map(|(_, accepted)| accepted.number),
            views_to_go: derived.views_to_go,
            camera: ground.camera.clone(),
            source_ended: ground.source_ended,
            paused: ground.paused,
            failures: ground.failures.clone(),
        }
    }
}
