//! Carries the screen's contents to the simulated person.

use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};

use boresight_geometry::frame::{CaptureTime, FrameId};
use boresight_guide::{
    guidance::{Advice, Progress, Refusal, Target, direction_difference_rad},
    session::{Outcome, Snapshot},
};
use boresight_present::instruction::Instruction;
use boresight_run::pipeline::FrameReport;
use boresight_sim::{
    Cues,
    technician::{Cue, CueKind, Instruction as Asked},
};

/// Minimum relative change of a distance or a shift for another look at the sentence.
const NOTICED_CHANGE: f64 = 0.25;
/// Minimum change of a direction or a tilt for another look at the sentence.
const NOTICED_TURN_RAD: f64 = 0.25;

/// Screen contents and voice of a session, as cues for a simulated person.
#[derive(Clone, Debug, Default)]
pub struct PersonCues {
    last_target: Option<u32>,
    last_instruction: Option<Asked>,
}

/// Sends the cues after each judged frame.
pub(super) struct CueSender {
    link: Sender<(FrameId, Vec<Cue>)>,
    cues: PersonCues,
    /// Session's number of the source's frame 0; a resumed session starts later.
    first_frame: Option<u64>,
}

/// Receives cues for the simulated person.
pub(super) struct CueReceiver {
    link: Receiver<(FrameId, Vec<Cue>)>,
    unread: std::collections::VecDeque<Cue>,
}

/// A connected pair with little room: at most one frame is under way.
pub(super) fn cue_link() -> (CueSender, CueReceiver) {
    let (sender, receiver) = bounded(8);
    let unread = std::collections::VecDeque::new();
    (
        CueSender { link: sender, cues: PersonCues::default(), first_frame: None },
        CueReceiver { link: receiver, unread },
    )
}

impl PersonCues {
    /// New cues on the screen and in the ear after judging the frame captured at `seen_at`.
    pub fn after(&mut self, seen_at: CaptureTime, snapshot: &Snapshot) -> Vec<Cue> {
        let decision = &snapshot.decision;
        let now = Instruction::of(snapshot);
        let mut cues = Vec::new();
        if matches!(decision.outcome, Outcome::Accepted { .. }) {
            cues.push(Cue { seen_at, kind: CueKind::Taken });
        }
        if decision.progress != Progress::Collecting {
            cues.push(Cue { seen_at, kind: CueKind::Finished });
        } else if snapshot.is_led != Some(false)
            && self.last_target != Some(decision.target_serial)
            && now.card.is_some()
            && let Some(target) = &snapshot.target
        {
            self.last_target = Some(decision.target_serial);
            let (ghost_px, target) = (target.ghost_px.clone(), u64::from(decision.target_serial));
            cues.push(Cue { seen_at, kind: CueKind::Show { ghost_px, target } });
        }
        let shown = &snapshot.shown;
        let target = snapshot.target.as_ref();
        let instruction = shown.advice.and_then(|advice| asked_for(&advice, target));
        let instruction = instruction.filter(|_| snapshot.is_led != Some(false));
        let news = match (self.last_instruction, instruction) {
            (Some(last), Some(new)) => !is_same_gist(&last, &new),
            (_, new) => new.is_some(),
        };
        if news && let Some(instruction) = instruction {
            let words = now.sentence(false).split_whitespace().count();
            cues.push(Cue { seen_at, kind: CueKind::Sentence { instruction, words } });
            self.last_instruction = Some(instruction);
        }
        cues
    }
}

impl CueSender {
    /// Sends the cues of a judged frame.
    pub(super) fn send(&mut self, report: FrameReport<'_>) {
        let cues = self.cues.after(report.observation.captured_at, report.snapshot);
        // Without a reader the camera has stopped, and nobody holds the board.
        let id = report.observation.frame_id.0;
        let first = *self.first_frame.get_or_insert(id);
        self.link.send((FrameId(id - first), cues)).ok();
    }
}

