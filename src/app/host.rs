//! What the window asks of the program, which knows sources, folders and settings.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use image::GrayImage;

use super::recordings::{DecidedRecording, Recording};
use crate::{
    calibration::Drift,
    device::Adjustable,
    guidance::Plan,
    pipeline::{Background, Finished, LiveFeed, Pipeline, PipelineError},
    session::{Command, ViewNumber},
};

/// Wakes the window; may be called from any thread.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// The program around the window.
pub trait AppHost {
    /// What the first session is about.
    fn first_wish(&self) -> SessionRequest;

    /// Starts or resumes a session.
    ///
    /// # Errors
    ///
    /// [`UserError`] with what the person can do; the same wish may be tried again.
    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError>;

    /// Sources that can be named now: a name, and what it is.
    fn sources(&mut self) -> Vec<(String, String)>;

    /// Modes of the camera of that name, as in the settings file; none if it is no live camera.
    fn modes(&mut self, source: &str) -> Vec<String>;

    /// Names of the formats that a result can be written in.
    fn formats(&self) -> Vec<&'static str>;

    /// Writes the result of the session in `folder` in the format of that number beside it. Returns the file.
    ///
    /// # Errors
    ///
    /// [`UserError`].
    fn export(&mut self, folder: &Path, format: usize) -> Result<PathBuf, UserError>;

    /// Older calibrations that the session in `folder` may be compared with.
    fn older(&self, folder: &Path) -> Vec<PathBuf>;

    /// Begins to compare the session in `folder` with the calibration in `old`, and to store what is found.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot begin.
    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError>;

    /// Recordings that are near at hand, newest first.
    fn recordings(&self) -> Vec<Recording>;

    /// Begins to open the recording in `folder`.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot begin.
    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError>;

    /// Whether a dropped path is a folder, which is then opened as a recording.
    fn is_folder(&self, path: &Path) -> bool;

    /// Shows a file in the program that the desktop has for it.
    ///
    /// # Errors
    ///
    /// [`UserError`].
    fn show(&mut self, file: &Path) -> Result<(), UserError>;

    /// Whether the person asked the whole program to end.
    fn interrupted(&self) -> bool;
}

/// What a session should be about.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRequest {
    /// Name of the source.
    pub source: String,
    /// Mode of a live camera, as in the settings file.
    pub mode: String,
    /// Inner corners of the board: columns, rows.
    pub board: [u16; 2],
    /// Side of a square.
    pub square_m: f64,
    /// How many views.
    pub plan: Plan,
    /// Folder of the session to resume.
    pub go_on_with: Option<PathBuf>,
    /// What to do first.
    pub first: Option<Command>,
}

/// A running session.
pub struct Opened {
    /// Its threads.
    pub pipeline: Pipeline,
    /// What they show.
    pub showing: LiveFeed,
    /// What the source calls itself.
    pub source: String,
    /// Where it is stored.
    pub folder: PathBuf,
    /// Pictures of views that are there already, by their numbers.
    pub pictures: Vec<(ViewNumber, GrayImage)>,
    /// The camera's controls that can be set.
    pub adjustables: Vec<Adjustable>,
    /// Something to be told at the start, such as which source was chosen.
    pub note: Option<String>,
    /// Stores the result. Runs beside the window.
    pub conclude: Box<dyn FnOnce(Result<Finished, PipelineError>) -> Ended + Send>,
}

/// What a session left behind.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Where it is stored.
    pub folder: PathBuf,
    /// Files with the result.
    pub files: Vec<PathBuf>,
    /// What a comparison with an older calibration found, if the session began with one.
    pub compared: Option<Result<Compared, UserError>>,
    /// What went wrong, if anything did.
    pub trouble: Option<UserError>,
}

/// A comparison under way.
pub type Comparing = Background<Result<Compared, UserError>>;

/// A recording that is being opened.
pub type Loading = Background<Result<DecidedRecording, UserError>>;

/// A session compared with an older calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The file with the older calibration.
    pub against: PathBuf,
    /// The verdict in words, or why there is none.
    pub what: String,
    /// The next action.
    pub action: String,
    /// What makes it weaker than it could be.
    pub doubts: Vec<String>,
    /// The change; `None` without a verdict.
    pub drift: Option<Box<Drift>>,
}

/// Something that did not work, and what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct UserError {
    /// What happened.
    pub what: String,
    /// The next action, if one is known.
    pub action: Option<String>,
}
