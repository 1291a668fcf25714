use std::{fmt, sync::Arc};

/// Receives every sentence for the person: the command line prints them on stderr. Cheap to clone; callable
/// from any thread.
#[derive(Clone)]
pub struct Announcer(Arc<dyn Fn(&str) + Send + Sync>);

impl Announcer {
    /// Passes each sentence to `say`.
    pub fn new(say: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self(Arc::new(say))
    }

    /// Drops every sentence.
    pub fn silent() -> Self {
        Self::new(|_| ())
    }

    /// Announces one sentence, or one line of a table.
    pub fn say(&self, sentence: &str) {
        (self.0)(sentence);
    }
}

impl fmt::Debug for Announcer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Announcer")
    }
}
