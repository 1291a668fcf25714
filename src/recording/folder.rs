//! The folder of one session.

use std::{
    fs::{self, File, TryLockError},
    io::Cursor,
    path::{Path, PathBuf},
};

use image::{
    GrayImage, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use serde::{Deserialize, Serialize};

use super::{
    CameraTable, Journal, JournalContents, RecordingError, Stored,
    journal::checksum,
    save::{Overwrite, UNFINISHED, save},
};
use crate::{
    config::Config,
    device::CameraInfo,
    frame::{Frame, FrameId, ImageSize},
    guidance::RULES,
};

/// Version of everything in the folder. A newer one is refused, never rewritten.
const SCHEMA: &str = "boresight.session/1";
const SCHEMA_NAME: &str = "boresight.session/";

/// What `session.toml` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// Version of the folder's contents.
    pub schema: String,
    /// When the session began, UTC.
    pub created: String,
    /// Name of the source.
    pub source: String,
    /// Width and height of the pictures.
    pub image_size_px: [u32; 2],
    /// The calibration that this session checks or replaces, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<String>,
    /// Version of the rules by which views were taken: [`RULES`] of the build that recorded them.
    #[serde(default = "first_rules")]
    pub guidance_rules: u32,
    /// Everything that was configured.
    pub config: Config,
    /// The live camera, if the source is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraTable>,
}

/// Recordings that don't say were made under the first rules.
fn first_rules() -> u32 {
    1
}

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

    /// The same session, made to check or replace the calibration in `file`.
    pub fn against(self, file: &Path) -> Self {
        Self { against: Some(file.display().to_string()), ..self }
    }

    /// The same session of a live camera, if there are `facts` of one.
    pub fn of_camera(self, facts: Option<CameraInfo>) -> Self {
        Self { camera: facts.map(CameraTable::from), ..self }
    }

    /// Size of the pictures.
    pub fn image_size(&self) -> ImageSize {
        ImageSize { width_px: self.image_size_px[0], height_px: self.image_size_px[1] }
    }
}

