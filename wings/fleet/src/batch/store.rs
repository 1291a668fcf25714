//! Results of a batch.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Deserialize;

use super::{
    address::{FETCHED, missing},
    buckets::Prefix,
    job::Job,
    manifest::ManifestFile,
    place::Place,
    row::OK,
};
use boresight_files::{
    FileError, FileLock, LineReader, Links, Overwrite, TEXT_LIMIT, copy, make_folder, read,
};

const JOB: &str = "batch.json";
const MANIFEST: &str = "manifest.jsonl";
const ROWS: &str = "items";
const FILES: &str = "files";
/// Largest row, in bytes.
const ROW_LIMIT: u64 = 16 << 20;

/// Locks of items under work.
const CLAIMS: &str = "claims";

/// The right to work on an item.
#[derive(Debug)]
pub(super) struct Claim {
    lock: Option<FileLock>,
}

impl Claim {
    /// Releases the claim of an item with a row.
    pub(super) fn finish(self) {
        if let Some(lock) = self.lock {
            lock.finish();
        }
    }
}

/// Error for a folder with the results of a different batch.
#[derive(Debug, thiserror::Error)]
#[error(
    "this folder holds the results of a different batch ({why}); choose a different one with --out: {path:?}"
)]
pub struct OtherJob {
    /// The differences between the two jobs, in words.
    pub why: String,
    /// Path of the results.
    pub path: PathBuf,
}

/// Results of a batch, in a folder or an object store: `batch.json`, `manifest.jsonl`,
/// `items/AB/ID.json`, and `files/AB/…` for files beside the rows.
#[derive(Clone, Debug)]
pub struct Store {
    place: Place,
    /// Rows existing at [`Store::look`], sorted; `None` to look up each row.
    seen: Option<Arc<Vec<u128>>>,
}

impl Store {
    /// Opens the results in `path`, a folder or `s3://BUCKET/PREFIX`.
    ///
    /// # Errors
    ///
    /// For an object store: if this build has none, or the settings or credentials don't suffice.
    pub fn at(path: &Path) -> anyhow::Result<Self> {
        Ok(Self { place: Place::at(path)?, seen: None })
    }

    /// Creates or reuses the folder for the results of `job` for the items of the manifest at
    /// `manifest`.
    ///
    /// # Errors
    ///
    /// [`OtherJob`], [`FileError`], or if an object store can't be used.
    pub fn prepare(&self, job: &Job, manifest: &Path) -> anyhow::Result<()> {
        let text = serde_json::to_string_pretty(job)? + "\n";
        // Read first, as it usually exists: a refused write would cost as much as many finished
        // items.
        let there = match self.place.read(JOB, TEXT_LIMIT)? {
            Some(bytes) => Some(self.job_of(&bytes)?),
            None if self.place.create(JOB, text.as_bytes())? => None,
            None => Some(self.job()?),
        };
        if let Some(why) = there.and_then(|there| difference(&there, job)) {
            return Err(OtherJob { why, path: self.place.path("") }.into());
        }
        match &self.place {
            Place::Folder(folder) => {
                let own = folder.join(MANIFEST);
                if !is_same(manifest, &own)? {
                    copy(manifest, &own, Overwrite::Allowed)?;
                }
                Ok(())
            }
            Place::Cloud(prefix) => store_manifest(prefix, manifest),
        }
    }

    /// Job of the results.
    ///
    /// # Errors
    ///
    /// If there are no results, or those of another version.
    pub fn job(&self) -> anyhow::Result<Job> {
        let file = self.place.path(JOB);
        self.job_of(&self.place.read(JOB, TEXT_LIMIT)?.ok_or_else(|| missing(&file))?)
    }

    fn job_of(&self, job: &[u8]) -> anyhow::Result<Job> {
        let file = self.place.path(JOB);
        let job: Result<Job, _> = serde_json::from_slice(job);
        job.map_err(|err| anyhow::anyhow!("no batch that this version can read ({err}): {file:?}"))
    }

    /// Manifest of the last run.
    ///
    /// # Errors
    ///
    /// If the manifest is in an object store and can't be fetched.
    pub(super) fn manifest(&self) -> anyhow::Result<ManifestFile> {
        ManifestFile::at(&self.place.path(MANIFEST))
    }

    /// True if the results are in an object store.
    pub(super) fn is_remote(&self) -> bool {
        matches!(self.place, Place::Cloud(_))
    }

    /// Notes the existing rows, where single look-ups would take long.
    ///
    /// # Errors
    ///
    /// If an object store can't be used.
    pub(super) fn look(&mut self) -> anyhow::Result<()> {
        let Place::Cloud(prefix) = &self.place else { return Ok(()) };
        let names = prefix.names(ROWS)?;
        let mut seen: Vec<u128> = names.iter().filter_map(|name| number_of(name)).collect();
        seen.sort_unstable();
        self.seen = Some(Arc::new(seen));
        Ok(())
    }

    /// True if the row exists; with `again`, only for successful rows.
    ///
    /// # Errors
    ///
    /// If an object store can't be used.
    pub(super) fn is_done(&self, id: &str, again: bool) -> anyhow::Result<bool> {
        if let Some(seen) = &self.seen {
            let is_seen = number_of(id).is_some_and(|id| seen.binary_search(&id).is_ok());
            if !is_seen || !again {
                return Ok(is_seen);
            }
        }
        if let (Place::Folder(folder), false) = (&self.place, again) {
            return Ok(folder.join(row_name(id)).symlink_metadata().is_ok());
        }
        let row = self.rows(&[id.to_owned()])?.pop();
        Ok(matches!(row, Some(Ok(Some(row))) if row.is_ok()))
    }

