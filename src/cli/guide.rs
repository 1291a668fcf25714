//! `boresight guide`.

use std::path::PathBuf;

use clap::Args;

use super::{
    accept_args::AcceptArguments,
    backend,
    guide_rig::{self, is_rig},
    lens_args::LensArguments,
    status::Status,
    stream_args::StreamArguments,
};
use boresight_app::{BoardFromCode, Exit, FinishedRun, Host, Opening, session::run::Concluded};
use boresight_present::text::window as words;
use boresight_run::config::Backend;
use boresight_terminal::{
    announcer,
    beside::{Beside, BesideArguments, Code},
    board_args::BoardArguments,
    operation::{Operation, OperationArguments},
    print, say,
    usage::WrongUsage,
};
#[cfg(feature = "window")]
use {
    boresight_app::{Services, window::desktop::has_display},
    boresight_window::open as window,
};

/// Guide a person through the poses, take the views, and calibrate.
///
/// Opens a window. Without options, its start page asks for camera, board and plan; with any, the
/// session starts at once. F12 lists the keys; you don't need any. The session ends when the plan
/// is complete, or at Ctrl-C. Your views are always safe: `--session DIR` resumes where you
/// stopped.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Source of the pictures: a camera (its name from `boresight devices`, or its node such as
    /// /dev/video0), gige:NAME for a machine-vision camera on the network, ros2:/TOPIC for a camera
    /// of ROS 2, sim, sim:SCENE.toml, sim:random:SEED, a recorded session, a folder of pictures, a
    /// video file, a recorded bag (MCAP, .db3), a stream such as rtsp://… or http://… (video files
    /// and streams need ffmpeg), pipe:COMMAND for what another program writes, or - for standard
    /// input. auto, the default without the start page: the only camera, or a simulation if there
    /// is none.
    #[arg(long, value_name = "SOURCE")]
    source: Option<String>,
    /// Camera backend [default: the first one below that this build has and that knows the camera].
    #[arg(long, value_name = "BACKEND", value_parser = backend::names())]
    backend: Option<Backend>,
    #[command(flatten)]
    stream: StreamArguments,
    /// Several cameras that see one board, each with any source; they need no trigger, since
    /// pictures are taken while the board rests. Also with --session: other sources for the cameras
    /// named.
    #[arg(long, value_name = "NAME=SOURCE", num_args = 1.., conflicts_with_all = ["source", "against", "set_camera_info"])]
    rig: Vec<String>,
    /// Calibration of a rig's camera, whose lens nobody has touched since.
    #[arg(long, value_name = "NAME=FILE", requires = "rig", conflicts_with = "session")]
    known_lens: Vec<String>,
    /// The rig's cameras have one trigger: a calm hand will do.
    #[arg(long, requires = "rig", conflicts_with = "session")]
    synchronised: bool,
    /// Guide in the terminal instead of a window.
    #[arg(long)]
    headless: bool,
    #[command(flatten)]
    board: BoardArguments,
    #[command(flatten)]
    goal: AcceptArguments,
    #[command(flatten)]
    lens: LensArguments,
    /// Resume this session with its original settings.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "settings", "config", "accept", "board_scale_error", "shifted_sensor", "lens"])]
    session: Option<PathBuf>,
    /// Compare the result with this older calibration and report what has changed. The older file
    /// isn't changed.
    #[arg(long, visible_alias = "replaces", value_name = "OLD", conflicts_with = "session")]
    against: Option<PathBuf>,
    /// Hold the new calibration to OLD, within the uncertainty of both: for a small or distant
    /// board. Use it only if focus and zoom are locked and nobody has touched them since. The
    /// result says if the lens has changed, or why it can't be held.
    #[arg(long, requires = "against")]
    hold: bool,
    /// Folder for the new session [default: a new one in ./sessions].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Save every picture, not only those of accepted views.
    #[arg(long)]
    record_stream: bool,
    /// Stop after this many pictures [default: 18000 of a simulation, all of any other source].
    #[arg(long, value_name = "N")]
    max_frames: Option<u64>,
    /// Give the result to the driver of a ROS 2 camera at the end: its service set_camera_info
    /// keeps and publishes it. A result that's untrustworthy is kept back.
    #[arg(long, conflicts_with = "session")]
    set_camera_info: bool,
    #[command(flatten)]
    beside: BesideArguments,
    #[command(flatten)]
    operation: OperationArguments,
    /// Print the result as JSON on the last line of stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight guide --board 9x6 --square 25mm
  boresight guide --headless --source sim
  boresight guide --accept \"length 800mm at 2m <= 2mm\"
  boresight guide --rig left=/dev/video0 right=/dev/video2 --board 9x6
  boresight guide --session sessions/2026-11-21T08-00-00Z";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let operation = self.operation.start()?;
        let mut opening = self.opening()?;
        if !self.rig.is_empty() || self.session.as_deref().is_some_and(is_rig) {
            if let Some(option) = self.operation.of_one_camera() {
                let usage = format!("{option} is for one camera: leave it out for a rig");
                return Err(WrongUsage(usage).into());
            }
            return self.guide_rig(&opening, operation);
        }
        if self.opens_window() {
            #[cfg(feature = "window")]
            {
                let at_once = self.says_something();
                if at_once {
                    opening.board_code = self.board.open_to_code()?;
                }
                return window::run(opening, &self.beside, operation, (at_once, self.json));
            }
        }
        opening.board_code = self.board.open_to_code()?;
        let beside = self.beside.start(operation, self.beside.for_person(announcer()))?;
        if cfg!(feature = "serve") && !beside.has_phone() && is_over_ssh() {
            say(words::OVER_SSH);
        }
        sessions(&beside, opening, self.json)
    }

    fn guide_rig(&self, opening: &Opening, operation: Operation) -> anyhow::Result<Exit> {
        let given = guide_rig::Given {
            cameras: &self.rig,
            known_lenses: &self.known_lens,
            is_synchronised: self.synchronised,
        };
        if self.opens_window() {
            #[cfg(feature = "window")]
            {
                let announcer = self.beside.announcer_of_rig();
                let run = given.open(opening, &announcer)?;
                let beside = self.beside.start(operation, announcer)?;
                return guide_rig::in_window(run, beside.host.clone(), self.json);
            }
        }
        let announcer = self.beside.for_person(announcer());
        let run = given.open(opening, &announcer)?;
        let beside = self.beside.start(operation, announcer)?;
        let exit = guide_rig::in_terminal(run, &beside.host, self.json)?;
        beside.wants_more();
        Ok(exit)
    }

    /// True to guide in a window. Says why not, unless that was asked for.
    fn opens_window(&self) -> bool {
        if self.headless {
            return false;
        }
        #[cfg(feature = "window")]
        if has_display() {
            return true;
        }
        say(if cfg!(feature = "window") { words::IN_TERMINAL } else { words::BUILT_WITHOUT });
        false
    }

    /// Program behind a window for the sessions.
    #[cfg(feature = "window")]
    pub(super) fn services(&self, paced: bool) -> anyhow::Result<Box<dyn Services>> {
        window::services(self.opening()?, &self.beside, self.says_something(), paced)
    }

    /// True if an option describes the session: then the window asks nothing.
    #[cfg(feature = "window")]
    fn says_something(&self) -> bool {
        self.source.is_some()
            || self.backend.is_some()
            || self.board.says_something()
            || self.goal.says_something()
            || self.lens.says_something()
            || self.session.is_some()
            || self.against.is_some()
            || self.out.is_some()
            || self.record_stream
    }

    fn opening(&self) -> anyhow::Result<Opening> {
        let mut config = self.board.config()?;
        self.goal.apply(&mut config);
        self.stream.apply(&mut config);
        self.lens.apply(&mut config);
        config.camera.set_camera_info |= self.set_camera_info;
        Ok(Opening {
            source: self.source.clone().unwrap_or_else(|| "auto".into()),
            backend: self.backend.clone(),
            config,
            session: self.session.clone(),
            takes_more: false,
            against: self.against.clone(),
            hold: self.hold,
            out: self.out.clone(),
            record_stream: self.record_stream,
            max_frames: self.max_frames,
            board_code: BoardFromCode::Nothing,
        })
    }
}

