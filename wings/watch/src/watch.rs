//! The fold: inputs in, decisions out.

use std::collections::VecDeque;

use nalgebra::Vector4;

use crate::{
    condition::Condition,
    cycle::{Cycle, Sample},
    input::{Answer, Input, Picture, turn_of},
    no_answer::NoAnswer,
    sequential::{MARGIN, RELEVANT, SEEN_WITHIN_SECS, Sequential, VISIBLE},
    slot::{DAY_SECS, HOUR_SECS, SEVERAL, lived_secs},
    state::{Cause, Decision, Finding, State},
};
use boresight_scene::{Lens, SHARED, px_per_turn};

/// Minimum number of answers and hours before any verdict: a day's light, nearly whole.
const LEARNING_ANSWERS: usize = 60;
const LEARNING_HOURS: f64 = 20.0;
/// End of learning references and cycle, after at least two days and nights, and the factor on the
/// limits until then: one day can't show the daily cycle.
pub(crate) const SETTLED_SECS: f64 = 3.0 * DAY_SECS;
const UNSETTLED: f64 = 3.0;
/// Number of answers of a pin, and Student's t of their scatter: one in ten thousand to a side.
const PIN_ANSWERS: usize = 6;
const PIN_T: f64 = 9.68;
/// Time over which the cycle follows the season.
const FOLLOWED_SECS: f64 = 14.0 * DAY_SECS;
/// Threshold of a changed focal length, in standard deviations including the lens's own error.
const FOCAL_SIGMAS: f64 = 3.0;
/// Half width of the interval of an answer that vouches for a camera, in standard deviations.
const INTERVAL_SIGMAS: f64 = 2.0;
/// Minimum log-likelihood ratio for preferring a cause: see [`Causes`].
///
/// [`Causes`]: crate::Causes
const SURE: f64 = 6.0;
/// Maximum shift of the picture by a knocked lens, as a share of the width.
const FARTHEST_KNOCK: f64 = 0.05;
/// Threshold for a partly disagreeing scene, as a share of the patches' usual agreement.
const LESS_AGREEMENT: f64 = 0.7;
/// Share of the patches that usually agree, below which nothing vouches for the camera.
const LITTLE_SEEN: f64 = 0.5;
/// Minimum reported shake, px.
const SHAKES_PX: f64 = 0.5;

/// Watched camera: state of the fold over its inputs.
#[derive(Clone, Debug)]
pub struct Watch {
    width_px: f64,
    px_per_turn: Vector4<f64>,
    /// Answers of the last two weeks while the camera stayed, and answers of learning.
    samples: VecDeque<Sample>,
    /// Cycle of the learning days, whose constant is kept.
    first: Option<Cycle>,
    cycle: Option<Cycle>,
    /// Time of the pin, and its scatter, as that of a cycle.
    pin: Option<(f64, Vector4<f64>)>,
    /// Time of the first learning picture.
    began_secs: Option<f64>,
    relearned_secs: f64,
    /// Time of the newest picture, and the time covered by all: see [`lived_secs`].
    newest_secs: Option<f64>,
    lived_secs: f64,
    /// Time of the newest answer that vouches for the camera, and number of such answers in a row.
    vouched_secs: Option<f64>,
    vouched: usize,
    /// Number of looks since, and of those with a picture that had no answer.
    unvouched: usize,
    unanswered_pictures: usize,
    /// Number of pictures of two motions since.
    two_motions: usize,
    /// Kind of change, until the camera is back or accepted.
    kind: Option<State>,
    test: Sequential,
    condition: Condition,
    gaps: VecDeque<Gap>,
    /// Reason of the newest picture for having no answer.
    lacks: Option<NoAnswer>,
    causes: VecDeque<f64>,
    shares: VecDeque<f64>,
    usual_share: Option<f64>,
    shake_px: Option<f64>,
    left_out_percent: Option<u32>,
    decision: Decision,
}

impl Watch {
    /// Camera of which only the lens is known.
    pub fn new(lens: &Lens) -> Self {
        Self::anew(f64::from(lens.image_size.width_px), px_per_turn(lens))
    }

