//! State of a session in three parts: see [`super`].

use std::{collections::BTreeMap, sync::Arc};

use nalgebra::Isometry3;

use super::{
    accepted::AcceptedView,
    calm::Calm,
    camera::CameraState,
    decision::Decision,
    ending::Ending,
    far_board::FarBoard,
    held_out_pair::{HeldOutPair, held_out_pair},
    precision::precision_of,
    seen::Seen,
    setup::SessionSetup,
    snapshot::{LiveView, PairSummary, Snapshot, ViewSummary, summaries},
    view_number::ViewNumber,
};
use crate::guidance::{
    Difference, GuidanceParams, HOLD_WIDTHS_PER_SEC, Hold, Knowledge, Lack, LensEstimate,
    MotionWindow, Progress, Readout, Target, View, final_progress, forecast, lack, measure,
    next_target, pose_of, progress,
};
use boresight_calibrate::{Calibration, CalibrationParams, NotCalibrated, calibrate};
use boresight_geometry::{
    Camera, Corner,
    boards::Board,
    frame::{CaptureTime, FrameId, SceneScale},
};

/// Number of views for [`Command::TakeMore`](super::Command::TakeMore): a view and its partner.
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
    /// Removed views, to be restored newest first, each with the index among the accepted views.
    pub(super) removed: Vec<(usize, AcceptedView)>,
    pub(super) next_number: ViewNumber,
    /// Total number of views if the person asked for more than the plan.
    pub(super) wanted_views: usize,
    /// Number of changes of the accepted views or of the requested pose.
    pub(super) changes: u32,
    /// Facts shown by frames beside the accepted views.
    pub(super) seen: Seen,
    pub(super) paused: bool,
    pub(super) source_ended: bool,
    /// Failed workers of the run, with the reasons.
    pub(super) failures: Vec<(String, String)>,
    pub(super) camera: CameraState,
    /// Pose requested by a rig, if any; `None` without a rig.
    pub(super) lead: Option<Option<Target>>,
    /// Focal lengths of views by the scene behind the board.
    pub(super) scene: BTreeMap<ViewNumber, SceneScale>,
}

impl Ground {
    /// Pose requested by a rig.
    pub(super) fn led_to(&self) -> Option<&Target> {
        self.lead.as_ref()?.as_ref()
    }

    /// Focal length of each accepted view by the scene behind the board; empty if never asked.
    pub(super) fn scene(&self) -> Vec<Option<SceneScale>> {
        match self.scene.is_empty() {
            true => Vec::new(),
            false => self.accepted.iter().map(|it| self.scene.get(&it.number).copied()).collect(),
        }
    }
}

/// State derived from the setup, the accepted views and the frames.
#[derive(Clone, Debug)]
pub(super) struct Derived {
    pub(super) lens_estimate: LensEstimate,
    /// See [`Session::corners_at_one_instant`].
    pub(super) corners: Arc<[Vec<Corner>]>,
    /// `None` without a view.
    pub(super) calibration: Option<Result<Arc<Calibration>, NotCalibrated>>,
    /// Accepted views, measured through the lens estimate.
    pub(super) measured: Vec<View>,
    pub(super) progress: Progress,
    pub(super) target: Option<Target>,
    /// Limits behind the requested pose.
    pub(super) limits: GuidanceParams,
    /// See [`Snapshot::moved_px`].
    pub(super) moved_px: f64,
    /// Information of the accepted views.
    pub(super) knowledge: Knowledge,
    pub(super) target_pose: Option<Isometry3<f64>>,
    /// Reach of a board small in the picture.
    pub(super) far: Option<FarBoard>,
    /// Prediction of the newest pair by the earlier views.
    pub(super) held_out: Option<HeldOutPair>,
    pub(super) views_to_go: Option<usize>,
    /// Missing part of the session; `None` if nothing, or if nothing more can be done.
    pub(super) lack: Option<Lack>,
    /// True if the picture's corners are known too badly: see
    /// [`Precision::lacks_corners`].
    pub(super) lacks_corners: bool,
    pub(super) views: Arc<[ViewSummary]>,
    pub(super) pairs: Arc<[PairSummary]>,
}

