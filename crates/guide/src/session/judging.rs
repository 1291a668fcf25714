//! Judges frames: refused with a reason, held, or taken.

use std::sync::Arc;

use super::{
    accepted::AcceptedView,
    decision::Outcome,
    input::Observation,
    snapshot::LiveView,
    state::{Session, Tracking},
    view_number::ViewNumber,
};
use crate::guidance::{
    Advice, Difference, HOLD_WIDTHS_PER_SEC, Hand, HeldFrame, Hold, Motion, Progress, Purpose,
    Refusal, Role, Velocity, View, advise, is_copy, is_enough, measure, newness, role_of,
    wanted_share,
};
use boresight_detect::Miss;
use boresight_geometry::{
    Corner,
    frame::{FrameKind, ImageSize},
};

/// Time with a board in the picture, after which the requested pose counts as impossible.
const TRIED_SECS: f64 = 7.0;
/// Number of poses without a further view, above which a board small in the picture is given up.
const GIVEN_UP_AFTER: usize = 2;
/// Time with the board cut off at the ghost, after which the ghost recedes.
const RECEDE_AFTER_SECS: f64 = 0.7;
/// Time in a good pose without being still, after which the person gets advice.
const ADVICE_SECS: f64 = 5.0;
/// Longest time credited to a frame: photographs in a folder are a second apart.
const LONGEST_STEP_SECS: f64 = 1.0;

/// Measurements of a frame, if any, and a role or refusal.
struct Judgement {
    view: Option<View>,
    role: Result<Worthy, Refusal>,
}

/// Role and gain of an acceptable view.
type Worthy = (Role, f64);

/// Motion of the board up to and within a frame.
#[derive(Clone, Copy, Default)]
struct Moves {
    motion: Option<Motion>,
    velocity: Option<Velocity>,
    /// Velocity as foreseen for the frames to come.
    foreseen: Option<Velocity>,
}

impl Session {
    /// Judges a frame and takes a view if complete. The advice is `None` if a view was taken.
    pub(super) fn judge_frame(&mut self, observation: &Observation) -> (Outcome, Option<Advice>) {
        let step_secs = self.note_time(observation);
        let moves = self.note_motion(observation);
        let motion = moves.motion;
        let speed_px_per_s = motion.map(|motion| motion.speed_px_per_s);
        let Judgement { view, role } = self.judge(observation, &moves);
        // A further view is taken in passing: nobody is asked to hold it.
        let is_further = matches!(role, Ok((Role::Further, _)));
        let pp_px = &self.derived.lens_estimate.camera.pp_px;
        let live = LiveView::of(observation, view.as_ref(), speed_px_per_s, pp_px);
        self.tracking.live = Some(Arc::new(live));
        let refusal = match (role, &view, &observation.seen) {
            (Ok((role, gain)), Some(view), Ok(seen)) => {
                if let Some(motion) = motion
                    && observation.kind == FrameKind::Video
                {
                    self.ground.seen.noise.add(motion.scatter);
                }
                let is_rigid = motion.is_some_and(|motion| motion.is_rigid);
                let frame = HeldFrame {
                    view: view.clone(),
                    seen: seen.corners.clone(),
                    velocity: moves.velocity,
                    role,
                    name: observation.name.clone(),
                    is_rigid,
                    gain,
                };
                if let Some(accepted) = self.hold_on(observation.kind, frame) {
                    return (accepted, None);
                }
                let wanted_secs = self.setup.guidance.hold_secs;
                let hold = self.tracking.hold.as_ref();
                Refusal::Holding { progress: hold.map_or(0.0, |hold| hold.progress(wanted_secs)) }
            }
            (Ok(_), ..) => Refusal::NotFound,
            (Err(refusal), ..) => {
                self.fade_hold(observation);
                refusal
            }
        };
        if !self.ground.paused && observation.kind == FrameKind::Video {
            self.adapt_target(observation, view.as_ref(), &refusal, step_secs);
        }
        let target = self.derived.target.as_ref();
        self.tracking.off = view.as_ref().zip(target).map(|(view, it)| Difference::of(view, it));
        let calm_px_per_s = HOLD_WIDTHS_PER_SEC * self.width_px();
        let hand = Hand {
            has_stopped: !is_further && speed_px_per_s.is_some_and(|speed| speed <= calm_px_per_s),
            needs_support: self.tracking.waited_secs >= ADVICE_SECS,
        };
        let advice = advise(view.as_ref(), &refusal, target, hand);
        (Outcome::Refused { refusal }, Some(advice))
    }

