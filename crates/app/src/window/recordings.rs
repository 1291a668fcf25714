//! Recorded sessions: list entries, results, and decisions to step through.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::bail;
use image::GrayImage;
use jiff::{Timestamp, tz::TimeZone};
use serde_json::Value;

use crate::{
    JournalReading, REPORT_FILE, RESULT_FILE, RIG_REPORT, RIG_RESULT, SavedSession,
    session::{
        comparison::MOST_OFFERED,
        source::{PathKind, is_session, kind_of},
    },
};
use boresight_calibrate::Verdict;
use boresight_files::{Links, TEXT_LIMIT, entries, read, read_text};
use boresight_formats::{CalibrationFile, RigFile};
use boresight_guide::session::{Input, Snapshot, ViewNumber};
use boresight_present::{grade::Grade, text};
use boresight_run::recording::{
    CameraTable, Header, Replayed, RigSessionFile, SessionFolder, Stored, stored_frame,
};

/// Folder of a session's pictures.
const FRAMES: &str = "frames";
/// Largest picture read for a list, in bytes.
const PICTURE_LIMIT: u64 = 64 << 20;

/// Loads the stored picture of a frame; `None` if missing or unreadable.
pub type LoadPicture = Box<dyn Fn(u64) -> Option<GrayImage> + Send>;

/// Largest side of the picture in a list.
const SMALL_PX: u32 = 192;

/// A recorded session in a list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recording {
    /// Folder of the recording.
    pub folder: PathBuf,
    /// Start in local time.
    pub when: String,
    /// Name of the camera, and picture size.
    pub camera: String,
    /// Verdict in words, or a note of a missing verdict.
    pub verdict: String,
    /// Gravity of the verdict; `None` without one.
    pub judged: Option<Verdict>,
    /// Views used by the calibration; `None` without one.
    pub views: Option<usize>,
    /// Report, if written.
    pub report: Option<PathBuf>,
    /// True for a session of several cameras: its report shows the result.
    pub is_rig: bool,
}

/// Kind of a path dropped onto the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dropped {
    /// A session's folder.
    Session,
    /// A folder of pictures, a video, or a recorded bag.
    Source,
    /// Another file: perhaps a calibration.
    File,
}

/// Final state of a stored session.
pub struct StoredSession {
    /// The last state.
    pub snapshot: Snapshot,
    /// Pictures of the views.
    pub pictures: Vec<(ViewNumber, GrayImage)>,
    /// Name of the source.
    pub source: String,
    /// Files with the result.
    pub files: Vec<PathBuf>,
}

/// A recording with decisions made again.
pub struct DecidedRecording {
    /// The state after each input; at least one.
    pub steps: Vec<Snapshot>,
    /// Steps decided differently by the build, from 0.
    pub different: Vec<usize>,
    /// Folder as named by the person.
    pub name: String,
    /// Loader of stored pictures.
    pub load: LoadPicture,
}

/// The recordings in `folders`, newest first.
pub fn within(folders: &BTreeSet<PathBuf>) -> Vec<Recording> {
    let folders = folders.iter().flat_map(|folder| entries(folder));
    let mut found: Vec<(String, Recording)> = folders
        .filter_map(|folder| match SessionFolder::header(&folder) {
            Ok(header) => Some((header.created.clone(), listed(folder, &header))),
            Err(_) => listed_rig(folder),
        })
        .collect();
    found.sort_by(|(a, one), (b, other)| b.cmp(a).then_with(|| other.folder.cmp(&one.folder)));
    found.into_iter().map(|(_, recording)| recording).take(MOST_OFFERED).collect()
}

/// Folders in `folder`, sorted, each with true if it holds a session. Without hidden ones.
pub fn folders_in(folder: &Path) -> Vec<(PathBuf, bool)> {
    let is_hidden =
        |path: &Path| path.file_name().is_none_or(|name| name.as_encoded_bytes().starts_with(b"."));
    let folders = entries(folder).into_iter().filter(|path| path.is_dir() && !is_hidden(path));
    folders.map(|path| (path.clone(), is_session(&path))).collect()
}

/// JSON in `file`, if readable.
fn tree(file: &Path) -> Option<Value> {
    let text = read_text(file, TEXT_LIMIT, Links::Refused).ok()?;
    serde_json::from_str(&text).ok()
}

/// Verdict with the name `code`, and its grade in words.
fn judged_as(code: Option<&str>, unfinished: bool) -> (Option<Verdict>, &'static str) {
    let all = [Verdict::Good, Verdict::Care, Verdict::Untrustworthy];
    let judged = all.into_iter().find(|verdict| Some(verdict.code()) == code);
    let in_words = |verdict| text::grade(Grade::by(verdict, unfinished));
    (judged, judged.map_or(text::sessions::NO_RESULT, in_words))
}

