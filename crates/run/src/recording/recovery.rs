//! Copies of a session: of the whole parts of a damaged session, and without private data.

use std::path::Path;

use super::{
    Journal, Line, RecordingError,
    envelope::checksum,
    folder::{HEADER, HEADER_LIMIT, JOURNAL, SessionFolder, stored_bytes},
};
use boresight_files::{Draft, FileError, Links, Overwrite, make_folder, read, save};
use boresight_geometry::frame::FrameId;

/// Counts of a recovery.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// Number of lines of the journal.
    pub lines: usize,
    /// Number of missing or damaged pictures, left out. Their lines are copied, without a picture.
    pub lost_pictures: usize,
}

/// Copies header, whole pictures, and the journal of the session `from` up to the first damage,
/// into the new folder `to`, which appears once it's complete and on the disk.
///
/// # Errors
///
/// [`RecordingError`] if something is at `to` already, if the header can't be read or isn't the
/// journal's, or if a file can't be written.
pub fn recover(from: &Path, to: &Path) -> Result<Recovered, RecordingError> {
    let (_, checksum) = SessionFolder::header_with_checksum(from)?;
    let header = read(&from.join(HEADER), HEADER_LIMIT, Links::Refused)?;
    copied(from, to, (header.as_slice(), checksum), |mut line| {
        let mut lost = false;
        if let Some(stored) = line.stored.take() {
            match stored_bytes(from, &stored) {
                Ok(bytes) => {
                    return Ok((Line { stored: Some(stored), ..line }, Some(bytes), false));
                }
                Err(_) => lost = true,
            }
        }
        Ok((line, None, lost))
    })
}

/// Copies header and journal of the session `from`, up to the first damage, into the new folder
/// `to`, without private data: without pictures, names of pictures, and the certificate's
/// statements; `hide` removes any other private parts from every text. Decisions follow from the
/// copy as from the session.
///
/// # Errors
///
/// As [`recover`]; also if `hide` leaves no journal line.
pub fn copy_for_others(
    from: &Path,
    to: &Path,
    hide: impl Fn(&str) -> String,
) -> Result<Recovered, RecordingError> {
    let (header, _) = SessionFolder::header_with_checksum(from)?;
    let broken = |err: String| FileError::writing(to)(std::io::Error::other(err));
    let header = toml::Value::try_from(header.for_others());
    let mut header = header.map_err(|err| broken(err.to_string()))?;
    hide_in_toml(&mut header, &hide);
    let header = toml::to_string(&header).map_err(|err| broken(err.to_string()))?;
    let of_header = (header.as_bytes(), checksum(header.as_bytes()));
    copied(from, to, of_header, |mut line| {
        line.stored = None;
        if let Some(observed) = line.input.observed_mut() {
            observed.forget_name();
        }
        let mut tree = serde_json::to_value(&line).map_err(|err| broken(err.to_string()))?;
        hide_in_json(&mut tree, &hide);
        let line = serde_json::from_value(tree).map_err(|err| broken(err.to_string()))?;
        Ok((line, None, false))
    })
}

/// Applies `hide` to every text in `tree`; names and numbers stay.
pub fn hide_in_json(tree: &mut serde_json::Value, hide: &impl Fn(&str) -> String) {
    match tree {
        serde_json::Value::String(text) => *text = hide(text),
        serde_json::Value::Array(all) => all.iter_mut().for_each(|each| hide_in_json(each, hide)),
        serde_json::Value::Object(all) => {
            all.values_mut().for_each(|each| hide_in_json(each, hide));
        }
        _ => {}
    }
}

fn hide_in_toml(tree: &mut toml::Value, hide: &impl Fn(&str) -> String) {
    match tree {
        toml::Value::String(text) => *text = hide(text),
        toml::Value::Array(all) => all.iter_mut().for_each(|each| hide_in_toml(each, hide)),
        toml::Value::Table(all) => {
            all.iter_mut().for_each(|(_, each)| hide_in_toml(each, hide));
        }
        _ => {}
    }
}

/// Copies the session `from`, up to the first damage, under `header` with its checksum. `each` maps
/// a line to the line to write, the bytes of its picture, and whether the picture is lost.
fn copied(
    from: &Path,
    to: &Path,
    (header, checksum): (&[u8], String),
    each: impl Fn(Line) -> Result<(Line, Option<Vec<u8>>, bool), RecordingError>,
) -> Result<Recovered, RecordingError> {
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
    let mut journal = Journal::create(&draft.path().join(JOURNAL), checksum)?;
    let mut recovered = Recovered { lines: 0, lost_pictures: 0 };
    for line in &contents.lines {
        let line = match line {
            Err(RecordingError::Damaged { .. }) => break,
            line => line?,
        };
        let (line, picture, is_lost) = each(line)?;
        if let (Some(stored), Some(bytes)) = (&line.stored, picture) {
            let name = FrameId(stored.frame).stored_name();
            save(&draft.path().join(name), &bytes, Overwrite::Allowed)?;
        }
        recovered.lost_pictures += usize::from(is_lost);
        journal.append_line(line)?;
        recovered.lines += 1;
    }
    journal.sync()?;
    save(&draft.path().join(HEADER), header, Overwrite::Never)?;
    draft.complete()?;
    Ok(recovered)
}
