//! Calm prompts: turns the requests of frames into a prompt slow enough to read.

use std::collections::VecDeque;

use super::prompt::Prompt;
use crate::guidance::{Advice, Difference};
use boresight_geometry::frame::CaptureTime;

/// Time for which frames must ask for a new prompt, within [`RECENT_SECS`], before it's shown.
const PERSIST_SECS: f64 = 0.4;
/// Maximum age of frames considered.
const RECENT_SECS: f64 = 0.8;
/// Minimum time on screen of a prompt, even of two words.
const DWELL_SECS: f64 = 0.6;
/// Time without a request for the shown prompt, after which the commonest request is shown, however
/// short.
const OUTDATED_SECS: f64 = 1.2;
/// Time without a request to hold still, after which "Hold still" goes: the pose is really lost.
const LOST_POSE_SECS: f64 = 0.5;
/// Maximum time credited to a frame: nothing is known about a gap in the pictures.
const LONGEST_FRAME_SECS: f64 = 0.2;
/// Minimum time between two prompts not shown at once: a person reads each and acts on it.
const NEXT_SECS: f64 = 2.5;

/// Prompt and advice on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shown {
    /// Prompt on the screen.
    pub prompt: Prompt,
    /// Newest advice behind the prompt, with amounts; `None` if the prompt doesn't come from
    /// advice.
    pub advice: Option<Advice>,
}

impl Default for Shown {
    fn default() -> Self {
        Self { prompt: Prompt::ShowBoard, advice: Some(Advice::ShowBoard) }
    }
}

/// Request of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Request {
    pub(super) prompt: Prompt,
    pub(super) advice: Advice,
    /// Difference of the board from the requested pose; `None` without a board.
    pub(super) off: Option<Difference>,
    /// Number of the requested pose.
    pub(super) target: u32,
}

/// Chooses the shown prompt from the prompts of frames. A shown prompt stays until it can be read,
/// or until its request is fulfilled. Time is the frames' time, so a recording shows the same.
#[derive(Clone, Debug, Default)]
pub(super) struct Calm {
    shown: Shown,
    /// Time at which the shown prompt came; `None` before the first frame, and for a prompt without
    /// a frame.
    since: Option<CaptureTime>,
    /// Time at which a frame last asked for the shown prompt.
    last_asked: Option<CaptureTime>,
    /// Requests of the last frames, each with the time credited.
    recent: VecDeque<Asked>,
    /// Time of the last prompt not shown at once.
    asked_at: Option<CaptureTime>,
    /// Number of the pose behind the shown prompt.
    target: u32,
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    at: CaptureTime,
    secs: f64,
    prompt: Prompt,
    advice: Advice,
}

impl Calm {
    pub(super) fn shown(&self) -> Shown {
        self.shown
    }

    /// Notes a state to show at once, or none. The prompt of an earlier state then goes.
    pub(super) fn note_state(&mut self, state: Option<Prompt>) {
        match state {
            Some(prompt) if self.shown.prompt != prompt => {
                self.shown = Shown { prompt, advice: None };
                self.since = None;
                self.recent.clear();
            }
            None if self.shown.prompt.is_state() => {
                self.shown = Shown::default();
                self.since = None;
                self.recent.clear();
            }
            _ => {}
        }
    }

    /// Notes the number of the requested pose, without another request.
    pub(super) fn note_pose(&mut self, target: u32) {
        self.target = target;
    }

    /// Notes the request of a frame captured at `now`, unless a state is shown.
    pub(super) fn note_frame(&mut self, now: CaptureTime, request: &Request) {
        let Request { prompt, advice, off, target } = *request;
        if self.shown.prompt.is_state() {
            return;
        }
        if self.newest_at().is_some_and(|newest| newest > now) {
            // The clock restarted.
            self.recent.clear();
            (self.since, self.last_asked, self.asked_at) = (None, None, None);
        }
        let is_other_pose = std::mem::replace(&mut self.target, target) != target;
        if prompt == Prompt::Taken {
            // Earlier requests are about the view taken now.
            self.recent.clear();
            self.show(now, Shown { prompt, advice: None });
            self.asked_at = None;
            return;
        }
        let before = self.recent.back().map(|asked| asked.at).or(self.since);
        let secs = before.map_or(0.0, |before| now.secs_since(before)).min(LONGEST_FRAME_SECS);
        self.recent.push_back(Asked { at: now, secs, prompt, advice });
        while self.recent.front().is_some_and(|old| now.secs_since(old.at) >= RECENT_SECS) {
            self.recent.pop_front();
        }
        let shown = self.shown.prompt;
        let newest = Shown { prompt, advice: Some(advice) };
        if prompt == shown {
            self.since.get_or_insert(now);
            self.last_asked = Some(now);
            self.shown.advice = Some(advice);
        } else if shown != Prompt::Taken
            && (is_other_pose || off.is_some_and(|off| shown.is_done(&off)))
        {
            // Following the old prompt any longer would lead away from the requested pose.
            self.show(now, newest);
        } else if let Some(next) = self.next(now, newest) {
            self.show(now, next);
        }
    }