    fn width_px(&self) -> f64 {
        f64::from(self.setup.image_size.width_px)
    }

    /// Advances the time waited for a view and for the requested pose, if a board is in the picture
    /// and capture isn't paused. Returns the time since the frame before, as far as it counts.
    fn note_time(&mut self, observation: &Observation) -> f64 {
        let Tracking { waited_secs, asked_secs, newest_at, hold, .. } = &mut self.tracking;
        let now = observation.captured_at;
        let passed_secs = newest_at.replace(now).map(|then| now.secs_since(then));
        let step_secs = passed_secs.unwrap_or(0.0).clamp(0.0, LONGEST_STEP_SECS);
        let is_there = matches!(observation.seen, Ok(_) | Err(Miss::PartialBoard { .. }));
        if is_there && !self.ground.paused {
            *waited_secs += step_secs;
            *asked_secs += if hold.is_some() { 0.0 } else { step_secs };
        }
        if let Ok(seen) = &observation.seen
            && observation.kind == FrameKind::Video
        {
            self.ground.seen.note_found(&seen.corners, passed_secs);
        }
        step_secs
    }

    /// Motion of the board up to and within the frame. The frame becomes the newest one to compare
    /// with. The frame before, whose velocity is known better now, updates the readout if the lens
    /// is known.
    fn note_motion(&mut self, observation: &Observation) -> Moves {
        let now = observation.captured_at;
        let window = &mut self.tracking.motion;
        let Ok(seen) = &observation.seen else {
            window.clear();
            return Moves::default();
        };
        if observation.kind == FrameKind::Photograph {
            window.clear();
            return Moves::default();
        }
        let motion = window.motion(now, &seen.corners);
        window.push(now, &seen.corners);
        let lens_estimate = &self.derived.lens_estimate;
        if let Some((then, corners)) = window.before_newest()
            && let Some(velocity) = window.velocity(then)
            && lens_estimate.covariance.is_some()
        {
            let points_m = self.derived.knowledge.points_m();
            self.ground.seen.readout.add(corners, &velocity, points_m, lens_estimate);
        }
        if let Some(hold) = &mut self.tracking.hold {
            let best = &mut hold.best;
            best.velocity = window.velocity(best.view.captured_at).or(best.velocity);
        }
        let (velocity, foreseen) = (window.velocity(now), window.velocity_foreseen(now));
        Moves { motion, velocity, foreseen }
    }

    /// Asks for another pose if the requested pose turns out impossible: the board is cut off
    /// there, the lens differs from the estimate, the board comes no nearer, or nothing came for
    /// long.
    fn adapt_target(
        &mut self,
        observation: &Observation,
        view: Option<&View>,
        refusal: &Refusal,
        step_secs: f64,
    ) {
        if *refusal == Refusal::NotCollecting {
            return;
        }
        let image_size = self.setup.image_size;
        if let Some(view) = view {
            let largest = &mut self.tracking.largest_span_fraction;
            *largest = largest.max(view.board_span_fraction(image_size));
            let (derived, seen) = (&self.derived, &mut self.ground.seen);
            if self.ground.accepted.is_empty()
                && seen.note_first_focal(view, &derived.lens_estimate)
            {
                self.replan();
                return;
            }
        }
        if self.ground.led_to().is_some() {
            return;
        }
        // A view about to be taken isn't lost, nor the session ended over it.
        if self.tracking.asked_secs >= TRIED_SECS && self.tracking.hold.is_none() {
            self.ask_for_another();
            return;
        }
        let leaves_picture = self.derived.target.as_ref().is_some_and(|it| it.leaves_picture);
        let is_cut_off =
            matches!(observation.seen, Err(Miss::PartialBoard { cut_off_by: Some(_), .. }));
        let cut_off_secs = &mut self.tracking.cut_off_secs;
        *cut_off_secs += if is_cut_off && !leaves_picture { step_secs } else { 0.0 };
        if *cut_off_secs >= RECEDE_AFTER_SECS {
            *cut_off_secs = 0.0;
            self.recede();
        }
    }

