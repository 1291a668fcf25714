//! The window's interface to the program, which knows sources, folders and settings.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use image::GrayImage;
use serde::{Deserialize, Serialize};

use super::{
    camera,
    recordings::{DecidedRecording, Dropped, Recording, StoredSession},
};
use boresight_calibrate::{BOARD_SCALE_SD, Drift};
use boresight_geometry::{
    device::Adjustable,
    markers::{MarkerChoice, Markers},
};
use boresight_guide::{
    guidance::Plan,
    session::{Command, ViewNumber},
};
use boresight_run::{
    config::{CertificateConfig, Config, LensName},
    pipeline::{Background, Finished, LiveFeed, Pipeline, PipelineError},
};

/// Wakes the window; may be called from any thread.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// True if `source` can only mean one of this computer's cameras, which may be away.
pub fn is_camera_name(source: &str) -> bool {
    camera::is_name(source)
}

/// The program around the window. A host without a start page can leave out the methods for it.
pub trait AppHost {
    /// Camera, board and plan of the first session.
    fn first_wish(&self) -> SessionRequest;

    /// True if the first session starts without asking: the person has said what it's about.
    fn starts_at_once(&self) -> bool {
        true
    }

    /// Choices stored by earlier windows.
    fn remembered(&self) -> Memory {
        Memory::default()
    }

    /// Keeps `memory` for the next window.
    ///
    /// # Errors
    ///
    /// [`UserError`]; what is kept is then as before.
    fn remember(&mut self, memory: &Memory) -> Result<(), UserError> {
        let _ = memory;
        Ok(())
    }

    /// The connected cameras, with their pictures. The first call begins to look through them.
    fn cameras(&mut self, wake: &Wake) -> Vec<CameraView> {
        let _ = wake;
        Vec::new()
    }

    /// Counts the board in front of the camera called `source` from now on, or none.
    fn count_board(&mut self, source: Option<&str>) {
        let _ = source;
    }

    /// The code beside a board of that many inner corners in `image`.
    fn read_code(&mut self, image: &GrayImage, board: [u16; 2]) -> Option<SeenCode> {
        let _ = (image, board);
        None
    }

    /// Closes the cameras that [`AppHost::cameras`] looks through.
    fn stop_looking(&mut self) {}

    /// Names of the papers that a board can be printed on.
    fn papers(&self) -> Vec<&'static str>;

    /// Writes a board of that many inner corners, with `markers` or plain, as large as fits on the paper of that number,
    /// and shows it.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it doesn't fit, or can't be written.
    fn print_board(
        &mut self,
        board: [u16; 2],
        markers: Option<Markers>,
        paper: usize,
    ) -> Result<PrintedBoard, UserError>;

    /// Starts or resumes a session.
    ///
    /// # Errors
    ///
    /// [`UserError`] with what the person can do; the same wish may be tried again.
    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError>;

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

    /// Begins to compare the session in `folder` with the calibration in `old`, and to store the result.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot begin.
    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError>;

    /// Recordings that are near at hand, newest first.
    fn recordings(&self) -> Vec<Recording>;

    /// Begins to read small pictures of the sessions in these folders; `None` where that can't be done.
    fn small_pictures(&self, folders: Vec<PathBuf>, wake: Wake) -> Option<SmallPictures> {
        let _ = (folders, wake);
        None
    }

    /// Begins to read the session in `folder` as it ended.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot begin.
    fn stored(&mut self, folder: &Path, wake: Wake) -> Result<Storing, UserError>;

    /// Moves the session in `folder` to the bin.
    ///
    /// # Errors
    ///
    /// [`UserError`]; the session is then where it was.
    fn delete(&mut self, folder: &Path) -> Result<(), UserError>;

    /// Begins to open the recording in `folder`.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot begin.
    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError>;

    /// What a path that was dropped onto the window is.
    fn dropped(&self, path: &Path) -> Dropped;

    /// Shows a file in the program that the desktop has for it.
    ///
    /// # Errors
    ///
    /// [`UserError`].
    fn show(&mut self, file: &Path) -> Result<(), UserError>;

    /// True if the person asked the whole program to end.
    fn interrupted(&self) -> bool;

    /// Switches the computer's voice on or off. With `mirrored`, left and right are swapped for a person who faces the
    /// camera. May be called as often as anything is painted.
    ///
    /// # Errors
    ///
    /// [`UserError`] if nothing here speaks.
    fn speak(&mut self, on: bool, mirrored: bool) -> Result<(), UserError> {
        let _ = (on, mirrored);
        Ok(())
    }

    /// Says something to try the voice.
    ///
    /// # Errors
    ///
    /// [`UserError`] if nothing here speaks.
    fn test_voice(&mut self) -> Result<(), UserError> {
        Ok(())
    }

    /// The phone's page, if it's served.
    fn phone(&self) -> Option<PhoneLink> {
        None
    }

    /// Number of phones that follow the session now.
    fn phones(&self) -> usize {
        0
    }

