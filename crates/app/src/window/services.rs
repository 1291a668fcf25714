//! Window's interface to the program: sources, folders and settings.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use image::GrayImage;
use serde::{Deserialize, Serialize};

use crate::{
    BoardFromCode,
    explain::UserError,
    session::{
        camera,
        comparison::Compared,
        rig_result::RigEnded,
        rig_run::{RigHand, RigNews},
    },
    window::recordings::{self, DecidedRecording, Dropped, Recording, StoredSession},
};
use boresight_calibrate::BOARD_SCALE_SD;
use boresight_geometry::{
    boards::{BoardChoice, Pattern},
    device::Adjustable,
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

/// True if `source` can only mean a camera of the computer, perhaps unplugged.
pub fn is_camera_name(source: &str) -> bool {
    camera::is_name(source)
}

/// Services of the program for the window. Without a start page, its methods can be left out.
pub trait Services {
    /// Camera, board and plan of the first session.
    fn first_wish(&self) -> SessionRequest;

    /// True if the first session starts without asking: its settings are given.
    fn starts_at_once(&self) -> bool {
        true
    }

    /// Choices stored by earlier windows.
    fn remembered(&self) -> Memory {
        Memory::default()
    }

    /// Stores `memory` for the next window.
    ///
    /// # Errors
    ///
    /// [`UserError`]; the stored memory is then unchanged.
    fn remember(&mut self, memory: &Memory) -> Result<(), UserError> {
        let _ = memory;
        Ok(())
    }

    /// Connected cameras with pictures. The first call starts the previews.
    fn cameras(&mut self, wake: &Wake) -> Vec<CameraView> {
        let _ = wake;
        Vec::new()
    }

    /// Counts the board in front of the camera called `source` from now on, or none.
    fn count_board(&mut self, source: Option<&str>) {
        let _ = source;
    }

    /// Looks for a board of `board` inner corners in `image`. `None` unless its whole rim is
    /// inside.
    fn whole_board(&mut self, image: &GrayImage, board: [u16; 2]) -> Option<SeenBoard> {
        let _ = (image, board);
        None
    }

    /// Closes the previews of [`Services::cameras`].
    fn stop_looking(&mut self) {}

    /// Names of the papers for printing.
    fn papers(&self) -> Vec<&'static str>;

    /// Writes `board` as large as fits on paper number `paper`, and shows the file.
    ///
    /// # Errors
    ///
    /// [`UserError`] if the board doesn't fit, or can't be written.
    fn print_board(&mut self, board: BoardChoice, paper: usize) -> Result<PrintedBoard, UserError>;

    /// Starts or resumes a session.
    ///
    /// # Errors
    ///
    /// [`UserError`] with the next action; the same wish may be tried again.
    fn open(&mut self, wish: &SessionRequest, wake: Wake) -> Result<Opened, UserError>;

    /// Opens a session of several cameras.
    ///
    /// # Errors
    ///
    /// [`UserError`] with the next action; the same request may be tried again.
    fn open_rig(&mut self, request: &RigRequest) -> Result<RigOpened, UserError>;

    /// Modes of the named camera, as in the settings file; empty unless it's a live camera.
    fn modes(&mut self, source: &str) -> Vec<String>;

    /// Names of the export formats of a camera, or of several if `is_rig`.
    fn formats(&self, is_rig: bool) -> Vec<&'static str>;

    /// Writes the result of the session in `folder` beside the session, in format number `format`.
    /// Returns the file.
    ///
    /// # Errors
    ///
    /// [`UserError`].
    fn export(&mut self, folder: &Path, format: usize) -> Result<PathBuf, UserError>;

    /// Older calibrations to compare the session in `folder` with.
    fn older(&self, folder: &Path) -> Vec<PathBuf>;

    /// Starts comparing the session in `folder` with the calibration in `old`, and storing the
    /// result.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot start.
    fn compare(&mut self, folder: &Path, old: &Path, wake: Wake) -> Result<Comparing, UserError>;

    /// Recordings nearby, newest first.
    fn recordings(&self) -> Vec<Recording>;

    /// Starts reading thumbnails of the sessions in `folders`; `None` where unsupported.
    fn small_pictures(&self, folders: Vec<PathBuf>, wake: Wake) -> Option<SmallPictures> {
        let _ = (folders, wake);
        None
    }

    /// Starts reading the final state of the session in `folder`.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot start.
    fn stored(&mut self, folder: &Path, wake: Wake) -> Result<Storing, UserError>;

    /// Starts carrying out `command` on the stored session in `folder`, without its camera. Its
    /// result is stored again.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot start.
    fn correct(
        &mut self,
        folder: &Path,
        command: Command,
        wake: Wake,
    ) -> Result<Storing, UserError>;

    /// Moves the session in `folder` to the bin.
    ///
    /// # Errors
    ///
    /// [`UserError`]; the session is then unchanged.
    fn delete(&mut self, folder: &Path) -> Result<(), UserError>;

    /// Moves the session in `folder` to the bin if it holds neither a view nor a recorded stream.
    ///
    /// # Errors
    ///
    /// As [`Self::delete`].
    fn discard(&mut self, folder: &Path) -> Result<(), UserError> {
        if recordings::keeps_pictures(folder) { Ok(()) } else { self.delete(folder) }
    }

    /// Starts opening the recording in `folder`.
    ///
    /// # Errors
    ///
    /// [`UserError`] if it cannot start.
    fn replay(&mut self, folder: &Path, wake: Wake) -> Result<Loading, UserError>;

    /// Kind of a path dropped onto the window.
    fn dropped(&self, path: &Path) -> Dropped;

    /// Shows a file in the desktop's program.
    ///
    /// # Errors
    ///
    /// [`UserError`].
    fn show(&mut self, file: &Path) -> Result<(), UserError>;

    /// True if the person asked the whole program to end.
    fn interrupted(&self) -> bool;

    /// Switches the computer's voice on or off. With `mirrored`, left and right are swapped for a
    /// person facing the camera. May be called on every repaint.
    ///
    /// # Errors
    ///
    /// [`UserError`] without a voice.
    fn speak(&mut self, on: bool, mirrored: bool) -> Result<(), UserError> {
        let _ = (on, mirrored);
        Ok(())
    }

    /// Speaks a test sentence.
    ///
    /// # Errors
    ///
    /// [`UserError`] without a voice.
    fn test_voice(&mut self) -> Result<(), UserError> {
        Ok(())
    }

    /// Link to the phone's page, if served.
    fn phone(&self) -> Option<PhoneLink> {
        None
    }

    /// Number of phones now following the session.
    fn phones(&self) -> usize {
        0
    }

    /// True, once, if a phone asked for two more views of the ended session.
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
    /// Link for the owner, with token.
    pub link: String,
    /// Link for onlookers.
    pub watcher: String,
    /// The link as a QR code: rows of modules with their quiet zone, true where dark.
    pub code: Vec<Vec<bool>>,
}

/// Camera, board and plan for a session.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRequest {
    /// Name of the source.
    pub source: String,
    /// Mode of a live camera, as in the settings file.
    pub mode: String,
    /// Inner corners of the board: columns, rows.
    pub board: [u16; 2],
    /// Print of the board.
    pub pattern: Pattern,
    /// Side of a square.
    pub square_m: f64,
    /// Properties of the board to take from a code beside the board: those not given otherwise.
    pub board_code: BoardFromCode,
    /// Plan, which sets the number of views.
    pub plan: Plan,
    /// Folder of the session to resume.
    pub go_on_with: Option<PathBuf>,
    /// Command to give as soon as the session runs.
    pub first: Option<Command>,
}

