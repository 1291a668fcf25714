//! Judges frames: refused with a reason, held, or taken.

use std::sync::Arc;

use super::{
    accepted::AcceptedView, decision::Outcome, input::Observation, snapshot::LiveView,
    state::Session, view_number::ViewNumber,
};
use crate::{
    frame::{FrameKind, ImageSize},
    guidance::{
        Advice, Hold, Progress, Refusal, Role, View, advise, gate, measure, role_of,
        stillness::{HeldFrame, Motion, still, still_limit_px_per_s},
    },
};

/// A frame as far as it could be measured, and what it is for or why it is refused.
struct Judgement {
    view: Option<View>,
    role: Result<Role, Refusal>,
}

impl Session {
    /// Judges a frame and takes the view that it completes. The advice is `None` if a view was taken.
    pub(super) fn judge_frame(&mut self, observation: &Observation) -> (Outcome, Option<Advice>) {
        let motion = self.motion(observation);
        let Judgement { view, role } = self.judge(observation, motion.as_ref());
        self.tracking.live = Some(Arc::new(LiveView::of(
            observation,
            view.as_ref(),
            motion.map(|motion| motion.speed_px_per_s),
            &self.derived.lens_estimate.camera.pp_px,
        )));
        let refusal = match (role, &view) {
            (Ok(role), Some(view)) => {
                let is_rigid = motion.is_some_and(|motion| motion.is_rigid);
                let name = observation.name.clone();
                let frame = HeldFrame { view: view.clone(), role, name, is_rigid };
                if let Some(accepted) = self.hold_on(observation, frame) {
                    return (accepted, None);
                }
                let progress = self.tracking.hold.as_ref().map_or(0.0, |hold| {
                    hold.progress(observation.captured_at, &self.setup.guidance)
                });
                Refusal::Holding { progress }
            }
            (Ok(_), None) => Refusal::NotFound,
            (Err(refusal), _) => {
                self.tracking.hold = None;
                refusal
            }
        };
        match &observation.seen {
            Ok(seen) => self.tracking.motion.push(observation.captured_at, &seen.corners),
            Err(_) => self.tracking.motion.clear(),
        }
        let target = self.derived.target.as_ref();
        let advice = advise(view.as_ref(), &refusal, target, &self.setup.guidance);
        (Outcome::Refused { refusal }, Some(advice))
    }

    fn width_px(&self) -> f64 {
        f64::from(self.setup.image_size.width_px)
    }

    /// How the board moved up to this frame; `None` without a board or an earlier frame to compare with.
    fn motion(&self, observation: &Observation) -> Option<Motion> {
        let corners = &observation.seen.as_ref().ok()?.corners;
        let limit_px_per_s = still_limit_px_per_s(self.width_px(), &self.setup.guidance);
        self.tracking.motion.motion(observation.captured_at, corners, limit_px_per_s)
    }

    fn judge(&mut self, observation: &Observation, motion: Option<&Motion>) -> Judgement {
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
            self.role(&view, observation.kind, motion)
        };
        Judgement { view: Some(view), role }
    }

    fn measured(&self, observation: &Observation) -> Result<View, Refusal> {
        let seen = observation.seen.as_ref().map_err(|_| Refusal::NotFound)?;
        let frame = (observation.frame_id, observation.captured_at);
        let lens_estimate = &self.derived.lens_estimate;
        measure(frame, &seen.corners, seen.quality.blur_px, &self.setup.board, lens_estimate)
    }

    /// What a view that the person didn't force is good for.
    fn role(&self, view: &View, kind: FrameKind, motion: Option<&Motion>) -> Result<Role, Refusal> {
        let (derived, guidance) = (&self.derived, &self.setup.guidance);
        if self.ground.paused || derived.progress != Progress::Collecting {
            return Err(Refusal::NotCollecting);
        }
        gate(view, guidance)?;
        let role = role_of(view, &derived.measured, &derived.lens_estimate, guidance)?;
        still(kind, motion, self.width_px(), guidance)?;
        Ok(role)
    }

    /// Adds a good frame to the hold; takes the sharpest once the hold is complete.
    fn hold_on(&mut self, observation: &Observation, frame: HeldFrame) -> Option<Outcome> {
        let (width_px, role) = (self.width_px(), frame.role);
        let hold = match self.tracking.hold.take() {
            Some(mut hold) if hold.covers(&frame.view.corners, width_px) => {
                hold.add(frame);
                hold
            }
            _ => Hold::start(frame),
        };
        let complete = observation.kind == FrameKind::Photograph
            || role == Role::Forced
            || hold.complete(observation.captured_at, &self.setup.guidance);
        if !complete {
            self.tracking.hold = Some(hold);
            return None;
        }
        let HeldFrame { view, role, name, .. } = hold.best;
        let (number, frame) = (self.ground.next_number, view.frame_id.0);
        self.accept(AcceptedView { number, name, role, view });
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
        self.accept(AcceptedView { number, name: observation.name.clone(), role, view });
        Ok(())
    }

    fn accept(&mut self, mut accepted: AcceptedView) {
        if let Role::Partner { of } = accepted.role {
            accepted.view.partner_frame =
                self.ground.accepted.get(of).map(|partner| partner.view.frame_id);
        }
        self.ground.next_number = self.ground.next_number.max(accepted.number.next());
        self.ground.accepted.push(accepted);
        self.replan();
    }
}