    /// Claims the item `id`, until the claim is dropped or the program ends; `None` while another
    /// program has the claim. Claims in an object store exclude nobody.
    ///
    /// # Errors
    ///
    /// If the claim's file can't be created.
    pub(super) fn claim(&self, id: &str) -> Result<Option<Claim>, FileError> {
        let Place::Folder(folder) = &self.place else { return Ok(Some(Claim { lock: None })) };
        let row = folder.join(CLAIMS).join(id);
        make_folder(&folder.join(CLAIMS))?;
        Ok(FileLock::try_for(&row)?.map(|lock| Claim { lock: Some(lock) }))
    }

    /// Stores a row. A row stored meanwhile by another worker stays, unless `replace` is set.
    ///
    /// # Errors
    ///
    /// If the row can't be stored.
    pub fn save_row(&self, id: &str, line: &[u8], replace: bool) -> anyhow::Result<()> {
        if replace {
            return self.place.replace(&row_name(id), line);
        }
        self.place.create(&row_name(id), line).map(|_| ())
    }

    /// Stores a file beside the named row, before the row. Returns its path below the folder.
    pub(super) fn save_file(&self, id: &str, name: &str, bytes: &[u8]) -> anyhow::Result<String> {
        let below = format!("{FILES}/{}/{name}", &id[..2]);
        self.place.replace(&below, bytes)?;
        Ok(below)
    }

    /// Moves the file `below`, left by the work on `id` in the folder `scratch`, to an object
    /// store.
    ///
    /// # Errors
    ///
    /// If the file isn't one of the row, or can't be read or stored.
    pub(super) fn take_file(&self, id: &str, below: &str, scratch: &Path) -> anyhow::Result<()> {
        let beginning = format!("{FILES}/{}/{id}", &id[..2]);
        let rest = below.strip_prefix(&beginning);
        anyhow::ensure!(rest.is_some_and(|rest| !rest.contains('/')), "a worker left a wrong file");
        let bytes = read(&scratch.join(below), TEXT_LIMIT, Links::Refused)?;
        // Another worker may have stored the same.
        self.place.create(below, &bytes).map(|_| ())
    }

    /// Rows of `ids`: each `None` if missing, or an error if unreadable or another row.
    ///
    /// # Errors
    ///
    /// If an object store can't be used.
    pub(super) fn rows(
        &self,
        ids: &[String],
    ) -> anyhow::Result<Vec<anyhow::Result<Option<StoredRow>>>> {
        let names: Vec<String> = ids.iter().map(|id| row_name(id)).collect();
        let read = self.place.read_each(&names, ROW_LIMIT)?;
        let rows = ids.iter().zip(&names).zip(read);
        let parsed = rows.map(|((id, name), bytes)| {
            bytes?.map(|bytes| self.parsed(id, name, bytes)).transpose()
        });
        Ok(parsed.collect())
    }

    fn parsed(&self, id: &str, name: &str, bytes: Vec<u8>) -> anyhow::Result<StoredRow> {
        let path = || self.place.path(name);
        let text = String::from_utf8(bytes).map_err(|_| FileError::NotText { path: path() })?;
        let head: Head = serde_json::from_str(&text)
            .map_err(|err| anyhow::anyhow!("a row is damaged ({err}): {:?}", path()))?;
        anyhow::ensure!(head.id == id, "a row has a different name than its file: {:?}", path());
        Ok(StoredRow { text, code: head.code })
    }
}

/// Path of a row below the store.
fn row_name(id: &str) -> String {
    format!("{ROWS}/{}/{id}.json", &id[..2])
}

/// Number of an id; `name` may end like a row's.
fn number_of(name: &str) -> Option<u128> {
    let id = name.strip_suffix(".json").unwrap_or(name);
    if id.len() == 32 { u128::from_str_radix(id, 16).ok() } else { None }
}

/// Stores `manifest` as the manifest of the batch at `prefix`, unless stored already.
fn store_manifest(prefix: &Prefix, manifest: &Path) -> anyhow::Result<()> {
    loop {
        if let Some(there) = prefix.fetched(MANIFEST)? {
            if is_same(manifest, &there.path().join(FETCHED))? {
                return Ok(());
            }
            return prefix.replace_file(MANIFEST, manifest);
        }
        if prefix.create_file(MANIFEST, manifest)? {
            return Ok(());
        }
        // Another worker was faster: look again.
    }
}

#[derive(Deserialize)]
struct Head {
    id: String,
    code: String,
}

/// A stored row.
pub(super) struct StoredRow {
    text: String,
    code: String,
}

impl StoredRow {
    /// The line, without line end.
    pub(super) fn line(&self) -> &str {
        self.text.trim_end()
    }

    /// True for a successful row.
    pub(super) fn is_ok(&self) -> bool {
        self.code == OK
    }
}

/// All differences between two jobs, in words; `None` if they are equal.
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

/// True if the files at `copy` and `path` have the same lines; false without a copy.
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