/// Start and list entry of the session of several cameras in `folder`, if it holds one.
fn listed_rig(folder: PathBuf) -> Option<(String, Recording)> {
    let session = RigSessionFile::read(&folder).ok()?;
    let names: Vec<&str> = session.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let Header { created, source, .. } =
        names.iter().find_map(|name| SessionFolder::header(&folder.join(name)).ok())?;
    let file = tree(&folder.join(RIG_RESULT)).and_then(|tree| RigFile::read(&tree).ok());
    let unfinished = file.as_ref().is_some_and(RigFile::is_unfinished);
    let (judged, verdict) = judged_as(file.as_ref().map(|file| &*file.verdict), unfinished);
    let report = folder.join(RIG_REPORT);
    let listed = Recording {
        when: local(&created),
        camera: text::sessions::cameras(&names, session.places().len()),
        verdict: text::of_source(&source, verdict),
        judged,
        views: None,
        report: report.is_file().then_some(report),
        is_rig: true,
        folder,
    };
    Some((created, listed))
}

/// List entry of the session in `folder`.
fn listed(folder: PathBuf, header: &Header) -> Recording {
    let result = tree(&folder.join(RESULT_FILE)).and_then(|tree| CalibrationFile::read(&tree).ok());
    let calibrated = result.filter(|file| file.result.is_some());
    let unfinished = calibrated.as_ref().is_some_and(CalibrationFile::is_unfinished);
    let (judged, verdict) = judged_as(calibrated.as_ref().map(|file| &*file.verdict), unfinished);
    let name = header.camera.as_ref().map_or(header.source.as_str(), CameraTable::name);
    let report = folder.join(REPORT_FILE);
    Recording {
        when: local(&header.created),
        camera: text::sessions::camera(name, header.image_size()),
        verdict: text::of_source(&header.source, verdict),
        judged,
        views: calibrated.map(|file| file.views.iter().filter(|view| view.used).count()),
        report: report.is_file().then_some(report),
        is_rig: false,
        folder,
    }
}

/// A time stamp in local time; unchanged if unparsable.
fn local(stamp: &str) -> String {
    let zoned = |stamp: Timestamp| stamp.to_zoned(TimeZone::system());
    stamp.parse::<Timestamp>().map_or_else(
        |_| stamp.to_owned(),
        |stamp| zoned(stamp).strftime("%-d %B %Y, %H:%M").to_string(),
    )
}

/// Thumbnail of the newest stored picture of the session in `folder`, of the first camera if it has
/// several; `None` without a readable picture.
pub fn small_picture(folder: &Path) -> Option<GrayImage> {
    let first = RigSessionFile::read(folder).ok().and_then(|rig| rig.cameras.into_iter().next());
    let session = first.map_or_else(|| folder.to_path_buf(), |camera| folder.join(camera.name));
    let newest =
        entries(&session.join(FRAMES)).into_iter().filter(|file| is_picture(file)).max()?;
    let bytes = read(&newest, PICTURE_LIMIT, Links::Refused).ok()?;
    let image = image::load_from_memory(&bytes).ok()?.into_luma8();
    let factor = f64::from(SMALL_PX) / f64::from(image.width().max(image.height()).max(1));
    let side = |px: u32| ((f64::from(px) * factor).round() as u32).max(1);
    let (width, height) = image.dimensions();
    Some(image::imageops::thumbnail(&image, side(width), side(height)))
}

/// True if the session in `folder` has stored a picture: that of a view, or of a recorded stream.
pub fn keeps_pictures(folder: &Path) -> bool {
    entries(&folder.join(FRAMES)).iter().any(|file| is_picture(file))
}

fn is_picture(file: &Path) -> bool {
    file.extension().is_some_and(|ending| ending == "png")
}

/// Kind of `path`: a session, pictures to calibrate from, or another file.
pub fn dropped(path: &Path) -> Dropped {
    match kind_of(path) {
        Some(PathKind::Session) => Dropped::Session,
        Some(PathKind::Bag | PathKind::Video | PathKind::Folder) => Dropped::Source,
        None => Dropped::File,
    }
}

