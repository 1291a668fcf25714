//! Somebody's calibration, judged by the page.

use std::path::{Path, PathBuf};

use wasm_bindgen::prelude::{JsError, wasm_bindgen};

use crate::request::told;
use boresight_app::{
    Announcer,
    commands::judgement::{Fresh, judgement},
};
use boresight_formats::import::{OldCalibration, read};
use boresight_guide::session::Session;
use boresight_present::{
    browser::{EndedPage, PageFile},
    report::judgement_page,
    text::phone as words,
};
use boresight_run::config::Config;

/// Calibration to judge, with the name of its file.
pub(crate) struct Given {
    name: PathBuf,
    old: OldCalibration,
}

impl Given {
    pub(crate) fn new(name: &str, text: &str) -> anyhow::Result<Self> {
        Ok(Self { name: name.into(), old: read(text)? })
    }

    /// Adds the judgement by the views of `session` to its `page`.
    pub(crate) fn onto(
        &self,
        page: EndedPage,
        session: &Session,
        config: &Config,
    ) -> anyhow::Result<EndedPage> {
        let fresh = Fresh::of_session(session, config, &Announcer::silent())?;
        let (_, judged) = judgement(&self.name, &self.old, Some(&fresh), None);
        let shown = judgement_page(&judged, Some(&fresh.file)).into_bytes();
        let mut page = page.judged(&judged);
        page.files.push(PageFile::new("judgement.html", words::JUDGEMENT, "text/html", shown));
        Ok(page)
    }
}

/// Judges the calibration `text` of the file `name` without pictures, or by its own corners:
/// `boresight.judgement/1`.
///
/// # Errors
///
/// If the file isn't a known calibration.
#[wasm_bindgen]
pub fn judged_alone(name: &str, text: &str) -> Result<String, JsError> {
    let judged = || {
        let old = read(text)?;
        let params = Config::load(None, &[])?.calibration();
        let own = Fresh::of_own_corners(&old, &params, &Announcer::silent());
        let (_, judged) = judgement(Path::new(name), &old, own.as_ref(), None);
        anyhow::Ok(judged.to_json()?.to_string())
    };
    judged().map_err(told)
}
