//! Endings of a session.

/// Reason for taking no more views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The plan is complete, and the precision reached.
    Finished,
    /// Finished except for the picture's corners, where no board came.
    WithoutCorners,
    /// The person or the source ended the session early.
    Early,
    /// Nothing more can be done: no further pose would help, or a worker failed.
    Stopped,
}