    fn anew(width_px: f64, px_per_turn: Vector4<f64>) -> Self {
        Self {
            width_px,
            px_per_turn,
            samples: VecDeque::new(),
            first: None,
            cycle: None,
            pin: None,
            began_secs: None,
            relearned_secs: f64::NEG_INFINITY,
            newest_secs: None,
            lived_secs: 0.0,
            vouched_secs: None,
            vouched: 0,
            unvouched: 0,
            unanswered_pictures: 0,
            two_motions: 0,
            kind: None,
            test: Sequential::new(width_px),
            condition: Condition::default(),
            gaps: VecDeque::new(),
            lacks: None,
            causes: VecDeque::new(),
            shares: VecDeque::new(),
            usual_share: None,
            shake_px: None,
            left_out_percent: None,
            decision: Decision {
                state: State::Learning { pictures: 0, hours: 0.0 },
                since_secs: 0.0,
                off_px: Vector4::zeros(),
                smallest_visible_px: Vector4::repeat(f64::INFINITY),
                reference_secs: 0.0,
                answered_secs: None,
                usual_seen: None,
                lacks: None,
                findings: Vec::new(),
            },
        }
    }

    /// Takes an input and returns the decision on the camera's state.
    pub fn handle(&mut self, input: &Input) -> Decision {
        match input {
            Input::Accepted { at, .. } => {
                *self = Self::anew(self.width_px, self.px_per_turn);
                self.decision.reference_secs = *at;
                self.decision.since_secs = *at;
            }
            Input::Learned { at, samples, pinned, .. } => {
                let to_px = |turn| turn_of(turn).vector().component_mul(&self.px_per_turn);
                self.samples = samples
                    .iter()
                    .map(|s| Sample { at_secs: s.at, value_px: to_px(&s.turn) })
                    .collect();
                self.lived_secs = self.lived_secs.max(lived_secs(samples.iter().map(|s| s.at)));
                self.began_secs = self.samples.iter().map(|s| s.at_secs).reduce(f64::min);
                self.cycle = None;
                self.first = None;
                self.test = Sequential::new(self.width_px);
                self.decision.reference_secs = *at;
                self.decision.lacks.take_if(|reason| *reason == NoAnswer::NoReferences);
                if *pinned && !self.is_pinned() {
                    self.pin = self.pin_scatter_px().map(|scatter_px| (*at, scatter_px));
                }
                self.learn(*at);
            }
            Input::Picture(picture) => self.picture(picture),
        }
        self.decision.clone()
    }

    /// Newest decision.
    pub fn decision(&self) -> &Decision {
        &self.decision
    }

    /// Decision of someone who asks once: a newest look without an answer that vouches for the
    /// camera doesn't end as OK, however short the silence.
    pub fn asked(&self) -> Decision {
        let mut decision = self.decision.clone();
        let (Some(reason), None) = (decision.lacks, self.kind) else { return decision };
        let is_said = match decision.state {
            State::Ok => true,
            State::Learning { .. } => !reason.is_of_a_picture() || reason.is_for_a_person(),
            State::Moved(_) | State::Zoom | State::Blurred | State::CannotTell { .. } => false,
        };
        if is_said {
            decision.state = State::CannotTell { reason, before: None };
            decision.since_secs = self.vouched_secs.unwrap_or(decision.since_secs);
        }
        decision
    }

    /// Target of a camera that stays at the hour, px, as [`crate::Turn::in_px`]; zero while
    /// learning.
    pub fn target_px(&self, at_secs: f64) -> Vector4<f64> {
        self.cycle.as_ref().map_or(Vector4::zeros(), |cycle| cycle.at(at_secs))
    }

    /// Scatter of six-hour medians about the cycle, px; `None` while learning.
    pub fn scatter_px(&self) -> Option<Vector4<f64>> {
        self.cycle.as_ref().map(|cycle| cycle.scatter_px)
    }

    /// Maximum permitted distance from [`Self::target_px`] for a camera pushed back, px: the state
    /// is then OK.
    pub fn may_be_left_px(&self) -> Vector4<f64> {
        self.test.may_be_left_px(&self.scatter_px().unwrap_or_default())
    }

    /// True from the pin of a camera on.
    pub fn is_pinned(&self) -> bool {
        self.pin.is_some()
    }

    /// Asks for answers anew: what was said before vouches for nothing.
    pub fn ask(&mut self, at_secs: f64) {
        let reason = NoAnswer::Unconfirmed;
        self.doubt(State::CannotTell { reason, before: None }, at_secs);
    }

    /// True after three days of learning.
    pub fn is_settled(&self) -> bool {
        self.first.is_some() && self.lived_secs >= SETTLED_SECS
    }