/// Whether nothing stands at `path` but what a crash between the first two writes leaves behind.
fn is_new(path: &Path) -> std::io::Result<bool> {
    let entries = match fs::read_dir(path) {
        Ok(entries) => entries,
        Err(err) if err.kind() == std::io::ErrorKind::NotFound => return Ok(true),
        Err(err) => return Err(err),
    };
    for entry in entries {
        let entry = entry?;
        let unfinished = entry.file_name().to_string_lossy().starts_with(UNFINISHED);
        let no_pictures = || {
            entry.file_name() == "frames"
                && fs::read_dir(entry.path()).is_ok_and(|mut f| f.next().is_none())
        };
        if !(unfinished || no_pictures()) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// An open session folder. One process at a time: the journal is locked while it is open.
#[derive(Debug)]
pub struct SessionFolder {
    path: PathBuf,
    journal: Journal,
    _lock: File,
}

impl SessionFolder {
    /// Creates `path` with its header.
    ///
    /// # Errors
    ///
    /// [`RecordingError::NotNew`] if there is something in the folder already, or [`RecordingError::Write`].
    pub fn create(path: &Path, header: &Header) -> Result<Self, RecordingError> {
        let failed = |source| RecordingError::Write { source, path: path.to_path_buf() };
        if !is_new(path).map_err(failed)? {
            return Err(RecordingError::NotNew { path: path.to_path_buf() });
        }
        fs::create_dir_all(path.join("frames")).map_err(failed)?;
        let text = toml::to_string(header)
            .map_err(|err| failed(std::io::Error::other(err.to_string())))?;
        save(&path.join("session.toml"), text.as_bytes(), Overwrite::Never)?;
        Self::open(path).map(|(folder, ..)| folder)
    }

    /// Opens a session to resume it.
    ///
    /// # Errors
    ///
    /// [`RecordingError`] if it can't be read, is damaged or newer, or can't be locked because another process
    /// has it open or the file system has no locks.
    pub fn open(path: &Path) -> Result<(Self, Header, JournalContents), RecordingError> {
        let header = Self::header(path)?;
        let lock_path = path.join("session.toml");
        let lock = File::open(&lock_path)
            .map_err(|source| RecordingError::Read { source, path: lock_path.clone() })?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(RecordingError::Locked { path: path.to_path_buf() });
            }
            Err(TryLockError::Error(source)) => {
                return Err(RecordingError::NoLock { source, path: path.to_path_buf() });
            }
        }
        let contents = Self::journal(path)?;
        let journal = Journal::append_to(&path.join("journal.jsonl"), &contents)?;
        Ok((Self { path: path.to_path_buf(), journal, _lock: lock }, header, contents))
    }

    /// Reads `session.toml` of the session at `path`.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Read`] or [`RecordingError::Header`].
    pub fn header(path: &Path) -> Result<Header, RecordingError> {
        let path = path.join("session.toml");
        let text = fs::read_to_string(&path)
            .map_err(|source| RecordingError::Read { source, path: path.clone() })?;
        let bad = |reason: String| RecordingError::Header { reason, path: path.clone() };
        let table: toml::Table = toml::from_str(&text).map_err(|err| bad(err.message().into()))?;
        let schema = table.get("schema").and_then(toml::Value::as_str).unwrap_or("none");
        if schema != SCHEMA {
            let newer = match schema.strip_prefix(SCHEMA_NAME) {
                Some(_) => "; a newer boresight made it",
                None => "",
            };
            return Err(bad(format!(
                "its schema is {schema:?}, this version reads {SCHEMA:?}{newer}"
            )));
        }
        toml::from_str(&text).map_err(|err| bad(err.message().into()))
    }

    /// Reads the journal of the session at `path`.
    ///
    /// # Errors
    ///
    /// See [`Journal::read`].
    pub fn journal(path: &Path) -> Result<JournalContents, RecordingError> {
        Journal::read(&path.join("journal.jsonl"))
    }

    /// Where the session is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The journal, for appending.
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Stores a picture, lossless, and syncs it. A leftover of a crash under the same number was never
    /// acknowledged and is replaced.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Write`].
    pub fn store_frame(&self, id: FrameId, frame: &Frame) -> Result<Stored, RecordingError> {
        let path = self.path.join(id.stored_name());
        let failed = |reason: image::ImageError| RecordingError::Write {
            source: std::io::Error::other(reason.to_string()),
            path: path.clone(),
        };
        let mut png = Vec::with_capacity(frame.image.len() / 2);
        PngEncoder::new_with_quality(&mut png, CompressionType::Fast, FilterType::Adaptive)
            .write_image(
                frame.image.as_raw(),
                frame.image.width(),
                frame.image.height(),
                image::ExtendedColorType::L8,
            )
            .map_err(failed)?;
        save(&path, &png, Overwrite::Allowed)?;
        Ok(Stored { frame: id.0, crc32: checksum(&png) })
    }
}

/// Reads a stored picture of the session at `session` and checks it.
///
/// # Errors
///
/// [`RecordingError::Read`] or [`RecordingError::Frame`].
pub fn stored_frame(session: &Path, stored: &Stored) -> Result<GrayImage, RecordingError> {
    let path = session.join(FrameId(stored.frame).stored_name());
    let bytes =
        fs::read(&path).map_err(|source| RecordingError::Read { source, path: path.clone() })?;
    let damaged = |reason: String| RecordingError::Frame { reason, path: path.clone() };
    if checksum(&bytes) != stored.crc32 {
        return Err(damaged("its checksum does not match".into()));
    }
    image::ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Png)
        .decode()
        .map(image::DynamicImage::into_luma8)
        .map_err(|err| damaged(err.to_string()))
}
