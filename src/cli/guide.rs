//! `boresight guide`.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use anyhow::{Context, bail};
use clap::Args;

use super::{
    Exit,
    board_args::BoardArguments,
    camera::BackendName,
    camera_words::CameraWords,
    compare,
    conclusion::{Conclusion, conclude},
    cue_link::cue_link,
    print, say, session_report,
    source::{SourceName, open_folder, open_session},
    truth,
};
#[cfg(unix)]
use crate::capture::Ffmpeg;
use crate::{
    capture::{
        FrameSource,
        synthetic::{SyntheticSource, TruthLog},
    },
    config::Config,
    guidance::{Progress, Refusal},
    pipeline::{Finished, Judged, Pipeline, PipelineError, SOURCE_PATIENCE, Setup},
    recording::{
        Header, SessionFolder, replay,
        save::{Overwrite, save},
    },
    session::{Input, Outcome, Session, Snapshot},
    text,
    ui::desk::{Compared, Desk},
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

/// A session that can be run.
pub(super) struct Run {
    pub(super) folder: SessionFolder,
    pub(super) session: Session,
    pub(super) source: Box<dyn FrameSource>,
    pub(super) judged: Listener,
    pub(super) truth: Option<TruthLog>,
    pub(super) record_stream: bool,
    pub(super) first_frame: u64,
    pub(super) resumed: bool,
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
            return super::window::run(opening, self.json);
        }
        let (run, _) = opening.open()?;
        run.finish(self.json)
    }

    /// The program around a window that shows these sessions.
    pub(super) fn desk(&self, paced: bool) -> anyhow::Result<Box<dyn Desk>> {
        super::window::desk(self.opening()?, paced)
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

/// What the result is called in the session's folder.
pub(super) const RESULT_FILE: &str = "calibration.json";
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

/// Called with every frame's result; the simulated technician listens here.
pub(super) type Listener = Box<dyn FnMut(Judged<'_>) + Send>;

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
            (Box::new(source), Box::new(move |judged: Judged<'_>| sender.tell(judged)), Some(truth))
        }
        SourceName::Camera(camera) => (camera.open()?, Box::new(|_: Judged<'_>| ()), None),
        #[cfg(unix)]
        SourceName::Video(name) => {
            (Box::new(Ffmpeg::open(name)?), Box::new(|_: Judged<'_>| ()), None)
        }
        SourceName::Session(path) => (open_session(path)?, Box::new(|_: Judged<'_>| ()), None),
        SourceName::Folder(path) => (open_folder(path)?, Box::new(|_: Judged<'_>| ()), None),
    })
}

/// A session that has run.
pub(super) struct Ran {
    /// As it ended.
    pub(super) session: Session,
    /// Its folder.
    pub(super) path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
}

impl Run {
    /// Runs until the plan is complete, the source ends, or Ctrl-C; then tells the result.
    pub(super) fn finish(self, json: bool) -> anyhow::Result<Exit> {
        Ok(self.carry_out()?.conclude(json)?.0)
    }

    /// Runs until the plan is complete, the source ends, or Ctrl-C.
    pub(super) fn carry_out(self) -> anyhow::Result<Ran> {
        let stop = stop_flag()?;
        let (setup, rest) = self.setup()?;
        let (pipeline, snapshots) = Pipeline::start(setup, || ())?;
        // Ends when the session thread does, too: a full disk closes the link.
        let mut camera_words = CameraWords::default();
        // A camera that is lost sends no snapshots; Ctrl-C must be heard nevertheless.
        while let Ok(snapshot) = snapshots.recv_within(SOURCE_PATIENCE) {
            let ended = snapshot.as_ref().is_some_and(ended);
            if let Some(snapshot) = snapshot {
                camera_words.tell(&snapshot.camera);
            }
            if stop.load(Ordering::Relaxed) || ended {
                break;
            }
        }
        rest.ran(pipeline.stop())
    }

    /// What the threads are started with, and what is needed once they have ended.
    pub(super) fn setup(self) -> anyhow::Result<(Setup, Rest)> {
        let path = self.folder.path().to_path_buf();
        say(&format!("Session: {}", path.display()));
        let Self {
            mut folder,
            mut session,
            source,
            judged,
            truth,
            record_stream,
            first_frame,
            resumed,
        } = self;
        if resumed {
            let decision = session.handle(&Input::Resumed);
            folder.journal_mut().append(&Input::Resumed, &decision, None, true)?;
        }
        let lossless = source.waits();
        let setup = Setup {
            source,
            session,
            folder: Some(folder),
            lossless,
            record_stream,
            first_frame,
            judged: Box::new(told(judged)),
        };
        Ok((setup, Rest { path, truth, first_frame }))
    }
}

/// A flag that Ctrl-C and a polite kill set.
pub(super) fn stop_flag() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    Ok(stop)
}

/// What is needed once the threads have ended.
pub(super) struct Rest {
    pub(super) path: PathBuf,
    truth: Option<TruthLog>,
    first_frame: u64,
}

impl Rest {
    /// The session that has run.
    pub(super) fn ran(self, finished: Result<Finished, PipelineError>) -> anyhow::Result<Ran> {
        let Self { path, truth, first_frame } = self;
        Ok(Ran { session: finished?.session, path, truth, first_frame })
    }
}

impl Ran {
    /// Tells the result and writes it into the session's folder. Returns what a comparison found, too, if one
    /// was asked for: that it fails is no failure of the session.
    pub(super) fn conclude(
        self,
        json: bool,
    ) -> anyhow::Result<(Exit, Option<anyhow::Result<Compared>>)> {
        let Self { session, path, truth, first_frame } = self;
        let header = SessionFolder::header(&path)?;
        let Conclusion { exit, report } = conclude(&session, &header);
        if !session.failures().is_empty() {
            say(&format!(
                "Every view that was shown as taken is safe; go on with: boresight guide --session {}",
                path.display()
            ));
        }
        if let Some(log) = truth {
            let truth = log.snapshot();
            if let Some(calibration) = session.calibration() {
                truth::tell(&truth, calibration);
            }
            truth::write(&path, &truth, first_frame)?;
        }
        let file = path.join(RESULT_FILE);
        // The session's own result; it follows from the journal and may be replaced.
        save(&file, serde_json::to_string_pretty(&report)?.as_bytes(), Overwrite::Allowed)?;
        say(&format!("Result: {}", file.display()));
        let compared = header.against.as_deref().map(|against| {
            let against = Path::new(against);
            let (compared, found) = compare::of_session(&path, &session, &header.source, against)?;
            say(&text::compared_with(against));
            compare::tell(&found, &compared.action);
            Ok(compared)
        });
        if let Some(Err(err)) = &compared {
            say(&format!("{} ({err:#})", text::NOT_COMPARED));
        }
        session_report::write_and_tell(&path, &session);
        if json {
            print(&report.to_string())?;
        }
        Ok((exit, compared))
    }
}

/// Prints each change of advice and every view taken, then passes the frame on.
fn told(mut judged: Listener) -> impl FnMut(Judged<'_>) + Send {
    let mut last = String::new();
    move |frame| {
        let snapshot = frame.snapshot;
        if let Some(outcome) = text::outcome(&snapshot.decision.outcome, snapshot) {
            say(&outcome);
        }
        // Nothing that the person does with the board would change this.
        if let Outcome::Refused { refusal: refusal @ Refusal::OtherSize { .. } } =
            &snapshot.decision.outcome
        {
            say(&format!("  Left out: {}", text::refusal(refusal)));
        }
        let advice = text::advice(&snapshot.decision.advice, frame.observation.seen.as_ref().err());
        // The same advice with another number is not news on a terminal.
        let gist: String = advice.chars().filter(|c| !c.is_ascii_digit()).collect();
        if gist != last {
            say(&format!("  {advice}"));
            last = gist;
        }
        judged(frame);
    }
}

fn ended(snapshot: &Snapshot) -> bool {
    snapshot.decision.progress != Progress::Collecting
        || snapshot.source_ended
        || !snapshot.failures.is_empty()
}
