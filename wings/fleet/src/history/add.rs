//! Sessions into the index.

use std::path::{Path, PathBuf};

use anyhow::bail;

use super::index::Index;
use crate::batch::{Row, recorded};
use boresight_app::session::session_folders::session_folders;

/// Counts of [`add`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Added {
    /// Sessions in and below the folders.
    pub sessions: usize,
    /// Sessions with a result in the index.
    pub added: usize,
    /// Sessions without a result.
    pub without: usize,
    /// Sessions removed from the index: deleted, or with an unreadable result.
    pub gone: usize,
    /// Sessions with an unreadable result, in words.
    pub damaged: Vec<String>,
}

/// Reads the results of the sessions in and below `roots` into the index at `path`. Indexed
/// sessions are read again; deleted or damaged ones leave the index, as do deleted roots. `found`
/// is called with the number of sessions, `each` after every one.
///
/// # Errors
///
/// If there are no sessions, a root can't be read, or the index can't.
pub fn add(
    path: &Path,
    roots: &[PathBuf],
    found: impl FnOnce(usize),
    each: impl Fn(),
) -> anyhow::Result<Added> {
    let (mut folders, mut absolute) = (Vec::new(), Vec::new());
    // Fail before the work rather than after.
    let before = Index::open(path)?;
    for root in roots {
        let whole = std::path::absolute(root)?;
        if whole.exists() || !before.has_below(&whole) {
            session_folders(root, &mut |folder| {
                folders.push(folder.to_path_buf());
                Ok(())
            })?;
        }
        absolute.push(whole);
    }
    let knows = absolute.iter().any(|root| before.has_below(root));
    if folders.is_empty() && !knows {
        bail!(
            "there is no session in or below these folders: a session is a folder with a session.toml"
        );
    }
    found(folders.len());
    let mut added = Added { sessions: folders.len(), ..Added::default() };
    let mut rows: Vec<Row> = Vec::new();
    for folder in &folders {
        match recorded(folder) {
            Ok(Some(row)) => rows.push(row),
            Ok(None) => added.without += 1,
            Err(err) => added.damaged.push(format!("{err:#}")),
        }
        each();
    }
    added.added = rows.len();
    added.gone = Index::add_to(path, &rows, &absolute)?;
    Ok(added)
}
