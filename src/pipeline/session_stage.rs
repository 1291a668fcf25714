//! What the session's thread does with an input: handle, record, and only then show.

use std::{collections::VecDeque, sync::Arc};

use crossbeam_channel::Receiver;

use super::{live_feed::AcceptedPicture, run::FrameReport};
use crate::{
    frame::{Frame, FrameId},
    recording::{RecordingError, SessionFolder},
    session::{Decision, Input, Outcome, Session, Snapshot},
};

/// Handles the inputs until the last one.
pub(super) fn fold(
    mut session: Session,
    mut recorder: Recorder,
    inbox: &Receiver<Input>,
    first_frame: u64,
    mut judged: Box<dyn FnMut(FrameReport<'_>) + Send>,
    show: impl Fn(Snapshot, Option<AcceptedPicture>),
) -> Result<Session, RecordingError> {
    while let Ok(input) = inbox.recv() {
        let decision = session.handle(&input);
        let picture = recorder.record(&session, &input, &decision, first_frame)?;
        let taken = match decision.outcome {
            Outcome::Accepted { view, .. } => picture.map(|frame| AcceptedPicture { view, frame }),
            _ => None,
        };
        let snapshot = session.snapshot(decision);
        if let Input::Observed(observation) = &input {
            let source_frame = FrameId(observation.frame_id.0 - first_frame);
            judged(FrameReport { source_frame, observation, snapshot: &snapshot });
        }
        show(snapshot, taken);
        if input == Input::Stop {
            break;
        }
    }
    Ok(session)
}

/// Keeps the pictures that may still be accepted, and writes what must outlast a crash.
pub(super) struct Recorder {
    folder: Option<SessionFolder>,
    record_stream: bool,
    pictures: Receiver<Arc<Frame>>,
    kept: VecDeque<Arc<Frame>>,
}

impl Recorder {
    /// Into `folder`, of the `pictures` that the detector sends.
    pub(super) fn new(
        folder: Option<SessionFolder>,
        record_stream: bool,
        pictures: Receiver<Arc<Frame>>,
    ) -> Self {
        Self { folder, record_stream, pictures, kept: VecDeque::new() }
    }

    /// Writes the input down. Returns the picture of a view that was taken.
    fn record(
        &mut self,
        session: &Session,
        input: &Input,
        decision: &Decision,
        first_frame: u64,
    ) -> Result<Option<Arc<Frame>>, RecordingError> {
        let mut current = None;
        if let Input::Observed(observation) = input {
            let id = observation.frame_id.0 - first_frame;
            // The detector sends a picture before its observation, so it is there.
            while let Ok(picture) = self.pictures.try_recv() {
                self.kept.push_back(picture);
            }
            current = self.kept.iter().find(|picture| picture.id.0 == id).cloned();
        }
        let accepted = match decision.outcome {
            Outcome::Accepted { frame, .. } => Some(frame - first_frame),
            _ => None,
        };
        let picture =
            accepted.and_then(|id| self.kept.iter().find(|picture| picture.id.0 == id).cloned());
        if let Some(folder) = &mut self.folder {
            // With the whole stream recorded, the accepted frame was stored when it was seen.
            let to_store = if self.record_stream { current.clone() } else { picture.clone() };
            let stored = to_store
                .map(|frame| folder.store_frame(FrameId(frame.id.0 + first_frame), &frame))
                .transpose()?;
            let sync = accepted.is_some()
                || matches!(decision.outcome, Outcome::Removed { .. })
                || matches!(input, Input::Command(_) | Input::Stop);
            folder.journal_mut().append(input, decision, stored, sync)?;
        }
        let in_hand = session.frame_in_hand().map(|id| id.0 - first_frame);
        let newest = current.map(|frame| frame.id.0);
        if let Some(newest) = newest {
            // Pictures of observations still in the inbox are newer than this one.
            self.kept.retain(|picture| picture.id.0 > newest || Some(picture.id.0) == in_hand);
        }
        Ok(picture)
    }
}