/// Cameras and settings for a session of several cameras.
#[derive(Clone, Debug, PartialEq)]
pub struct RigRequest {
    /// Name in the rig and source of each camera.
    pub cameras: Vec<(String, String)>,
    /// Settings of all of them. With a session to continue, its cameras and settings hold.
    pub wish: SessionRequest,
}

/// Session of several cameras, ready to run.
pub struct RigOpened {
    /// Names of the cameras.
    pub names: Vec<String>,
    /// Orders of the person to the session.
    pub hand: RigHand,
    /// Runs the session to its stored result. Runs beside the window.
    pub work: RigWork,
}

/// Work of a rig's session, which calls the given function after all news.
pub type RigWork = Box<dyn FnOnce(&mut dyn FnMut(&RigNews<'_>)) -> anyhow::Result<RigEnded> + Send>;

/// A camera and preview before a session.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraView {
    /// Stable name, to find the camera again.
    pub source: String,
    /// Name stated by the camera.
    pub name: String,
    /// Size of the pictures; empty before the first.
    pub mode: String,
    /// Newest picture, small.
    pub picture: Option<Arc<GrayImage>>,
    /// Number of the newest picture.
    pub number: u64,
    /// Inner corners of the board in front of the camera, if counted.
    pub board: Option<[u16; 2]>,
    /// Code printed beside the board.
    pub code: Option<SeenCode>,
    /// Corners around the whole board just seen, as [`SeenBoard::rim`].
    pub rim: Option<[[f32; 2]; 4]>,
    /// Board of another kind, seen where a plain board is counted.
    pub other: Option<OtherKind>,
    /// Reason for being unusable now.
    pub trouble: Option<UserError>,
}

impl CameraView {
    /// A camera not yet previewed.
    pub fn new(source: &str, name: &str) -> Self {
        Self {
            source: source.into(),
            name: name.into(),
            mode: String::new(),
            picture: None,
            number: 0,
            board: None,
            code: None,
            rim: None,
            other: None,
            trouble: None,
        }
    }
}

/// A recognised board of another kind.
#[derive(Clone, Debug, PartialEq)]
pub struct OtherKind {
    /// Kind in words.
    pub said: String,
    /// Markers, tags or circles.
    pub pattern: Pattern,
    /// Points in a row and in a column, if known.
    pub board: Option<[u16; 2]>,
}

/// A checkerboard seen with its whole rim.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenBoard {
    /// Corners around the squares, in order, as shares of the picture's width and height.
    pub rim: [[f32; 2]; 4],
    /// Code printed beside the board.
    pub code: Option<SeenCode>,
}