    /// Prompt to replace the shown prompt, if any.
    fn next(&self, now: CaptureTime, newest: Shown) -> Option<Shown> {
        let Some(since) = self.since else { return Some(newest) };
        let shown_secs = now.secs_since(since);
        if newest.prompt == Prompt::HoldStill && self.shown.prompt != Prompt::Taken {
            return Some(newest);
        }
        let is_too_soon = self.asked_at.is_some_and(|asked| now.secs_since(asked) < NEXT_SECS);
        if shown_secs < DWELL_SECS || is_too_soon {
            return None;
        }
        let (commonest, asked_secs) = self.commonest()?;
        let outdated_secs = self.last_asked.map_or(shown_secs, |asked| now.secs_since(asked));
        if self.shown.prompt == Prompt::HoldStill && outdated_secs < LOST_POSE_SECS {
            return None;
        }
        let is_due = asked_secs >= PERSIST_SECS || outdated_secs >= OUTDATED_SECS;
        (is_due && commonest.prompt != self.shown.prompt)
            .then_some(Shown { prompt: commonest.prompt, advice: Some(commonest.advice) })
    }

    /// The most frequent request of the last frames, in the newest frame's words, and the duration.
    fn commonest(&self) -> Option<(Asked, f64)> {
        let asked_secs = |prompt: Prompt| -> f64 {
            self.recent.iter().filter(|asked| asked.prompt == prompt).map(|asked| asked.secs).sum()
        };
        self.recent
            .iter()
            .map(|asked| (*asked, asked_secs(asked.prompt)))
            .max_by(|(_, a), (_, b)| a.total_cmp(b))
    }

    fn show(&mut self, now: CaptureTime, shown: Shown) {
        let is_at_once = matches!(shown.prompt, Prompt::HoldStill | Prompt::Taken);
        if shown.prompt != self.shown.prompt && !is_at_once {
            self.asked_at = Some(now);
        }
        self.shown = shown;
        (self.since, self.last_asked) = (Some(now), Some(now));
    }

