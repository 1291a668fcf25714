//! Judges frames: refused with a reason, held, or taken.

use std::sync::Arc;

use super::{
    accepted::AcceptedView,
    decision::Outcome,
    input::Observation,
    setup::SessionSetup,
    snapshot::LiveView,
    state::{Session, Tracking},
    view_number::ViewNumber,
};
use crate::guidance::{
    Advice, GuidanceParams, HeldFrame, Hold, Motion, Progress, Purpose, Refusal, Role, Smear,
    StillLimits, View, advise, covering_share, gate,
    hold::wanted_secs,
    measure, role_of, still,
    worth::{is_followed, least_share},
};
use boresight_detect::Miss;
use boresight_geometry::{
    Corner,
    frame::{FrameKind, ImageSize},
};

/// Largest multiple of a partner's limit …
const MOST_EASE: f64 = 4.0;
/// … which grows by one each time this long has passed.
const EASE_SECS: f64 = 3.0;
/// The least angle between independent lines relaxes to this …
const EASED_INDEPENDENT_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// … within this time …
const EASED_WITHIN_SECS: f64 = 2.0;
/// … for someone who hasn't followed the ghost for this long, or didn't for the last view.
const UNFOLLOWED_SECS: f64 = 4.0;
/// Speed limit multiplier for a person who ignores the outline.
const UNFOLLOWED_MOTION: f64 = 1.3;

/// The limits after a pose has been asked for during `waited_secs`: a partner may be farther off its place, and
/// lines that differ significantly count as independent at a smaller angle, from a less tilted board. `unfollowed` counts
/// the views that weren't shown by someone who follows the ghost. Through a lens that is only guessed, and may be much
/// wider, a tilt is a guess, too: in the end any counts.
fn eased(
    guidance: &GuidanceParams,
    waited_secs: f64,
    unfollowed: u32,
    is_guessed: bool,
) -> GuidanceParams {
    let late_secs = if unfollowed > 0 { 0.0 } else { UNFOLLOWED_SECS };
    let share = ((waited_secs - late_secs) / EASED_WITHIN_SECS).clamp(0.0, 1.0);
    let least_rad = EASED_INDEPENDENT_RAD.min(guidance.independent_rad);
    let less_tilt = if is_guessed { 1.0 } else { 0.5 };
    GuidanceParams {
        partner_offset_px: guidance.partner_offset_px
            * (1.0 + waited_secs / EASE_SECS).clamp(1.0, MOST_EASE),
        independent_rad: guidance.independent_rad + share * (least_rad - guidance.independent_rad),
        min_tilt_rad: guidance.min_tilt_rad * (1.0 - less_tilt * share),
        ..*guidance
    }
}

/// Least share of what the ghost would cover, at first …
const COVERED: f64 = 0.8;
/// … which falls by as much each time this long has passed, down to the least.
const COVERED_STEP: (f64, f64) = (0.1, 3.0);
const COVERED_LEAST: f64 = 0.4;

/// Least share of what the ghost would cover at which a view is taken that is to cover more of the picture.
fn least_covered(waited_secs: f64) -> f64 {
    let (step, every_secs) = COVERED_STEP;
    (COVERED - step * waited_secs.max(0.0) / every_secs).max(COVERED_LEAST)
}

/// A ghost recedes after the board has been cut off at it for this long.
const RECEDE_AFTER_SECS: f64 = 0.7;
/// Give up on a far board after this long without a new view: its lines are too uncertain to differ.
const GIVEN_UP_SECS: f64 = 30.0;
/// Give up on poses beyond the picture's edge after this long without one, or after this long cut off and unidentified.
const BEYOND_EDGE_WITHIN_SECS: f64 = 20.0;
const LOST_BEYOND_EDGE_SECS: f64 = 6.0;
/// A board that hasn't come nearer within this time won't.
const NEARER_WITHIN_SECS: f64 = 8.0;
/// No frame counts for longer than this, however long ago the one before came: photographs in a folder are a second apart.
const LONGEST_STEP_SECS: f64 = 1.0;

/// What a frame measures, if anything, and its role or why it is refused.
struct Judgement {
    view: Option<View>,
    role: Result<Role, Refusal>,
}

