//! Several cameras and one board: `boresight guide --rig`.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use super::rig;
#[cfg(unix)]
use super::status::keys::Keys;
use boresight_app::{
    Announcer, Exit, Opening, Voice,
    session::rig_run::{RigOpening, RigRequest, RigRun},
};
use boresight_files::Overwrite;
use boresight_guide::rig::RigPrompt;
use boresight_present::text::rig as words;
use boresight_run::recording::RigSessionCamera;
use boresight_terminal::{say, stop_flag, usage::WrongUsage};

/// Name of the result in the session's folder.
const RESULT: &str = "rig.json";
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
    fn open(&self, opening: &Opening, announcer: &Announcer) -> anyhow::Result<RigRun> {
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

    /// Guides in the terminal, and calibrates the rig.
    pub(super) fn run(
        &self,
        opening: &Opening,
        voice: Option<&Voice>,
        announcer: &Announcer,
        as_json: bool,
    ) -> anyhow::Result<Exit> {
        let run = self.open(opening, announcer)?;
        carry_out(run, voice, announcer, as_json)
    }
}

/// Guides in the terminal, calibrates the rig, and writes it into the session's folder.
pub(super) fn carry_out(
    run: RigRun,
    voice: Option<&Voice>,
    announcer: &Announcer,
    as_json: bool,
) -> anyhow::Result<Exit> {
    let stop = stop_flag()?;
    let undo = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    let keys = keys(&undo, &stop);
    #[cfg(unix)]
    if keys.is_some() {
        say(words::KEYS);
    }
    let mut teller = Teller { said: String::new(), newest: None };
    let finished = run.carry_out(&stop, &undo, announcer, |request| {
        if let Some(sentence) = teller.news(request) {
            announcer.ask(sentence);
            if let Some(voice) = voice {
                voice.request(sentence, sentence);
            }
        }
    })?;
    let out = finished.folder.join(RESULT);
    let written = (Some(out.as_path()), Overwrite::Allowed, as_json);
    rig::calibrate(&finished.names, &finished.views, &finished.config, written)
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
    fn news(&mut self, request: &RigRequest) -> Option<&str> {
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
