//! Folder of a study: finished parts, so that an interrupted study continues where it stopped.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::{Serialize, de::DeserializeOwned};

use boresight_files::{Links, Overwrite, TEXT_LIMIT, entries, make_folder, read, read_text, save};

const PARTS: &str = "parts";
const PARAMS: &str = "parameters.toml";

/// Folder of a study.
#[derive(Clone, Debug)]
pub struct StudyFolder {
    path: PathBuf,
}

impl StudyFolder {
    /// Creates `path`, or opens a study with the same parameters there. `params` is their TOML
    /// text.
    ///
    /// # Errors
    ///
    /// If the folder holds something else, or can't be written.
    pub fn open(path: &Path, params: &str) -> anyhow::Result<Self> {
        let folder = Self { path: path.to_path_buf() };
        match read_text(&path.join(PARAMS), TEXT_LIMIT, Links::Refused) {
            Ok(before) if before == params => return Ok(folder),
            Ok(_) => bail!(
                "{} holds a study with other parameters: choose another --out",
                path.display()
            ),
            Err(err) if err.is_missing() => {}
            Err(err) => return Err(err.into()),
        }
        if !entries(path).is_empty() {
            bail!("{} is not empty and holds no study: choose another --out", path.display());
        }
        make_folder(&path.join(PARTS))?;
        folder.write(PARAMS, params.as_bytes())?;
        Ok(folder)
    }

    /// True if the part `name` is finished.
    pub fn is_done(&self, name: &str) -> bool {
        self.path.join(format!("{PARTS}/{name}.json")).exists()
    }

    /// Part `name`: loaded if finished, or computed by `work` and stored.
    ///
    /// # Errors
    ///
    /// If `work` has no result or it can't be written.
    pub fn part<T: Serialize + DeserializeOwned>(
        &self,
        name: &str,
        work: impl FnOnce() -> Option<T>,
    ) -> anyhow::Result<T> {
        let file = format!("{PARTS}/{name}.json");
        let before = read(&self.path.join(&file), TEXT_LIMIT, Links::Refused).ok();
        if let Some(part) = before.and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(part);
        }
        let part = work().with_context(|| format!("{name} has no result"))?;
        self.write(&file, &serde_json::to_vec(&part)?)?;
        Ok(part)
    }

    /// Writes a file of the study atomically.
    ///
    /// # Errors
    ///
    /// [`boresight_files::FileError::Write`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        Ok(save(&self.path.join(name), bytes, Overwrite::Allowed)?)
    }
}