    /// True, once, if a phone asked for two more views of the session that has ended.
    fn phone_wants_more(&self) -> bool {
        false
    }

    /// True if a phone asked for the end of the session.
    fn phone_ends_session(&self) -> bool {
        false
    }
}

/// Address of the phone's page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PhoneLink {
    /// Link for the owner, with its token.
    pub link: String,
    /// The link for those who only look on.
    pub watcher: String,
    /// The link as a QR code: rows of modules with their quiet zone, true where dark.
    pub code: Vec<Vec<bool>>,
}

/// Camera, board and plan that a session should use.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRequest {
    /// Name of the source.
    pub source: String,
    /// Mode of a live camera, as in the settings file.
    pub mode: String,
    /// Inner corners of the board: columns, rows.
    pub board: [u16; 2],
    /// Markers of a ChArUco board; none on a plain one.
    pub markers: Option<MarkerChoice>,
    /// Side of a square.
    pub square_m: f64,
    /// What of the board a code beside it decides: whatever nobody has said.
    pub board_code: BoardFromCode,
    /// Plan, which sets the number of views.
    pub plan: Plan,
    /// Folder of the session to resume.
    pub go_on_with: Option<PathBuf>,
    /// Command to give as soon as the session runs.
    pub first: Option<Command>,
}

/// Properties of the board to read from a code in its margin, if the first frames show one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BoardFromCode {
    /// Nothing: the board is given.
    #[default]
    Nothing,
    /// Columns and rows: the square is given.
    Counts,
    /// The square: columns and rows are given. A code with others says nothing.
    Square,
    /// Columns, rows and square.
    All,
}

impl BoardFromCode {
    /// What's open where columns and rows, or the square, are given.
    pub fn unless_given(counts: bool, square: bool) -> Self {
        match (counts, square) {
            (true, true) => Self::Nothing,
            (false, true) => Self::Counts,
            (true, false) => Self::Square,
            (false, false) => Self::All,
        }
    }

    /// Whether the square is open.
    pub fn has_square(self) -> bool {
        matches!(self, Self::Square | Self::All)
    }
}

/// A camera, and what it sees before a session.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraView {
    /// The name that finds it again.
    pub source: String,
    /// Name as the camera itself gives it.
    pub name: String,
    /// Size of its pictures; empty before the first.
    pub mode: String,
    /// The newest picture, small.
    pub picture: Option<Arc<GrayImage>>,
    /// Number of that picture.
    pub number: u64,
    /// Inner corners of the board in front of it, if they are counted.
    pub board: Option<[u16; 2]>,
    /// The code that is printed beside that board.
    pub code: Option<SeenCode>,
    /// The board of another kind that is seen where a plain one is counted.
    pub other: Option<OtherKind>,
    /// Why it can't be used now.
    pub trouble: Option<UserError>,
}

impl CameraView {
    /// A camera that hasn't been looked through yet.
    pub fn new(source: &str, name: &str) -> Self {
        Self {
            source: source.into(),
            name: name.into(),
            mode: String::new(),
            picture: None,
            number: 0,
            board: None,
            code: None,
            other: None,
            trouble: None,
        }
    }
}

/// A board of another kind that was recognised.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherKind {
    /// What it is, in words.
    pub said: String,
    /// Its markers, tags or circles.
    pub markers: MarkerChoice,
    /// Its points in a row and in a column, if they're known.
    pub board: Option<[u16; 2]>,
}

/// A board that its printed code names.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenCode {
    /// ID of the board.
    pub id: String,
    /// Inner corners: columns, rows.
    pub board: [u16; 2],
    /// Side of a square: as measured if that is known, else as printed.
    pub square_m: f64,
}

/// A sheet with a board.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedBoard {
    /// Path of the printable file.
    pub file: PathBuf,
    /// Side of a square.
    pub square_m: f64,
    /// Steps for the person who prints it.
    pub steps: Vec<String>,
}

/// Choices kept from one window to the next; `None` where the person has chosen nothing.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Memory {
    /// Source of the last session.
    pub source: Option<String>,
    /// Mode of the last session's camera.
    pub mode: Option<String>,
    /// Inner corners of the board.
    pub board: Option<[u16; 2]>,
    /// Markers of the board, if it's a ChArUco board.
    pub markers: Option<MarkerChoice>,
    /// Side of a square.
    pub square_m: Option<f64>,
    /// Plan, which sets the number of views.
    #[serde(with = "plan_name")]
    pub plan: Option<Plan>,
    /// Streams and files that were opened, newest first, without passwords.
    pub streams: Vec<String>,
    /// Paper for a printed board.
    pub paper: Option<usize>,
    /// True if the person sees themselves as in a mirror.
    pub mirrored: Option<bool>,
    /// A tone for each view.
    pub tone: Option<bool>,
    /// The sentence spoken.
    pub speech: Option<bool>,
    /// Numbers beside the picture.
    pub panels: Option<bool>,
    /// Full screen while nobody is at the computer.
    pub full_screen: Option<bool>,
    /// A view has been taken in this person's window: they know how the guide works.
    pub knows_guide: Option<bool>,
    /// Name of the colour theme.
    pub theme: Option<String>,
    /// Size of the interface.
    pub zoom: Option<f32>,
    /// Folder for new sessions; empty for the usual one.
    pub folder: String,
    /// Goal of new sessions, as `--accept` takes it; empty for none.
    pub goal: String,
    /// Lens models of new sessions, by their code.
    pub lens: Option<String>,
    /// Standard deviation of the board's square size, in percent.
    pub board_error_percent: Option<f64>,
    /// What certificates say beside the numbers.
    pub certificate: CertificateConfig,
}

