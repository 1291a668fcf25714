//! Speech: the words of a session, and the queue for the voice.
//!
//! [`Narrator`] turns snapshots into ranked words. [`Queue`] picks the next word to say and cuts
//! others short. Both are pure: the caller passes the time in, and speaks. The phone's page follows
//! the same rules in its script.
//!
//! There are two kinds of words: *news* happens once (a view was taken, the camera is lost or
//! back). A *request* holds while it's shown; it is offered repeatedly, so leaving out an old
//! request loses nothing.

mod narrator;
mod queue;

pub use narrator::Narrator;
pub use queue::{GUIDANCE_GAP_SECS, Queue, REPEAT_SECS, STALE_SECS, Step};

/// Importance of a word; a higher rank cuts a lower one short, except news, which is always
/// finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rank {
    /// Position or direction for the board.
    Guidance,
    /// Keep the board still.
    Hold,
    /// Camera, picture or session is back.
    Back,
    /// Camera, picture or session needs attention.
    Lost,
    /// View taken, or session complete.
    Taken,
}

impl Rank {
    /// True for news: a sentence of this rank, once begun, is finished.
    pub fn is_news(self) -> bool {
        self >= Self::Back
    }
}

/// Words to say: six at most, and no number.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Word {
    /// Importance among other words.
    pub rank: Rank,
    /// Words with left and right as seen in the picture.
    pub text: String,
    /// Words with left and right exchanged, for a person facing the camera.
    pub mirrored: String,
}
