//! Stable name of an error and its next action: one row an error in one table.

use std::error::Error;

use crate::session::comparison::NoKnownLens;
use boresight_capture::{BagFlaw, CaptureError};
use boresight_files::FileError;
use boresight_formats::import::NotImported;
use boresight_geometry::{boards::InvalidBoard, markers::InvalidMarkers};
use boresight_present::text;
use boresight_run::{config::ConfigError, pipeline::PipelineError, recording::RecordingError};
use boresight_sim::SceneError;

/// Error with a stable name, and perhaps a next action.
pub trait Explained: Error {
    /// Stable name for programs; `None` leaves it to the cause.
    fn code(&self) -> Option<&'static str>;

    /// Next action of the person; `None` leaves it to the cause.
    fn next(&self) -> Option<String> {
        None
    }
}

/// Row of a table of errors: the cause as an explained error, if it is of the row's type.
pub type Row = for<'a> fn(&'a (dyn Error + 'static)) -> Option<&'a dyn Explained>;

/// The row of errors of the type `E`.
pub fn row<'a, E: Explained + 'static>(
    cause: &'a (dyn Error + 'static),
) -> Option<&'a dyn Explained> {
    cause.downcast_ref::<E>().map(|err| err as &dyn Explained)
}

/// Errors of the program without its wings.
pub const ERRORS: [Row; 10] = [
    row::<RecordingError>,
    row::<PipelineError>,
    row::<FileError>,
    row::<CaptureError>,
    row::<SceneError>,
    row::<NotImported>,
    row::<NoKnownLens>,
    row::<InvalidBoard>,
    row::<InvalidMarkers>,
    row::<ConfigError>,
];

/// Stable name of an error by `tables`, for programs; `FAILED` if unnamed.
pub fn code_by(tables: &[&[Row]], err: &anyhow::Error) -> &'static str {
    explained(tables, err).find_map(Explained::code).unwrap_or("FAILED")
}

/// Next action for an error by `tables`, if known. The error itself says what happened.
pub fn next_by(tables: &[&[Row]], err: &anyhow::Error) -> Option<String> {
    explained(tables, err).find_map(Explained::next)
}

/// Causes of `err` with a row in `tables`, the outermost first.
fn explained<'a>(
    tables: &'a [&[Row]],
    err: &'a anyhow::Error,
) -> impl Iterator<Item = &'a dyn Explained> {
    err.chain().filter_map(|cause| tables.iter().copied().flatten().find_map(|row| row(cause)))
}

/// Stable name of an error of the program without its wings; `FAILED` if unnamed.
pub fn error_code(err: &anyhow::Error) -> &'static str {
    code_by(&[&ERRORS], err)
}

/// Next action for an error of the program without its wings, if known.
pub fn explain(err: &anyhow::Error) -> Option<String> {
    next_by(&[&ERRORS], err)
}

impl Explained for RecordingError {
    fn code(&self) -> Option<&'static str> {
        Some(Self::code(self))
    }

    fn next(&self) -> Option<String> {
        recording(self)
    }
}

impl Explained for PipelineError {
    fn code(&self) -> Option<&'static str> {
        None
    }

    fn next(&self) -> Option<String> {
        if let Self::Recording(err) = self { recording(err) } else { None }
    }
}

impl Explained for FileError {
    fn code(&self) -> Option<&'static str> {
        Some(Self::code(self))
    }

    fn next(&self) -> Option<String> {
        file(self)
    }
}

impl Explained for CaptureError {
    fn code(&self) -> Option<&'static str> {
        Some(match self {
            Self::Camera { fault, .. } => fault.code(),
            Self::Read { .. } | Self::Decode { .. } => "PICTURE-UNREADABLE",
            Self::Bag { .. } => "BAG",
            Self::GaveUp { .. } => "SOURCE-UNREADABLE",
            Self::NoPictures { .. } => "NO-PICTURES",
        })
    }

    fn next(&self) -> Option<String> {
        Some(capture(self))
    }
}