    fn picture(&mut self, picture: &Picture) {
        if picture.late {
            self.late(picture);
            return;
        }
        let at_secs = picture.at;
        self.decision.lacks = picture.none;
        let is_taken = picture.none.is_none_or(NoAnswer::is_of_a_picture);
        if is_taken && self.is_set_back(at_secs) {
            let (reason, before) = (NoAnswer::WrongClock, None);
            self.doubt(State::CannotTell { reason, before }, at_secs);
            return;
        }
        if let Some(answer) = &picture.answer {
            self.lacks = None;
            self.answered(at_secs, answer);
            return;
        }
        let reason = picture.none.unwrap_or(NoAnswer::NoPicture);
        if let NoAnswer::TwoMotions { left_out_percent: left_out @ Some(_), .. } = reason {
            self.left_out_percent = left_out;
        }
        if reason == NoAnswer::NoReferences && self.cycle.is_none() {
            // The first pictures serve for learning.
            self.lacks = None;
            self.began_secs.get_or_insert(at_secs);
            self.learn(at_secs);
            return;
        }
        // A missing picture says nothing about the newest picture's lack.
        let before = self.lacks.filter(|_| !is_taken);
        if is_taken {
            self.lacks = Some(reason);
        }
        self.unanswered(at_secs, reason, before);
    }

    /// True if a picture's time lies an hour before that of an earlier picture.
    fn is_set_back(&mut self, at_secs: f64) -> bool {
        let newest = self.newest_secs.unwrap_or(at_secs);
        if newest - at_secs > HOUR_SECS {
            return true;
        }
        self.lived_secs += lived_secs([newest, at_secs]);
        self.newest_secs = Some(newest.max(at_secs));
        false
    }

    /// Enters "can't tell" while no picture was usable at all, or after a gap unusual for these
    /// days: at least an hour, at most a day, and a day while the usual gaps are being learned.
    /// Three pictures of two motions suffice once the camera is learned. Within a day, other
    /// pictures without an answer must be several, and are compared with gaps that
    /// had some: a week without pictures doesn't make a week of pictures that disagree usual.
    fn unanswered(&mut self, at_secs: f64, reason: NoAnswer, before: Option<NoAnswer>) {
        let is_blind = reason.is_of_a_picture() && !reason.is_of_an_answer();
        let alike = self.gaps.iter().filter(|gap| gap.had_unanswered || !is_blind);
        let usual = alike.map(|gap| gap.secs).fold(0.0, f64::max);
        let least = if self.cycle.is_some() { HOUR_SECS } else { DAY_SECS };
        let patience = (MARGIN * usual).clamp(least, DAY_SECS);
        let told = self.kind.and(self.decision.answered_secs);
        let used = told.or(self.vouched_secs).or(self.began_secs);
        self.vouched = 0;
        self.unvouched += 1;
        self.unanswered_pictures += usize::from(is_blind);
        self.two_motions += usize::from(matches!(reason, NoAnswer::TwoMotions { .. }));
        let is_several = !is_blind || self.unanswered_pictures >= SEVERAL;
        let is_long = used.is_none_or(|used| {
            let waited_secs = at_secs - used;
            waited_secs > patience && (is_several || waited_secs > DAY_SECS)
        });
        let is_told = matches!(self.decision.state, State::CannotTell { .. });
        // What moved is in the picture, so no usual silence explains it.
        let is_lost = (self.is_only_pinned() && self.unvouched >= SEVERAL)
            || (self.is_settled() && self.two_motions >= SEVERAL);
        if is_long || is_told || (is_lost && self.kind.is_none()) {
            self.doubt(State::CannotTell { reason, before }, used.unwrap_or(at_secs));
        }
    }

    /// Begins to count the looks without an answer that vouches for the camera.
    fn begin_count(&mut self) {
        (self.unvouched, self.unanswered_pictures, self.two_motions) = (0, 0, 0);
    }

    fn doubt(&mut self, state: State, since_secs: f64) {
        self.vouched = 0;
        self.enter(state, since_secs);
    }

    /// Notes an answer that vouches for the camera.
    fn vouch(&mut self, at_secs: f64) {
        if let Some(before) = self.vouched_secs.filter(|before| at_secs > *before) {
            // A silence already reported as "can't tell" isn't usual.
            if !matches!(self.decision.state, State::CannotTell { .. }) {
                let (secs, had_unanswered) = (at_secs - before, self.unanswered_pictures > 0);
                self.gaps.push_back(Gap { until_secs: at_secs, secs, had_unanswered });
            }
        }
        self.gaps.retain(|gap| at_secs - gap.until_secs < FOLLOWED_SECS);
        self.vouched_secs = Some(at_secs);
        self.vouched += 1;
        self.begin_count();
    }