const MOST_STREAMS: usize = 4;

impl Memory {
    /// Puts a stream or file first.
    pub fn note_stream(&mut self, name: &str) {
        self.streams.retain(|stream| stream != name);
        self.streams.insert(0, name.into());
        self.streams.truncate(MOST_STREAMS);
    }

    /// The memory without impossible values: the file may be anybody's.
    pub(super) fn sensible(mut self) -> Self {
        let sides = |board: &[u16; 2]| board.iter().all(|side| (3..=99).contains(side));
        self.board = self.board.filter(sides);
        let length = |length_m: &f64| (0.0001..=9.9).contains(length_m);
        self.square_m = self.square_m.filter(length);
        self.markers = self.markers.filter(|it| it.side_m.as_ref().is_none_or(length));
        self.zoom = self.zoom.filter(|zoom| (0.5..=3.0).contains(zoom));
        self.streams.truncate(MOST_STREAMS);
        self.lens = self.lens.filter(|code| code.parse::<LensName>().is_ok());
        let percent = |percent: &f64| (0.0..=10.0).contains(percent);
        self.board_error_percent = self.board_error_percent.filter(percent);
        if !self.certificate.is_usable() {
            self.certificate = CertificateConfig::default();
        }
        self
    }

    /// Lays what new sessions should have over `config`, where that says nothing itself.
    pub fn apply(&self, config: &mut Config) {
        if config.guidance.accept.is_none() {
            config.guidance.accept = self.goal.trim().parse().ok();
        }
        if config.calibration.lens == LensName::AUTO
            && let Some(lens) = self.lens.as_ref().and_then(|code| code.parse().ok())
        {
            config.calibration.lens = lens;
        }
        let error = &mut config.board.scale_error_percent;
        if (*error - 100.0 * BOARD_SCALE_SD).abs() < 1e-9 {
            *error = self.board_error_percent.unwrap_or(*error);
        }
        config.certificate = config.certificate.clone().over(self.certificate.clone());
    }
}

mod plan_name {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use boresight_guide::guidance::Plan;
    use boresight_run::config::PlanName;

    #[expect(clippy::ref_option, reason = "serde's signature")]
    pub(super) fn serialize<S: Serializer>(
        plan: &Option<Plan>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        plan.map(PlanName::from).serialize(serializer)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Plan>, D::Error> {
        Ok(Option::<PlanName>::deserialize(deserializer)?.map(Plan::from))
    }
}

/// A running session.
pub struct Opened {
    /// Threads of the session.
    pub pipeline: Pipeline,
    /// Feed of the session's snapshots and pictures.
    pub showing: LiveFeed,
    /// Name of the source.
    pub source: String,
    /// Folder of the session.
    pub folder: PathBuf,
    /// Pictures of views that are there already, by their numbers.
    pub pictures: Vec<(ViewNumber, GrayImage)>,
    /// The camera's controls that can be set.
    pub adjustables: Vec<Adjustable>,
    /// Note to show at the start, such as which source was chosen.
    pub note: Option<String>,
    /// Stores the result. Runs beside the window.
    pub conclude: Box<dyn FnOnce(Result<Finished, PipelineError>) -> Ended + Send>,
}

/// Files and messages left behind by a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Folder of the session.
    pub folder: PathBuf,
    /// Files with the result.
    pub files: Vec<PathBuf>,
    /// Result of the comparison with an older calibration, if the session began with one.
    pub compared: Option<Result<Compared, UserError>>,
    /// The error, if any.
    pub trouble: Option<UserError>,
}

/// A comparison under way.
pub type Comparing = Background<Result<Compared, UserError>>;

/// A recording that is being opened.
pub type Loading = Background<Result<DecidedRecording, UserError>>;

/// A stored session that is being read.
pub type Storing = Background<Result<StoredSession, UserError>>;

/// Small pictures of sessions that are being read.
pub type SmallPictures = Background<Vec<(PathBuf, GrayImage)>>;

/// A session compared with an older calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// The file with the older calibration.
    pub against: PathBuf,
    /// The verdict in words, or why there is none.
    pub what: String,
    /// The next action.
    pub action: String,
    /// Reasons for caution about the verdict.
    pub doubts: Vec<String>,
    /// The change; `None` without a verdict.
    pub drift: Option<Box<Drift>>,
}

/// Something that did not work, and what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct UserError {
    /// The error in words.
    pub what: String,
    /// The next action, if one is known.
    pub action: Option<String>,
}