impl Explained for SceneError {
    fn code(&self) -> Option<&'static str> {
        Some("SETTINGS")
    }

    fn next(&self) -> Option<String> {
        match self {
            Self::File(err) => file(err),
            Self::Invalid { .. } => {
                Some("docs/schemas.md lists what a scene file may hold.".into())
            }
        }
    }
}

impl Explained for NotImported {
    fn code(&self) -> Option<&'static str> {
        Some("OLD-CALIBRATION")
    }

    fn next(&self) -> Option<String> {
        imported(self).map(Into::into)
    }
}

impl Explained for NoKnownLens {
    fn code(&self) -> Option<&'static str> {
        Some("OLD-CALIBRATION")
    }
}

impl Explained for InvalidBoard {
    fn code(&self) -> Option<&'static str> {
        Some("BOARD")
    }
}

impl Explained for InvalidMarkers {
    fn code(&self) -> Option<&'static str> {
        Some("BOARD")
    }
}

impl Explained for ConfigError {
    fn code(&self) -> Option<&'static str> {
        Some("SETTINGS")
    }

    fn next(&self) -> Option<String> {
        Some(match self {
            Self::File(err) => file(err).unwrap_or_default(),
            Self::Markers(_) => "Name a ChArUco board by its squares, dictionary and marker size, and give the square's side, for example --board charuco:8x11:DICT_4X4_50:15mm --square 20mm.".into(),
            Self::Board(_) => "Name the board by its inner corners and a square's side, for example --board 9x6 --square 25mm.".into(),
            Self::Invalid { .. } => "config/default.toml lists all settings and their values; `boresight guide --help` shows how to set them.".into(),
        })
    }
}

/// An error and the next action, for a window: camera faults in words, without their codes.
pub fn user_error(err: &anyhow::Error) -> UserError {
    if let Some(CaptureError::Camera { fault, detail }) = err.downcast_ref() {
        let (what, action) = text::camera::with_detail(*fault, detail);
        return UserError { what, action: Some(action) };
    }
    UserError { what: format!("{err:#}"), action: explain(err) }
}

/// Action when memory or file handles run out.
const MORE_MEANS: &str =
    "Close other programs, or allow this one more memory and open files (ulimit).";

/// True if memory or file handles have run out: no fault of the file.
fn is_short_of_means(err: &std::io::Error) -> bool {
    // ENFILE and EMFILE have no variant in `ErrorKind`.
    err.kind() == std::io::ErrorKind::OutOfMemory || matches!(err.raw_os_error(), Some(23 | 24))
}

fn file(err: &FileError) -> Option<String> {
    use std::io::ErrorKind;
    match err {
        FileError::Write { source, path } => {
            let session = path.ancestors().find(|folder| folder.join("session.toml").exists());
            let go_on = session.map_or(String::new(), |session| {
                format!(
                    " Your views are safe. To continue: boresight guide --session {}",
                    session.display()
                )
            });
            let action = match source.kind() {
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
                    "The disk is full: free some space."
                }
                // `ErrorKind` has no variant for EIO.
                _ if source.raw_os_error() == Some(5) => {
                    "The disk fails: save what is on it, and use another one."
                }
                _ if is_short_of_means(source) => MORE_MEANS,
                _ => "Check that the folder exists and is writable.",
            };
            Some(format!("{action}{go_on}"))
        }
        FileError::Exists { .. } => {
            Some("Choose another name, or add --force to overwrite the file.".into())
        }
        FileError::NotAFile { .. } => Some(
            "Name a plain file: links, devices and FIFOs are neither read nor replaced.".into(),
        ),
        FileError::Read { source, .. } if is_short_of_means(source) => Some(MORE_MEANS.into()),
        FileError::Read { path, .. } => {
            let is_of_session = path.file_name().is_some_and(|name| name == "session.toml");
            Some(if is_of_session {
                "Check the name; a session is the folder that holds session.toml.".into()
            } else {
                "Check the name, and that the file is readable.".into()
            })
        }
        FileError::NotPrivate { path } => Some(format!(
            "Keep it to yourself: chmod 600 {}. If somebody may have read it, delete it, and a new one is made.",
            path.display()
        )),
        FileError::TooLarge { .. } | FileError::NotText { .. } => {
            Some("Check the name: this is no file of that kind.".into())
        }
    }
}

