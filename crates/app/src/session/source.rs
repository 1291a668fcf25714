//! Sources by name: parses and opens them.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

#[cfg(not(all(unix, feature = "live", feature = "bags")))]
use crate::MissingFeature;
use crate::{
    Announcer, RESULT_FILE, RIG_RESULT,
    session::{
        camera::{self, ChosenCamera},
        cue_link::{CueSender, cue_link},
    },
};
#[cfg(all(unix, feature = "live"))]
use boresight_capture::Ffmpeg;
use boresight_capture::{
    CaptureError, FrameSource, ImageFolder, Recorded, SourceIdentity, Upright, is_address, is_bag,
    limited, unread_pictures_in, without_secrets,
};
use boresight_geometry::frame::{CaptureTime, Frame, FrameId, FrameKind, ImageSize};
use boresight_guide::session::Input;
use boresight_present::text;
use boresight_run::{
    config::Config,
    pipeline::OnFrame,
    recording::{RigSessionFile, SessionFolder, stored_frame},
};
use boresight_sim::{Cues, Scene, SceneFile, SyntheticSource, TruthLog};
#[cfg(feature = "bags")]
use boresight_sources::open_bag;
use nalgebra::Isometry3;

/// Default limit of a simulated camera's frames: ten minutes at 30 per second.
const SIMULATED_FRAMES: u64 = 18_000;

/// Maximum number of frames in flight from the simulated camera.
const IN_FLIGHT: usize = 24;

/// Hint on valid names.
const SOURCES: &str = "try a name from `boresight devices`, sim, a session folder, a folder of pictures, a video file, a recorded bag, a stream such as rtsp://…, pipe:COMMAND, or - for standard input";

/// Name of standard input as a source.
const STDIN: &str = "pipe:-";

/// An open source.
pub struct OpenSource {
    /// The source of the frames.
    pub source: Box<dyn FrameSource>,
    /// Callback for every judged frame, through which the simulated person reads the screen.
    pub on_frame: OnFrame,
    /// The truth, if the source is simulated.
    pub truth: Option<TruthLog>,
}

/// A parsed but unopened source name.
#[derive(Clone, Debug)]
pub enum SourceName {
    /// The simulated camera.
    Simulated(Box<Scene>),
    /// A live camera.
    Camera(Box<ChosenCamera>),
    /// A network stream or a video file.
    Video(String),
    /// A recorded bag, with the topic of the pictures, if named.
    Bag(PathBuf, Option<String>),
    /// A recorded session.
    Session(PathBuf),
    /// A folder of pictures, and orientation.
    Folder(PathBuf, Upright),
}

/// Kind of a file or folder that holds pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathKind {
    /// The folder of a session.
    Session,
    /// A recorded bag: a file, or the folder that ROS 2 makes.
    Bag,
    /// A file of moving pictures.
    Video,
    /// Any other folder.
    Folder,
}

impl OpenSource {
    /// Size of the source's pictures.
    ///
    /// # Errors
    ///
    /// If the source doesn't state it before its first picture.
    pub fn image_size(&self) -> anyhow::Result<ImageSize> {
        self.source.identity().image_size.context("the source doesn't state its picture size")
    }
}

