//! The state of a session in three parts: see the table in [`super`].

use std::sync::Arc;

use super::{
    accepted::AcceptedView,
    calm::Calm,
    camera::CameraState,
    decision::Decision,
    far_board::FarBoard,
    held_out_pair::{HeldOutPair, held_out_pair},
    precision::precision_of,
    seen::Seen,
    setup::SessionSetup,
    snapshot::{LiveView, PairSummary, Snapshot, ViewSummary, summaries},
    view_number::ViewNumber,
};
use crate::guidance::{
    ExposureEstimate, GuidanceParams, Hold, Knowledge, LensEstimate, MotionWindow, Patience,
    Precision, Progress, Purpose, Target, View, covering_target, final_progress, forecast, measure,
    next_target, progress, worth::pose_of,
};
use boresight_calibrate::{Calibration, CalibrationParams, NotCalibrated, calibrate};
use boresight_geometry::{
    Camera, Corner,
    board::Checkerboard,
    frame::{CaptureTime, FrameId},
};

/// Views that [`Command::TakeMore`](super::Command::TakeMore) asks for: a view and its partner.
pub(super) const MORE_VIEWS: usize = 2;

/// A calibration in progress.
#[derive(Clone, Debug)]
pub struct Session {
    pub(super) setup: Arc<SessionSetup>,
    pub(super) ground: Ground,
    pub(super) derived: Derived,
    pub(super) tracking: Tracking,
    pub(super) calm: Calm,
}

/// Facts established by inputs. None can be computed from the others.
#[derive(Clone, Debug, Default)]
pub(super) struct Ground {
    pub(super) accepted: Vec<AcceptedView>,
    /// Removed views that may be restored, newest last, each with its index among the accepted ones.
    pub(super) removed: Vec<(usize, AcceptedView)>,
    pub(super) next_number: ViewNumber,
    /// Views that the person wants in addition to the plan.
    pub(super) wanted_views: usize,
    /// Number of changes of the accepted views or of the pose asked for.
    pub(super) changes: u32,
    /// Number of views shown by someone who doesn't follow the ghost; a view that follows halves it.
    pub(super) unfollowed: u32,
    /// Facts that frames have shown beside the accepted views.
    pub(super) seen: Seen,
    pub(super) paused: bool,
    pub(super) source_ended: bool,
    /// Workers that failed in this run, with the reason.
    pub(super) failures: Vec<(String, String)>,
    pub(super) camera: CameraState,
}

/// State derived from the setup, the accepted views and the frames.
#[derive(Clone, Debug)]
pub(super) struct Derived {
    pub(super) lens_estimate: LensEstimate,
    /// `None` without a view.
    pub(super) calibration: Option<Result<Arc<Calibration>, NotCalibrated>>,
    /// The accepted views, measured through the lens estimate.
    pub(super) measured: Vec<View>,
    pub(super) progress: Progress,
    pub(super) target: Option<Target>,
    /// The limits with which the pose asked for was chosen.
    pub(super) limits: GuidanceParams,
    /// True if the person wants more than the plan: views that cover more of the picture.
    pub(super) wants_more: bool,
    /// Information in the accepted views, and the variance that the pose asked for would leave; infinite without one.
    pub(super) knowledge: Knowledge,
    pub(super) variance_after_target: f64,
    /// Limits of a board that stays small.
    pub(super) far: Option<FarBoard>,
    /// Prediction of the newest pair by the views before it.
    pub(super) held_out: Option<HeldOutPair>,
    precision: Option<Precision>,
    pub(super) views_to_go: Option<usize>,
    pub(super) views: Arc<[ViewSummary]>,
    pub(super) pairs: Arc<[PairSummary]>,
}

/// State that connects one frame with the next; lost without harm.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracking {
    pub(super) motion: MotionWindow,
    pub(super) exposure: ExposureEstimate,
    pub(super) hold: Option<Hold>,
    pub(super) patience: Patience,
    /// True if the board was still in the newest frame.
    pub(super) was_still: bool,
    /// Time for which a board has been in the picture since the pose was asked for, pauses aside.
    pub(super) asked_secs: f64,
    /// Time for which the board has been cut off since then.
    pub(super) cut_off_secs: f64,
    /// Capture time of the newest frame since then.
    pub(super) newest_at: Option<CaptureTime>,
    /// Largest share of the picture that the board has spanned since then.
    pub(super) largest_span_fraction: f64,
    /// Views that the newest input removed.
    pub(super) just_removed: Vec<ViewNumber>,
    /// Take the next frame with a board, without any check.
    pub(super) force_next: bool,
    pub(super) live: Option<Arc<LiveView>>,
}