    /// Reason for an answer not to vouch for a camera that points where it did.
    fn lack(&self, answer: &Answer, off_px: &Vector4<f64>) -> Option<NoAnswer> {
        let variance = answer.covariance().diagonal();
        let sd_px = variance.map(|v| v.max(0.0).sqrt()).component_mul(&self.px_per_turn);
        let farthest_px = off_px.abs() + INTERVAL_SIGMAS * sd_px;
        let limit_px = self.decision.smallest_visible_px;
        if (0..4).any(|i| farthest_px[i] > limit_px[i]) {
            return Some(NoAnswer::Unsure);
        }
        let (agree, of) = (answer.patches[1], answer.sought?);
        let is_little = seen_share(answer)? < LITTLE_SEEN * self.decision.usual_seen?;
        is_little.then_some(NoAnswer::LittleSeen { agree, of })
    }

    fn answered(&mut self, at_secs: f64, answer: &Answer) {
        self.decision.answered_secs = Some(at_secs);
        self.began_secs.get_or_insert(at_secs);
        self.condition.note(at_secs, answer);
        self.shake_px = answer.shake;
        let sample = self.sample(at_secs, answer);
        let share = f64::from(answer.patches[1]) / f64::from(answer.patches[0].max(1));
        push(&mut self.shares, share, 24);
        if let Some(causes) = answer.causes {
            let ratio = libm::log(causes.shifted_px.max(1e-3) / causes.turned_px.max(1e-3));
            push(&mut self.causes, 2.0 * f64::from(causes.compared) * ratio / SHARED, 24);
        } else {
            self.causes.clear();
        }
        let Some(cycle) = self.cycle.clone() else {
            self.vouch(at_secs);
            self.samples.push_back(sample);
            self.learn(at_secs);
            return;
        };
        let widened = if self.is_settled() { 1.0 } else { UNSETTLED };
        let wide_px = self.test.scale_px(&cycle.scatter_px) * widened;
        let off_px = cycle.residual(&sample);
        let verdict = self.test.step(at_secs, &off_px, &wide_px);
        self.decision.off_px = verdict.level_px;
        self.decision.smallest_visible_px = self.test.smallest_visible_px(&wide_px);
        let focal_sd_px = answer.covariance()[(3, 3)].max(0.0).sqrt() * self.px_per_turn[3];
        let is_zoom = verdict.alarms[3] && verdict.level_px[3].abs() > FOCAL_SIGMAS * focal_sd_px;
        let has_moved = verdict.alarms[..3].contains(&true);
        let lack = self.lack(answer, &off_px);
        let cause = self.cause(verdict.alarms[2]);
        let told = if is_zoom && cause != Cause::Knocked {
            Some(State::Zoom)
        } else if has_moved || is_zoom {
            Some(State::Moved(cause))
        } else {
            self.condition.is_blurred().then_some(State::Blurred)
        };
        if let Some(told) = told {
            let is_still = match self.kind {
                Some(State::Moved(_)) => has_moved,
                Some(kind) => kind == State::Zoom && is_zoom,
                None => false,
            };
            let blurred_since = || self.condition.blurred_since();
            let since = verdict.since_secs.or_else(blurred_since).unwrap_or(at_secs);
            if self.kind.is_none() {
                // The change itself is no usual movement.
                self.samples.retain(|s| s.at_secs < since);
            }
            let state = self.kind.filter(|_| is_still).map_or(told, |kind| match (kind, told) {
                (State::Moved(Cause::Either), State::Moved(_)) => told,
                _ => kind,
            });
            self.kind = Some(state);
            self.begin_count();
            self.doubt(state, since);
        } else if let Some(reason) = lack {
            self.decision.lacks = Some(reason);
            match self.kind {
                Some(kind) => self.doubt(kind, at_secs),
                None => self.unanswered(at_secs, reason, None),
            }
        } else {
            self.vouch(at_secs);
            if self.vouched >= SEVERAL || self.decision.state == State::Ok {
                self.kind = None;
                self.enter(State::Ok, at_secs);
            } else if let State::CannotTell { .. } = self.decision.state {
                let state = State::CannotTell { reason: NoAnswer::Unconfirmed, before: None };
                self.enter(state, at_secs);
            }
        }
        if self.decision.state == State::Ok {
            self.samples.push_back(sample);
            if self.is_settled() || self.is_only_pinned() {
                let followed = |usual: Option<f64>, now: f64| {
                    Some(usual.map_or(now, |usual| 0.99 * usual + 0.01 * now))
                };
                self.usual_share = followed(self.usual_share, share);
                if let (Some(seen), None) = (seen_share(answer), lack) {
                    self.decision.usual_seen = followed(self.decision.usual_seen, seen);
                }
            }
        }
        self.samples.retain(|s| at_secs - s.at_secs < FOLLOWED_SECS);
        if self.is_only_pinned() {
            self.learn(at_secs);
        } else {
            self.follow(at_secs);
        }
        self.decision.findings = self.findings(&cycle);
    }

