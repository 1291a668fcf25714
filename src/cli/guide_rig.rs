//! Several cameras and one board: `boresight guide --rig`.

use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::sync::atomic::Ordering;

#[cfg(unix)]
use super::status::keys::Keys;
use boresight_app::{
    Announcer, Exit, Host, Opening,
    session::{
        rig_result::RigEnded,
        rig_run::{RigHand, RigOpening, RigRun},
    },
};
use boresight_present::text::rig as words;
use boresight_run::recording::RigSessionCamera;
use boresight_terminal::{print, say, stop_flag, usage::WrongUsage};
#[cfg(feature = "window")]
use {
    boresight_app::{session::rig_run::RigNews, window::services::RigOpened},
    boresight_window::rig_window::run_rig,
};

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

/// Guides in the terminal, calibrates the rig, and writes it into the session's folder.
pub(super) fn in_terminal(run: RigRun, host: &Host, as_json: bool) -> anyhow::Result<Exit> {
    let hand = RigHand::new(stop_flag()?);
    #[cfg(unix)]
    let keys = keys(&hand);
    #[cfg(unix)]
    if keys.is_some() {
        say(words::KEYS);
    }
    printed(host.rig(run, &hand, |_| ())?, as_json).map(|ended| ended.exit)
}

/// The same in a window.
#[cfg(feature = "window")]
pub(super) fn in_window(run: RigRun, host: Host, as_json: bool) -> anyhow::Result<Exit> {
    let (names, hand) = (run.names(), RigHand::new(stop_flag()?));
    let orders = hand.clone();
    let work = Box::new(move |show: &mut dyn FnMut(&RigNews<'_>)| {
        printed(host.rig(run, &orders, show)?, as_json)
    });
    run_rig(RigOpened { names, hand, work })
}

fn printed(ended: RigEnded, as_json: bool) -> anyhow::Result<RigEnded> {
    if as_json {
        print(&ended.json)?;
    }
    Ok(ended)
}

/// Keys of the terminal, if any: take the newest place back, end.
#[cfg(unix)]
fn keys(hand: &RigHand) -> Option<Keys> {
    let hand = hand.clone();
    Keys::start(move |key| match key.to_ascii_lowercase() {
        b'u' => hand.undo.store(true, Ordering::Relaxed),
        b'q' => hand.stop.store(true, Ordering::Relaxed),
        _ => {}
    })
}

/// True if `folder` is the session of several cameras.
pub(super) fn is_rig(folder: &Path) -> bool {
    boresight_run::recording::RigSessionFile::is_in(folder)
}