impl Session {
    /// Judges a frame and takes the view that it completes. The advice is `None` if a view was taken.
    pub(super) fn judge_frame(&mut self, observation: &Observation) -> (Outcome, Option<Advice>) {
        let now = observation.captured_at;
        let step_secs = self.note_time(observation);
        let motion = self.note_motion(observation);
        let exposure_secs = self.exposure_secs();
        let smear = motion.map(|motion| Smear::of(&motion, exposure_secs));
        let Judgement { view, role } = self.judge(observation, smear.as_ref());
        let pp_px = &self.derived.lens_estimate.camera.pp_px;
        let live = LiveView::of(observation, view.as_ref(), smear, pp_px);
        self.tracking.live = Some(Arc::new(live));
        self.tracking.was_still = role.is_ok();
        let refusal = match (role, &view) {
            (Ok(role), Some(view)) => {
                if let Some(motion) = motion
                    && observation.kind == FrameKind::Video
                {
                    self.ground.seen.noise.add(motion.scatter);
                }
                let is_rigid = motion.is_some_and(|motion| motion.is_rigid);
                let name = observation.name.clone();
                let frame = HeldFrame { view: view.clone(), role, name, is_rigid, smear };
                if let Some(accepted) = self.hold_on(observation.kind, frame) {
                    return (accepted, None);
                }
                let wanted_secs = self.wanted_hold_secs();
                let hold = self.tracking.hold.as_ref();
                Refusal::Holding { progress: hold.map_or(0.0, |hold| hold.progress(wanted_secs)) }
            }
            (Ok(_), None) => Refusal::NotFound,
            (Err(refusal), _) => {
                self.fade_hold(observation);
                refusal
            }
        };
        self.adapt_target(observation, view.as_ref(), &refusal, step_secs);
        let target = self.derived.target.as_ref();
        let needs_support = self.tracking.patience.needs_advice(now);
        let advice = advise(view.as_ref(), &refusal, target, needs_support, &self.setup.guidance);
        (Outcome::Refused { refusal }, Some(advice))
    }

    fn width_px(&self) -> f64 {
        f64::from(self.setup.image_size.width_px)
    }

    /// Lets the time go on for which the pose has been asked for, if a board is in the picture. The time since the frame
    /// before, as far as it counts.
    fn note_time(&mut self, observation: &Observation) -> f64 {
        let Tracking { asked_secs, newest_at, .. } = &mut self.tracking;
        let now = observation.captured_at;
        let passed_secs = newest_at.replace(now).map(|then| now.secs_since(then));
        let step_secs = passed_secs.unwrap_or(0.0).clamp(0.0, LONGEST_STEP_SECS);
        if let Ok(seen) = &observation.seen {
            *asked_secs += if self.ground.paused { 0.0 } else { step_secs };
            if observation.kind == FrameKind::Video {
                self.ground.seen.note_found(&seen.corners, passed_secs);
            }
        }
        step_secs
    }

    /// How the board moved up to this frame, which becomes the newest one to compare with. `None` without a board
    /// or an earlier frame.
    fn note_motion(&mut self, observation: &Observation) -> Option<Motion> {
        let now = observation.captured_at;
        let Tracking { motion: window, exposure, .. } = &mut self.tracking;
        let Ok(seen) = &observation.seen else {
            window.clear();
            exposure.add(now, None, 0.0);
            return None;
        };
        let motion = window.motion(now, &seen.corners);
        window.push(now, &seen.corners);
        exposure.add(now, motion.as_ref(), seen.quality.blur_px);
        motion
    }

    /// How long the shutter is open: the driver's value, or else the estimate from blur and speed.
    fn exposure_secs(&self) -> f64 {
        self.ground.camera.exposure_secs().unwrap_or_else(|| self.tracking.exposure.secs())
    }

