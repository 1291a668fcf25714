//! Applies inputs other than frames: commands, camera events and the rest.

use super::{
    accepted::AcceptedView,
    calm::Request,
    camera::CameraState,
    decision::{Decision, Outcome},
    input::{Command, Input, Observation},
    prompt::Prompt,
    state::{MORE_VIEWS, Session, Tracking},
    view_number::ViewNumber,
};
use crate::guidance::{Advice, Refusal, Role, View};
use boresight_geometry::device::CameraEvent;

impl Session {
    /// Applies an input and returns the decision.
    pub fn handle(&mut self, input: &Input) -> Decision {
        self.tracking.just_removed.clear();
        let (frame, outcome, advice) = match input {
            Input::Observed(observation) => {
                let (outcome, advice) = self.judge_frame(observation);
                (Some(observation.frame_id.0), outcome, advice)
            }
            Input::Command(command) => (None, self.apply_command(*command), None),
            Input::Led(target) => {
                // A recording may hold anything.
                let corners = self.setup.board.corner_count();
                let target = target.clone().filter(|target| target.ghost_px.len() == corners);
                if self.ground.lead.as_ref() != Some(&target) {
                    self.ground.lead = Some(target);
                    self.replan();
                }
                self.tracking.ask_anew();
                (None, Outcome::Noted, None)
            }
            Input::Camera(event) => (None, self.apply_camera_event(event), None),
            Input::WorkerFailed { worker, reason } => {
                self.ground.failures.push((worker.clone(), reason.clone()));
                (None, Outcome::Noted, None)
            }
            Input::Resumed => {
                self.start_run();
                (None, Outcome::Noted, None)
            }
            Input::Scene(scales) => {
                self.ground.scene = scales.iter().copied().collect();
                self.replan();
                (None, Outcome::Noted, None)
            }
            Input::SourceEnded => {
                self.ground.source_ended = true;
                (None, Outcome::Noted, None)
            }
            Input::Stop => (None, Outcome::Noted, None),
        };
        let decision = Decision {
            frame,
            outcome,
            advice: advice.unwrap_or_else(|| self.standing_advice()),
            progress: self.derived.progress,
            accepted: self.ground.accepted.len(),
            target_serial: self.ground.changes,
        };
        let observation = match input {
            Input::Observed(observation) => Some(observation),
            _ => None,
        };
        self.prompt(&decision, observation);
        decision
    }

    /// Chooses the prompt after `decision`; `observation` is set if the decision is about a frame.
    fn prompt(&mut self, decision: &Decision, observation: Option<&Observation>) {
        let ground = &self.ground;
        let has_failed = !ground.failures.is_empty();
        let is_idle = (ground.paused, ground.source_ended);
        let state = Prompt::of_state(decision.progress, has_failed, &ground.camera, is_idle);
        self.calm.note_state(state);
        // The request stays the same after a further view, taken in passing.
        if matches!(decision.outcome, Outcome::Accepted { role: Role::Further, .. }) {
            self.calm.note_pose(decision.target_serial);
        } else if let Some(observation) = observation {
            let prompt = Prompt::of_decision(decision, observation.seen.as_ref().err());
            let asked = Request {
                prompt,
                advice: decision.advice,
                off: self.tracking.off,
                target: decision.target_serial,
            };
            self.calm.note_frame(observation.captured_at, &asked);
        }
    }

    /// Advice in force until the next frame.
    fn standing_advice(&self) -> Advice {
        if self.derived.target.is_none() {
            Advice::Finished
        } else if self.ground.camera.may_take() {
            Advice::ShowBoard
        } else {
            Advice::Mend { refusal: Refusal::CameraNotReady }
        }
    }

    /// Begins another run of the same session. Views stay; the state of the last run's camera,
    /// workers and person is cleared.
    fn start_run(&mut self) {
        let ground = &mut self.ground;
        ground.source_ended = false;
        ground.paused = false;
        ground.failures.clear();
        ground.camera = CameraState::default();
        if ground.lead.take().is_some() {
            self.replan();
        }
        let live = self.tracking.live.take();
        self.tracking = Tracking { live, ..Tracking::default() };
    }

    /// Applies a camera event. If a geometry-moving control changed, drops every view, accepted or
    /// removed, taken after the control was last seen in place: a calibration describes one lens.
    fn apply_camera_event(&mut self, event: &CameraEvent) -> Outcome {
        let ground = &mut self.ground;
        let has_views = !(ground.accepted.is_empty() && ground.removed.is_empty());
        ground.camera.apply(event, has_views);
        if !ground.camera.may_take() {
            self.tracking.ask_anew();
            self.tracking.force_next = false;
        }
        let CameraEvent::ControlChanged(change) = event else { return Outcome::Noted };
        if !change.control.moves_geometry() {
            return Outcome::Noted;
        }
        let is_of_this_lens = |view: &View| view.captured_at <= change.good_until;
        ground.removed.retain(|(_, removed)| is_of_this_lens(&removed.view));
        let is_other = |taken: &mut AcceptedView| !is_of_this_lens(&taken.view);
        let dropped = ground.accepted.extract_if(.., is_other).map(|taken| taken.number);
        self.tracking.just_removed.extend(dropped);
        let Some(view) = self.tracking.just_removed.last().copied() else { return Outcome::Noted };
        self.views_removed();
        Outcome::Removed { view }
    }

    fn apply_command(&mut self, command: Command) -> Outcome {
        match command {
            Command::ForceNext => {
                self.tracking.force_next = true;
                Outcome::Noted
            }
            Command::Pause => {
                self.ground.paused = true;
                self.tracking.hold = None;
                Outcome::Noted
            }
            Command::Resume => {
                self.ground.paused = false;
                Outcome::Noted
            }
            Command::UndoLast => match self.ground.accepted.last().map(|last| last.number) {
                Some(view) => self.remove(view),
                None => Outcome::Noted,
            },
            Command::Remove { view } => self.remove(view),
            Command::Restore => self.restore(),
            Command::TakeMore => {
                self.ground.wanted_views = self.ground.accepted.len() + MORE_VIEWS;
                self.replan();
                self.tracking.start_over();
                Outcome::Noted
            }
        }
    }

    fn remove(&mut self, view: ViewNumber) -> Outcome {
        let Some(index) = self.ground.accepted.iter().position(|taken| taken.number == view) else {
            return Outcome::Noted;
        };
        let removed = self.ground.accepted.remove(index);
        self.ground.removed.push((index, removed));
        self.tracking.just_removed.push(view);
        self.views_removed();
        Outcome::Removed { view }
    }

    fn views_removed(&mut self) {
        self.ground.seen.note_removed();
        self.replan();
        self.tracking.start_over();
    }

    fn restore(&mut self) -> Outcome {
        let Some((index, restored)) = self.ground.removed.pop() else { return Outcome::Noted };
        let view = restored.number;
        let accepted = &mut self.ground.accepted;
        accepted.insert(index.min(accepted.len()), restored);
        self.replan();
        self.tracking.start_over();
        Outcome::Restored { view }
    }
}
