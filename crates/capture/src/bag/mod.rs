//! Recorded bags: MCAP files, and databases (`.db3`) of ROS 2, with pictures in messages of ROS 2.
//!
//! | file | holds |
//! |---|---|
//! | `files` | the files of a bag, and their formats |
//! | `message` | contents of a bag |
//! | `mcap`, `db3` | the messages of one topic in a file |
//! | `source` | their pictures as a frame source |
//! | `copy` | a copy of a bag with the calibration in it |
//! | `flaw` | reasons of a bag without pictures |

#[cfg(feature = "bags")]
mod copy;
#[cfg(feature = "bags")]
mod db3;
#[cfg(feature = "bags")]
mod files;
mod flaw;
#[cfg(feature = "bags")]
mod mcap;
#[cfg(feature = "bags")]
mod message;
#[cfg(feature = "bags")]
mod source;

use std::path::{Path, PathBuf};

#[cfg(feature = "bags")]
pub use copy::{CopiedBag, NotCopied, copy_with};
pub use flaw::BagFlaw;
#[cfg(feature = "bags")]
pub use source::Bag;

/// Endings of a bag's files.
const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".db3.zstd"];
/// File in the folder of a bag.
const METADATA: &str = "metadata.yaml";

fn is_bag_file(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).map(str::to_ascii_lowercase);
    name.is_some_and(|name| ENDINGS.iter().any(|ending| name.ends_with(ending))) && path.is_file()
}

/// True if `path` is a bag by name: a file, or a folder made by ROS 2.
pub fn is_bag(path: &Path) -> bool {
    let holds_one = || {
        let mut entries = path.read_dir().into_iter().flatten().flatten();
        entries.any(|entry| is_bag_file(&entry.path()))
    };
    is_bag_file(path) || (path.join(METADATA).is_file() && holds_one())
}

/// The files of the bag at `path` in the order of their numbers.
///
/// # Errors
///
/// If the folder can't be listed.
pub fn bag_files(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_path_buf()]);
    }
    let mut files = Vec::new();
    for entry in path.read_dir()? {
        files.push(entry?.path());
    }
    files.retain(|file| is_bag_file(file));
    // `bag_10` follows `bag_9`.
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    Ok(files)
}
