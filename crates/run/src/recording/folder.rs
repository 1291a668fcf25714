//! The folder of a session.

use std::{
    collections::BTreeMap,
    fs::{File, TryLockError},
    io::Cursor,
    path::{Path, PathBuf},
};

use image::{
    GrayImage, ImageEncoder, ImageError,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use serde::{Deserialize, Serialize};

use super::{
    CameraTable, Journal, JournalContents, RecordedOutcome, RecordingError, Stored,
    envelope::checksum,
};
use crate::config::{CameraConfig, CertificateConfig, Config};
use boresight_capture::{PICTURE_LIMIT_PX, Upright, decoded};
use boresight_files::{
    FileError, Links, Overwrite, UNFINISHED, entries, is_own_folder, is_still_at, make_folder,
    open, read, read_text, save,
};
use boresight_geometry::{
    device::CameraInfo,
    frame::{Frame, FrameId, ImageSize},
};
use boresight_guide::guidance::RULES;

/// Version of everything in the folder. A newer version is refused, never rewritten.
const SCHEMA: &str = "boresight.session/1";
const SCHEMA_NAME: &str = "boresight.session/";
pub(super) const HEADER: &str = "session.toml";
pub(super) const JOURNAL: &str = "journal.jsonl";
const FRAMES: &str = "frames";
/// Size limits in bytes of the header and of a stored picture.
pub(super) const HEADER_LIMIT: u64 = 1 << 20;
const FRAME_LIMIT: u64 = 512 << 20;

/// Contents of `session.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the folder's contents.
    pub schema: String,
    /// Start of the session, UTC.
    pub created: String,
    /// Name of the source.
    pub source: String,
    /// Width and height of the pictures.
    pub image_size_px: [u32; 2],
    /// Calibration to check or replace, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<String>,
    /// Version of the rules for taking views: [`RULES`] of the recording build.
    #[serde(default = "first_rules")]
    pub guidance_rules: u32,
    /// All settings.
    pub config: Config,
    /// The live camera, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraTable>,
}

/// Recordings without a version were made under the first rules.
fn first_rules() -> u32 {
    1
}

/// Settings of the guidance in recordings from before the first release: they have no effect.
const BEFORE_RELEASE: [&str; 11] = [
    "min_tilt_deg",
    "max_tilt_deg",
    "max_direction_sigma_deg",
    "min_fill",
    "margin_px",
    "max_blur_px",
    "max_smear_px",
    "still_widths_per_sec",
    "partner_offset_px",
    "max_slot_error_deg",
    "independent_deg",
];

impl Header {
    /// The header of a new session.
    pub fn new(source: &str, image_size: ImageSize, config: Config) -> Self {
        Self {
            schema: SCHEMA.into(),
            created: jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
            source: source.into(),
            image_size_px: [image_size.width_px, image_size.height_px],
            against: None,
            guidance_rules: RULES,
            config,
            camera: None,
        }
    }

    /// The header for a session to check or replace the calibration in `file`.
    pub fn against(self, file: &Path) -> Self {
        Self { against: Some(file.display().to_string()), ..self }
    }

    /// The header for a session of a live camera, if `facts` are given.
    pub fn of_camera(self, facts: Option<CameraInfo>) -> Self {
        Self { camera: facts.map(CameraTable::from), ..self }
    }

    /// The text of `session.toml`.
    ///
    /// # Errors
    ///
    /// If a value can't be written as TOML.
    pub fn text(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }

    /// The parts of the header that others may see: whatever decides. A new part is named here
    /// first.
    pub(super) fn for_others(self) -> Self {
        let Self { schema, created, source, image_size_px, against, guidance_rules, .. } = self;
        let Config { board, camera, guidance, calibration, .. } = self.config;
        let CameraConfig { mode, backend, raw, set_camera_info, as_stored, .. } = camera;
        let topic = String::new();
        let camera = CameraConfig { mode, backend, raw, topic, set_camera_info, as_stored };
        let (certificate, boards) = (CertificateConfig::default(), BTreeMap::new());
        let config = Config { board, camera, guidance, calibration, certificate, boards };
        let (against, camera) = (against.map(|_| "hidden".to_owned()), self.camera);
        Self { schema, created, source, image_size_px, against, guidance_rules, config, camera }
    }

