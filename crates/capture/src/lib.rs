//! Frames in: every source of pictures behind one trait, [`FrameSource`].
//!
//! ```
//! use std::time::Duration;
//!
//! use boresight_capture::{Arrival, FrameSource, ImageFolder, Upright};
//! use image::GrayImage;
//!
//! let folder = tempfile::tempdir()?;
//! GrayImage::new(64, 48).save(folder.path().join("first.png"))?;
//!
//! let mut source = ImageFolder::open(folder.path(), Upright::AsMarked)?;
//! let Arrival::Frame(frame) = source.next_frame(Duration::ZERO)? else { panic!("no picture") };
//! assert_eq!((frame.name.as_str(), frame.image.dimensions()), ("first.png", (64, 48)));
//! assert!(matches!(source.next_frame(Duration::ZERO)?, Arrival::End));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | holds |
//! |---|---|
//! | `v4l2` | cameras of Linux (feature `live`); the program's only unsafe code |
//! | `pipe` | pictures of another program, or standard input (feature `live`), on Unix |
//! | `ffmpeg` | network streams and video files (feature `live`), on Unix |
//! | `programs` | programs that read or send pictures, ended on every way out |
//! | `bag_flaw` | recorded bags by name, and their flaws; the wing `boresight-sources` reads them |
//! | `nokhwa` | cameras of other systems (feature `nokhwa`) |
//! | `image_folder`, `recorded` | pictures from files and memory |
//! | `adapted` | adapters of sources |
//! | `guarded` | guard around sources of third-party code, which may panic |
//! | [`integrity`] | check for whole frames |
//! | `pixel_format`, `camera_mode` | brightness from cameras; choice of the mode |
//! | `pixels` | brightness from other programs' formats |
//! | `compressed`, `decoded` | brightness from JPEG and PNG in memory and in files |
//! | `exif` | time and lens of a picture in its file |
//! | `address` | names of network streams, with and without secrets |
//! | `health` | appearance of pictures |
//! | `stream_report` | events of a stream without camera controls |
//! | `reader_words` | messages of ffmpeg |

mod adapted;
mod address;
mod bag_flaw;
mod camera_mode;
mod compressed;
mod decoded;
mod exif;
#[cfg(all(unix, feature = "live"))]
mod ffmpeg;
mod guarded;
#[cfg(any(all(unix, feature = "live"), feature = "nokhwa"))]
mod health;
mod image_folder;
pub mod integrity;
#[cfg(feature = "nokhwa")]
pub mod nokhwa;
#[cfg(all(unix, feature = "live"))]
mod pipe;
mod pixel_format;
mod pixels;
#[cfg(all(unix, feature = "live"))]
mod programs;
/// Programs in a build without any.
#[cfg(not(all(unix, feature = "live")))]
mod programs {
    /// Does nothing: no source waits for a program.
    pub fn stop_opening() {}

    /// Does nothing: no program runs.
    pub fn end_programs() {}
}
mod raw_form;
#[cfg(all(unix, feature = "live"))]
mod reader_words;
mod recorded;
#[cfg(all(unix, feature = "live"))]
mod stream_report;
#[cfg(all(target_os = "linux", feature = "live"))]
pub mod v4l2;

pub use adapted::{limited, preceded, renumbered};
pub use address::{is_address, is_command, is_topic, without_secrets};
pub use bag_flaw::{BagFlaw, RosFlaw, bag_files, is_bag, listed};
pub use camera_mode::{CameraMode, choose, layout, not_offered};
pub use compressed::Decompressor;
pub use decoded::{PICTURE_LIMIT_PX, Upright, decoded};
pub use exif::{exif_time, film_length_mm};
#[cfg(all(unix, feature = "live"))]
pub use ffmpeg::Ffmpeg;
pub use guarded::guarded;
pub use image_folder::{
    ImageFolder, is_picture, picture_ending, pictures_in, read_picture, read_picture_turned,
    unread_pictures_in,
};
#[cfg(all(unix, feature = "live"))]
pub use pipe::Pipe;
pub use pixel_format::Unpacker;
pub use pixels::Pixels;
pub use programs::{end_programs, stop_opening};
pub use raw_form::{NoRawForm, RawForm};
pub use recorded::Recorded;

