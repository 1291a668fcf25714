//! Several cameras and one board: `boresight guide --rig`.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use super::rig::{self, Announced, Written};
#[cfg(unix)]
use super::status::keys::Keys;
use boresight_app::{
    Announcer, Exit, Opening, Voice,
    session::rig_run::{RigNews, RigOpening, RigRun},
};
use boresight_files::Overwrite;
use boresight_guide::rig::RigPrompt;
use boresight_present::text::rig as words;
use boresight_run::recording::RigSessionCamera;
use boresight_terminal::{say, stop_flag, usage::WrongUsage};
#[cfg(feature = "window")]
use boresight_window::rig::{RigEnded, RigHand, run_rig};

/// Name of the result in the session's folder.
pub(super) const RESULT: &str = "rig.json";
/// Time that a sentence must have been right before it's said: a board passes through many.
const SETTLED: Duration = Duration::from_millis(400);

/// Cameras of a rig, as given.
pub(super) struct Given<'a> {
    /// `NAME=SOURCE` of each camera.
    pub(super) cameras: &'a [String],
    /// `NAME=FILE` of calibrations.
    pub(super) known_lenses: &'a [String],
    pub(super) is_synchronised: bool,
}

impl Given<'_> {
    fn split<'a>(usage: &str, text: &'a str) -> anyhow::Result<(&'a str, &'a str)> {
        let wrong = || WrongUsage(format!("{usage}, not {text:?}")).into();
        text.split_once('=').ok_or_else(wrong)
    }

    /// Opens a new session like `opening`, or resumes the one in its folder.
    pub(super) fn open(&self, opening: &Opening, announcer: &Announcer) -> anyhow::Result<RigRun> {
        let mut cameras = Vec::with_capacity(self.cameras.len());
        for camera in self.cameras {
            cameras.push(Self::split("--rig takes NAME=SOURCE", camera)?);
        }
        if let Some(folder) = &opening.session {
            let like = Opening { session: None, ..opening.clone() };
            let source = |name: &str| {
                let given = cameras.iter().find(|(camera, _)| *camera == name);
                given.map(|(_, source)| (*source).to_owned())
            };
            return RigRun::resume(folder, &like, source, announcer);
        }
        let mut lenses = Vec::with_capacity(self.known_lenses.len());
        for lens in self.known_lenses {
            let (name, path) = Self::split("--known-lens takes NAME=FILE", lens)?;
            if !cameras.iter().any(|(camera, _)| *camera == name) {
                let usage = format!("--known-lens: no camera is called {name:?}");
                return Err(WrongUsage(usage).into());
            }
            lenses.push((name, PathBuf::from(path)));
        }
        let of = |(name, source): (&str, &str)| {
            let lens = lenses.iter().find(|(of, _)| *of == name);
            let known_lens = lens.map(|(_, path)| path.clone());
            let camera = RigSessionCamera { name: name.into(), known_lens };
            (camera, Opening { source: source.into(), out: None, ..opening.clone() })
        };
        RigOpening {
            cameras: cameras.into_iter().map(of).collect(),
            is_synchronised: self.is_synchronised,
            out: opening.out.clone(),
        }
        .open(announcer)
    }
}

/// What speaks beside a rig's session, and how its result is printed.
pub(super) struct Guide {
    pub(super) announcer: Announcer,
    pub(super) voice: Option<Voice>,
    pub(super) as_json: bool,
}

impl Guide {
    /// Guides in the terminal, calibrates the rig, and writes it into the session's folder.
    pub(super) fn in_terminal(self, run: RigRun) -> anyhow::Result<Exit> {
        let stop = stop_flag()?;
        let undo = Arc::new(AtomicBool::new(false));
        #[cfg(unix)]
        let keys = keys(&undo, &stop);
        #[cfg(unix)]
        if keys.is_some() {
            say(words::KEYS);
        }
        Ok(self.carry_out(run, (&stop, &undo), |_| ())?.exit)
    }

    /// The same in a window.
    #[cfg(feature = "window")]
    pub(super) fn in_window(self, run: RigRun) -> anyhow::Result<Exit> {
        let hand = RigHand { stop: stop_flag()?, undo: Arc::new(AtomicBool::new(false)) };
        let (names, orders) = (run.names(), hand.clone());
        run_rig(names, hand, move |show| {
            let Announced { exit, grade, lines } =
                self.carry_out(run, (&orders.stop, &orders.undo), |news| show(news))?;
            Ok(RigEnded { exit, grade, lines })
        })
    }

    fn carry_out(
        &self,
        run: RigRun,
        (stop, undo): (&AtomicBool, &AtomicBool),
        mut each: impl FnMut(&RigNews<'_>),
    ) -> anyhow::Result<Announced> {
        let mut teller = Teller { said: String::new(), newest: None };
        let finished = run.carry_out(stop, undo, &self.announcer, |news| {
            each(news);
            if let Some(sentence) = teller.news(news) {
                self.announcer.ask(sentence);
                if let Some(voice) = &self.voice {
                    voice.request(sentence, sentence);
                }
            }
        })?;
        let out = finished.folder.join(RESULT);
        let page = out.with_extension("html");
        let written = Written {
            out: Some(&out),
            report: cfg!(feature = "report").then_some(page.as_path()),
            overwrite: Overwrite::Allowed,
            as_json: self.as_json,
        };
        rig::calibrate(&finished.names, &finished.views, &finished.config, written)
    }
}

/// Keys of the terminal, if any: take the newest place back, end.
#[cfg(unix)]
fn keys(undo: &Arc<AtomicBool>, stop: &Arc<AtomicBool>) -> Option<Keys> {
    let (undo, stop) = (Arc::clone(undo), Arc::clone(stop));
    Keys::start(move |key| match key.to_ascii_lowercase() {
        b'u' => undo.store(true, Ordering::Relaxed),
        b'q' => stop.store(true, Ordering::Relaxed),
        _ => {}
    })
}

/// Chooses when to say a sentence.
struct Teller {
    said: String,
    newest: Option<(String, Instant)>,
}

impl Teller {
    /// The sentence of `request`, if it's news and has settled.
    fn news(&mut self, request: &RigNews<'_>) -> Option<&str> {
        let since = match self.newest.take() {
            Some((sentence, since)) if sentence == request.sentence => since,
            _ => Instant::now(),
        };
        self.newest = Some((request.sentence.clone(), since));
        let is_settled = since.elapsed() >= SETTLED || request.prompt == RigPrompt::Taken;
        if !is_settled || self.said == request.sentence {
            return None;
        }
        self.said.clone_from(&request.sentence);
        Some(&self.said)
    }
}

/// True if `folder` is the session of several cameras.
pub(super) fn is_rig(folder: &Path) -> bool {
    boresight_run::recording::RigSessionFile::is_in(folder)
}