    /// Asks for another pose if frames show that this one can't be shown: the board is cut off at it, the lens isn't
    /// as believed, or the board comes no nearer.
    fn adapt_target(
        &mut self,
        observation: &Observation,
        view: Option<&View>,
        refusal: &Refusal,
        step_secs: f64,
    ) {
        let is_paused = self.ground.paused || *refusal == Refusal::NotCollecting;
        if observation.kind == FrameKind::Photograph || is_paused {
            return;
        }
        let image_size = self.setup.image_size;
        let cut_off = matches!(refusal, Refusal::AtTheEdge { .. })
            || matches!(observation.seen, Err(Miss::PartialBoard { cut_off_by: Some(_), .. }));
        let seen = &mut self.ground.seen;
        let Tracking { asked_secs, cut_off_secs, largest_span_fraction, .. } = &mut self.tracking;
        let waited_secs = *asked_secs;
        if self.derived.limits.is_far()
            && observation.seen.is_ok()
            && !self.ground.accepted.is_empty()
            && waited_secs >= GIVEN_UP_SECS
        {
            seen.given_up = true;
            self.replan();
            return;
        }
        *cut_off_secs += if cut_off { step_secs } else { 0.0 };
        if self.derived.target.as_ref().is_some_and(|target| target.leaves_picture) {
            if waited_secs >= BEYOND_EDGE_WITHIN_SECS || *cut_off_secs >= LOST_BEYOND_EDGE_SECS {
                seen.stays_inside = true;
                self.replan();
                self.tracking.forget_motion();
            }
            return;
        }
        if *cut_off_secs >= RECEDE_AFTER_SECS {
            *cut_off_secs = 0.0;
            self.recede();
            return;
        }
        let Some(view) = view else { return };
        *largest_span_fraction = largest_span_fraction.max(view.board_span_fraction(image_size));
        let largest_span_fraction = *largest_span_fraction;
        let (derived, seen) = (&self.derived, &mut self.ground.seen);
        if self.ground.accepted.is_empty() && seen.note_first_focal(view, &derived.lens_estimate) {
            self.replan();
            return;
        }
        let Some(target) = &self.derived.target else { return };
        if waited_secs >= NEARER_WITHIN_SECS
            && self.ground.seen.note_small(largest_span_fraction, target, image_size)
        {
            self.replan();
            self.tracking.forget_motion();
        }
    }

