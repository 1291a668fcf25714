use std::{fmt, sync::Arc};

/// Receives every sentence for the person; the command line prints them on stderr. Cheap to clone;
/// callable from any thread.
#[derive(Clone)]
pub struct Announcer {
    say: Arc<dyn Fn(&str) + Send + Sync>,
    /// True if requests to the person are announced, too.
    asks: bool,
    /// True if left and right are mirrored for a person facing the camera.
    mirrored: bool,
}

impl Announcer {
    /// Passes each sentence to `say`.
    pub fn new(say: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self { say: Arc::new(say), asks: true, mirrored: true }
    }

    /// Copy for a person behind the camera, or looking at its picture: left and right are the
    /// picture's.
    #[must_use]
    pub fn from_behind(self) -> Self {
        Self { mirrored: false, ..self }
    }

    /// True if left and right are mirrored for a person facing the camera.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Drops every sentence.
    pub fn silent() -> Self {
        Self::new(|_| ())
    }

    /// Copy without requests, for a person reading elsewhere.
    #[must_use]
    pub fn without_requests(self) -> Self {
        Self { asks: false, ..self }
    }

    /// Announces a request to the person.
    pub fn ask(&self, sentence: &str) {
        if self.asks {
            self.say(&format!("  {sentence}"));
        }
    }

    /// Announces a sentence or a line of a table.
    pub fn say(&self, sentence: &str) {
        (self.say)(sentence);
    }
}

impl fmt::Debug for Announcer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Announcer")
    }
}