impl Tracking {
    /// Ends the hold: the next frame can't be compared with those before.
    pub(super) fn forget_motion(&mut self) {
        self.hold = None;
        self.motion.clear();
        self.patience = Patience::default();
        self.was_still = false;
        self.asked_secs = 0.0;
        self.cut_off_secs = 0.0;
        self.newest_at = None;
        self.largest_span_fraction = 0.0;
    }
}

impl Derived {
    pub(super) fn of(setup: &SessionSetup, ground: &Ground) -> Self {
        let Ground { accepted, seen, wanted_views, .. } = ground;
        let SessionSetup { board, image_size, .. } = setup;
        let solver =
            &CalibrationParams { noise_floor_px: seen.noise_px(), ..setup.calibration.clone() };
        let more = wanted_views.saturating_sub(accepted.len());
        let guidance = &seen.limits(&setup.guidance.after(accepted.len()), board, accepted);
        let corners: Vec<Vec<Corner>> =
            accepted.iter().map(|accepted| accepted.view.corners.clone()).collect();
        let calibration = (!corners.is_empty())
            .then(|| calibrate(&corners, board, *image_size, solver).map(Arc::new));
        let solved = calibration.as_ref().and_then(|result| result.as_deref().ok());
        let lens_estimate = lens_estimate(setup, solved, accepted.len(), seen.first_f_px);
        let measured: Vec<View> =
            accepted.iter().map(|accepted| remeasured(accepted, setup, &lens_estimate)).collect();
        let precision = solved.map(|solved| precision_of(solved, *image_size));
        let mut progress = progress(&measured, precision.as_ref(), guidance);
        if progress == Progress::Collecting && seen.given_up {
            progress = final_progress(precision.as_ref(), guidance);
        }
        let covers = (1..=MORE_VIEWS).contains(&more);
        let covering = seen.limits(&setup.guidance.for_coverage(), board, accepted);
        let target = match progress {
            _ if covers => covering_target(&measured, board, &lens_estimate, &covering),
            Progress::Collecting => {
                next_target(&measured, board, &lens_estimate, precision.as_ref(), guidance)
            }
            Progress::Complete | Progress::Exhausted => None,
        };
        let wants_more = covers && target.is_some();
        if wants_more {
            progress = Progress::Collecting;
        }
        if progress == Progress::Collecting && target.is_none() {
            progress = final_progress(precision.as_ref(), guidance);
        }
        let knowledge = Knowledge::new(&measured, board, &lens_estimate, guidance);
        let variance_after_target =
            variance_after(target.as_ref(), &knowledge, board, &lens_estimate);
        let far = guidance.is_far().then(|| FarBoard::of(board, &lens_estimate, seen, guidance));
        let held_out = held_out_pair(&measured, board, *image_size, solver);
        let views_to_go = match progress {
            Progress::Collecting => {
                let planned = forecast(&measured, precision.as_ref(), guidance);
                planned.max((more > 0).then_some(more))
            }
            Progress::Complete | Progress::Exhausted => None,
        };
        let (views, pairs) = summaries(accepted, &measured, board, &lens_estimate, solved);
        Self {
            lens_estimate,
            measured,
            progress,
            target,
            limits: if covers { covering } else { *guidance },
            wants_more,
            knowledge,
            variance_after_target,
            far: far.flatten(),
            held_out,
            precision,
            views_to_go,
            views,
            pairs,
            calibration,
        }
    }

    /// Draws the ghost of the pose asked for again, a step smaller.
    fn recede_target(&mut self, setup: &SessionSetup) {
        let Some(target) = &self.target else { return };
        let limits = Seen::receded_limits(target, setup.image_size, self.limits);
        let (board, precision) = (&setup.board, self.precision.as_ref());
        let (measured, lens) = (&self.measured, &self.lens_estimate);
        let smaller = if self.wants_more {
            covering_target(measured, board, lens, &limits)
        } else {
            next_target(measured, board, lens, precision, &limits)
        };
        if smaller.is_some() {
            self.target = smaller;
            self.variance_after_target =
                variance_after(self.target.as_ref(), &self.knowledge, board, &self.lens_estimate);
        }
    }

    /// True if the pose asked for is to cover what no board has covered.
    pub(super) fn covers_more(&self) -> bool {
        self.wants_more
            || self.target.as_ref().is_some_and(|target| target.purpose == Purpose::BeyondEdge)
    }

    pub(super) fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.calibration.as_ref().and_then(|result| result.as_ref().ok())
    }
}

