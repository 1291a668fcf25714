//! The phone's page beside a session, or beside a watched camera that's pushed back: its links, and the result that it
//! shows.

mod adjust;
mod head;
mod result;

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use adjust::adjust_page;
pub use head::Head;
pub use result::ended_page;

use crate::{Hub, Links, QrCode, Server, Setup, Stage};
use boresight_app::{Announcer, Opening, run::Concluded, watch::Step};
use boresight_guide::session::Session;
use boresight_present::text::phone as words;
use boresight_run::pipeline::Onlookers;
use boresight_watch::Lens;

/// Time for which the result is served after the last page has left.
const LINGER_SECS: f64 = 30.0;
const LOOK: Duration = Duration::from_millis(100);

/// A page that is being served.
pub struct Phone {
    hub: Arc<Hub>,
    server: Server,
}

impl Phone {
    /// Serves the page, which says that a session is being opened until one begins.
    ///
    /// # Errors
    ///
    /// [`crate::ServeError`].
    pub fn start(setup: &Setup) -> anyhow::Result<Self> {
        let hub = Arc::new(Hub::new());
        let server = Server::start(setup, Arc::clone(&hub))?;
        Ok(Self { hub, server })
    }

    /// The hub, which looks on at a session.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// The links to the page.
    pub fn links(&self) -> &[Links] {
        self.server.links()
    }

    /// Announces the links, the likeliest one as a QR code, too.
    pub fn announce(&self, announcer: &Announcer) {
        let [first, others @ ..] = self.links() else { return };
        announcer.say(words::SCAN);
        for line in QrCode::of(&first.owner).iter().flat_map(QrCode::lines) {
            announcer.say(&line);
        }
        announcer.say(&words::link(&first.owner));
        for other in others {
            announcer.say(&words::other_link(&other.owner));
        }
        announcer.say(&words::watchers(&first.watcher));
    }

    /// Shows what to do to push a watched camera with that lens back.
    pub fn adjusting(&self, step: &Step<'_>, lens: &Lens) {
        self.hub.adjusting(step.frame, adjust_page(step, lens));
    }

    /// Shows that the result is being computed.
    pub fn ending(&self) {
        self.hub.show(Stage::Ending);
    }

    /// Shows the result of the session in `folder`.
    pub fn ended(&self, session: &Session, concluded: &Concluded, folder: &Path) {
        self.hub.show(Stage::Ended(Arc::new(ended_page(session, concluded, folder, false))));
    }

    /// Opens, runs and concludes a session that the page shows, beside `others` who look on. With `can_restart`, the
    /// page offers to leave its result for another session.
    ///
    /// # Errors
    ///
    /// As [`Opening::open`], [`boresight_app::Run::carry_out`] and [`boresight_app::FinishedRun::conclude`].
    pub fn session(
        &self,
        opening: &Opening,
        others: &Onlookers,
        (stop, can_restart): (&AtomicBool, bool),
        announcer: &Announcer,
    ) -> anyhow::Result<Concluded> {
        self.hub.show(Stage::Starting);
        let run = opening.open(announcer)?.paced();
        let mut onlookers = others.clone();
        onlookers.push(Arc::clone(&self.hub) as _);
        let finished = run.carry_out_before(stop, &onlookers, announcer)?;
        self.hub.show(Stage::Ending);
        let (session, folder) = (finished.session.clone(), finished.path.clone());
        let concluded = finished.conclude(announcer)?;
        let page = ended_page(&session, &concluded, &folder, can_restart);
        self.hub.show(Stage::Ended(Arc::new(page)));
        Ok(concluded)
    }

    /// Waits until nobody looks at the last page any more, saying `words`, or until `stop` is set. If there never was a
    /// page, it doesn't wait.
    pub fn linger(&self, stop: &AtomicBool, words: &str, announcer: &Announcer) {
        let is_needed =
            || self.hub.pages() > 0 || self.hub.alone_secs().is_some_and(|secs| secs < LINGER_SECS);
        if is_needed() {
            announcer.say(words);
        }
        while is_needed() && !stop.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
        }
    }
}