    /// Asks for another pose. A board never shown beyond the picture's edge stays inside, a board
    /// that comes no nearer than it has isn't asked to, and a direction not shown is left for
    /// another one.
    fn ask_for_another(&mut self) {
        let Some(target) = &self.derived.target else { return };
        let seen = &mut self.ground.seen;
        let largest = self.tracking.largest_span_fraction;
        if target.leaves_picture {
            seen.stays_inside = true;
        } else if !seen.note_small(largest, target, self.setup.image_size) {
            seen.tried_rad.push(target.tilt_azimuth_rad);
            let is_hopeless = seen.tried_rad.len() > GIVEN_UP_AFTER;
            // Directions tried long ago may be tried again.
            seen.tried_rad.drain(..usize::from(is_hopeless));
            seen.given_up |=
                is_hopeless && self.derived.limits.is_far() && !self.ground.accepted.is_empty();
        }
        self.replan();
        self.tracking.ask_anew();
    }

    fn fade_hold(&mut self, observation: &Observation) {
        let width_px = self.width_px();
        let is_same_pose = |hold: &Hold| match &observation.seen {
            Ok(seen) => hold.covers(&seen.corners, width_px),
            Err(_) => true,
        };
        self.tracking.hold = self.tracking.hold.take().and_then(|mut hold| {
            (is_same_pose(&hold) && hold.fade(observation.captured_at)).then_some(hold)
        });
    }

    fn judge(&mut self, observation: &Observation, moves: &Moves) -> Judgement {
        let unmeasured = |refusal| Judgement { view: None, role: Err(refusal) };
        let setup = &self.setup;
        if observation.image_size != setup.image_size {
            let pair = |size: ImageSize| (size.width_px, size.height_px);
            let (size_px, wanted_px) = (pair(observation.image_size), pair(setup.image_size));
            return unmeasured(Refusal::OtherSize { size_px, wanted_px });
        }
        if !self.ground.camera.may_take_of(observation.captured_at) {
            return unmeasured(Refusal::CameraNotReady);
        }
        let view = match self.measured(observation, moves.foreseen.as_ref()) {
            Ok(view) => view,
            Err(refusal) => return unmeasured(refusal),
        };
        let role = if std::mem::take(&mut self.tracking.force_next) {
            Ok((Role::Forced, self.gain(&view, true)))
        } else {
            let speed_px_per_s = moves.motion.map(|motion| motion.speed_px_per_s);
            self.role(&view, observation.kind, speed_px_per_s)
        };
        Judgement { view: Some(view), role }
    }

    /// Measurements of a frame, with the corners at a common instant.
    fn measured(
        &self,
        observation: &Observation,
        velocity: Option<&Velocity>,
    ) -> Result<View, Refusal> {
        let seen = observation.seen.as_ref().map_err(|_| Refusal::NotFound)?;
        let frame = (observation.frame_id, observation.captured_at);
        let height_px = f64::from(self.setup.image_size.height_px);
        let readout = &self.ground.seen.readout;
        let corners = readout.at_one_instant(&seen.corners, velocity, height_px);
        let (board, lens_estimate) = (&self.setup.board, &self.derived.lens_estimate);
        measure(frame, &corners, seen.quality.blur_px, board, lens_estimate)
    }

