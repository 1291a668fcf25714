//! New views compared with an older calibration.

use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::{Announcer, RESULT_FILE, SavedSession, session::source::result_named_by};
use boresight_calibrate::{Drift, KnownLens, LensFlaw, NoDrift, OldLens, Verdict, drift};
use boresight_capture::without_secrets;
use boresight_files::{Links, Overwrite, TEXT_LIMIT, entries, read_text, save};
use boresight_formats::{
    CheckFile,
    import::{self, OldCalibration},
};
use boresight_geometry::frame::ImageSize;
use boresight_guide::session::Session;
use boresight_present::text;

/// File name of a comparison in the session's folder.
const CHECK_FILE: &str = "check.json";
/// Most older calibrations or recordings offered.
pub(crate) const MOST_OFFERED: usize = 50;

/// Reason for not holding a calibration to an older calibration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoKnownLens {
    /// The file has a focal length for every view but none for the camera.
    #[error("it has a focal length for each view and none for the camera")]
    FocalVaries,
    /// The size of the pictures differs.
    #[error("it is for pictures of {old} px, and these have {new}")]
    OtherSize {
        /// Size in the older calibration.
        old: ImageSize,
        /// Size of the new pictures.
        new: ImageSize,
    },
    /// The file states no covariance.
    #[error("it states no uncertainty: use a calibration.json of boresight")]
    NoUncertainty,
}

/// Reason for a missing verdict.
#[derive(Debug)]
pub enum NoVerdict {
    /// The file names another camera.
    OtherCamera {
        /// Name in the file.
        old: String,
        /// Name of the source.
        new: String,
    },
    /// The file has a focal length for every view but none for the camera.
    FocalVaries,
    /// The views do not allow a verdict.
    NoDrift(NoDrift),
}

impl NoVerdict {
    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::OtherCamera { .. } => "OTHER-CAMERA",
            Self::FocalVaries => "FOCAL-VARIES",
            Self::NoDrift(reason) => reason.code(),
        }
    }
}

/// Result of a comparison: the change, or the reason for a missing verdict.
pub type Checked = Result<Drift, NoVerdict>;

/// Reads a calibration of any supported program, or of the session in the folder `path`.
///
/// # Errors
///
/// If the session has no result yet, the file can't be read, or [`import::NotImported`].
pub fn read(path: &Path) -> anyhow::Result<OldCalibration> {
    let path = &result_named_by(path)?;
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let mut old = import::read(&text).with_context(|| format!("could not use {path:?}"))?;
    // Older versions kept the password of an address.
    old.source = old.source.map(|name| without_secrets(&name));
    Ok(old)
}

/// Lens of `old`, as the constraint for a calibration from pictures of `image_size`.
///
/// # Errors
///
/// [`NoKnownLens`].
pub fn known_lens(old: &OldCalibration, image_size: ImageSize) -> Result<KnownLens, NoKnownLens> {
    if old.focal_varies {
        return Err(NoKnownLens::FocalVaries);
    }
    if old.image_size != image_size {
        return Err(NoKnownLens::OtherSize { old: old.image_size, new: image_size });
    }
    let covariance = old.covariance.as_ref().ok_or(NoKnownLens::NoUncertainty)?;
    Ok(KnownLens::new(&old.camera, covariance))
}

/// Reason for a missing verdict that needs no views: the lens varies, can't be right, or may never
/// have been.
pub fn not_comparable(old: &OldCalibration) -> Option<NoVerdict> {
    if old.focal_varies {
        return Some(NoVerdict::FocalVaries);
    }
    let flaw = LensFlaw::of(&old.camera, old.image_size, &old.outlines).map(NoDrift::Impossible);
    let reason = flaw.or_else(|| old.covariance.is_none().then_some(NoDrift::NotJudged));
    reason.map(NoVerdict::NoDrift)
}

/// Compares the views of `session` with `old`. Displacements above `limit_px` matter; without it,
/// those above 0.08 % of the picture's width.
///
/// # Errors
///
/// [`NoVerdict`].
pub fn compare(session: &Session, old: &OldCalibration, limit_px: Option<f64>) -> Checked {
    if old.focal_varies {
        return Err(NoVerdict::FocalVaries);
    }
    let lens = OldLens {
        camera: old.camera,
        covariance: old.covariance,
        outlines: &old.outlines,
        image_size: old.image_size,
    };
    let setup = session.setup();
    drift(session.corners_at_one_instant(), &setup.board, setup.image_size, &lens, limit_px)
        .map_err(NoVerdict::NoDrift)
}