    fn wanted_hold_secs(&self) -> f64 {
        wanted_secs(self.tracking.asked_secs, self.ground.unfollowed, &self.setup.guidance)
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

    fn judge(&mut self, observation: &Observation, smear: Option<&Smear>) -> Judgement {
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
        let view = match self.measured(observation) {
            Ok(view) => view,
            Err(refusal) => return unmeasured(refusal),
        };
        let role = if std::mem::take(&mut self.tracking.force_next) {
            Ok(Role::Forced)
        } else {
            self.role(&view, observation.kind, smear)
        };
        Judgement { view: Some(view), role }
    }

    fn measured(&self, observation: &Observation) -> Result<View, Refusal> {
        let seen = observation.seen.as_ref().map_err(|_| Refusal::NotFound)?;
        let frame = (observation.frame_id, observation.captured_at);
        let lens_estimate = &self.derived.lens_estimate;
        measure(frame, &seen.corners, seen.quality.blur_px, &self.setup.board, lens_estimate)
    }

    /// The role of a view that the person didn't force.
    fn role(
        &mut self,
        view: &View,
        kind: FrameKind,
        smear: Option<&Smear>,
    ) -> Result<Role, Refusal> {
        if self.ground.paused || self.derived.progress != Progress::Collecting {
            return Err(Refusal::NotCollecting);
        }
        let now = view.captured_at;
        let role = self.offered_role(view, kind);
        self.tracking.patience.note(now, role.is_ok());
        let role = role?;
        let unfollowed = self.ground.unfollowed > 0 || self.tracking.asked_secs > UNFOLLOWED_SECS;
        let eased = if unfollowed { UNFOLLOWED_MOTION } else { 1.0 };
        let relaxed = self.tracking.patience.factor(now).max(eased);
        let SessionSetup { image_size, guidance, .. } = &*self.setup;
        let limits = StillLimits::new(*image_size, guidance, relaxed, self.tracking.was_still);
        still(kind, smear, &limits)?;
        Ok(role)
    }

    /// The role of a view by its pose alone, whatever its motion: any open direction or partner counts, not only the
    /// one asked for. The longer nothing better comes, the less it must tell, and the farther a partner may be off.
    fn offered_role(&self, view: &View, kind: FrameKind) -> Result<Role, Refusal> {
        let derived = &self.derived;
        let guidance = &if derived.covers_more() {
            self.setup.guidance.for_coverage()
        } else {
            self.setup.guidance.after(self.ground.accepted.len())
        };
        let waited_secs = self.tracking.asked_secs;
        // A photograph was chosen, and is offered once.
        let least_share = match kind {
            FrameKind::Photograph => 0.0,
            FrameKind::Video => least_share(waited_secs, self.ground.unfollowed),
        };
        let is_guessed = derived.lens_estimate.covariance.is_none();
        let eased = eased(guidance, waited_secs, self.ground.unfollowed, is_guessed);
        let gated = gate(view, &eased);
        if gated.is_err() && gate(view, &eased.for_partner()).is_err() {
            gated?;
        }
        let role = role_of(view, &derived.measured, &derived.lens_estimate, &eased)?;
        if !matches!(role, Role::Partner { .. }) {
            gated?;
        }
        let (worth, wanted) = match self.covers(view) {
            // A photograph was chosen.
            Some(share) if kind == FrameKind::Video => (share, least_covered(waited_secs)),
            _ => (self.worth(view), least_share),
        };
        // A whole board on its way to where it should leave the picture isn't what was asked for, however long that takes.
        let leaves_picture = derived.target.as_ref().is_some_and(|target| target.leaves_picture);
        let is_whole = view.corners.iter().all(Corner::is_seen);
        if leaves_picture && is_whole && role == Role::NewDirection && kind == FrameKind::Video {
            return Err(Refusal::TellsLittle { worth: worth.min(1.0), wanted: 1.0 });
        }
        if worth < wanted { Err(Refusal::TellsLittle { worth, wanted }) } else { Ok(role) }
    }

    /// What a view covers, as a share of what the pose asked for would; `None` unless that is what it's for.
    fn covers(&self, view: &View) -> Option<f64> {
        let derived = &self.derived;
        let target = derived.target.as_ref().filter(|_| derived.covers_more())?;
        let (ghost, size) = (&target.ghost_px, self.setup.image_size);
        Some(covering_share(view, ghost, &derived.measured, &self.setup.board, size))
    }

    /// What a view tells, as a share of what the pose asked for would.
    fn worth(&self, view: &View) -> f64 {
        let (derived, board) = (&self.derived, &self.setup.board);
        let lens = &derived.lens_estimate;
        let after = derived.knowledge.variance_after_seen(&view.corners, board, lens);
        derived.knowledge.share(after, derived.variance_after_target)
    }

    /// Adds a good frame to the hold; takes the sharpest once the hold is complete.
    fn hold_on(&mut self, kind: FrameKind, frame: HeldFrame) -> Option<Outcome> {
        let (width_px, role) = (self.width_px(), frame.role);
        let hold = match self.tracking.hold.take() {
            Some(mut hold) if hold.covers(&frame.view.corners, width_px) => {
                hold.add(frame);
                hold
            }
            _ => Hold::start(frame),
        };
        let complete = kind == FrameKind::Photograph
            || role == Role::Forced
            || hold.is_complete(self.wanted_hold_secs());
        if !complete {
            self.tracking.hold = Some(hold);
            return None;
        }
        let HeldFrame { view, role, name, .. } = hold.best;
        let wanted_rad = self.derived.target.as_ref().map(|target| target.tilt_azimuth_rad);
        let follows = role == Role::Forced || is_followed(&view, self.worth(&view), wanted_rad);
        self.ground.unfollowed =
            if follows { self.ground.unfollowed / 2 } else { self.ground.unfollowed + 1 };
        let (number, frame) = (self.ground.next_number, view.frame_id.0);
        self.accept(number, name, role, view);
        Some(Outcome::Accepted { view: number, frame, role })
    }

    /// Accepts the view of `observation` as `number`, as an earlier build recorded it, without judging it again.
    ///
    /// # Errors
    ///
    /// The [`Refusal`] that says why the observation measures nothing.
    pub fn accept_recorded(
        &mut self,
        observation: &Observation,
        number: ViewNumber,
        role: Role,
    ) -> Result<(), Refusal> {
        let view = self.measured(observation)?;
        self.accept(number, observation.name.clone(), role, view);
        Ok(())
    }

    fn accept(&mut self, number: ViewNumber, name: String, role: Role, mut view: View) {
        if let Role::Partner { of } = role {
            view.partner_frame = self.ground.accepted.get(of).map(|partner| partner.view.frame_id);
        }
        self.ground.next_number = self.ground.next_number.max(number.next());
        let (target, image_size) = (self.derived.target.as_ref(), self.setup.image_size);
        self.ground.seen.note_accepted(&view, target, image_size);
        let was_beyond_edge = target.is_some_and(|target| target.purpose == Purpose::BeyondEdge);
        self.ground.accepted.push(AcceptedView { number, name, role, was_beyond_edge, view });
        self.replan();
        self.tracking.forget_motion();
    }
}
