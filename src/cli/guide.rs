//! `boresight guide`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;

use super::{
    Exit,
    board_args::BoardArguments,
    camera::BackendName,
    compare,
    cue_link::cue_link,
    run::{Listener, Run},
    say,
    source::{SourceName, open_folder, open_session},
    window,
};
#[cfg(unix)]
use crate::capture::Ffmpeg;
use crate::{
    capture::FrameSource,
    config::Config,
    pipeline::FrameReport,
    recording::{Header, SessionFolder, replay},
    session::Session,
    simulation::{SyntheticSource, TruthLog},
    text,
    ui::desk::AppHost,
};

/// Guide a person through the poses, take the views by itself, and calibrate.
///
/// Example: boresight guide --board 9x6 --square 25mm
/// Example: boresight guide --headless --source sim
///
/// Opens a window; in it F12 shows all keys, and none is needed.
/// A session ends by itself when the plan is complete, and at Ctrl-C; nothing that was shown as taken is
/// ever lost, and `--session DIR` goes on where it stopped.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Where pictures come from: a camera (its name from `boresight devices`, or its node such as
    /// /dev/video0), sim, sim:SCENE.toml, sim:random:SEED, a recorded session, a folder of pictures, a video
    /// file, or a stream such as rtsp://… and http://… (both need ffmpeg); auto takes the only real camera, else the simulated one, and says which.
    #[arg(long, default_value = "auto", value_name = "SOURCE")]
    source: String,
    /// Through what a live camera is read [default: v4l on Linux, nokhwa elsewhere].
    #[arg(long, value_name = "BACKEND")]
    backend: Option<BackendName>,
    /// Guide by words in the terminal instead of a window.
    #[arg(long)]
    headless: bool,
    #[command(flatten)]
    board: BoardArguments,
    /// Go on with this session, with the settings that it began with.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "settings", "config"])]
    session: Option<PathBuf>,
    /// An older calibration to compare with: the result says what has changed since. It is named in the new
    /// one, and left as it is.
    #[arg(long, visible_alias = "replaces", value_name = "OLD", conflicts_with = "session")]
    against: Option<PathBuf>,
    /// Folder of the new session; by default a new one in ./sessions.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Store every picture, not only the accepted ones.
    #[arg(long)]
    record_stream: bool,
    /// Stop after this many pictures.
    #[arg(long, value_name = "N", default_value_t = 18_000)]
    max_frames: u64,
    /// Print the result as JSON, as the last line on stdout.
    #[arg(long)]
    json: bool,
}

/// What a session is opened with: the arguments, or what the window's settings make of them.
pub(super) struct Opening {
    pub(super) source: String,
    /// Instead of the configuration's.
    pub(super) backend: Option<BackendName>,
    pub(super) config: Config,
    /// The session to go on with.
    pub(super) session: Option<PathBuf>,
    /// The older calibration to compare with.
    pub(super) against: Option<PathBuf>,
    pub(super) out: Option<PathBuf>,
    pub(super) record_stream: bool,
    pub(super) max_frames: u64,
}

impl Arguments {
    /// A full session of a camera whose calibration in `old` no longer holds.
    pub(super) fn full(
        source: String,
        board: BoardArguments,
        old: PathBuf,
        (backend, max_frames): (Option<BackendName>, u64),
        json: bool,
    ) -> Self {
        Self {
            source,
            backend,
            headless: true,
            board,
            session: None,
            against: Some(old),
            out: None,
            record_stream: false,
            max_frames,
            json,
        }
    }

    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let opening = self.opening()?;
        if !self.headless {
            return window::run(opening, self.json);
        }
        let (run, _) = opening.open()?;
        run.finish(self.json)
    }

    /// The program around a window that shows these sessions.
    pub(super) fn desk(&self, paced: bool) -> anyhow::Result<Box<dyn AppHost>> {
        window::desk(self.opening()?, paced)
    }

    fn opening(&self) -> anyhow::Result<Opening> {
        Ok(Opening {
            source: self.source.clone(),
            backend: self.backend,
            config: self.board.config()?,
            session: self.session.clone(),
            against: self.against.clone(),
            out: self.out.clone(),
            record_stream: self.record_stream,
            max_frames: self.max_frames,
        })
    }
}