    /// Size of the pictures.
    pub fn image_size(&self) -> ImageSize {
        ImageSize { width_px: self.image_size_px[0], height_px: self.image_size_px[1] }
    }

    /// The header in `text`, from `path`.
    fn parsed(text: &str, path: PathBuf) -> Result<Self, RecordingError> {
        let bad =
            |reason: String| RecordingError::Header { reason, newer: false, path: path.clone() };
        let mut table: toml::Table =
            toml::from_str(text).map_err(|err| bad(err.message().into()))?;
        let schema = table.get("schema").and_then(toml::Value::as_str).unwrap_or("none");
        if schema != SCHEMA {
            let newer = schema.starts_with(SCHEMA_NAME);
            let by_newer = if newer { "; a newer boresight made it" } else { "" };
            let reason =
                format!("its schema is {schema:?}, this version reads {SCHEMA:?}{by_newer}");
            return Err(RecordingError::Header { reason, newer, path });
        }
        let guidance = table.get_mut("config").and_then(|config| config.get_mut("guidance"));
        if let Some(guidance) = guidance.and_then(toml::Value::as_table_mut) {
            guidance.retain(|key, _| !BEFORE_RELEASE.contains(&key));
        }
        let header: Self = table.try_into().map_err(|err: toml::de::Error| {
            bad(err.to_string().trim_end().replace("\nin ", " in "))
        })?;
        if header.image_size_px.iter().any(|side| !(1..=PICTURE_LIMIT_PX).contains(side)) {
            return Err(bad(format!("image_size_px needs sides of 1 to {PICTURE_LIMIT_PX}")));
        }
        header.config.check().map_err(|err| bad(err.to_string()))?;
        Ok(header)
    }
}

/// True if `path` is free, except for leftovers of a crash during creation.
fn is_new(path: &Path) -> bool {
    if path.symlink_metadata().is_ok_and(|there| there.is_file()) {
        return false;
    }
    entries(path).iter().all(|entry| {
        let name = entry.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(UNFINISHED)
            || (name == FRAMES && is_own_folder(entry) && entries(entry).is_empty())
            || (name == JOURNAL && entry.symlink_metadata().is_ok_and(|there| there.len() == 0))
    })
}

/// An open session folder. The journal is locked while open, so only a single process has access.
#[derive(Debug)]
pub struct SessionFolder {
    path: PathBuf,
    journal: Journal,
    lock: File,
}

impl SessionFolder {
    /// Creates `path` with a header. The header comes last, so a folder with a header is complete.
    ///
    /// # Errors
    ///
    /// [`RecordingError::NotNew`] if there is something in the folder already, or
    /// [`RecordingError::File`].
    pub fn create(path: &Path, header: &Header) -> Result<Self, RecordingError> {
        if !is_new(path) {
            return Err(RecordingError::NotNew { path: path.to_path_buf() });
        }
        make_folder(path)?;
        make_folder(&path.join(FRAMES))?;
        let text = header
            .text()
            .map_err(|err| FileError::writing(path)(std::io::Error::other(err.to_string())))?;
        let journal = Journal::create(&path.join(JOURNAL), checksum(text.as_bytes()))?;
        save(&path.join(HEADER), text.as_bytes(), Overwrite::Never)?;
        Ok(Self { path: path.to_path_buf(), journal, lock: lock(path)? })
    }

    /// Opens a session to be resumed. Changes nothing until the first line is appended.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] if it can't be read, is damaged, lacks lines or is newer, or can't be
    /// locked because another process has it open or the file system has no locks.
    pub fn open(path: &Path) -> Result<(Self, Header, JournalContents), RecordingError> {
        let (header, header_crc32) = Self::header_with_checksum(path)?;
        let lock = lock(path)?;
        let contents = Self::journal_of(path, &header_crc32)?;
        let frames = path.join(FRAMES);
        if !is_own_folder(&frames) {
            let what = "not a folder of this session";
            return Err(FileError::NotAFile { what, path: frames }.into());
        }
        let journal = Journal::append_to(&path.join(JOURNAL), &contents, header_crc32)?;
        Ok((Self { path: path.to_path_buf(), journal, lock }, header, contents))
    }