impl SourceName {
    /// Parses `name`: `sim`, `sim:SCENE.toml`, `sim:random:SEED`, `sim:demo:SEED`, a camera's node
    /// or stable name, a video file, stream or bag, `pipe:COMMAND`, `-` for standard input, a
    /// session folder, or a folder of pictures. `auto` is the only real camera if there is exactly
    /// one, else the simulated camera; announces the choice. Announces skipped pictures of a
    /// folder, too.
    ///
    /// # Errors
    ///
    /// If no source has this name, a scene file is wrong, `auto` finds several cameras, or the
    /// backend in `config` doesn't exist.
    pub fn parse(name: &str, config: &Config, announcer: &Announcer) -> anyhow::Result<Self> {
        camera::Backend::asked(&config.camera.backend)?;
        if text::is_simulated(name) {
            let board = config.board()?;
            let usual = |scene: Scene| Scene { board, ..scene };
            let scene = match name.strip_prefix("sim:") {
                None => usual(Scene::ordinary_webcam(1)),
                Some(rest) => match rest.split_once(':') {
                    Some(("random", seed)) => usual(Scene::random(parsed_seed(seed)?)),
                    Some(("demo", seed)) => usual(Scene::demo(parsed_seed(seed)?)),
                    _ => SceneFile::load_with(Path::new(rest), board)?,
                },
            };
            return Ok(Self::Simulated(Box::new(scene)));
        }
        let name = if name == "-" { STDIN } else { name };
        let path = PathBuf::from(name);
        let kind = kind_of(&path);
        if is_address(name) || kind == Some(PathKind::Video) {
            return Ok(Self::Video(name.into()));
        }
        if camera::is_name(name) {
            return ChosenCamera::named(name, config).map(|camera| Self::Camera(Box::new(camera)));
        }
        if name == "auto" {
            if let Some(camera) = ChosenCamera::only(config, announcer)? {
                return Ok(Self::Camera(Box::new(camera)));
            }
            announcer.say(text::window::NO_CAMERA);
            let mut scene = Scene::ordinary_webcam(1);
            scene.board = config.board()?;
            return Ok(Self::Simulated(Box::new(scene)));
        }
        match kind {
            Some(PathKind::Session) => Ok(Self::Session(path)),
            Some(PathKind::Bag) => {
                let topic = &config.camera.topic;
                Ok(Self::Bag(path, (!topic.is_empty()).then(|| topic.clone())))
            }
            Some(PathKind::Folder) => {
                let left_out = unread_pictures_in(&path);
                if !left_out.is_empty() {
                    announcer.say(&text::source::pictures_left_out(&left_out));
                }
                Ok(Self::Folder(path, config.camera.upright()))
            }
            Some(PathKind::Video) | None => bail!("no source {name:?}: {SOURCES}"),
        }
    }

    /// Stable name to open the same source again; `given` is the typed name.
    pub fn stable_name(&self, given: &str) -> String {
        match self {
            Self::Simulated(_) if given == "auto" => "sim".into(),
            Self::Camera(camera) => camera.stable_name(),
            Self::Video(name) => without_secrets(name),
            _ => given.into(),
        }
    }

    /// Opens the source, which ends after `max_frames`. By default only a simulated camera has a
    /// limit.
    ///
    /// # Errors
    ///
    /// [`CaptureError`], or [`boresight_run::recording::RecordingError`] for a session folder.
    pub fn open(&self, max_frames: Option<u64>) -> anyhow::Result<OpenSource> {
        let source: Box<dyn FrameSource> = match self {
            Self::Simulated(scene) => {
                return Ok(open_simulated(scene, max_frames.unwrap_or(SIMULATED_FRAMES)));
            }
            Self::Camera(camera) => camera.open()?,
            #[cfg(all(unix, feature = "live"))]
            Self::Video(name) => Box::new(Ffmpeg::open(name)?),
            #[cfg(not(all(unix, feature = "live")))]
            Self::Video(name) => unreadable(name)?,
            #[cfg(feature = "bags")]
            Self::Bag(path, topic) => open_bag(path, topic.as_deref())?,
            #[cfg(not(feature = "bags"))]
            Self::Bag(..) => bail!(MissingFeature::BAGS),
            Self::Session(path) => open_session(path)?,
            Self::Folder(path, upright) => Box::new(ImageFolder::open(path, *upright)?),
        };
        let source = match max_frames {
            Some(most) => Box::new(limited(source, most)),
            None => source,
        };
        Ok(OpenSource { source, on_frame: Box::new(|_| ()), truth: None })
    }
}

fn parsed_seed(seed: &str) -> anyhow::Result<u64> {
    seed.parse().with_context(|| format!("{seed:?} is no seed: a whole number"))
}

fn open_simulated(scene: &Scene, max_frames: u64) -> OpenSource {
    let (sender, receiver) = cue_link();
    let cues = Box::new(receiver);
    simulated(SyntheticSource::new(scene.clone(), cues, Some(max_frames), IN_FLIGHT), sender)
}

fn simulated(source: SyntheticSource, mut sender: CueSender) -> OpenSource {
    OpenSource {
        truth: Some(source.truth()),
        source: Box::new(source),
        on_frame: Box::new(move |report| sender.send(report)),
    }
}