/// Runs a session in the terminal, and adds two views as often as requested by a phone.
fn sessions(beside: &Beside, mut opening: Opening, as_json: bool) -> anyhow::Result<Exit> {
    loop {
        let finished = in_terminal(&beside.host, &opening, beside.code());
        let concluded = printed(beside.host.conclude(finished)?, as_json)?;
        if !beside.wants_more() {
            return Ok(concluded.exit);
        }
        opening = opening.going_on(&concluded.path);
    }
}

fn is_over_ssh() -> bool {
    std::env::var_os("SSH_CONNECTION").is_some()
}

/// Runs a session in the terminal, with lines rewritten in place where possible; `code` makes the
/// lines of a phone's QR code.
pub(super) fn in_terminal(
    host: &Host,
    opening: &Opening,
    code: Option<Code>,
) -> anyhow::Result<FinishedRun> {
    let run = host.open(opening)?;
    let announcer = host.announcer();
    let Some(status) = Status::new(announcer.is_mirrored()) else { return host.finish(run) };
    if let Some(code) = code {
        status.offer_code(code);
    }
    // The lines hold the requests.
    let host = host.announced_by(announcer.clone().without_requests());
    host.watched_by(status.onlooker()).finish(run)
}

/// Prints the result as JSON with `as_json`.
pub(super) fn printed(concluded: Concluded, as_json: bool) -> anyhow::Result<Concluded> {
    if as_json {
        print(&concluded.result.to_json()?.to_string())?;
    }
    Ok(concluded)
}
