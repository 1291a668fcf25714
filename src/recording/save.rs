//! Writes whole files so that they are either the old or the new ones, never half of one.

use std::{fs::File, io::Write, path::Path};

use super::RecordingError;

/// How the names of files begin that are not written to the end yet.
pub(super) const UNFINISHED: &str = ".boresight-";

/// Whether an existing file may be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overwrite {
    /// Refuse with [`RecordingError::Exists`].
    Never,
    /// Replace it.
    Allowed,
}

/// Writes `bytes` beside `path`, syncs, renames, and syncs the folder.
///
/// # Errors
///
/// [`RecordingError::Exists`] or [`RecordingError::Write`]; the old file, if any, is then untouched.
pub fn save(path: &Path, bytes: &[u8], overwrite: Overwrite) -> Result<(), RecordingError> {
    let failed = |source| RecordingError::Write { source, path: path.to_path_buf() };
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    // As readable as the journal beside it; the umask takes away what the person doesn't want to share.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut beside = builder.prefix(UNFINISHED).tempfile_in(folder).map_err(failed)?;
    beside.write_all(bytes).map_err(failed)?;
    beside.as_file().sync_all().map_err(failed)?;
    match overwrite {
        Overwrite::Allowed => drop(beside.persist(path).map_err(|err| failed(err.error))?),
        Overwrite::Never => drop(beside.persist_noclobber(path).map_err(|err| {
            if err.error.kind() == std::io::ErrorKind::AlreadyExists {
                RecordingError::Exists { path: path.to_path_buf() }
            } else {
                failed(err.error)
            }
        })?),
    }
    // Without this the new name itself could be lost with the power.
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed)
}