impl Opening {
    /// Opens source and folder. Returns what can be run, and what a person at a window should know.
    pub(super) fn open(&self) -> anyhow::Result<(Run, Option<String>)> {
        // What cannot be read is better known before the views are taken than after.
        let old = self.against.as_deref().map(compare::read).transpose()?;
        for doubt in old.iter().flat_map(text::doubts_of_old) {
            say(&format!("{doubt}."));
        }
        let (mut config, resumed) = match &self.session {
            Some(path) => {
                let opened = SessionFolder::open(path)?;
                (opened.1.config.clone(), Some(opened))
            }
            None => (self.config.clone(), None),
        };
        if let Some(backend) = self.backend {
            config.camera.backend = backend.into();
        }
        let name = match &resumed {
            Some((_, header, _)) if self.source == "auto" => header.source.clone(),
            _ => self.source.clone(),
        };
        let name = SourceName::parse(&name, &config)?;
        // With one camera, or none, the person did not choose.
        let note = matches!(name, SourceName::Simulated(_) if self.source == "auto")
            .then(|| text::window::NO_CAMERA.to_owned());
        let (source, judged, truth) = open(&name, self.max_frames)?;
        let image_size =
            source.identity().image_size.context("the source does not say its picture size")?;
        let mut session = Session::new(config.session(image_size)?);
        let mut first_frame = 0;
        let is_resumed = resumed.is_some();
        let folder = match resumed {
            Some((folder, header, contents)) => {
                if header.image_size() != image_size {
                    bail!(
                        "the session's pictures are {:?}, this source's {:?}: a calibration is for one size",
                        header.image_size_px,
                        [image_size.width_px, image_size.height_px]
                    );
                }
                replay(&mut session, contents.lines, |_, decision| {
                    first_frame = first_frame.max(decision.frame.map_or(0, |frame| frame + 1));
                });
                say(&format!("Going on with {} views.", session.accepted().len()));
                folder
            }
            None => {
                let path = self.out.clone().unwrap_or_else(new_session_path);
                let header = Header::new(&spelled(&name, &self.source), image_size, config)
                    .of_camera(source.camera_facts());
                let header = match &self.against {
                    Some(old) => header.against(old),
                    None => header,
                };
                SessionFolder::create(&path, &header)?
            }
        };
        let run = Run {
            folder,
            session,
            source,
            judged,
            truth,
            record_stream: self.record_stream,
            first_frame,
            resumed: is_resumed,
        };
        Ok((run, note))
    }
}

/// What brings the same source back: the name as given.
pub(super) fn spelled(name: &SourceName, given: &str) -> String {
    match name {
        SourceName::Simulated(_) if given == "auto" => "sim".into(),
        SourceName::Camera(camera) => camera.stable_name(),
        _ => given.into(),
    }
}

/// Frames that a simulated camera may have under way at once.
const IN_FLIGHT: usize = 24;

/// A new folder name from the time.
pub(super) fn new_session_path() -> PathBuf {
    let stamp = jiff::Timestamp::now().strftime("%Y-%m-%dT%H-%M-%SZ").to_string();
    let plain = Path::new("sessions").join(&stamp);
    (2..1000)
        .map(|n| Path::new("sessions").join(format!("{stamp}-{n}")))
        .fold(plain, |free, next| if free.exists() { next } else { free })
}

/// A source, who listens to what is made of its frames, and the truth if it knows it.
pub(super) type Opened = (Box<dyn FrameSource>, Listener, Option<TruthLog>);

/// Opens a source; the simulated one with the link that tells its technician what to do.
pub(super) fn open(name: &SourceName, max_frames: u64) -> anyhow::Result<Opened> {
    Ok(match name {
        SourceName::Simulated(scene) => {
            let (mut sender, receiver) = cue_link();
            let source = SyntheticSource::new(
                (**scene).clone(),
                Box::new(receiver),
                Some(max_frames),
                IN_FLIGHT,
            );
            let truth = source.truth();
            (
                Box::new(source),
                Box::new(move |judged: FrameReport<'_>| sender.tell(judged)),
                Some(truth),
            )
        }
        SourceName::Camera(camera) => (camera.open()?, Box::new(|_: FrameReport<'_>| ()), None),
        #[cfg(unix)]
        SourceName::Video(name) => {
            (Box::new(Ffmpeg::open(name)?), Box::new(|_: FrameReport<'_>| ()), None)
        }
        SourceName::Session(path) => (open_session(path)?, Box::new(|_: FrameReport<'_>| ()), None),
        SourceName::Folder(path) => (open_folder(path)?, Box::new(|_: FrameReport<'_>| ()), None),
    })
}