    /// True until a pinned camera is learned.
    fn is_only_pinned(&self) -> bool {
        self.is_pinned() && self.first.is_none()
    }

    /// Scatter of the first answers, with which the smallest visible change bounds one more of
    /// them. `None` if they are too few, or the camera wasn't still.
    fn pin_scatter_px(&self) -> Option<Vector4<f64>> {
        let count = self.samples.len() as f64;
        let mean: Vector4<f64> =
            self.samples.iter().map(|s| s.value_px).sum::<Vector4<f64>>() / count;
        let square = |s: &Sample| (s.value_px - mean).map(|off| off * off);
        let sum: Vector4<f64> = self.samples.iter().map(square).sum();
        let sd_px = sum.map(|sum| (sum / (count - 1.0)).sqrt());
        // A camera that moves by more than what matters doesn't stand yet.
        let is_still = sd_px.amax() < RELEVANT * self.width_px;
        let factor = PIN_T * (1.0 + 1.0 / count).sqrt() / (UNSETTLED * VISIBLE);
        (self.samples.len() >= PIN_ANSWERS && is_still).then_some(sd_px * factor)
    }

    /// Compares the camera with the first answers of its pin.
    fn take_pin(&mut self, at_secs: f64) {
        let (Some((pinned_secs, scatter_px)), None) = (self.pin, &self.cycle) else { return };
        let first = self.samples.iter().filter(|s| s.at_secs <= pinned_secs);
        let values_px: Vec<Vector4<f64>> = first.map(|s| s.value_px).collect();
        if values_px.is_empty() {
            return;
        }
        self.cycle = Some(Cycle::pinned(&values_px, scatter_px));
        self.test = Sequential::pinned(self.width_px);
        let wide_px = self.test.scale_px(&scatter_px) * UNSETTLED;
        self.decision.smallest_visible_px = self.test.smallest_visible_px(&wide_px);
        self.decision.reference_secs = pinned_secs;
        self.decision.findings = vec![Finding::Pinned];
        if let State::Learning { .. } = self.decision.state {
            self.vouched = SEVERAL;
            self.begin_count();
            self.vouched_secs = Some(at_secs);
            self.enter(State::Ok, at_secs);
        }
    }

    /// Learns from a picture older than earlier arrivals. The newer ones determine the camera's
    /// state.
    fn late(&mut self, picture: &Picture) {
        let (Some(answer), None) = (&picture.answer, &self.cycle) else { return };
        let sample = self.sample(picture.at, answer);
        let place = self.samples.partition_point(|s| s.at_secs <= sample.at_secs);
        self.samples.insert(place, sample);
        self.learn(self.decision.answered_secs.unwrap_or(picture.at));
    }

    fn sample(&self, at_secs: f64, answer: &Answer) -> Sample {
        Sample { at_secs, value_px: answer.turn().vector().component_mul(&self.px_per_turn) }
    }

    /// Learns the first cycle, also repeatedly during the first three days.
    fn learn(&mut self, at_secs: f64) {
        let hours = lived_secs(self.samples.iter().map(|s| s.at_secs)) / HOUR_SECS;
        let pictures = self.samples.len();
        if pictures < LEARNING_ANSWERS || hours < LEARNING_HOURS {
            self.take_pin(at_secs);
            if self.cycle.is_some() {
                return;
            }
            let since = self.began_secs.unwrap_or(at_secs);
            self.enter(State::Learning { pictures, hours }, since);
            return;
        }
        let samples: Vec<Sample> = self.samples.iter().copied().collect();
        self.cycle = Cycle::learn(&samples, self.width_px, None);
        self.first.clone_from(&self.cycle);
        if self.is_pinned() {
            self.test = Sequential::new(self.width_px);
            self.decision.usual_seen = None;
        }
        self.relearned_secs = at_secs;
        self.condition.set_usual();
        if let Some(cycle) = &self.cycle {
            self.decision.smallest_visible_px = self.test.smallest_visible_px(&cycle.scatter_px);
            self.decision.reference_secs = at_secs;
            if let State::Learning { .. } = self.decision.state {
                self.enter(State::Ok, at_secs);
            }
        }
    }

