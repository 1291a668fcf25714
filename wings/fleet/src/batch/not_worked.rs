//! Failures of items.

/// Reason for a failed item, beside the errors of the session.
#[derive(Debug, thiserror::Error)]
pub enum NotWorked {
    /// The session is another one by now.
    #[error("the session has changed since the manifest was written")]
    Changed,
    /// There is nothing to compare with.
    #[error("the session names no older calibration to be compared with")]
    NoOldCalibration,
    /// A recorded bag ended early.
    #[error("{0}")]
    BrokenBag(String),
}