/// The result in words, and the next action.
pub fn words(found: &Checked) -> (String, String) {
    let (what, action) = match found {
        Ok(drift) => return text::drift(drift),
        Err(NoVerdict::NoDrift(reason)) => text::no_drift(reason),
        Err(NoVerdict::FocalVaries) => text::focal_varied(),
        Err(NoVerdict::OtherCamera { old, new }) => text::other_camera(old, new),
    };
    (what, action.into())
}

/// Announces the finding, and `action`.
pub fn announce(found: &Checked, action: &str, source: &str, announcer: &Announcer) {
    let say = |line: &str| announcer.say(line);
    let (what, _) = words(found);
    say(&text::of_source(source, &format!("{what}. {action}")));
    let Ok(drift) = found else { return };
    for line in text::drift_numbers(drift) {
        say(&format!("  {line}"));
    }
}

/// The file of a check of `source` against the calibration `old` from the file `against`.
pub fn check_file(
    against: &Path,
    source: &str,
    old: &OldCalibration,
    found: &Checked,
    action: &str,
) -> CheckFile {
    let (what, _) = words(found);
    let found = found.as_ref().map_err(NoVerdict::code);
    let against = against.display().to_string();
    CheckFile::of(found, (&against, source), old.image_size, (&what, action))
}

/// Writes `boresight.check/1` into the session's folder. It follows from the session and the older
/// file, so it may be replaced. Returns the file.
///
/// # Errors
///
/// [`boresight_files::FileError::Write`].
pub fn store(session: &Path, check: &CheckFile) -> anyhow::Result<PathBuf> {
    let file = session.join(CHECK_FILE);
    save(&file, serde_json::to_string_pretty(&check.to_json()?)?.as_bytes(), Overwrite::Allowed)?;
    Ok(file)
}

/// Compares a finished session with the calibration in `against` and writes `check.json`. The
/// report is written separately.
///
/// # Errors
///
/// If `against` can't be read or `check.json` can't be written.
pub fn of_session(
    path: &Path,
    session: &Session,
    source: &str,
    against: &Path,
) -> anyhow::Result<(Compared, Checked)> {
    let old = read(against)?;
    let found = compare(session, &old, None);
    let mut doubts = text::doubts_of_old(&old);
    let other = old.source.as_deref().filter(|named| *named != source);
    doubts.extend(other.map(|named| text::maybe_other_camera(named, source)));
    let (what, action) = words(&found);
    let has_moved = found.as_ref().is_ok_and(|drift| drift.is_significant);
    let is_good = session.calibration().is_some_and(|new| new.verdict == Verdict::Good);
    let action = if has_moved && is_good { text::USE_THE_NEW_ONE.into() } else { action };
    store(path, &check_file(against, source, &old, &found, &action))?;
    let drift = found.as_ref().ok().cloned().map(Box::new);
    let against = against.to_path_buf();
    Ok((Compared { against, what, action, doubts, drift }, found))
}

/// Compares the session in the folder `path` with the calibration in `against`, and rewrites the
/// report.
///
/// # Errors
///
/// As [`of_session`], and if the folder can't be read.
pub fn of_folder(path: &Path, against: &Path, announcer: &Announcer) -> anyhow::Result<Compared> {
    let saved = SavedSession::open(path)?;
    saved.announce(announcer);
    let (compared, _) = of_session(path, &saved.session, &saved.header.source, against)?;
    #[cfg(feature = "report")]
    crate::session::session_report::write_and_announce(path, &saved.session, announcer);
    Ok(compared)
}

/// Results of the sessions beside the session in `folder`, newest first: candidates for a
/// comparison.
pub fn older(folder: &Path) -> Vec<PathBuf> {
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
    let mut files: Vec<PathBuf> = entries(parent.unwrap_or(Path::new(".")))
        .into_iter()
        .filter(|beside| beside.file_name() != folder.file_name())
        .map(|beside| beside.join(RESULT_FILE))
        .filter(|file| file.is_file())
        .collect();
    // Folders are named by their time.
    files.sort_unstable_by(|a, b| b.cmp(a));
    files.truncate(MOST_OFFERED);
    files
}

/// A session compared with an older calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The file with the older calibration.
    pub against: PathBuf,
    /// Verdict in words, or the reason for missing.
    pub what: String,
    /// The next action.
    pub action: String,
    /// Reasons for caution about the verdict.
    pub doubts: Vec<String>,
    /// The change; `None` without a verdict.
    pub drift: Option<Box<Drift>>,
}
