//! A named thread, always joined, that reports its own death.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    thread::{Builder, JoinHandle},
};

use crossbeam_channel::Sender;

use super::error::PipelineError;
use boresight_geometry::panic_message;
use boresight_guide::session::Input;

pub(super) struct Worker<T> {
    name: &'static str,
    handle: JoinHandle<Option<T>>,
}

impl<T: Send + 'static> Worker<T> {
    /// Runs `body` on a thread called `name`; a panic becomes [`Input::WorkerFailed`].
    pub(super) fn spawn(
        name: &'static str,
        inbox: Sender<Input>,
        body: impl FnOnce() -> T + Send + 'static,
    ) -> Result<Self, PipelineError> {
        let run = move || match catch_unwind(AssertUnwindSafe(body)) {
            Ok(value) => Some(value),
            Err(payload) => {
                let reason =
                    panic_message::panic_message(&*payload).unwrap_or_else(|| "panicked".into());
                // If the session is gone too, its own join reports that.
                inbox.send(Input::WorkerFailed { worker: name.into(), reason }).ok();
                None
            }
        };
        let handle = Builder::new()
            .name(name.into())
            .spawn(run)
            .map_err(|source| PipelineError::Spawn { worker: name, source })?;
        Ok(Self { name, handle })
    }

    pub(super) fn join(self) -> Result<T, PipelineError> {
        let Self { name, handle } = self;
        handle.join().ok().flatten().ok_or(PipelineError::WorkerPanicked { worker: name })
    }
}
