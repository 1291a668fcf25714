//! The folder of a batch's results.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{job::Job, row::OK};
use crate::files::{
    FileError, LineReader, Links, Overwrite, TEXT_LIMIT, copy, make_folder, read, read_text, save,
};

const JOB: &str = "batch.json";
const MANIFEST: &str = "manifest.jsonl";
const ROWS: &str = "items";
const FILES: &str = "files";
/// The largest row.
const ROW_LIMIT: u64 = 16 << 20;

/// A folder that holds results of something else.
#[derive(Debug, thiserror::Error)]
#[error(
    "this folder holds the results of a different batch ({why}); choose a different one with --out: {path:?}"
)]
pub struct OtherJob {
    /// What differs.
    pub why: String,
    /// The folder.
    pub path: PathBuf,
}

/// The folder of a batch's results: `batch.json`, `manifest.jsonl`, `items/AB/ID.json`, and `files/AB/…` for what
/// items write beside their rows.
#[derive(Clone, Debug)]
pub struct Store {
    path: PathBuf,
}

impl Store {
    /// The results in `path`.
    pub fn at(path: &Path) -> Self {
        Self { path: path.to_path_buf() }
    }

    /// Makes the folder, or takes one that is there, for the results of `job` for the items of `manifest`.
    ///
    /// # Errors
    ///
    /// [`OtherJob`], or [`FileError`].
    pub fn prepare(&self, job: &Job, manifest: &Path) -> anyhow::Result<()> {
        make_folder(&self.path)?;
        let text = serde_json::to_string_pretty(job)? + "\n";
        let file = self.path.join(JOB);
        match save(&file, text.as_bytes(), Overwrite::Never) {
            Ok(()) => {}
            Err(FileError::Exists { .. }) => {
                let there = self.job()?;
                if let Some(why) = difference(&there, job) {
                    return Err(OtherJob { why, path: self.path.clone() }.into());
                }
            }
            Err(err) => return Err(err.into()),
        }
        let own = self.manifest();
        if !is_same(manifest, &own)? {
            copy(manifest, &own, Overwrite::Allowed)?;
        }
        Ok(())
    }

    /// What the results are of.
    ///
    /// # Errors
    ///
    /// If there are no results, or those of another version.
    pub fn job(&self) -> anyhow::Result<Job> {
        let file = self.path.join(JOB);
        let text = read_text(&file, TEXT_LIMIT, Links::Refused)?;
        let job: Result<Job, _> = serde_json::from_str(&text);
        job.map_err(|err| anyhow::anyhow!("no batch that this version can read ({err}): {file:?}"))
    }

    /// The manifest that was run last.
    pub fn manifest(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// Where the row of that name is.
    pub fn row_path(&self, id: &str) -> PathBuf {
        self.path.join(ROWS).join(&id[..2]).join(format!("{id}.json"))
    }

    /// Whether the row is there; with `again`, whether it's there and says that the work was done.
    pub fn is_done(&self, id: &str, again: bool) -> bool {
        let path = self.row_path(id);
        if !again {
            return path.symlink_metadata().is_ok();
        }
        self.row(id).is_ok_and(|row| row.is_some_and(|row| row.is_ok()))
    }

    /// Stores a row. If another worker has stored it meanwhile, that one stays, unless it's to be replaced.
    ///
    /// # Errors
    ///
    /// [`FileError::Write`].
    pub fn save_row(&self, id: &str, line: &[u8], replace: bool) -> Result<(), FileError> {
        let path = self.row_path(id);
        make_folder(path.parent().unwrap_or(&self.path))?;
        let overwrite = if replace { Overwrite::Allowed } else { Overwrite::Never };
        match save(&path, line, overwrite) {
            Err(FileError::Exists { .. }) => Ok(()),
            saved => saved,
        }
    }

    /// Stores a file beside the row of that name, before it. Returns its path below the folder.
    pub(super) fn save_file(&self, id: &str, name: &str, bytes: &[u8]) -> anyhow::Result<String> {
        let below = format!("{FILES}/{}/{name}", &id[..2]);
        let path = self.path.join(&below);
        make_folder(path.parent().unwrap_or(&self.path))?;
        save(&path, bytes, Overwrite::Allowed)?;
        Ok(below)
    }

    /// Reads the row of that name; `None` if it isn't there.
    ///
    /// # Errors
    ///
    /// If it can't be read or isn't that row.
    pub(super) fn row(&self, id: &str) -> anyhow::Result<Option<StoredRow>> {
        let path = self.row_path(id);
        let bytes = match read(&path, ROW_LIMIT, Links::Refused) {
            Ok(bytes) => bytes,
            Err(err) if err.is_missing() => return Ok(None),
            Err(err) => return Err(err.into()),
        };
        let text =
            String::from_utf8(bytes).map_err(|_| FileError::NotText { path: path.clone() })?;
        let head: Head = serde_json::from_str(&text)
            .map_err(|err| anyhow::anyhow!("a row is damaged ({err}): {path:?}"))?;
        anyhow::ensure!(head.id == id, "a row has a different name than its file: {path:?}");
        Ok(Some(StoredRow { text, code: head.code }))
    }
}

#[derive(Deserialize)]
struct Head {
    id: String,
    code: String,
}

/// A row as it's stored.
pub(super) struct StoredRow {
    text: String,
    code: String,
}

impl StoredRow {
    /// The line, without its end.
    pub(super) fn line(&self) -> &str {
        self.text.trim_end()
    }

    /// Whether it says that the work was done.
    pub(super) fn is_ok(&self) -> bool {
        self.code == OK
    }
}

/// What differs between two jobs; `None` if nothing does.
fn difference(there: &Job, job: &Job) -> Option<String> {
    if there == job {
        return None;
    }
    let (theirs, ours) = (serde_json::to_value(there).ok()?, serde_json::to_value(job).ok()?);
    let fields = theirs.as_object()?.iter();
    let differs = |(name, value): (&String, &serde_json::Value)| {
        (ours.get(name) != Some(value)).then(|| {
            let ours = ours.get(name).cloned().unwrap_or_default();
            format!("{name}: {value} there, {ours} here")
        })
    };
    Some(fields.filter_map(differs).collect::<Vec<_>>().join("; "))
}

/// Whether the file at `copy` holds the same lines as that at `path`; false if there is no copy.
fn is_same(path: &Path, copy: &Path) -> Result<bool, FileError> {
    if copy.symlink_metadata().is_err() {
        return Ok(false);
    }
    let mut given = LineReader::open(path, 1 << 16, Links::Followed)?;
    let mut own = LineReader::open(copy, 1 << 16, Links::Refused)?;
    let (mut one, mut other) = (Vec::new(), Vec::new());
    loop {
        let (more, also) = (given.read(&mut one)?, own.read(&mut other)?);
        if one != other {
            return Ok(false);
        }
        if !more && !also {
            return Ok(true);
        }
    }
}