/// Final state of the session in `folder`, with the recorded views.
///
/// # Errors
///
/// As [`SavedSession::open`].
pub fn stored(folder: &Path) -> anyhow::Result<StoredSession> {
    let SavedSession { header, mut session, contents, .. } = SavedSession::open(folder)?;
    let decision = session.handle(&Input::Resumed);
    let picture = |frame: u64| {
        let stored = contents.stored.iter().find(|stored| stored.frame == frame)?;
        stored_frame(folder, stored).ok()
    };
    let pictures = session
        .accepted()
        .iter()
        .filter_map(|view| Some((view.number, picture(view.view.frame_id.0)?)))
        .collect();
    let files = [REPORT_FILE, RESULT_FILE].map(|name| folder.join(name));
    Ok(StoredSession {
        snapshot: session.snapshot(decision),
        pictures,
        source: header.source,
        files: files.into_iter().filter(|file| file.is_file()).collect(),
    })
}

/// Decides the recording in `folder` again.
///
/// # Errors
///
/// If the folder can't be read, or its journal is empty.
pub fn open(folder: &Path) -> anyhow::Result<DecidedRecording> {
    let journal = JournalReading::of(folder)?;
    let mut steps = Vec::new();
    let again = journal.decide_again(&journal.header.config, |session, decision| {
        steps.push(session.snapshot(*decision));
    })?;
    decided(folder, steps, &again.replayed, journal.contents.stored)
}

/// A recording to step through: the state after each input, and the steps decided differently by
/// this build.
///
/// # Errors
///
/// If there is no step.
pub fn decided(
    folder: &Path,
    steps: Vec<Snapshot>,
    replayed: &Replayed,
    stored: Vec<Stored>,
) -> anyhow::Result<DecidedRecording> {
    if steps.is_empty() {
        bail!("this recording is empty");
    }
    let different = replayed.different_lines.iter().map(|line| line - 1).collect();
    let name = folder.display().to_string();
    let folder = folder.to_path_buf();
    let load = move |frame: u64| {
        let stored = stored.iter().find(|stored| stored.frame == frame)?;
        stored_frame(&folder, stored).ok()
    };
    Ok(DecidedRecording { steps, different, name, load: Box::new(load) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Host, Opening};
    use boresight_run::config::Config;

    #[test]
    fn whatever_can_be_a_source_is_one_when_it_is_dropped() -> anyhow::Result<()> {
        let place = tempfile::tempdir()?;
        let at = |name: &str| place.path().join(name);
        let sources = ["a.mp4", "a.wmv", "a.MTS", "a.gif", "a.3gp", "a.flv", "a.mcap", "a.db3"];
        for name in sources.into_iter().chain(["calibration.json", "camera.yaml"]) {
            std::fs::write(at(name), b"")?;
            let wanted = if sources.contains(&name) { Dropped::Source } else { Dropped::File };
            assert_eq!(dropped(&at(name)), wanted, "{name}");
        }
        assert_eq!(dropped(place.path()), Dropped::Source);
        std::fs::write(at("session.toml"), b"")?;
        assert_eq!(dropped(place.path()), Dropped::Session, "opening it says what is wrong");
        Ok(())
    }

    #[test]
    fn a_list_tells_when_of_what_and_how_it_ended() -> anyhow::Result<()> {
        let place = tempfile::tempdir()?;
        let folder = place.path().join("one");
        let config = Config::load(None, &["guidance.plan=\"quick\"".into()])?;
        let opening = Opening {
            out: Some(folder.clone()),
            max_frames: Some(300),
            ..Opening::new("sim", config)
        };
        let host = Host::silent();
        let finished = host.finish(host.open(&opening)?)?;
        let views = finished.session.accepted().len();
        let open = within(&BTreeSet::from([place.path().into()]));
        assert_eq!((open[0].judged, open[0].views), (None, None), "it isn't concluded");
        host.conclude(Ok(finished))?;
        let listed = within(&BTreeSet::from([place.path().into()]));
        let [one] = listed.as_slice() else { anyhow::bail!("{listed:?}") };
        assert_eq!(one.folder, folder);
        assert!(one.verdict.contains("SIMULATED"), "{}", one.verdict);
        assert!(one.camera.starts_with("sim, 1280 × 720"), "{}", one.camera);
        assert!(one.when.contains(':') && !one.when.contains('Z'), "{}", one.when);
        assert_eq!(one.views, Some(views));
        let picture = small_picture(&folder).ok_or_else(|| anyhow::anyhow!("a picture"))?;
        assert_eq!(picture.dimensions(), (192, 108));
        let stored = stored(&folder)?;
        assert_eq!((stored.pictures.len(), stored.snapshot.views.len()), (views, views));
        assert!(stored.snapshot.calibration.is_some());
        Ok(())
    }
}
