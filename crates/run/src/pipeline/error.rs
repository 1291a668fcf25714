//! Errors of a pipeline.

use crate::recording::RecordingError;

/// A pipeline failure.
#[derive(Debug, thiserror::Error)]
pub enum PipelineError {
    /// The operating system refused a thread.
    #[error("could not start the {worker} thread")]
    Spawn {
        /// Name of the thread.
        worker: &'static str,
        /// The system's error.
        source: std::io::Error,
    },
    /// A thread panicked.
    #[error("the {worker} thread failed")]
    WorkerPanicked {
        /// Name of the thread.
        worker: &'static str,
    },
    /// The session could not be recorded; everything acknowledged before is safe.
    #[error("the session could not be recorded")]
    Recording(#[from] RecordingError),
}
