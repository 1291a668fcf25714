//! Several cameras and one board: each camera keeps its [`Session`](crate::session::Session), and
//! a [`RigSession`] leads them to common places.
//!
//! The fold takes a session's [`Snapshot`](crate::session::Snapshot) and returns orders for the
//! sessions. Cameras without a trigger take a moment's pictures at different times, so a place is
//! taken only while the board rests in every camera that sees it.
//!
//! | file | question |
//! |---|---|
//! | `rest` | how long has the board been at rest in a camera? |
//! | `plan` | calibration so far, and the place with the most gain? |
//! | `lead` | when to take a place, and from which cameras? |
//! | `prompt` | the one sentence to say? |

mod lead;
mod plan;
mod prompt;
mod rest;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod world;

pub use lead::{Order, Place, RigSession};
pub use plan::{Plan, Wanted, plan};
pub use prompt::RigPrompt;