    /// Role of an acceptable view, the hold and forced views aside. Its gain is at least a share of
    /// the requested pose's, decreasing with the time waited. A photograph's principal line must
    /// also be independent of all accepted ones, or be the missing partner of one.
    fn role(
        &self,
        view: &View,
        kind: FrameKind,
        speed_px_per_s: Option<f64>,
    ) -> Result<Worthy, Refusal> {
        if self.ground.paused || self.derived.progress != Progress::Collecting {
            return Err(Refusal::NotCollecting);
        }
        let derived = &self.derived;
        let (role, share) = if self.ground.led_to().is_some() {
            // A rig needs places of the board, not directions of one camera's lines.
            (Role::NewDirection, 1.0)
        } else {
            let is_copy = || is_copy(view, &derived.measured, self.width_px());
            match role_of(view, &derived.measured, &derived.lens_estimate, &self.setup.guidance) {
                Err(Refusal::AlreadyCovered { nearest_rad, wanted_rad })
                    if kind == FrameKind::Video && !is_copy() =>
                {
                    (Role::Further, (nearest_rad / wanted_rad).powi(2))
                }
                role => (role?, 1.0),
            }
        };
        let gain = self.gain(view, true);
        // A photograph was chosen by the person, and comes only once.
        if kind == FrameKind::Photograph {
            return Ok((role, gain));
        }
        let wanted = wanted_share(self.tracking.waited_secs, self.shown());
        let worth_of = self.worth_of(view);
        let worth = share * worth_of(gain);
        if is_enough(worth, wanted) {
            return Ok((role, gain));
        }
        if is_enough(share * worth_of(self.gain(view, false)), wanted) {
            let wanted_px_per_s = HOLD_WIDTHS_PER_SEC * self.width_px();
            return Err(Refusal::Moving { speed_px_per_s, wanted_px_per_s });
        }
        Err(Refusal::TellsLittle { worth, wanted })
    }

    /// Gain of a view, as moved or as if still.
    fn gain(&self, view: &View, as_moved: bool) -> f64 {
        let knowledge = &self.derived.knowledge;
        knowledge.gain_by_the_end(&knowledge.seen(&view.corners, as_moved))
    }

    /// Worth of the last view of this run when it was taken; `None` if the person forced it, or
    /// without such a view. A removed view doesn't count.
    fn shown(&self) -> Option<f64> {
        let is_kept = |of| self.ground.accepted.iter().any(|taken| taken.number == of);
        let (_, share) = self.tracking.shares.iter().rfind(|(of, _)| is_kept(*of))?;
        *share
    }

    /// Turns a gain of `view` into its worth: its share of what the pose asked for would tell now,
    /// or of what a planned view tells if no pose fits the ghost.
    fn worth_of(&self, view: &View) -> impl Fn(f64) -> f64 + use<> {
        let knowledge = &self.derived.knowledge;
        let usual = knowledge.usual(Some(view));
        let pose = self.derived.target_pose.as_ref();
        let asked = pose.map(|pose| knowledge.gain_by_the_end(&knowledge.at(pose, usual)));
        let best = asked.filter(|gain| *gain > 0.0).unwrap_or_else(|| knowledge.planned_gain());
        let newness = newness(view, &self.derived.measured, self.width_px());
        move |gain| match (gain > 0.0, best > 0.0) {
            (true, true) => gain * newness / best,
            (true, false) => newness,
            (false, _) => 0.0,
        }
    }

