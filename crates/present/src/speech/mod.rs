//! Speech: the words of a session, and the queue that a voice reads them from.
//!
//! [`Narrator`] turns snapshots into words with a rank. [`Queue`] decides which word is begun next and which one is
//! cut short. Both are pure: time is handed in, and whoever has a voice (a program, a browser) speaks. The phone's
//! page follows the same rules in its script.
//!
//! Two kinds of words: *news* happens once (a view was taken, the camera is lost or back). A *request* holds while it's
//! shown; it is offered again and again, so that leaving out an old one loses nothing.

mod narrator;
mod queue;

pub use narrator::Narrator;
pub use queue::{GUIDANCE_GAP_SECS, Queue, REPEAT_SECS, STALE_SECS, Step};

/// Importance of a word; a higher one cuts a lower one short, except news, which is always finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Rank {
    /// Place or direction for the board.
    Guidance,
    /// Keep the board still.
    Hold,
    /// Camera, picture or session are back.
    Back,
    /// Camera, picture or session need attention.
    Lost,
    /// A view was taken, or the session is complete.
    Taken,
}

impl Rank {
    /// True if a sentence of this rank, once begun, is finished.
    pub fn is_news(self) -> bool {
        self >= Self::Back
    }
}

/// Something to say: six spoken words at most, and no number.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Word {
    /// Importance among other words.
    pub rank: Rank,
    /// Words with left and right as seen in the picture.
    pub text: String,
    /// Words with left and right exchanged, for a person who faces the camera.
    pub mirrored: String,
}
