//! Carries what the screen shows to the simulated person.

use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, bounded};

use crate::{
    frame::FrameId,
    guidance::Progress,
    pipeline::FrameReport,
    session::Outcome,
    simulation::{
        Cues,
        technician::{Cue, CueKind},
    },
};

/// Sends what a person would see and hear after each judged frame.
pub(super) struct CueSender {
    link: Sender<(FrameId, Vec<Cue>)>,
    last_target: Option<u32>,
    /// The session's number of the source's frame 0, which a resumed session doesn't begin with.
    first_frame: Option<u64>,
}

/// What the simulated person reads.
pub(super) struct CueReceiver {
    link: Receiver<(FrameId, Vec<Cue>)>,
    unread: std::collections::VecDeque<Cue>,
}

/// A connected pair. One frame is under way at a time, so a little room is enough.
pub(super) fn cue_link() -> (CueSender, CueReceiver) {
    let (sender, receiver) = bounded(8);
    let unread = std::collections::VecDeque::new();
    (
        CueSender { link: sender, last_target: None, first_frame: None },
        CueReceiver { link: receiver, unread },
    )
}

impl CueSender {
    /// Sends what a person would see and hear after this frame.
    pub(super) fn send(&mut self, report: FrameReport<'_>) {
        let decision = &report.snapshot.decision;
        let seen_at = report.observation.captured_at;
        let mut cues = Vec::new();
        if matches!(decision.outcome, Outcome::Accepted { .. }) {
            cues.push(Cue { seen_at, kind: CueKind::Taken });
        }
        if decision.progress != Progress::Collecting {
            cues.push(Cue { seen_at, kind: CueKind::Finished });
        } else if self.last_target != Some(decision.target_serial)
            && let Some(target) = &report.snapshot.target
        {
            self.last_target = Some(decision.target_serial);
            let (ghost_px, target) = (target.ghost_px.clone(), u64::from(decision.target_serial));
            cues.push(Cue { seen_at, kind: CueKind::Show { ghost_px, target } });
        }
        // Without a reader the camera has stopped, and nobody holds the board.
        let id = report.observation.frame_id.0;
        let first = *self.first_frame.get_or_insert(id);
        self.link.send((FrameId(id - first), cues)).ok();
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
