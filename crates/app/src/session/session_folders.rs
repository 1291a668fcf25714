//! Sessions and recorded bags in and below a folder.

use std::{
    io::{Error, ErrorKind},
    path::Path,
};

use boresight_capture::is_bag;
use boresight_files::{FileError, entries, is_own_folder};

const HEADER: &str = "session.toml";

/// Finds the sessions in and below `root`, including damaged ones, and hands each absolute path to
/// `found`, sorted. Links below the root aren't followed.
///
/// # Errors
///
/// If the root is no folder, or `found` fails.
pub fn session_folders(
    root: &Path,
    found: &mut dyn FnMut(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    recordings(root, &is_session, found)
}

/// Finds the sessions and the recorded bags in and below `root`, as [`session_folders`] does;
/// `root` may be a bag itself.
///
/// # Errors
///
/// As there.
pub fn sessions_and_bags(
    root: &Path,
    found: &mut dyn FnMut(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let is_one = |path: &Path| is_session(path) || (!path.is_symlink() && is_bag(path));
    recordings(root, &is_one, found)
}

fn is_session(path: &Path) -> bool {
    path.join(HEADER).symlink_metadata().is_ok()
}

fn recordings(
    root: &Path,
    is_one: &dyn Fn(&Path) -> bool,
    found: &mut dyn FnMut(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    if !root.is_dir() && !is_one(root) {
        let why = match root.exists() {
            true => Error::new(ErrorKind::NotADirectory, "it's neither a folder nor a session"),
            false => Error::new(ErrorKind::NotFound, "nothing is there"),
        };
        return Err(FileError::reading(root)(why).into());
    }
    walk(&std::path::absolute(root)?, is_one, found)
}

fn walk(
    path: &Path,
    is_one: &dyn Fn(&Path) -> bool,
    found: &mut dyn FnMut(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    if is_one(path) {
        return found(path);
    }
    if !is_own_folder(path) {
        return Ok(());
    }
    entries(path).iter().try_for_each(|entry| walk(entry, is_one, found))
}