fn variance_after(
    target: Option<&Target>,
    knowledge: &Knowledge,
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
) -> f64 {
    let pose = target.and_then(|target| {
        let ghost: Vec<Corner> =
            target.ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
        pose_of(&ghost, board, lens_estimate)
    });
    pose.map_or(f64::INFINITY, |pose| knowledge.variance_after(&pose, board, lens_estimate))
}

/// Lens estimate from the calibration or, up to the second view, a guess: one view fixes no lens.
fn lens_estimate(
    setup: &SessionSetup,
    solved: Option<&Calibration>,
    views: usize,
    first_f_px: Option<f64>,
) -> LensEstimate {
    let mut guess = LensEstimate::guess(setup.image_size);
    if let Some(known) = &setup.calibration.known_lens {
        guess.camera = known.camera();
        guess.known_covariance = Some(known.covariance());
        guess.covariance = guess.known_covariance;
    } else if let Some(f_px) = first_f_px {
        guess.camera = Camera::pinhole(f_px, guess.camera.pp_px);
    }
    match solved {
        Some(calibration) if views >= 2 => LensEstimate {
            camera: calibration.camera,
            covariance: Some(calibration.covariance),
            ..guess
        },
        _ => guess,
    }
}

/// The view through the newest lens estimate, or as accepted if that estimate has no ray for one of its corners.
fn remeasured(accepted: &AcceptedView, setup: &SessionSetup, lens_estimate: &LensEstimate) -> View {
    let view = &accepted.view;
    let frame = (view.frame_id, view.captured_at);
    match measure(frame, &view.corners, view.blur_px, &setup.board, lens_estimate) {
        Ok(again) => View { partner_frame: view.partner_frame, ..again },
        Err(_) => view.clone(),
    }
}

impl Session {
    /// A session without views.
    pub fn new(setup: SessionSetup) -> Self {
        let (ground, tracking) = (Ground::default(), Tracking::default());
        let derived = Derived::of(&setup, &ground);
        Self { setup: Arc::new(setup), ground, derived, tracking, calm: Calm::default() }
    }

    /// Recomputes [`Derived`] after the accepted views or [`Seen`] changed.
    pub(super) fn replan(&mut self) {
        self.ground.changes += 1;
        self.derived = Derived::of(&self.setup, &self.ground);
    }

    /// Lets the ghost of the pose asked for recede, because the board is cut off at it.
    pub(super) fn recede(&mut self) {
        if self.ground.seen.recede() {
            self.ground.changes += 1;
            self.derived.recede_target(&self.setup);
        }
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

    /// Progress of the session.
    pub fn progress(&self) -> Progress {
        self.derived.progress
    }

    /// The pose asked for; `None` if the session is over.
    pub fn target(&self) -> Option<&Target> {
        self.derived.target.as_ref()
    }

    /// Noise of one corner per axis, measured while the board was held: the standard deviation of the corners'
    /// residuals from the board's common motion between frames. `None` until a hold has shown enough of it.
    pub fn measured_noise_px(&self) -> Option<f64> {
        self.ground.seen.noise_px()
    }

    /// Workers that failed in this run, with the reason.
    pub fn failures(&self) -> &[(String, String)] {
        &self.ground.failures
    }

    /// The live camera, if the source is one.
    pub fn camera(&self) -> &CameraState {
        &self.ground.camera
    }

    /// Snapshot for a window or a terminal after `decision`.
    pub fn snapshot(&self, decision: Decision) -> Snapshot {
        let Self { setup, ground, derived, tracking, calm } = self;
        let lens = &derived.lens_estimate;
        Snapshot {
            setup: Arc::clone(setup),
            decision,
            shown: calm.shown(),
            live: tracking.live.clone(),
            target: derived.target.clone(),
            far: derived.far,
            held_out: derived.held_out,
            measured_noise_px: self.measured_noise_px(),
            pp_px: derived.calibration().map_or(setup.image_size.centre_px(), |c| c.camera.pp_px),
            pp_covariance_px2: lens.covariance.map(|_| lens.pp_covariance_px2()),
            lens: lens.camera,
            calibration: derived.calibration().cloned(),
            views: Arc::clone(&derived.views),
            pairs: Arc::clone(&derived.pairs),
            just_removed: tracking.just_removed.clone(),
            removed: ground.removed.last().map(|(_, accepted)| accepted.number),
            views_to_go: derived.views_to_go,
            camera: ground.camera.clone(),
            source_ended: ground.source_ended,
            paused: ground.paused,
            failures: ground.failures.clone(),
        }
    }
}
