//! Log of changes to the disk, in order, for tests that rebuild each possible state after a power
//! cut.

use std::path::Path;

/// A change of the disk.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "disk-log"), allow(dead_code, reason = "nobody listens"))]
pub(super) enum Change<'a> {
    MakeFolder(&'a Path),
    Create(&'a Path),
    Append { path: &'a Path, bytes: &'a [u8] },
    Cut { path: &'a Path, bytes: u64 },
    Rename { from: &'a Path, to: &'a Path },
    Remove(&'a Path),
    SyncFile(&'a Path),
    SyncFolder(&'a Path),
}

#[cfg(not(feature = "disk-log"))]
pub(super) fn note(_change: &Change<'_>) {}

#[cfg(feature = "disk-log")]
pub(super) use listening::note;
#[cfg(feature = "disk-log")]
pub use listening::{DiskLog, LoggedChange};

#[cfg(feature = "disk-log")]
mod listening {
    use std::{
        path::{Path, PathBuf},
        sync::{Mutex, PoisonError},
    };

    use super::Change;

    /// A change of the disk, with paths relative to the log's folder; the folder itself is empty.
    #[derive(Clone, Debug, PartialEq, Eq)]
    #[expect(missing_docs, reason = "as named")]
    pub enum LoggedChange {
        MakeFolder(PathBuf),
        Create(PathBuf),
        Append { path: PathBuf, bytes: Vec<u8> },
        Cut { path: PathBuf, bytes: u64 },
        Rename { from: PathBuf, to: PathBuf },
        Remove(PathBuf),
        SyncFile(PathBuf),
        SyncFolder(PathBuf),
    }

    static LOGS: Mutex<Vec<(PathBuf, Vec<LoggedChange>)>> = Mutex::new(Vec::new());

    /// The changes in a folder, from any thread, during the life of the value.
    #[derive(Debug)]
    pub struct DiskLog {
        root: PathBuf,
    }

    impl DiskLog {
        /// Begins a log of the changes in `root`, an absolute path.
        pub fn of(root: &Path) -> Self {
            let mut logs = LOGS.lock().unwrap_or_else(PoisonError::into_inner);
            logs.push((root.to_path_buf(), Vec::new()));
            Self { root: root.to_path_buf() }
        }

        /// The changes so far, oldest first.
        pub fn changes(&self) -> Vec<LoggedChange> {
            let logs = LOGS.lock().unwrap_or_else(PoisonError::into_inner);
            let own = logs.iter().find(|(root, _)| *root == self.root);
            own.map_or_else(Vec::new, |(_, changes)| changes.clone())
        }
    }

    impl Drop for DiskLog {
        fn drop(&mut self) {
            LOGS.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .retain(|(root, _)| *root != self.root);
        }
    }

    pub(in super::super) fn note(change: &Change<'_>) {
        let mut logs = LOGS.lock().unwrap_or_else(PoisonError::into_inner);
        for (root, changes) in logs.iter_mut() {
            let below = |path: &Path| path.strip_prefix(&*root).ok().map(Path::to_path_buf);
            let logged = match *change {
                Change::MakeFolder(path) => below(path).map(LoggedChange::MakeFolder),
                Change::Create(path) => below(path).map(LoggedChange::Create),
                Change::Append { path, bytes } => {
                    below(path).map(|path| LoggedChange::Append { path, bytes: bytes.to_vec() })
                }
                Change::Cut { path, bytes } => {
                    below(path).map(|path| LoggedChange::Cut { path, bytes })
                }
                Change::Rename { from, to } => {
                    below(from).zip(below(to)).map(|(from, to)| LoggedChange::Rename { from, to })
                }
                Change::Remove(path) => below(path).map(LoggedChange::Remove),
                Change::SyncFile(path) => below(path).map(LoggedChange::SyncFile),
                Change::SyncFolder(path) => below(path).map(LoggedChange::SyncFolder),
            };
            changes.extend(logged);
        }
    }
}