/// Simulated cameras in front of one person, each with `cam_from_first`.
pub(super) fn open_simulated_rig(
    cameras: Vec<(Scene, Isometry3<f64>)>,
    max_frames: u64,
) -> Vec<OpenSource> {
    let (senders, receivers): (Vec<_>, Vec<_>) = cameras.iter().map(|_| cue_link()).unzip();
    let cues = receivers.into_iter().map(|receiver| Box::new(receiver) as Box<dyn Cues>);
    let sources = SyntheticSource::rig(cameras, cues.collect(), Some(max_frames), IN_FLIGHT);
    sources.into_iter().zip(senders).map(|(source, sender)| simulated(source, sender)).collect()
}

/// Error for network streams and video files in builds without a reader.
#[cfg(not(all(unix, feature = "live")))]
fn unreadable(name: &str) -> anyhow::Result<Box<dyn FrameSource>> {
    if cfg!(unix) {
        bail!(MissingFeature::LIVE);
    }
    bail!("network streams and video files are read on Linux and macOS only: {name:?}")
}

/// Kind of the pictures at `path`; `None` if it's neither a folder nor a recording.
pub fn kind_of(path: &Path) -> Option<PathKind> {
    if is_session(path) {
        Some(PathKind::Session)
    } else if is_bag(path) {
        Some(PathKind::Bag)
    } else if is_video(path) {
        Some(PathKind::Video)
    } else {
        path.is_dir().then_some(PathKind::Folder)
    }
}

/// True if `path` is a recording of a camera: a video file or a bag.
pub fn is_recording(path: &Path) -> bool {
    matches!(kind_of(path), Some(PathKind::Video | PathKind::Bag))
}

/// True if `folder` is a session folder.
pub fn is_session(folder: &Path) -> bool {
    folder.join("session.toml").is_file()
}

/// Calibration file named by `path`: itself, or the result of the session in the folder.
///
/// # Errors
///
/// If the session has no result yet.
pub fn result_named_by(path: &Path) -> anyhow::Result<PathBuf> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let is_rig = RigSessionFile::is_in(path);
    let file = path.join(if is_rig { RIG_RESULT } else { RESULT_FILE });
    if (is_rig || is_session(path)) && !file.exists() {
        bail!("{}", text::source::no_result_yet(path));
    }
    Ok(file)
}

/// True if `path` is a video file.
fn is_video(path: &Path) -> bool {
    const ENDINGS: [&str; 18] = [
        "mp4", "mov", "mkv", "avi", "webm", "m4v", "mjpeg", "mjpg", "ts", "mts", "m2ts", "mpg",
        "mpeg", "wmv", "flv", "ogv", "3gp", "gif",
    ];
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    path.is_file() && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
}

/// The stored pictures of a session, as a source.
fn open_session(path: &Path) -> anyhow::Result<Box<dyn FrameSource>> {
    let (header, contents) = SessionFolder::read(path)?;
    let identity =
        SourceIdentity { name: header.source.clone(), image_size: Some(header.image_size()) };
    let session = path.to_path_buf();
    let frames = contents.stored;
    let stored: BTreeSet<u64> = frames.iter().map(|stored| stored.frame).collect();
    let mut times = BTreeMap::new();
    for line in &contents.lines {
        if let Input::Observed(observation) = Input::from(line?.input)
            && stored.contains(&observation.frame_id.0)
        {
            times.insert(
                observation.frame_id.0,
                (observation.captured_at, observation.kind, observation.name),
            );
        }
    }
    if frames.is_empty() {
        bail!("no pictures are stored in {path:?}");
    }
    let play = frames.into_iter().enumerate().map(move |(index, stored)| {
        let image = stored_frame(&session, &stored).map_err(|err| CaptureError::Decode {
            reason: err.to_string(),
            path: session.clone(),
        })?;
        let (captured_at, kind, name) = times.get(&stored.frame).cloned().unwrap_or((
            CaptureTime { nanos: 0 },
            FrameKind::Photograph,
            String::new(),
        ));
        Ok(Frame { id: FrameId(index as u64), captured_at, kind, name, image })
    });
    Ok(Box::new(Recorded::new(identity, play)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_ffmpeg_reads_is_a_source() {
        let place = tempfile::tempdir().expect("a folder");
        for name in ["a.mp4", "a.GIF", "a.mts", "a.mpeg"] {
            let path = place.path().join(name);
            assert!(!is_video(&path), "{name} isn't there yet");
            std::fs::write(&path, b"").expect("written");
            assert!(is_video(&path), "{name}");
        }
        assert!(!is_video(place.path()));
    }
}