    /// Reads header and journal of the session at `path`.
    ///
    /// # Errors
    ///
    /// As [`Self::header`] and [`Journal::read`], and [`RecordingError::OtherHeader`] and
    /// [`RecordingError::LinesMissing`].
    pub fn read(path: &Path) -> Result<(Header, JournalContents), RecordingError> {
        let (header, header_crc32) = Self::header_with_checksum(path)?;
        Ok((header, Self::journal_of(path, &header_crc32)?))
    }

    fn journal_of(path: &Path, header_crc32: &str) -> Result<JournalContents, RecordingError> {
        let contents = Self::journal(path)?;
        match &contents.header_crc32 {
            Some(of_journal) if of_journal != header_crc32 => {
                Err(RecordingError::OtherHeader { path: path.to_path_buf() })
            }
            _ => match missing_lines(path, &contents) {
                Some(reason) => {
                    Err(RecordingError::LinesMissing { reason, path: path.join(JOURNAL) })
                }
                None => Ok(contents),
            },
        }
    }

    /// Reads `session.toml` of the session at `path`.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`] or [`RecordingError::Header`].
    pub fn header(path: &Path) -> Result<Header, RecordingError> {
        Self::header_with_checksum(path).map(|(header, _)| header)
    }

    /// Reads `session.toml`, with the checksum.
    pub(super) fn header_with_checksum(path: &Path) -> Result<(Header, String), RecordingError> {
        let path = path.join(HEADER);
        let text = read_text(&path, HEADER_LIMIT, Links::Refused)?;
        Ok((Header::parsed(&text, path)?, checksum(text.as_bytes())))
    }

    /// Reads the journal of the session at `path`.
    ///
    /// # Errors
    ///
    /// See [`Journal::read`].
    pub fn journal(path: &Path) -> Result<JournalContents, RecordingError> {
        Journal::read(&path.join(JOURNAL))
    }

    /// Path of the session.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal, for appending.
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Stores a picture, lossless, and syncs it. A leftover of a crash under the same number was
    /// never acknowledged and is replaced.
    ///
    /// # Errors
    ///
    /// [`RecordingError::File`], also if another folder is in its place by now.
    pub fn store_frame(&self, id: FrameId, frame: &Frame) -> Result<Stored, RecordingError> {
        let path = self.path.join(id.stored_name());
        if !is_still_at(&self.lock, &self.path.join(HEADER)) {
            let moved = "the session's folder isn't in its place any more";
            return Err(FileError::writing(&path)(std::io::Error::other(moved)).into());
        }
        let (png, stored) = stored_png(id, &frame.image)
            .map_err(|err| FileError::writing(&path)(std::io::Error::other(err.to_string())))?;
        save(&path, &png, Overwrite::Allowed)?;
        Ok(stored)
    }
}

/// The file of a picture, lossless, and the entry for the journal.
///
/// # Errors
///
/// If the picture has no pixels.
pub fn stored_png(id: FrameId, picture: &GrayImage) -> Result<(Vec<u8>, Stored), ImageError> {
    let mut png = Vec::with_capacity(picture.len() / 2);
    PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive)
        .write_image(
            picture.as_raw(),
            picture.width(),
            picture.height(),
            image::ExtendedColorType::L8,
        )?;
    let stored = Stored { frame: id.0, crc32: checksum(&png) };
    Ok((png, stored))
}

fn lock(path: &Path) -> Result<File, RecordingError> {
    let lock = open(&path.join(HEADER), Links::Refused)?;
    match lock.try_lock() {
        Ok(()) => Ok(lock),
        Err(TryLockError::WouldBlock) => Err(RecordingError::Locked { path: path.to_path_buf() }),
        Err(TryLockError::Error(source)) => {
            Err(RecordingError::NoLock { source, path: path.to_path_buf() })
        }
    }
}