/// Request to the person in `advice`; `None` without a request.
fn asked_for(advice: &Advice, target: Option<&Target>) -> Option<Asked> {
    Some(match *advice {
        Advice::ShowBoard => Asked::ShowBoard,
        Advice::ShowWholeFirst => Asked::ShowWholeFirst,
        Advice::TipTowards { wanted_rad: azimuth_rad, .. } => {
            Asked::Tip { azimuth_rad, tilt_rad: target?.tilt_rad }
        }
        Advice::Tilt { wanted_rad: tilt_rad, tilt_azimuth_rad: azimuth_rad, .. } => {
            Asked::Tip { azimuth_rad, tilt_rad }
        }
        Advice::Distance { span_fraction, wanted } => {
            Asked::Distance { ratio: span_fraction / wanted.max(1e-3) }
        }
        Advice::Shift { right_px, down_px } => Asked::Shift { right_px, down_px },
        Advice::HoldStill { .. } | Advice::SteadyTheBoard | Advice::Holding { .. } => {
            Asked::HoldStill
        }
        Advice::Mend { refusal: Refusal::CameraNotReady } | Advice::Finished => return None,
        Advice::Mend { .. } => Asked::MatchGhost,
    })
}

/// True if `new` tells a reader of `last` nothing.
fn is_same_gist(last: &Asked, new: &Asked) -> bool {
    let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= NOTICED_CHANGE * scale;
    match (*last, *new) {
        (Asked::Distance { ratio: a }, Asked::Distance { ratio: b }) => {
            near(libm::log(a), libm::log(b), 1.0) && (a < 1.0) == (b < 1.0)
        }
        (
            Asked::Shift { right_px: right_a, down_px: down_a },
            Asked::Shift { right_px: right_b, down_px: down_b },
        ) => {
            let scale = libm::hypot(right_a, down_a);
            near(right_a, right_b, scale) && near(down_a, down_b, scale)
        }
        (
            Asked::Tip { azimuth_rad: a, tilt_rad: tilt_a },
            Asked::Tip { azimuth_rad: b, tilt_rad: tilt_b },
        ) => {
            direction_difference_rad(a, b).abs() < NOTICED_TURN_RAD
                && (tilt_a - tilt_b).abs() < NOTICED_TURN_RAD
        }
        (a, b) => a == b,
    }
}

impl Cues for CueReceiver {
    fn wait_judged(&mut self, published: Option<FrameId>, patience: Duration) -> bool {
        let Some(published) = published else { return true };
        let deadline = Instant::now() + patience;
        while let Ok((frame, cues)) = self.link.recv_deadline(deadline) {
            self.unread.extend(cues);
            if frame >= published {
                return true;
            }
        }
        false
    }

    fn next_cue(&mut self) -> Option<Cue> {
        self.unread.pop_front()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_asks_the_person_for_what_it_says() {
        let asks = |advice: Advice| asked_for(&advice, None);
        let closer = asks(Advice::Distance { span_fraction: 0.3, wanted: 0.6 });
        assert_eq!(closer, Some(Asked::Distance { ratio: 0.5 }));
        let hold = Advice::HoldStill { speed_px_per_s: None, wanted_px_per_s: 20.0 };
        assert_eq!(asks(hold), asks(Advice::Holding { progress: 0.4 }));
        assert_eq!(asks(hold), Some(Asked::HoldStill));
        assert_eq!(asks(Advice::Finished), None);
        assert_eq!(asks(Advice::TipTowards { tilt_azimuth_rad: None, wanted_rad: 1.0 }), None);
    }

    #[test]
    fn a_few_pixels_more_or_less_are_no_news() {
        let closer = |ratio| Asked::Distance { ratio };
        assert!(is_same_gist(&closer(0.7), &closer(0.8)));
        assert!(!is_same_gist(&closer(0.7), &closer(1.1)));
        assert!(!is_same_gist(&closer(0.4), &closer(0.8)));
        let shift = |right_px| Asked::Shift { right_px, down_px: 10.0 };
        assert!(is_same_gist(&shift(50.0), &shift(45.0)));
        assert!(!is_same_gist(&shift(50.0), &shift(-50.0)));
        let tip = |azimuth_rad| Asked::Tip { azimuth_rad, tilt_rad: 0.7 };
        assert!(is_same_gist(&tip(0.1), &tip(std::f64::consts::TAU - 0.1)));
        assert!(!is_same_gist(&tip(0.0), &tip(1.0)));
        assert!(!is_same_gist(&Asked::HoldStill, &Asked::MatchGhost));
    }
}
