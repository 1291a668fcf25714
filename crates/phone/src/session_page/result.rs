//! Result with files, as shown by the page.

use std::path::Path;

use crate::{EndedPage, PageFile};
use boresight_app::{
    Announcer, REPORT_FILE,
    session::{
        export::{self, Format, offered},
        run::Concluded,
    },
};
use boresight_files::{Links, TEXT_LIMIT, read};
use boresight_guide::session::Session;
use boresight_present::text::phone as words;

/// Page about the ended and stored session in `folder`.
pub fn ended_page(
    session: &Session,
    concluded: &Concluded,
    folder: &Path,
    can_restart: bool,
) -> EndedPage {
    EndedPage { can_restart, ..EndedPage::of(session, &concluded.result, files(folder)) }
}

/// The report at `path`; `None` if it can't be read.
pub(super) fn report(path: &Path) -> Option<PageFile> {
    let bytes = read(path, TEXT_LIMIT / 8, Links::Refused).ok()?;
    let name = path.file_name()?.to_str()?;
    Some(PageFile::new(name, words::REPORT, "text/html", bytes))
}

/// Report and exports that can hold the lens. Files that can't be made are left out: the page has
/// no use for an error.
fn files(folder: &Path) -> Vec<PageFile> {
    let report = report(&folder.join(REPORT_FILE));
    report.into_iter().chain(exports(folder, offered(false))).collect()
}

/// The result in `input` in each of `formats` that can hold it.
pub(super) fn exports(input: &Path, formats: Vec<Format>) -> impl Iterator<Item = PageFile> {
    formats.into_iter().filter_map(move |format| {
        let exported = export::export(input, format, None, None, &Announcer::silent()).ok()?;
        let bytes = exported.text.into_bytes();
        Some(PageFile::new(format.file(), format.label(), "application/octet-stream", bytes))
    })
}
