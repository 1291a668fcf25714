//! A result as the page shows it, with its files.

use std::path::Path;

use crate::{EndedPage, PageFile};
use boresight_app::{
    Announcer, REPORT_FILE,
    export::{self, FORMATS},
    run::Concluded,
};
use boresight_calibrate::{NotCalibrated, Verdict};
use boresight_files::{Links, TEXT_LIMIT, read};
use boresight_guide::{
    guidance::Progress,
    session::{Ending, Session},
};
use boresight_present::text::{self, phone as words};

/// The page about the session in `folder`, which has run and is stored.
pub fn ended_page(
    session: &Session,
    concluded: &Concluded,
    folder: &Path,
    can_restart: bool,
) -> EndedPage {
    let source = concluded.result.source.as_deref().unwrap_or_default();
    let image_size = session.setup().image_size;
    let mut page = EndedPage {
        image_size_px: [image_size.width_px, image_size.height_px],
        can_restart,
        files: files(folder),
        ..EndedPage::default()
    };
    let Some(calibration) = session.calibration() else {
        let reason = session.not_calibrated().unwrap_or(&NotCalibrated::NoViews);
        let (what, action) = text::not_calibrated(reason);
        page.verdict = "none";
        page.aloud = words::NO_CALIBRATION;
        page.what = text::of_source(source, words::NO_CALIBRATION);
        page.action = format!("{what}. {action}");
        return page;
    };
    page.verdict = match calibration.verdict {
        Verdict::Good => "good",
        Verdict::Care => "care",
        Verdict::Untrustworthy => "bad",
    };
    page.aloud = words::aloud(calibration.verdict);
    page.what = text::of_source(source, text::verdict_on(calibration));
    page.findings = calibration
        .findings
        .iter()
        .map(|finding| {
            let (what, action) = text::finding(finding);
            (what, action.to_owned())
        })
        .collect();
    page.action = match (page.findings.first(), session.progress()) {
        (Some((_, action)), _) => action.clone(),
        (None, Progress::Collecting) => text::ending(Ending::Early).to_owned(),
        (None, _) => words::USE_IT.to_owned(),
    };
    page.lines = text::result::result_lines(calibration)
        .into_iter()
        .map(|(name, value)| (name.to_owned(), value))
        .collect();
    let map = concluded.result.projection_sd_px.as_ref().filter(|_| text::knows_sd(calibration));
    page.map = map.map_or_else(Vec::new, |map| map.grid.clone());
    page
}

/// The report and every export that can hold the lens. Files that can't be made are left out: the page has no use for
/// an error.
fn files(folder: &Path) -> Vec<PageFile> {
    let file = |name: &str, label: &str, media_type, bytes: Vec<u8>| PageFile {
        name: name.to_owned(),
        label: label.to_owned(),
        media_type,
        bytes: bytes.into(),
    };
    let report = read(&folder.join(REPORT_FILE), TEXT_LIMIT / 8, Links::Refused).ok();
    let report = report.map(|bytes| file(REPORT_FILE, words::REPORT, "text/html", bytes));
    let exports = FORMATS.iter().filter_map(|format| {
        let exported = export::export(folder, *format, None, &Announcer::silent()).ok()?;
        let bytes = exported.text.into_bytes();
        Some(file(format.file(), format.label(), "application/octet-stream", bytes))
    });
    report.into_iter().chain(exports).collect()
}
