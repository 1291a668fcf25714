//! A temporary session taken from a recorded bag.

use std::path::{Path, PathBuf};

use anyhow::Context;

use boresight_app::{Host, Opening};
use boresight_files::Scratch;
use boresight_run::config::Config;

/// A session in a temporary folder, deleted on drop.
#[derive(Debug)]
pub(super) struct TakenSession {
    path: PathBuf,
    _folder: Scratch,
}

impl TakenSession {
    /// Guides through the pictures of the bag at `path`, with `settings` for the board and all
    /// else; also returns the error of a broken-off bag.
    ///
    /// # Errors
    ///
    /// If the settings are wrong, or the bag has no readable picture.
    pub(super) fn from_bag(
        path: &Path,
        settings: &[String],
    ) -> anyhow::Result<(Self, Option<String>)> {
        let folder = Scratch::new()?;
        let host = Host::silent();
        let source = path.to_str().context("its name isn't UTF-8")?;
        let session = folder.path().join("session");
        let opening = Opening {
            out: Some(session.clone()),
            ..Opening::new(source, Config::load(None, settings)?)
        };
        let finished = host.finish(host.open(&opening)?)?;
        let broken = finished.session.failures().first().map(|(_, how)| how.clone());
        host.conclude(Ok(finished))?;
        Ok((Self { path: session, _folder: folder }, broken))
    }

    /// The session's folder.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}