use std::{sync::Arc, time::Duration};

use boresight_geometry::{
    device::{Adjustable, CameraEvent, CameraInfo, Control, ControlBefore, Fault},
    frame::{Frame, ImageSize},
};

/// A source of frames.
///
/// Called from one thread only. A source ends its processes when dropped.
pub trait FrameSource: Send {
    /// Name of the source for people and recordings, and size of the pictures.
    fn identity(&self) -> SourceIdentity;

    /// True if the source may be paced by the consumer, like files and the simulated camera. Not so
    /// a live camera: its newest frame is worth more than an old one.
    fn waits(&self) -> bool {
        true
    }

    /// Facts about the live camera; `None` for other sources.
    fn camera_facts(&self) -> Option<CameraInfo> {
        None
    }

    /// Adjustable controls; none unless a live camera.
    fn adjustables(&mut self) -> Vec<Adjustable> {
        Vec::new()
    }

    /// Sets a control. The result is an event once the picture has settled; frames before it are
    /// held back. Does nothing without such a control, or while the camera is away.
    fn adjust(&mut self, control: Control, value: i64) {
        let _ = (control, value);
    }

    /// Restores the camera's controls to `before` when the source is dropped: the state found by an
    /// earlier run of the session, which may have ended without restoring it. Does nothing without
    /// such controls.
    fn put_back_at_end(&mut self, before: &[ControlBefore]) {
        let _ = before;
    }

    /// Waits at most `patience` for a frame.
    ///
    /// # Errors
    ///
    /// [`CaptureError`] if the source is broken; the frames delivered before stay good.
    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError>;
}

/// Arrival from a source.
#[derive(Clone, Debug)]
pub enum Arrival {
    /// A picture. The source may reuse its memory once every clone of the `Arc` is gone.
    Frame(Arc<Frame>),
    /// An event of a live camera.
    Event(CameraEvent),
    /// Nothing came in time; ask again.
    NothingYet,
    /// There will be no more frames.
    End,
}

/// Name and shape of a source.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceIdentity {
    /// Stable name: a device identity, a path, `sim:` and the scene's name.
    pub name: String,
    /// Size of every delivered picture, if known before the first.
    pub image_size: Option<ImageSize>,
}

/// Reason of a broken source.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// A file or folder could not be read.
    #[error("could not read {path:?}")]
    Read {
        /// Error of the system.
        source: std::io::Error,
        /// The file.
        path: std::path::PathBuf,
    },
    /// A file is not a decodable picture.
    #[error("not a readable picture ({reason}): {path:?}")]
    Decode {
        /// Message of the decoder.
        reason: String,
        /// The file.
        path: std::path::PathBuf,
    },
    /// A camera cannot be used.
    #[error("{}{}", fault.code(), if detail.is_empty() { String::new() } else { format!(": {detail}") })]
    Camera {
        /// Fault of the camera.
        fault: Fault,
        /// Details; may be empty.
        detail: String,
    },
    /// A recorded bag gives no pictures, or no more.
    #[error("{flaw}: {path:?}")]
    Bag {
        /// Reason.
        flaw: BagFlaw,
        /// The bag.
        path: std::path::PathBuf,
    },
    /// The code that reads the source panicked.
    #[error("the reader of {name} gave up ({reason})")]
    GaveUp {
        /// Message of the panic.
        reason: String,
        /// The source.
        name: String,
    },
    /// A folder without a picture.
    #[error("there is no picture that can be read in {path:?}")]
    NoPictures {
        /// The folder.
        path: std::path::PathBuf,
    },
}
