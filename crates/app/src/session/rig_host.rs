//! A session of several cameras from the first request to the stored result.

use std::time::{Duration, Instant};

use super::{
    host::Host,
    rig_result::{RigEnded, RigFiles, conclude_rig},
    rig_run::{RigHand, RigNews, RigRun},
};
use crate::{RIG_REPORT, RIG_RESULT};
use boresight_files::Overwrite;
use boresight_guide::rig::RigPrompt;

/// Least age of a request before its sentence: a moving board passes through many requests.
const SETTLED: Duration = Duration::from_millis(400);

impl Host {
    /// Guides a person through the places, calibrates the rig, and writes it into the session's
    /// folder. `each` is called after all news.
    ///
    /// # Errors
    ///
    /// If a place or the result can't be written; every announced place is on disk.
    pub fn rig(
        &self,
        run: RigRun,
        hand: &RigHand,
        mut each: impl FnMut(&RigNews<'_>),
    ) -> anyhow::Result<RigEnded> {
        let (names, companions) = (run.names(), self.companions());
        companions.iter().for_each(|companion| companion.rig_opens(&run));
        let mut requests = Requests { said: String::new(), newest: None };
        let finished = run.carry_out(hand, self.announcer(), |news| {
            companions.iter().for_each(|companion| companion.rig_news(news, &names, hand));
            each(news);
            if let Some(sentence) = requests.news(news) {
                self.announcer().ask(sentence);
                companions.iter().for_each(|companion| companion.rig_asks(sentence));
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
        let (views, config) = (&finished.views, &finished.config);
        let ended = conclude_rig(&finished.names, views, config, files, self.announcer())?;
        companions.iter().for_each(|companion| companion.rig_ended(&ended, &finished.folder));
        Ok(ended)
    }
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
