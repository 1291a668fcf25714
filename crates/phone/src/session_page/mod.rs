//! The phone's page beside a session, or beside a watched camera being pushed back: links, and
//! result.

mod head;
mod led;
mod result;

use std::{
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::Builder,
    time::Duration,
};

pub use head::Head;
pub use result::ended_page;

use crate::{AdjustPage, EndedPage, Hub, Links, QrCode, Server, Setup, Stage};
use boresight_app::{
    Announcer, Companion,
    session::{
        rig_result::RigEnded,
        rig_run::{RigHand, RigNews, RigRun},
        run::{Concluded, Run},
    },
};
use boresight_geometry::frame::Frame;
use boresight_guide::session::Session;
use boresight_present::text::phone as words;
use boresight_run::pipeline::Onlookers;

/// Serving time of the result after the last page has left.
const LINGER_SECS: f64 = 30.0;
const LOOK: Duration = Duration::from_millis(100);

/// Served page. Beside a [`boresight_app::Host`], it shows and commands each session.
pub struct Phone {
    hub: Arc<Hub>,
    server: Server,
    can_restart: bool,
}

impl Phone {
    /// Serves the page, which shows that a session is being opened until one begins.
    ///
    /// # Errors
    ///
    /// [`crate::ServeError`].
    pub fn start(setup: &Setup) -> anyhow::Result<Self> {
        let hub = Arc::new(Hub::new());
        let server = Server::start(setup, Arc::clone(&hub))?;
        Ok(Self { hub, server, can_restart: false })
    }

    /// Page that offers to leave a result for another session.
    #[must_use]
    pub fn restarting(self) -> Self {
        Self { can_restart: true, ..self }
    }

    /// Hub, which observes a session.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Valid links to the page.
    pub fn links(&self) -> Vec<Links> {
        self.server.links()
    }

    /// See [`Server::code`].
    pub fn code(&self) -> impl Fn() -> Vec<String> + Send + Sync + 'static {
        self.server.code()
    }

    /// Announces the links, the likeliest one also as a QR code; and the next links when the
    /// owner's is used up.
    pub fn announce(&self, announcer: &Announcer) {
        let links = self.links();
        let Some(first) = links.first() else { return };
        if let Some(port) = self.server.taken_port() {
            announcer.say(&words::port_is_taken(port));
        }
        announcer.say(words::SCAN);
        announce_owners(&links, announcer);
        announcer.say(&words::watchers(&first.watcher));
        let announcer = announcer.clone();
        self.server.when_used(move |links| {
            let (announcer, links) = (announcer.clone(), links.to_vec());
            let announce = move || {
                announcer.say(words::SCAN_NEXT);
                announce_owners(&links, &announcer);
            };
            // Pages don't wait for an unread terminal.
            Builder::new().name("links".into()).spawn(announce).ok();
        });
    }

    /// Shows the action to push a watched camera with `lens` back.
    pub fn adjusting(&self, frame: &Arc<Frame>, page: AdjustPage) {
        self.hub.adjusting(frame, page);
    }

    /// Shows `words` and waits until nobody looks at the last page any more, or until `stop` is
    /// set. Returns at once if there never was a page. True if two more views are requested.
    pub fn linger(&self, stop: &AtomicBool, words: &str, announcer: &Announcer) -> bool {
        let is_needed =
            || self.hub.pages() > 0 || self.hub.alone_secs().is_some_and(|secs| secs < LINGER_SECS);
        if is_needed() {
            announcer.say(words);
        }
        while is_needed() && !stop.load(Ordering::Relaxed) {
            if self.hub.take_more() {
                return true;
            }
            std::thread::sleep(LOOK);
        }
        false
    }
}

impl Companion for Phone {
    fn onlookers(&self) -> Onlookers {
        vec![Arc::clone(&self.hub) as _]
    }

    fn opening(&self) {
        self.hub.show(Stage::Starting);
    }

    fn opens(&self, run: &Run) {
        self.hub.opens(run.open.truth.is_some(), run.board_in_words());
    }

    fn ending(&self) {
        self.hub.show(Stage::Ending);
    }

    fn ended(&self, session: &Session, concluded: &Concluded, can_go_on: bool) {
        let page = ended_page(session, concluded, &concluded.path, self.can_restart);
        self.hub.show(Stage::Ended(Arc::new(EndedPage { can_go_on, ..page })));
    }

    fn rig_opens(&self, run: &RigRun) {
        self.hub.show(Stage::Starting);
        self.hub.opens(run.is_simulated(), run.board_in_words());
    }

    fn rig_news(&self, news: &RigNews<'_>, names: &[String], hand: &RigHand) {
        self.lead(news, names, hand);
    }

    fn rig_ended(&self, ended: &RigEnded, folder: &Path) {
        let page = EndedPage::of_rig(ended.file.as_ref(), ended.grade, led::files(folder));
        self.hub.show(Stage::Ended(page.into()));
    }
}

fn announce_owners(links: &[Links], announcer: &Announcer) {
    let [first, others @ ..] = links else { return };
    for line in QrCode::of(&first.owner).iter().flat_map(QrCode::lines) {
        announcer.say(&line);
    }
    announcer.say(&words::link(&first.owner));
    for other in others {
        announcer.say(&words::other_link(&other.owner));
    }
}