/// State to connect frames; lost without harm.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracking {
    pub(super) motion: MotionWindow,
    pub(super) hold: Option<Hold>,
    /// Time with a board in the picture since the accepted views changed, pauses aside.
    pub(super) waited_secs: f64,
    /// The same since the pose was requested, holds aside.
    pub(super) asked_secs: f64,
    /// Time since then with the board cut off.
    pub(super) cut_off_secs: f64,
    /// Capture time of the newest frame since then.
    pub(super) newest_at: Option<CaptureTime>,
    /// Largest share of the picture spanned by the board since then.
    pub(super) largest_span_fraction: f64,
    /// Worth of each view of this run when it was taken; `None` if the person forced it.
    pub(super) shares: Vec<(ViewNumber, Option<f64>)>,
    /// Views removed by the newest input.
    pub(super) just_removed: Vec<ViewNumber>,
    /// Take the next frame with a board, without any check.
    pub(super) force_next: bool,
    pub(super) live: Option<Arc<LiveView>>,
    /// Difference of the newest frame's board from the requested pose.
    pub(super) off: Option<Difference>,
}

impl Tracking {
    /// Ends the hold and the waiting: the accepted views have changed.
    pub(super) fn start_over(&mut self) {
        self.waited_secs = 0.0;
        self.ask_anew();
    }

    /// Ends the hold: another pose is requested.
    pub(super) fn ask_anew(&mut self) {
        (self.hold, self.off) = (None, None);
        self.motion.clear();
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
        let solver = &CalibrationParams {
            noise_floor_px: seen.noise_px(),
            scene: ground.scene(),
            ..setup.calibration.clone()
        };
        let more = wanted_views.saturating_sub(accepted.len());
        let height_px = f64::from(image_size.height_px);
        let at_one_instant = |taken: &AcceptedView| {
            seen.readout.at_one_instant(&taken.seen, taken.velocity.as_ref(), height_px)
        };
        let corners: Arc<[Vec<Corner>]> = accepted.iter().map(at_one_instant).collect();
        let calibration = (!corners.is_empty())
            .then(|| calibrate(&corners, board, *image_size, solver).map(Arc::new));
        let solved = calibration.as_ref().and_then(|result| result.as_deref().ok());
        let lens_estimate = lens_estimate(setup, solved, accepted.len(), seen.first_f_px);
        let measured: Vec<View> = accepted
            .iter()
            .zip(&*corners)
            .map(|(taken, corners)| remeasured(&taken.view, corners, setup, &lens_estimate))
            .collect();
        let precision = solved.map(|solved| precision_of(solved, *image_size));
        let moved_px = common_px(&measured);
        let guidance = &seen.limits(&setup.guidance, board, accepted);
        let calm_px_per_s = HOLD_WIDTHS_PER_SEC * f64::from(image_size.width_px);
        let knowledge = Knowledge::new(&measured, board, &lens_estimate, guidance)
            .held_calmly(calm_px_per_s * seen.readout.sd_secs());
        let mut progress = progress(&measured, precision.as_ref(), guidance);
        if more > 0 {
            progress = Progress::Collecting;
        } else if progress == Progress::Collecting && seen.given_up {
            progress = final_progress(precision.as_ref(), guidance);
        }
        // A rig knows when its cameras are done.
        if ground.lead.is_some() {
            progress = Progress::Collecting;
        }
        let target = match progress {
            Progress::Collecting => ground.led_to().cloned().or_else(|| {
                next_target(&measured, &seen.tried_rad, board, &knowledge, &lens_estimate, guidance)
            }),
            Progress::Complete | Progress::Exhausted => None,
        };
        if progress == Progress::Collecting && target.is_none() && ground.lead.is_none() {
            progress = final_progress(precision.as_ref(), guidance);
        }
        let target_pose = pose_asked_for(target.as_ref(), board, &lens_estimate);
        let far = guidance
            .is_far()
            .then(|| FarBoard::of(&measured, board, &lens_estimate, seen, guidance));
        let held_out = held_out_pair(&measured, board, *image_size, solver);
        let views_to_go = match progress {
            Progress::Collecting => {
                let planned = forecast(&measured, precision.as_ref(), guidance);
                planned.max((more > 0).then_some(more))
            }
            Progress::Complete | Progress::Exhausted => None,
        };
        // Out of reach for a board small in the picture; whether or not boards beyond the edge are
        // still requested.
        let lacks_corners = !guidance.is_far()
            && precision.as_ref().is_some_and(|it| it.lacks_corners(&setup.guidance));
        let lack = (progress == Progress::Collecting)
            .then(|| lack(&measured, precision.as_ref(), guidance).unwrap_or(Lack::Views));
        let (views, pairs) = summaries(accepted, &measured, board, &lens_estimate, solved);
        Self {
            lens_estimate,
            measured,
            progress,
            target,
            limits: *guidance,
            moved_px,
            knowledge,
            target_pose,
            far: far.flatten(),
            held_out,
            views_to_go,
            lack,
            lacks_corners,
            views,
            pairs,
            calibration,
            corners,
        }
    }