    fn newest_at(&self) -> Option<CaptureTime> {
        self.recent.back().map(|asked| asked.at).max(self.since)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::session::prompt::Edge;

    const FRAME_SECS: f64 = 1.0 / 30.0;

    fn at(secs: f64) -> CaptureTime {
        CaptureTime { nanos: (1e9 * secs) as u64 }
    }

    /// Shows frames with the given `prompts`, and returns the shown prompt after each.
    fn shown(calm: &mut Calm, from_secs: f64, prompts: &[Prompt]) -> Vec<Prompt> {
        prompts
            .iter()
            .enumerate()
            .map(|(i, prompt)| {
                let request =
                    Request { prompt: *prompt, advice: Advice::ShowBoard, off: None, target: 0 };
                calm.note_frame(at(from_secs + i as f64 * FRAME_SECS), &request);
                calm.shown().prompt
            })
            .collect()
    }

    fn frames(prompt: Prompt, secs: f64) -> Vec<Prompt> {
        vec![prompt; (secs / FRAME_SECS).round() as usize]
    }

    #[test]
    fn a_prompt_is_shown_once_it_persists_and_then_stays() {
        let mut calm = Calm::default();
        shown(&mut calm, 0.0, &frames(Prompt::Closer, 3.0));
        assert_eq!(calm.shown().prompt, Prompt::Closer);
        let next = shown(&mut calm, 3.0, &frames(Prompt::Farther, 0.35));
        assert_eq!(next.last(), Some(&Prompt::Closer), "it might be over at once");
        shown(&mut calm, 3.35, &frames(Prompt::Farther, 0.1));
        assert_eq!(calm.shown().prompt, Prompt::Farther);
        let next = shown(&mut calm, 3.45, &frames(Prompt::Closer, 2.4));
        assert_eq!(next.last(), Some(&Prompt::Farther), "it can be read and done");
        shown(&mut calm, 5.85, &frames(Prompt::Closer, 0.2));
        assert_eq!(calm.shown().prompt, Prompt::Closer);
    }

    #[test]
    fn hold_still_taken_and_a_lost_camera_come_at_once() {
        let mut calm = Calm::default();
        shown(&mut calm, 0.0, &frames(Prompt::Closer, 0.2));
        assert_eq!(shown(&mut calm, 0.2, &[Prompt::HoldStill]), [Prompt::HoldStill]);
        assert_eq!(shown(&mut calm, 0.3, &[Prompt::Taken]), [Prompt::Taken]);
        calm.note_state(Some(Prompt::CameraLost));
        assert_eq!(calm.shown().prompt, Prompt::CameraLost);
        assert_eq!(shown(&mut calm, 0.4, &[Prompt::Closer]), [Prompt::CameraLost]);
        calm.note_state(None);
        assert_eq!(shown(&mut calm, 0.5, &[Prompt::Closer]), [Prompt::Closer]);
    }

    #[test]
    fn hold_still_stays_until_the_pose_is_lost() {
        let mut calm = Calm::default();
        shown(&mut calm, 0.0, &frames(Prompt::HoldStill, 2.0));
        let restless: Vec<Prompt> = (0..90)
            .map(|i| if i % 12 == 0 { Prompt::HoldStill } else { Prompt::TipMore })
            .collect();
        let next = shown(&mut calm, 2.0, &restless);
        assert!(next.iter().all(|prompt| *prompt == Prompt::HoldStill));
        shown(&mut calm, 5.0, &frames(Prompt::TipMore, 0.6));
        assert_eq!(calm.shown().prompt, Prompt::TipMore);
    }

    #[test]
    fn after_a_view_only_later_frames_count() {
        let mut calm = Calm::default();
        shown(&mut calm, 0.0, &frames(Prompt::HoldStill, 2.0));
        shown(&mut calm, 2.0, &[Prompt::Taken]);
        let next = shown(&mut calm, 2.1, &frames(Prompt::Tip(Edge::Left), 0.45));
        assert!(next.iter().all(|prompt| *prompt == Prompt::Taken));
        shown(&mut calm, 2.55, &frames(Prompt::Tip(Edge::Left), 0.2));
        assert_eq!(calm.shown().prompt, Prompt::Tip(Edge::Left));
    }

    #[test]
    fn a_prompt_that_nothing_asks_for_any_more_goes_though_none_persists() {
        let mut calm = Calm::default();
        shown(&mut calm, 0.0, &frames(Prompt::ShowBoard, 2.0));
        let flicker: Vec<Prompt> =
            (0..60).map(|i| [Prompt::Closer, Prompt::TipMore, Prompt::TipLess][i % 3]).collect();
        let next = shown(&mut calm, 2.0, &flicker);
        assert_ne!(next.last(), Some(&Prompt::ShowBoard));
        let changes = next.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert_eq!(changes, 1, "{next:?}");
    }

    #[test]
    fn a_clock_that_starts_again_stops_nothing() {
        let mut calm = Calm::default();
        shown(&mut calm, 100.0, &frames(Prompt::Closer, 2.0));
        shown(&mut calm, 0.0, &frames(Prompt::Farther, 0.5));
        assert_eq!(calm.shown().prompt, Prompt::Farther);
    }

    #[test]
    fn the_amounts_are_those_of_the_newest_frame() {
        let mut calm = Calm::default();
        let closer = |wanted| Advice::Distance { span_fraction: 0.2, wanted };
        let mut note = |secs, prompt, wanted| {
            let request = Request { prompt, advice: closer(wanted), off: None, target: 0 };
            calm.note_frame(at(secs), &request);
        };
        note(0.0, Prompt::Closer, 0.5);
        note(0.1, Prompt::Closer, 0.6);
        note(0.2, Prompt::Farther, 0.1);
        assert_eq!(calm.shown(), Shown { prompt: Prompt::Closer, advice: Some(closer(0.6)) });
    }

    proptest! {
        /// A shown prompt, except the immediate ones, stays for its time and seldom changes, for
        /// any requests.
        #[test]
        fn nothing_flickers(asked in proptest::collection::vec(0_usize..6, 1..900)) {
            const PROMPTS: [Prompt; 6] = [
                Prompt::ShowBoard,
                Prompt::Closer,
                Prompt::Farther,
                Prompt::TipMore,
                Prompt::TipLess,
                Prompt::FollowTheOutline,
            ];
            let mut calm = Calm::default();
            let asked: Vec<Prompt> = asked.iter().map(|i| PROMPTS[*i]).collect();
            let shown = shown(&mut calm, 0.0, &asked);
            let changed: Vec<f64> = (1..shown.len())
                .filter(|i| shown[*i] != shown[i - 1])
                .map(|i| i as f64 * FRAME_SECS)
                .collect();
            for pair in changed.windows(2) {
                prop_assert!(pair[1] - pair[0] >= DWELL_SECS - 1e-6, "{changed:?}");
            }
            for (i, from) in changed.iter().enumerate() {
                let within = changed[i..].iter().filter(|at| **at - from < 5.0).count();
                prop_assert!(within <= 2, "{changed:?}");
            }
        }
    }
}
