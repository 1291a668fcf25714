//! How a session ends.

/// Why no more views are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// The plan is complete, and its precision reached.
    Finished,
    /// The same but for the picture's corners, where boards didn't reach.
    WithoutCorners,
    /// The person or the source ended it before that.
    Early,
    /// Nothing more can be done: no further pose would help, or a worker failed.
    Stopped,
}