fn recording(err: &RecordingError) -> Option<String> {
    match err {
        RecordingError::File(err) => file(err),
        RecordingError::NotNew { path } => Some(if path.join("session.toml").exists() {
            format!(
                "To continue the session in it: boresight guide --session {}. To start another one, choose a new folder.",
                path.display()
            )
        } else {
            "Choose a new folder. Nothing in this one was changed.".into()
        }),
        RecordingError::Damaged { path, .. } | RecordingError::LinesMissing { path, .. } => {
            // Both name the journal.
            let session = path.parent().unwrap_or(path).display().to_string();
            Some(text::doctor::next(false, &session))
        }
        RecordingError::Locked { .. } => Some("Close the other program first.".into()),
        RecordingError::NoLock { .. } => {
            Some("Use a file system with locks: choose a folder on a local disk with --out. To continue a session, copy its folder to one.".into())
        }
        RecordingError::OtherHeader { .. } => Some(
            "Restore the session.toml that the session began with. To decide with other settings: boresight replay SESSION --set …".into(),
        ),
        RecordingError::Newer { .. } => Some(text::doctor::next(true, "SESSION")),
        RecordingError::Header { .. } | RecordingError::Frame { .. } => None,
    }
}

fn capture(err: &CaptureError) -> String {
    match err {
        CaptureError::Camera { fault, .. } => {
            let (cause, action) = text::camera::fault(*fault);
            // A source without pictures has given no views.
            return format!("{cause}. {}", action.replace(" Your views are safe.", ""));
        }
        CaptureError::Read { .. } => "Check the name, and that the file is readable.",
        CaptureError::Decode { .. } => {
            "Leave the file out, or replace it with an undamaged one."
        }
        CaptureError::Bag { flaw, .. } => match flaw {
            BagFlaw::Unreadable(_) => {
                "Check that it's an MCAP file or a bag of ROS 2, and that it was copied whole."
            }
            BagFlaw::NoPictures(_) => {
                "Choose a bag with Image or CompressedImage of ROS 2's sensor_msgs, or RawImage or CompressedImage of Foxglove."
            }
            BagFlaw::Several(_) => "Say which with --topic.",
            BagFlaw::NoSuchTopic { .. } => "Name one of them with --topic.",
            BagFlaw::NoPicture { .. } | BagFlaw::Silent(_) => "Choose another topic with --topic.",
            BagFlaw::Damaged { .. } | BagFlaw::Torn { .. } => {
                "The session holds what was read. Copy the bag again if there's a whole one."
            }
        },
        CaptureError::GaveUp { .. } => {
            "It's damaged, or sends what no camera sends: copy it again, or use another one."
        }
        CaptureError::NoPictures { .. } => {
            "Choose a folder with pictures of the board: PNG, JPEG, BMP, PGM, PPM, TIFF or WebP."
        }
    }
    .into()
}

fn imported(err: &NotImported) -> Option<&'static str> {
    match err {
        NotImported::Model { .. } | NotImported::Coefficient { .. } => Some(
            "Fit a supported lens model with the program that wrote the file, or recalibrate: boresight guide",
        ),
        NotImported::NoResult => Some("Its findings say why. Recalibrate: boresight guide"),
        NotImported::Schema { .. } => Some("Use the newer version that wrote it."),
        NotImported::Missing { .. } | NotImported::Nonsense { .. } => {
            Some("Fix the file, or write it again with the program that made it.")
        }
        NotImported::NoSize => {
            Some("State it: boresight convert IN OUT --image-size 1280x720, then use OUT.")
        }
        NotImported::OtherSize { .. } => Some("Leave the size out, or use the right file."),
        NotImported::Unread { .. } => Some(
            "Export a format that is listed from that program, or recalibrate: boresight guide",
        ),
        NotImported::TooLong { .. }
        | NotImported::UnknownFormat
        | NotImported::Malformed { .. } => None,
    }
}

/// A failure, and the next action.
#[derive(Clone, Debug, PartialEq)]
pub struct UserError {
    /// The error in words.
    pub what: String,
    /// The next action, if known.
    pub action: Option<String>,
}