    /// Draws the ghost of the requested pose again, a step smaller.
    fn recede_target(&mut self, setup: &SessionSetup, tried_rad: &[f64]) {
        let Some(target) = &self.target else { return };
        let limits = Seen::receded_limits(target, setup.image_size, self.limits);
        let (board, lens) = (&setup.board, &self.lens_estimate);
        let smaller = next_target(&self.measured, tried_rad, board, &self.knowledge, lens, &limits);
        if smaller.is_some() {
            self.target = smaller;
            self.target_pose = pose_asked_for(self.target.as_ref(), board, lens);
        }
    }

    pub(super) fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.calibration.as_ref().and_then(|result| result.as_ref().ok())
    }
}

fn pose_asked_for(
    target: Option<&Target>,
    board: &Board,
    lens_estimate: &LensEstimate,
) -> Option<Isometry3<f64>> {
    let ghost: Vec<Corner> =
        target?.ghost_px.iter().map(|px| Corner::isotropic(*px, 1.0)).collect();
    pose_of(&ghost, &board.corners_in_board_m(), lens_estimate)
}

/// Root mean square of the error common to the corners of a view, over all views.
fn common_px(views: &[View]) -> f64 {
    let seen = || views.iter().flat_map(|view| &view.corners).filter(|corner| corner.is_seen());
    let squares: f64 = seen().map(|corner| corner.common_px.powi(2)).sum();
    (squares / seen().count().max(1) as f64).sqrt()
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

/// View of the corners through the newest lens estimate, or as accepted if any corner lacks a ray.
fn remeasured(
    view: &View,
    corners: &[Corner],
    setup: &SessionSetup,
    lens_estimate: &LensEstimate,
) -> View {
    let frame = (view.frame_id, view.captured_at);
    match measure(frame, corners, view.blur_px, &setup.board, lens_estimate) {
        Ok(again) => {
            View { partner_frame: view.partner_frame, is_further: view.is_further, ..again }
        }
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

    /// Lets the ghost of the requested pose recede, because the board is cut off there.
    pub(super) fn recede(&mut self) {
        if self.ground.seen.recede() {
            self.ground.changes += 1;
            self.derived.recede_target(&self.setup, &self.ground.seen.tried_rad);
        }
    }

    /// See [`SessionSetup`].
    pub fn setup(&self) -> &SessionSetup {
        &self.setup
    }

    /// Accepted views, in the order of the calibration.
    pub fn accepted(&self) -> &[AcceptedView] {
        &self.ground.accepted
    }

    /// Corners of each accepted view as used by the calibration: at one instant, as far as the
    /// readout is known now. Those of [`AcceptedView::seen`] are sheared if the board moved.
    pub fn corners_at_one_instant(&self) -> &[Vec<Corner>] {
        &self.derived.corners
    }

    /// Calibration from the accepted views, if any.
    pub fn calibration(&self) -> Option<&Arc<Calibration>> {
        self.derived.calibration()
    }

    /// Reason for a missing calibration; `None` with a calibration, or without views.
    pub fn not_calibrated(&self) -> Option<&NotCalibrated> {
        self.derived.calibration.as_ref().and_then(|result| result.as_ref().err())
    }

    /// Frame to be taken if the hold were complete now. The recorder must keep its picture.
    pub fn frame_in_hand(&self) -> Option<FrameId> {
        self.tracking.hold.as_ref().map(|hold| hold.best.view.frame_id)
    }

    /// Progress of the session.
    pub fn progress(&self) -> Progress {
        self.derived.progress
    }

    /// Ending of the session, or the ending if stopped now.
    pub fn ending(&self) -> Ending {
        let has_failed = !self.ground.failures.is_empty();
        match self.derived.progress {
            Progress::Complete if self.derived.lacks_corners => Ending::WithoutCorners,
            Progress::Complete => Ending::Finished,
            Progress::Collecting if !has_failed => Ending::Early,
            Progress::Collecting | Progress::Exhausted => Ending::Stopped,
        }
    }

    /// Missing part of an unfinished session; `None` once over.
    pub fn lack(&self) -> Option<Lack> {
        self.derived.lack
    }

    /// The requested pose; `None` if the session is over.
    pub fn target(&self) -> Option<&Target> {
        self.derived.target.as_ref()
    }

    /// Limits and goals that apply now: those of the setup, as far as the frames allow.
    pub fn limits(&self) -> &GuidanceParams {
        &self.derived.limits
    }

    /// Noise of a corner per axis, measured while the board was held: the standard deviation of the
    /// corners' residuals from the board's common motion between frames. `None` until a hold has
    /// shown enough of it.
    pub fn measured_noise_px(&self) -> Option<f64> {
        self.ground.seen.noise_px()
    }

    /// Focal length of each accepted view by the scene behind the board; empty if never asked.
    #[doc(hidden)]
    pub fn scene(&self) -> Vec<Option<SceneScale>> {
        self.ground.scene()
    }

    /// Typical error of corners by the motion of the boards during the readout, in pixels.
    #[doc(hidden)]
    pub fn moved_px(&self) -> f64 {
        self.derived.moved_px
    }

    /// Readout time of the sensor's rows, as far as the moving board has shown.
    pub fn readout(&self) -> &Readout {
        &self.ground.seen.readout
    }

    /// Failed workers of the run, with the reasons.
    #[doc(hidden)]
    pub fn failures(&self) -> &[(String, String)] {
        &self.ground.failures
    }

    /// State of the live camera, if any.
    pub fn camera(&self) -> &CameraState {
        &self.ground.camera
    }

    /// Snapshot for a window or a terminal after `decision`.
    pub fn snapshot(&self, decision: Decision) -> Snapshot {
        let Self { setup, ground, derived, tracking, calm } = self;
        let lens = &derived.lens_estimate;
        Snapshot {
            setup: Arc::clone(setup),
            ending: self.ending(),
            lack: self.lack(),
            decision,
            shown: calm.shown(),
            hold: tracking.hold.as_ref().map(|hold| hold.progress(setup.guidance.hold_secs)),
            live: tracking.live.clone(),
            target: derived.target.clone(),
            limits: derived.limits,
            moved_px: derived.moved_px,
            far: derived.far,
            held_out: derived.held_out,
            measured_noise_px: self.measured_noise_px(),
            pp_px: derived.calibration().map_or(setup.image_size.centre_px(), |c| c.camera.pp_px),
            pp_covariance_px2: lens.covariance.map(|_| lens.pp_covariance_px2()),
            lens: lens.camera,
            calibration: derived.calibration().cloned(),
            views: Arc::clone(&derived.views),
            corners: Arc::clone(&derived.corners),
            pairs: Arc::clone(&derived.pairs),
            just_removed: tracking.just_removed.clone(),
            removed: ground.removed.last().map(|(_, accepted)| accepted.number),
            views_to_go: derived.views_to_go,
            camera: ground.camera.clone(),
            source_ended: ground.source_ended,
            paused: ground.paused,
            is_led: ground.lead.as_ref().map(Option::is_some),
            failures: ground.failures.clone(),
        }
    }
}
