//! Work that a batch does on each item.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::item::{Item, hex};
use boresight_files::{Links, TEXT_LIMIT, read};
use boresight_guide::guidance::RULES;

/// Name and version of the format.
pub const JOB_SCHEMA: &str = "boresight.batch/1";

/// What is done with a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// The session's own result is taken as it is.
    Recorded,
    /// Every decision is made again, and compared with the recorded one.
    Replay,
    /// The same, with the board found again in the stored pictures.
    Redetect,
    /// The recorded views are calibrated again.
    Calibrate,
    /// The recorded views are compared with an older calibration.
    Check,
    /// The report is written.
    Report,
    /// The result is written for another program.
    Export,
}

/// What is done with each item of a batch, and all that a result depends on beside the session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Job {
    /// [`JOB_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.batch/1")))]
    pub schema: String,
    /// What is done.
    pub action: Action,
    /// Settings that differ from a session's own, `KEY=VALUE`.
    pub settings: Vec<String>,
    /// The calibration that every session is compared with; null if each has its own.
    pub against: Option<String>,
    /// SHA-256 of that file.
    pub against_sha256: Option<String>,
    /// The format of an export.
    pub format: Option<String>,
    /// Version of the program, `+`, and the hash of its sources.
    pub version: String,
    /// Version of the rules by which it takes views.
    pub guidance_rules: u32,
}

impl Job {
    /// Job for `action` by the program of version `version`, with no changed setting. Programs with
    /// different decisions have different versions.
    pub fn new(action: Action, version: &str) -> Self {
        Self {
            schema: JOB_SCHEMA.into(),
            action,
            settings: Vec::new(),
            against: None,
            against_sha256: None,
            format: None,
            version: version.into(),
            guidance_rules: RULES,
        }
    }

    /// Compares every session with the calibration in `file`.
    ///
    /// # Errors
    ///
    /// If the file can't be read, or its path isn't UTF-8.
    pub fn against(self, file: &Path) -> anyhow::Result<Self> {
        let bytes = read(file, TEXT_LIMIT, Links::Followed)?;
        let path = std::path::absolute(file)?;
        let against = path.to_str().map(str::to_owned);
        let against = against.ok_or_else(|| anyhow::anyhow!("the name isn't UTF-8: {path:?}"))?;
        let sha256 = hex(&hmac_sha256::Hash::hash(&bytes));
        Ok(Self { against: Some(against), against_sha256: Some(sha256), ..self })
    }

    /// Name of the result of `item`: a hash of all its inputs.
    pub fn id_of(&self, item: &Item) -> Id {
        let mut hash = hmac_sha256::Hash::new();
        let format = self.format.as_deref().unwrap_or_default();
        let old = self.against_sha256.as_deref().unwrap_or_default();
        let rules = self.guidance_rules.to_string();
        let action = format!("{:?}", self.action);
        let fixed = [&item.session, &item.content, &self.version, &rules, &action, format, old];
        let settings = self.settings.iter().map(String::as_str);
        for part in fixed.into_iter().chain(settings) {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part);
        }
        let mut id = [0; 16];
        id.copy_from_slice(&hash.finalize()[..16]);
        Id(id)
    }
}

/// Name of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Id([u8; 16]);

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&hex(&self.0))
    }
}