/// Evidence of lines missing from `contents`, the journal of the session at `path`; `None` without
/// evidence.
///
/// A crash can leave a picture without its line: at most one for each run of the program.
fn missing_lines(path: &Path, contents: &JournalContents) -> Option<String> {
    let named: std::collections::BTreeSet<PathBuf> = contents
        .stored
        .iter()
        .map(|stored| path.join(FrameId(stored.frame).stored_name()))
        .collect();
    let runs = 1 + contents.resumed;
    let is_picture = |file: &PathBuf| file.extension().is_some_and(|ending| ending == "png");
    let nameless = entries(&path.join(FRAMES))
        .iter()
        .filter(|file| is_picture(file) && !named.contains(*file))
        .count();
    (nameless > runs).then(|| format!("{nameless} pictures have no line"))
}

/// Number of views taken by the lines, including removed views.
///
/// # Errors
///
/// As [`LinesWalk`](super::LinesWalk).
pub fn views_taken(contents: &JournalContents) -> Result<usize, RecordingError> {
    contents.lines.iter().try_fold(0, |count, line| {
        let is_taken = matches!(line?.outcome(), Some(RecordedOutcome::Accepted { .. }));
        Ok(count + usize::from(is_taken))
    })
}

/// Bytes of a stored picture of the session at `session`, checked.
///
/// # Errors
///
/// [`RecordingError::File`] or [`RecordingError::Frame`].
pub(super) fn stored_bytes(session: &Path, stored: &Stored) -> Result<Vec<u8>, RecordingError> {
    let path = session.join(FrameId(stored.frame).stored_name());
    let frames = session.join(FRAMES);
    if frames.symlink_metadata().is_ok_and(|there| !there.is_dir()) {
        return Err(
            FileError::NotAFile { what: "not a folder of this session", path: frames }.into()
        );
    }
    let bytes = read(&path, FRAME_LIMIT, Links::Refused)?;
    if checksum(&bytes) != stored.crc32 {
        return Err(RecordingError::Frame { reason: "its checksum does not match".into(), path });
    }
    Ok(bytes)
}

/// Reads and checks a stored picture of the session at `session`.
///
/// # Errors
///
/// [`RecordingError::File`] or [`RecordingError::Frame`].
pub fn stored_frame(session: &Path, stored: &Stored) -> Result<GrayImage, RecordingError> {
    let bytes = stored_bytes(session, stored)?;
    decoded(Cursor::new(bytes), image::ImageFormat::Png, Upright::AsStored).map_err(|reason| {
        let path = session.join(FrameId(stored.frame).stored_name());
        RecordingError::Frame { reason, path }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_took_this_ones_place_gets_no_picture() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("session");
        let size = ImageSize { width_px: 8, height_px: 6 };
        let header = Header::new("sim", size, Config::load(None, &[]).expect("defaults"));
        let frame = Frame {
            id: FrameId(0),
            captured_at: boresight_geometry::frame::CaptureTime { nanos: 0 },
            kind: boresight_geometry::frame::FrameKind::Photograph,
            name: String::new(),
            image: GrayImage::new(8, 6),
        };
        let folder = SessionFolder::create(&path, &header).expect("made");
        folder.store_frame(frame.id, &frame).expect("stored");
        std::fs::rename(&path, place.path().join("away")).expect("renamed");
        SessionFolder::create(&path, &header).expect("made");
        folder.store_frame(frame.id, &frame).expect_err("it isn't its folder");
        assert!(entries(&path.join(FRAMES)).is_empty());
    }

    #[test]
    fn a_session_from_before_the_first_release_opens() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let header = Header::new("sim", size, Config::load(None, &[]).expect("defaults"));
        let with = |key: &str| {
            let mut table = toml::Table::try_from(&header).expect("a table");
            let guidance = table["config"]["guidance"].as_table_mut().expect("a table");
            guidance.insert(key.into(), 0.2.into());
            Header::parsed(&table.to_string(), HEADER.into())
        };
        assert_eq!(with("min_fill").expect("read"), header);
        assert!(with("minimum_fill").is_err());
    }
}