    /// Adds a good frame to the hold; takes the best once the hold is complete.
    fn hold_on(&mut self, kind: FrameKind, frame: HeldFrame) -> Option<Outcome> {
        let (width_px, role) = (self.width_px(), frame.role);
        let (is_led, is_forced) = (self.ground.lead.is_some(), role == Role::Forced);
        let hold = match self.tracking.hold.take() {
            // The pictures of several cameras are of one moment: no earlier frame will do.
            Some(_) if is_led && is_forced => Hold::start(frame),
            Some(mut hold) if hold.covers(&frame.view.corners, width_px) => {
                hold.add(frame);
                hold
            }
            _ => Hold::start(frame),
        };
        let is_held =
            kind == FrameKind::Photograph || hold.is_complete(self.setup.guidance.hold_secs);
        let complete = is_forced || (is_held && !is_led);
        if !complete {
            self.tracking.hold = Some(hold);
            return None;
        }
        let HeldFrame { view, seen, velocity, role, name, gain, .. } = hold.best;
        let share = (role != Role::Forced).then(|| self.worth_of(&view)(gain));
        self.tracking.shares.push((self.ground.next_number, share));
        let (number, frame) = (self.ground.next_number, view.frame_id.0);
        let was_beyond_edge = false;
        let taken = AcceptedView { number, name, role, was_beyond_edge, view, seen, velocity };
        self.accept(taken);
        Some(Outcome::Accepted { view: number, frame, role })
    }

    /// Accepts the view of `observation` as `number`, as recorded by an earlier build, without
    /// judging.
    ///
    /// # Errors
    ///
    /// The [`Refusal`] if the observation measures nothing.
    pub fn accept_recorded(
        &mut self,
        observation: &Observation,
        number: ViewNumber,
        role: Role,
    ) -> Result<(), Refusal> {
        let view = self.measured(observation, None)?;
        let (name, seen) = (observation.name.clone(), view.corners.clone());
        let (velocity, was_beyond_edge) = (None, false);
        let taken = AcceptedView { number, name, role, was_beyond_edge, view, seen, velocity };
        self.accept(taken);
        Ok(())
    }

    fn accept(&mut self, mut taken: AcceptedView) {
        if let Role::Partner { of } = taken.role {
            let partner = self.ground.accepted.get(of);
            taken.view.partner_frame = partner.map(|partner| partner.view.frame_id);
        }
        taken.view.is_further = taken.role == Role::Further;
        self.ground.next_number = self.ground.next_number.max(taken.number.next());
        let (target, image_size) = (self.derived.target.as_ref(), self.setup.image_size);
        self.ground.seen.note_accepted(&taken.view, target, image_size);
        let was_asked = target.is_some_and(|target| target.purpose == Purpose::BeyondEdge);
        taken.was_beyond_edge = was_asked && !taken.seen.iter().all(Corner::is_seen);
        self.ground.accepted.push(taken);
        self.replan();
        self.tracking.start_over();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::{guidance::GuidanceParams, session::SessionSetup};
    use boresight_calibrate::CalibrationParams;
    use boresight_geometry::{
        boards::Board,
        frame::{CaptureTime, FrameId},
    };

    #[test]
    fn a_ghost_that_no_pose_fits_makes_no_view_worth_everything() {
        let board = Board::new(9, 6, 0.025).expect("valid");
        let image_size = ImageSize { width_px: 1280, height_px: 720 };
        let mut session = Session::new(SessionSetup {
            board,
            image_size,
            guidance: GuidanceParams::default(),
            calibration: CalibrationParams::default(),
        });
        let lens_estimate = session.derived.lens_estimate.clone();
        let turned = Vector3::new(0.5, -0.3, 0.0);
        // A small board tells little.
        let pose = Isometry3::new(Vector3::new(0.0, 0.0, 1.5), turned);
        let px = |point| lens_estimate.camera.px_from_board(&pose, point).expect("in front");
        let points_m = board.corners_in_board_m();
        let corners: Vec<Corner> =
            points_m.iter().map(|point| Corner::isotropic(px(point), 0.05)).collect();
        let frame = (FrameId(0), CaptureTime { nanos: 0 });
        let view = measure(frame, &corners, 0.8, &board, &lens_estimate).expect("a board");
        let gain = session.gain(&view, true);
        let fitted = session.worth_of(&view)(gain);
        session.derived.target_pose = None;
        let (nothing, little) = (session.worth_of(&view)(0.0), session.worth_of(&view)(gain));
        assert_eq!(nothing, 0.0);
        assert!(0.0 < little && little < 0.1 && fitted < 0.1, "{little} {fitted}");
    }
}
