//! Which source a name means.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};

use super::{
    camera::{self, ChosenCamera},
    say,
};
#[cfg(unix)]
use crate::capture::is_address;
use crate::{
    capture::{CaptureError, FrameSource, ImageFolder, Recorded, SourceIdentity},
    config::Config,
    frame::{CaptureTime, Frame, FrameId, FrameKind},
    recording::{SessionFolder, stored_frame},
    session::Input,
    simulation::{Scene, SceneFile},
};

/// A source by name, not yet opened.
#[derive(Clone, Debug)]
pub(super) enum SourceName {
    /// The simulated camera.
    Simulated(Box<Scene>),
    /// A live camera.
    Camera(Box<ChosenCamera>),
    /// A network stream or a video file.
    #[cfg(unix)]
    Video(String),
    /// A recorded session.
    Session(PathBuf),
    /// A folder of pictures.
    Folder(PathBuf),
}

impl SourceName {
    /// What `name` means: `sim`, `sim:SCENE.toml`, `sim:random:SEED`, a camera's node or stable name, a
    /// session folder, or a folder of pictures. `auto` is the only real camera if there is one, else the
    /// simulated one; it says which.
    pub(super) fn parse(name: &str, config: &Config) -> anyhow::Result<Self> {
        if let Some(simulated) = name.strip_prefix("sim") {
            let mut scene = match simulated.strip_prefix(':') {
                None if simulated.is_empty() => Scene::default_720p(1),
                Some(rest) => match rest.strip_prefix("random:") {
                    Some(seed) => Scene::random(
                        seed.parse()
                            .with_context(|| format!("{seed:?} is no seed: a whole number"))?,
                    ),
                    None => SceneFile::load(Path::new(rest))?,
                },
                None => {
                    bail!(
                        "no source {name:?}: try a name from `boresight devices`, sim, a session folder, or a folder of pictures"
                    )
                }
            };
            scene.board = config.board()?;
            return Ok(Self::Simulated(Box::new(scene)));
        }
        #[cfg(unix)]
        if is_address(name) || is_video(Path::new(name)) {
            return Ok(Self::Video(name.into()));
        }
        if camera::is_name(name) {
            return ChosenCamera::named(name, config).map(|camera| Self::Camera(Box::new(camera)));
        }
        if name == "auto" {
            if let Some(camera) = ChosenCamera::only(config)? {
                return Ok(Self::Camera(Box::new(camera)));
            }
            say("There is no camera: this is the simulated camera with a simulated technician.");
            let mut scene = Scene::default_720p(1);
            scene.board = config.board()?;
            return Ok(Self::Simulated(Box::new(scene)));
        }
        let path = PathBuf::from(name);
        if path.join("session.toml").is_file() {
            return Ok(Self::Session(path));
        }
        if path.is_dir() {
            return Ok(Self::Folder(path));
        }
        bail!(
            "no source {name:?}: try a name from `boresight devices`, sim, a session folder, or a folder of pictures"
        )
    }
}

/// Whether `path` is a file of moving pictures.
#[cfg(unix)]
fn is_video(path: &Path) -> bool {
    const ENDINGS: [&str; 9] = ["mp4", "mov", "mkv", "avi", "webm", "m4v", "mjpeg", "mjpg", "ts"];
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    path.is_file() && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
}

/// Opens a folder of pictures.
pub(super) fn open_folder(path: &Path) -> anyhow::Result<Box<dyn FrameSource>> {
    Ok(Box::new(ImageFolder::open(path)?))
}

/// Opens the stored pictures of a session as a source.
pub(super) fn open_session(path: &Path) -> anyhow::Result<Box<dyn FrameSource>> {
    let header = SessionFolder::header(path)?;
    let identity =
        SourceIdentity { name: header.source.clone(), image_size: Some(header.image_size()) };
    let session = path.to_path_buf();
    let mut frames = Vec::new();
    let mut times = std::collections::BTreeMap::new();
    for line in SessionFolder::journal(path)?.lines {
        if let Input::Observed(observation) = Input::from(line.input) {
            times.insert(
                observation.frame_id.0,
                (observation.captured_at, observation.kind, observation.name),
            );
        }
        frames.extend(line.stored);
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