/// A board named by a printed code.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenCode {
    /// ID of the board.
    pub id: String,
    /// Inner corners: columns, rows.
    pub board: [u16; 2],
    /// Side of a square: as measured if known, else as printed.
    pub square_m: f64,
}

/// A sheet with a board.
#[derive(Clone, Debug, PartialEq)]
pub struct PrintedBoard {
    /// Path of the printable file.
    pub file: PathBuf,
    /// Side of a square.
    pub square_m: f64,
    /// Steps for the person at the printer.
    pub steps: Vec<String>,
}

/// Choices kept between windows; `None` where nothing was chosen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Memory {
    /// Source of the last session.
    pub source: Option<String>,
    /// Mode of the last session's camera.
    pub mode: Option<String>,
    /// Inner corners of the board.
    pub board: Option<[u16; 2]>,
    /// Print of the board.
    #[serde(rename = "markers")]
    pub pattern: Pattern,
    /// Side of a square.
    pub square_m: Option<f64>,
    /// Plan, which sets the number of views.
    #[serde(with = "plan_name")]
    pub plan: Option<Plan>,
    /// Recently opened streams and files, newest first, without passwords.
    pub streams: Vec<String>,
    /// Paper for a printed board.
    pub paper: Option<usize>,
    /// True for a mirrored picture.
    pub mirrored: Option<bool>,
    /// True for a tone with each view.
    pub tone: Option<bool>,
    /// True for spoken sentences.
    pub speech: Option<bool>,
    /// True for numbers beside the picture.
    pub panels: Option<bool>,
    /// True for full screen while the person is away from the computer.
    pub full_screen: Option<bool>,
    /// True once a view has been taken in the window: the person knows the guide.
    pub knows_guide: Option<bool>,
    /// Name of the colour theme.
    pub theme: Option<String>,
    /// Size of the interface.
    pub zoom: Option<f32>,
    /// Folder for new sessions; empty for the usual one.
    pub folder: String,
    /// Goal of new sessions, in the format of `--accept`; empty for none.
    pub goal: String,
    /// Code of the lens models for new sessions.
    pub lens: Option<String>,
    /// Standard deviation of the board's square size, in percent.
    pub board_error_percent: Option<f64>,
    /// Statements for certificates.
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

    /// Drops impossible values: the file may come from anywhere.
    pub(super) fn sensible(mut self) -> Self {
        let sides = |board: &[u16; 2]| board.iter().all(|side| (3..=99).contains(side));
        self.board = self.board.filter(sides);
        let length = |length_m: &f64| (0.0001..=9.9).contains(length_m);
        self.square_m = self.square_m.filter(length);
        if self.pattern.side_m().is_some_and(|side_m| !length(&side_m)) {
            self.pattern = Pattern::Plain;
        }
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

    /// Fills the gaps of `config` with the stored choices for new sessions.
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
    /// Pictures of existing views, by number.
    pub pictures: Vec<(ViewNumber, GrayImage)>,
    /// Adjustable controls of the camera.
    pub adjustables: Vec<Adjustable>,
    /// Note to show at the start, such as the chosen source.
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
    /// Result of the comparison with an older calibration, if requested.
    pub compared: Option<Result<Compared, UserError>>,
    /// The error, if any.
    pub trouble: Option<UserError>,
}

/// A comparison under way.
pub type Comparing = Background<Result<Compared, UserError>>;

/// A recording being opened.
pub type Loading = Background<Result<DecidedRecording, UserError>>;

/// A stored session being read.
pub type Storing = Background<Result<StoredSession, UserError>>;

/// Thumbnails of sessions being read.
pub type SmallPictures = Background<Vec<(PathBuf, GrayImage)>>;
