//! The sessions in and below a folder.

use std::{io::ErrorKind, path::Path};

use boresight_files::{FileError, entries, is_own_folder};

const HEADER: &str = "session.toml";

/// Finds the sessions in and below `root`, damaged ones, too, in the order of their paths, which are absolute, and hands
/// each to `found`. Links below the root aren't followed.
///
/// # Errors
///
/// If the root is no folder, or `found` fails.
pub fn session_folders(
    root: &Path,
    found: &mut dyn FnMut(&Path) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    if !root.is_dir() {
        let kind = if root.exists() { ErrorKind::NotADirectory } else { ErrorKind::NotFound };
        return Err(FileError::reading(root)(kind.into()).into());
    }
    walk(&std::path::absolute(root)?, found)
}

fn walk(folder: &Path, found: &mut dyn FnMut(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
    if folder.join(HEADER).symlink_metadata().is_ok() {
        return found(folder);
    }
    entries(folder)
        .iter()
        .filter(|entry| is_own_folder(entry))
        .try_for_each(|entry| walk(entry, found))
}
