//! The session thread: apply an input, write it to the journal, then publish the snapshot.

use std::{collections::VecDeque, sync::Arc};

use crossbeam_channel::Receiver;

use super::live_feed::AcceptedPicture;
use crate::recording::{RecordingError, SessionFolder};
use boresight_geometry::frame::Frame;
use boresight_guide::session::{Decision, Input, Observation, Outcome, Session, Snapshot};

/// A judged frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameReport<'a> {
    /// Result of the detector.
    pub observation: &'a Observation,
    /// State of the session after the frame.
    pub snapshot: &'a Snapshot,
}

/// Called with every judged frame, on the session thread.
pub type OnFrame = Box<dyn FnMut(FrameReport<'_>) + Send>;

/// Applies inputs until [`Input::Stop`] or until every sender is gone, and returns the session.
pub(super) fn run_session(
    mut session: Session,
    mut recorder: Recorder,
    inbox: &Receiver<Input>,
    mut on_frame: OnFrame,
    publish: impl Fn(Snapshot, Option<AcceptedPicture>),
) -> Result<Session, RecordingError> {
    while let Ok(input) = inbox.recv() {
        let decision = session.handle(&input);
        let picture = recorder.record(&session, &input, &decision)?;
        let accepted = match decision.outcome {
            Outcome::Accepted { view, .. } => picture.map(|frame| AcceptedPicture { view, frame }),
            _ => None,
        };
        let snapshot = session.snapshot(decision);
        if let Input::Observed(observation) = &input {
            on_frame(FrameReport { observation, snapshot: &snapshot });
        }
        publish(snapshot, accepted);
        if input == Input::Stop {
            break;
        }
    }
    Ok(session)
}

/// Keeps the pictures still acceptable, and writes everything that must outlast a crash.
pub struct Recorder {
    folder: Option<SessionFolder>,
    record_stream: bool,
    pictures: Receiver<Arc<Frame>>,
    kept: VecDeque<Arc<Frame>>,
}

impl Recorder {
    /// Records into `folder`; `pictures` come from the detector.
    pub(super) fn new(
        folder: Option<SessionFolder>,
        record_stream: bool,
        pictures: Receiver<Arc<Frame>>,
    ) -> Self {
        Self { folder, record_stream, pictures, kept: VecDeque::new() }
    }

    /// Recorder for a caller without threads: each picture goes to [`Self::keep`] before its
    /// observation goes to [`Self::record`].
    pub fn by_hand(folder: SessionFolder) -> Self {
        Self::new(Some(folder), false, crossbeam_channel::never())
    }

    /// Keeps an acceptable picture.
    pub fn keep(&mut self, picture: Arc<Frame>) {
        self.kept.push_back(picture);
    }

    /// Writes the journal line of `decision`, made by `session` on `input`, and the picture.
    /// Returns the picture of an accepted view. After returning, an accepted view outlasts a power
    /// cut.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] if the disk refuses.
    pub fn record(
        &mut self,
        session: &Session,
        input: &Input,
        decision: &Decision,
    ) -> Result<Option<Arc<Frame>>, RecordingError> {
        let mut current = None;
        if let Input::Observed(observation) = input {
            // The detector sends a picture before its observation, so it has arrived.
            while let Ok(picture) = self.pictures.try_recv() {
                self.kept.push_back(picture);
            }
            current = self.kept.iter().find(|picture| picture.id == observation.frame_id).cloned();
        }
        let accepted = match decision.outcome {
            Outcome::Accepted { frame, .. } => Some(frame),
            _ => None,
        };
        let picture =
            accepted.and_then(|id| self.kept.iter().find(|picture| picture.id.0 == id).cloned());
        if let Some(folder) = &mut self.folder {
            // With the whole stream recorded, the accepted frame was stored on arrival.
            let to_store = if self.record_stream { current.clone() } else { picture.clone() };
            let stored = to_store.map(|frame| folder.store_frame(frame.id, &frame)).transpose()?;
            // A picture on the disk without its line would look like a lost line.
            let sync = accepted.is_some()
                || stored.is_some()
                || matches!(decision.outcome, Outcome::Removed { .. })
                || matches!(input, Input::Command(_) | Input::Stop);
            folder.journal_mut().append(input, decision, stored, sync)?;
        }
        if let Some(newest) = current.map(|frame| frame.id) {
            let in_hand = session.frame_in_hand();
            // Pictures of observations still in the inbox are newer than this one.
            self.kept.retain(|picture| picture.id > newest || Some(picture.id) == in_hand);
        }
        Ok(picture)
    }
}
