//! What a frame is worth: refused with its reason, held, or taken.

use std::sync::Arc;

use super::{AcceptedView, LiveView, Observation, Outcome, Session};
use crate::{
    detection::Detection,
    frame::{FrameKind, ImageSize},
    guidance::{
        Advice, Hold, Progress, Refusal, Role, View, advise, gate, measure, role_of,
        stillness::{moved_rigidly, speed_px_per_s, still},
    },
};

/// A view worth taking and what for; or why not, with the view as far as it could be measured.
type Judgement = Result<(View, Role), (Option<Box<View>>, Refusal)>;

impl Session {
    /// Judges a frame, and takes the view that it completes.
    pub(super) fn observe(&mut self, observation: &Observation) -> (Outcome, Option<Advice>) {
        let judged = self.judge(observation);
        let view = match &judged {
            Ok((view, _)) => Some(view),
            Err((view, _)) => view.as_deref(),
        };
        let speed_px_per_s = self.speed_px_per_s(observation);
        self.live = Some(Arc::new(LiveView::of(
            observation,
            view,
            speed_px_per_s,
            &self.lens_estimate.camera.pp_px,
        )));
        let (view, refusal) = match judged {
            Ok((view, role)) => {
                if let Some(accepted) = self.hold_on(observation, view.clone(), role) {
                    return (accepted, None);
                }
                let progress = self.hold.as_ref().map_or(0.0, |hold| {
                    hold.progress(observation.captured_at, &self.setup.guidance)
                });
                (Some(Box::new(view)), Refusal::Holding { progress })
            }
            Err((view, refusal)) => {
                self.hold = None;
                (view, refusal)
            }
        };
        self.last_seen = observation
            .seen
            .as_ref()
            .ok()
            .map(|seen| (observation.captured_at, seen.corners.clone()));
        let advice = advise(
            view.as_deref(),
            Some(&refusal),
            self.hold.as_ref(),
            self.target.as_ref(),
            &self.setup.guidance,
        );
        (Outcome::Refused { refusal }, Some(advice))
    }

    fn speed_px_per_s(&self, observation: &Observation) -> Option<f64> {
        let corners = &observation.seen.as_ref().ok()?.corners;
        let before = self.last_seen.as_ref().map(|(time, corners)| (*time, corners.as_slice()));
        speed_px_per_s(before, (observation.captured_at, corners))
    }

    /// Whether the frame is worth taking, and for what; with the view as far as it could be measured.
    fn judge(&mut self, observation: &Observation) -> Judgement {
        let setup = &self.setup;
        if observation.image_size != setup.image_size {
            let pair = |size: ImageSize| (size.width_px, size.height_px);
            let (size_px, wanted_px) = (pair(observation.image_size), pair(setup.image_size));
            return Err((None, Refusal::OtherSize { size_px, wanted_px }));
        }
        if !self.camera.may_take_of(observation.captured_at) {
            return Err((None, Refusal::CameraNotReady));
        }
        let seen: &Detection = observation.seen.as_ref().map_err(|_| (None, Refusal::NotFound))?;
        let view = measure(
            (observation.frame_id, observation.captured_at),
            &seen.corners,
            seen.quality.blur_px,
            &setup.board,
            &self.lens_estimate,
        )
        .map_err(|refusal| (None, refusal))?;
        if self.force_next {
            self.force_next = false;
            return Ok((view, Role::Forced));
        }
        let refuse = |refusal| (Some(Box::new(view.clone())), refusal);
        if self.paused || self.progress != Progress::Collecting {
            return Err(refuse(Refusal::NotCollecting));
        }
        gate(&view, &setup.guidance).map_err(refuse)?;
        let views: Vec<View> = self.accepted.iter().map(|accepted| accepted.view.clone()).collect();
        let role = role_of(&view, &views, &self.lens_estimate, &setup.guidance).map_err(refuse)?;
        let before = self.last_seen.as_ref().map(|(time, corners)| (*time, corners.as_slice()));
        let now = (observation.captured_at, seen.corners.as_slice());
        let width_px = f64::from(setup.image_size.width_px);
        still(observation.kind, before, now, width_px, &setup.guidance).map_err(refuse)?;
        Ok((view, role))
    }

    /// Adds a good view to the hold; takes the sharpest once the hold is complete.
    fn hold_on(&mut self, observation: &Observation, view: View, role: Role) -> Option<Outcome> {
        let width_px = f64::from(self.setup.image_size.width_px);
        let now = observation.captured_at;
        let before = self.last_seen.as_ref();
        let together = before.is_some_and(|(_, before)| moved_rigidly(before, &view.corners));
        match &mut self.hold {
            Some(hold) if hold.covers(&view.corners, width_px) => hold.add(view, role, together),
            hold => {
                *hold = Some(Hold::start(view, role, together));
                self.hold_name.clone_from(&observation.name);
            }
        }
        let hold = self.hold.as_ref()?;
        let complete = observation.kind == FrameKind::Photograph
            || role == Role::Forced
            || hold.complete(now, &self.setup.guidance);
        if !complete {
            return None;
        }
        let Hold { best, role, .. } = self.hold.take()?;
        let (id, frame) = (self.next_view, best.frame_id.0);
        let name = std::mem::take(&mut self.hold_name);
        self.accept(id, name, role, best);
        Some(Outcome::Accepted { view: id, frame, role })
    }

    /// Accepts the view of `observation` as `view`, as an earlier build recorded it, without judging it again.
    ///
    /// # Errors
    ///
    /// The [`Refusal`] that says why the observation measures nothing.
    pub fn accept_recorded(
        &mut self,
        observation: &Observation,
        view: u32,
        role: Role,
    ) -> Result<(), Refusal> {
        let seen = observation.seen.as_ref().map_err(|_| Refusal::NotFound)?;
        let frame = (observation.frame_id, observation.captured_at);
        let measured = measure(
            frame,
            &seen.corners,
            seen.quality.blur_px,
            &self.setup.board,
            &self.lens_estimate,
        )?;
        self.accept(view, observation.name.clone(), role, measured);
        Ok(())
    }

    fn accept(&mut self, id: u32, name: String, role: Role, mut view: View) {
        if let Role::Partner { of } = role {
            view.partner_frame = self.accepted.get(of).map(|accepted| accepted.view.frame_id);
        }
        self.next_view = self.next_view.max(id + 1);
        self.accepted.push(AcceptedView { id, name, role, view });
        self.solve();
    }
}
