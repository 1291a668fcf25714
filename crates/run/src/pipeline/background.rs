//! Runs a closure on a named background thread, joined on drop.

use std::thread::{Builder, JoinHandle};

use super::{
    error::PipelineError,
    latest::{LatestReceiver, latest},
};

const NAME: &str = "background";

/// Work on a background thread. Joined on drop, so nothing stays half written.
#[derive(Debug)]
pub struct Background<T> {
    outcome: LatestReceiver<T>,
    thread: Option<JoinHandle<()>>,
}

impl<T: Send + 'static> Background<T> {
    /// Starts `work`.
    ///
    /// # Errors
    ///
    /// [`PipelineError::Spawn`].
    pub fn start(work: impl FnOnce() -> T + Send + 'static) -> Result<Self, PipelineError> {
        let (outcome_in, outcome) = latest();
        let thread = Builder::new()
            .name(NAME.into())
            .spawn(move || {
                // The window may have closed meanwhile; then the outcome is unused.
                outcome_in.publish(work()).ok();
            })
            .map_err(|source| PipelineError::Spawn { worker: NAME, source })?;
        Ok(Self { outcome, thread: Some(thread) })
    }

    /// The outcome, once. Never waits.
    pub fn outcome(&self) -> Option<T> {
        self.outcome.try_recv()
    }

    /// True if no outcome will come: already taken, or the work panicked.
    pub fn is_over(&self) -> bool {
        self.outcome.is_closed()
    }
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            // The thread has printed a panic; there is nothing to add.
            thread.join().ok();
        }
    }
}
