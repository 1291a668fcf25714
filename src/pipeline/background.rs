//! Work that a window must not wait for.

use std::thread::{Builder, JoinHandle};

use super::{
    PipelineError,
    latest::{LatestReceiver, latest},
};

/// Something that is being brought to its end. Joined when dropped, so that nothing is left half written.
#[derive(Debug)]
pub struct Background<T> {
    outcome: LatestReceiver<T>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Background<T> {
    /// Does `work` on a thread of its own.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start(work: impl FnOnce() -> T + Send + 'static) -> Result<Self, PipelineError> {
        let (outcome_in, outcome) = latest();
        let thread = Builder::new()
            .name("ending".into())
            .spawn(move || {
                // Nobody hears the outcome if the window has gone.
                outcome_in.publish(work()).ok();
            })
            .map_err(|source| PipelineError::Spawn { worker: "ending", source })?;
        Ok(Self { outcome, thread: Some(thread) })
    }

    /// What came of it, once. Never waits.
    pub fn outcome(&self) -> Option<T> {
        self.outcome.try_recv()
    }

    /// Whether no outcome will come any more: it was taken, or the work panicked.
    pub fn is_over(&self) -> bool {
        self.outcome.is_closed()
    }
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // A panic has been printed by its thread; there is nothing to add.
            thread.join().ok();
        }
    }
}
