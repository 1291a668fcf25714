use std::{fmt, sync::Arc};

/// Receives every sentence for the person: the command line prints them on stderr. Cheap to clone; callable
/// from any thread.
#[derive(Clone)]
pub struct Announcer {
    say: Arc<dyn Fn(&str) + Send + Sync>,
    /// True if what the person should do now is said, too.
    asks: bool,
    /// True if left and right are those of a person who faces the camera.
    mirrored: bool,
}

impl Announcer {
    /// Passes each sentence to `say`.
    pub fn new(say: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self { say: Arc::new(say), asks: true, mirrored: true }
    }

    /// The same for a person who looks the way the camera looks, or at its picture: left and right are the picture's.
    #[must_use]
    pub fn from_behind(self) -> Self {
        Self { mirrored: false, ..self }
    }

    /// Whether left and right are those of a person who faces the camera.
    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Drops every sentence.
    pub fn silent() -> Self {
        Self::new(|_| ())
    }

    /// The same for a person who sees elsewhere what to do now.
    #[must_use]
    pub fn without_requests(self) -> Self {
        Self { asks: false, ..self }
    }

    /// Announces what the person should do now.
    pub fn ask(&self, sentence: &str) {
        if self.asks {
            self.say(&format!("  {sentence}"));
        }
    }

    /// Announces one sentence, or one line of a table.
    pub fn say(&self, sentence: &str) {
        (self.say)(sentence);
    }
}

impl fmt::Debug for Announcer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Announcer")
    }
}