    /// Updates the cycle once a day: from all samples until three days are learned, then waves and
    /// scatter only.
    fn follow(&mut self, at_secs: f64) {
        if at_secs - self.relearned_secs < DAY_SECS || self.decision.state != State::Ok {
            return;
        }
        self.relearned_secs = at_secs;
        if !self.is_settled() {
            let samples: Vec<Sample> = self.samples.iter().copied().collect();
            self.cycle = Cycle::learn(&samples, self.width_px, None);
            self.first.clone_from(&self.cycle);
            return;
        }
        // A later change may not have been seen yet.
        let vouched = self.samples.iter().filter(|s| at_secs - s.at_secs >= SEEN_WITHIN_SECS);
        let samples: Vec<Sample> = vouched.copied().collect();
        let length =
            samples.last().zip(samples.first()).map_or(0.0, |(b, a)| b.at_secs - a.at_secs);
        if length >= SETTLED_SECS {
            self.cycle =
                Cycle::learn(&samples, self.width_px, self.first.as_ref()).or(self.cycle.take());
        }
    }

    /// Cause of a moved picture; a knocked lens doesn't roll it.
    fn cause(&self, rolled: bool) -> Cause {
        // A lens knocked farther no longer fills the picture.
        if self.decision.off_px.fixed_rows::<2>(0).norm() > FARTHEST_KNOCK * self.width_px {
            return Cause::Turned;
        }
        let unknown = if rolled { Cause::Turned } else { Cause::Either };
        if self.causes.len() < SEVERAL {
            return unknown;
        }
        let evidence = self.causes.iter().sum::<f64>() / self.causes.len() as f64;
        match evidence {
            e if e > SURE => Cause::Turned,
            e if e < -SURE => Cause::Knocked,
            _ => unknown,
        }
    }

    fn findings(&self, cycle: &Cycle) -> Vec<Finding> {
        let mut found = Vec::new();
        found.extend(self.is_only_pinned().then_some(Finding::Pinned));
        if let (State::Moved(_), Some(usual)) = (self.decision.state, self.usual_share) {
            let mut now: Vec<f64> = self.shares.iter().copied().collect();
            let share = boresight_scene::median(&mut now).unwrap_or(usual);
            found.extend((share < LESS_AGREEMENT * usual).then_some(Finding::AlsoShifted));
        }
        if let Some(first) = &self.first {
            let (was_px, is_px) = (first.scatter_px.amax(), cycle.scatter_px.amax());
            found.extend((is_px > MARGIN * was_px).then_some(Finding::SwaysMore { was_px, is_px }));
        }
        found.extend(self.left_out_percent.map(|percent| Finding::LeftOut { percent }));
        found.extend(
            self.shake_px.filter(|px| *px > SHAKES_PX).map(|by_px| Finding::Shakes { by_px }),
        );
        found
    }

    /// Enters a state; its start time is kept if the state is unchanged, and known.
    fn enter(&mut self, state: State, since_secs: f64) {
        let is_same =
            std::mem::discriminant(&state) == std::mem::discriminant(&self.decision.state);
        if !is_same || self.decision.since_secs == 0.0 {
            self.decision.since_secs = since_secs;
        }
        self.decision.state = state;
    }
}

/// Time between two answers that vouch for the camera.
#[derive(Clone, Copy, Debug)]
struct Gap {
    until_secs: f64,
    secs: f64,
    /// True if pictures without an answer came.
    had_unanswered: bool,
}

/// Agreeing patches as a share of those looked for.
fn seen_share(answer: &Answer) -> Option<f64> {
    Some(f64::from(answer.patches[1]) / f64::from(answer.sought?.max(1)))
}

fn push<T>(values: &mut VecDeque<T>, value: T, most: usize) {
    values.push_back(value);
    if values.len() > most {
        values.pop_front();
    }
}
