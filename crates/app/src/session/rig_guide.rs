//! A session of several cameras from the first request to the stored result.

use std::time::{Duration, Instant};

use super::{
    rig_result::{RigEnded, RigFiles, conclude_rig},
    rig_run::{RigHand, RigNews, RigRun},
};
use crate::{Announcer, RIG_REPORT, RIG_RESULT};
use boresight_files::Overwrite;
use boresight_guide::rig::RigPrompt;

/// Time that a sentence must have been right before it's said: a board passes through many.
const SETTLED: Duration = Duration::from_millis(400);

/// Guides a person through the places, calibrates the rig, and writes it into the session's
/// folder. `speak` gets each request that is news; `each` is called after all news.
///
/// # Errors
///
/// If a place or the result can't be written; every announced place is on disk.
pub fn guide_rig(
    run: RigRun,
    hand: &RigHand,
    announcer: &Announcer,
    speak: impl Fn(&str),
    mut each: impl FnMut(&RigNews<'_>),
) -> anyhow::Result<RigEnded> {
    let mut requests = Requests { said: String::new(), newest: None };
    let finished = run.carry_out(hand, announcer, |news| {
        each(news);
        if let Some(sentence) = requests.news(news) {
            announcer.ask(sentence);
            speak(sentence);
        }
    })?;
    let out = finished.folder.join(RIG_RESULT);
    let page = finished.folder.join(RIG_REPORT);
    let files = RigFiles {
        out: Some(&out),
        report: cfg!(feature = "report").then_some(page.as_path()),
        picture: &|name, number| finished.picture(name, number),
        is_simulated: finished.is_simulated,
        overwrite: Overwrite::Allowed,
    };
    conclude_rig(&finished.names, &finished.views, &finished.config, files, announcer)
}

/// Chooses when to say a sentence.
struct Requests {
    said: String,
    newest: Option<(String, Instant)>,
}

impl Requests {
    /// The sentence of `request`, if it's news and has settled.
    fn news(&mut self, request: &RigNews<'_>) -> Option<&str> {
        let since = match self.newest.take() {
            Some((sentence, since)) if sentence == request.sentence() => since,
            _ => Instant::now(),
        };
        self.newest = Some((request.sentence().to_owned(), since));
        let is_settled = since.elapsed() >= SETTLED || request.prompt == RigPrompt::Taken;
        if !is_settled || self.said == request.sentence() {
            return None;
        }
        request.sentence().clone_into(&mut self.said);
        Some(&self.said)
    }
}
