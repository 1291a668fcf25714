//! Recovery of a damaged session: copies its whole parts into a new one.

use std::path::Path;

use super::{
    Journal, RecordingError,
    folder::{HEADER, HEADER_LIMIT, JOURNAL, SessionFolder, stored_bytes},
};
use boresight_files::{Draft, FileError, Links, Overwrite, make_folder, read, save};
use boresight_geometry::frame::FrameId;

/// Counts of a recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// Lines of the journal.
    pub lines: usize,
    /// Pictures that are missing or damaged and were left out. Their lines are copied, without a picture.
    pub lost_pictures: usize,
}

/// Copies header, whole pictures, and the journal of the session `from` up to the first damage, into the new
/// folder `to`, which appears once it's complete and on the disk.
///
/// # Errors
///
/// [`RecordingError`] if something is at `to` already, if the header can't be read or isn't the journal's, or
/// if a file can't be written.
pub fn recover(from: &Path, to: &Path) -> Result<Recovered, RecordingError> {
    let (_, header_crc32) = SessionFolder::header_with_checksum(from)?;
    let contents = Journal::read_until_damage(&from.join(JOURNAL))?;
    if contents.header_crc32.as_ref().is_some_and(|of_journal| *of_journal != header_crc32) {
        return Err(RecordingError::OtherHeader { path: from.to_path_buf() });
    }
    let draft = Draft::begin(to).map_err(|err| match err {
        FileError::Exists { path } => RecordingError::NotNew { path },
        other => other.into(),
    })?;
    make_folder(&draft.path().join("frames"))?;
    let mut journal = Journal::create(&draft.path().join(JOURNAL), header_crc32)?;
    let mut recovered = Recovered { lines: 0, lost_pictures: 0 };
    for line in &contents.lines {
        let mut line = match line {
            Err(RecordingError::Damaged { .. }) => break,
            line => line?,
        };
        if let Some(stored) = line.stored.take() {
            let name = FrameId(stored.frame).stored_name();
            match stored_bytes(from, &stored) {
                Ok(bytes) => {
                    save(&draft.path().join(name), &bytes, Overwrite::Allowed)?;
                    line.stored = Some(stored);
                }
                Err(_) => recovered.lost_pictures += 1,
            }
        }
        journal.append_line(&line)?;
        recovered.lines += 1;
    }
    journal.sync()?;
    let header = read(&from.join(HEADER), HEADER_LIMIT, Links::Refused)?;
    save(&draft.path().join(HEADER), &header, Overwrite::Never)?;
    draft.complete()?;
    Ok(recovered)
}
