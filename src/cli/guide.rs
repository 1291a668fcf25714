//! `boresight guide`.

use std::path::PathBuf;

use clap::Args;

use super::{
    accept_args::AcceptArguments,
    backend::BackendName,
    board_args::BoardArguments,
    terminal::{announcer, print, say, stop_flag},
};
use crate::{
    app::{Exit, Opening},
    text::window as words,
};
#[cfg(feature = "window")]
use {super::window, crate::app::AppHost};

/// Guide a person through the poses, take the views by itself, and calibrate.
///
/// Example: boresight guide --board 9x6 --square 25mm
/// Example: boresight guide --headless --source sim
/// Example: boresight guide --accept "length 800mm at 2m <= 2mm"
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
    #[command(flatten)]
    goal: AcceptArguments,
    /// Resume this session, with the settings that it began with.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "settings", "config", "accept", "board_scale_error"])]
    session: Option<PathBuf>,
    /// An older calibration to compare with: the result says what has changed since. It is named in the new
    /// one, and left as it is.
    #[arg(long, visible_alias = "replaces", value_name = "OLD", conflicts_with = "session")]
    against: Option<PathBuf>,
    /// Hold the new calibration to OLD, within the uncertainty of both: for a small or distant board. Use it only if
    /// focus and zoom are locked and nobody has touched them since; if the lens has changed, the result says so.
    #[arg(long, requires = "against")]
    hold: bool,
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

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let opening = self.opening()?;
        if !self.headless {
            #[cfg(feature = "window")]
            if crate::ui::has_display() {
                return window::run(opening, self.json);
            }
            say(if cfg!(feature = "window") { words::IN_TERMINAL } else { words::BUILT_WITHOUT });
        }
        run(&opening, self.json)
    }

    /// The program behind a window that shows these sessions.
    #[cfg(feature = "window")]
    pub(super) fn app_host(&self, paced: bool) -> anyhow::Result<Box<dyn AppHost>> {
        window::app_host(self.opening()?, paced)
    }

    fn opening(&self) -> anyhow::Result<Opening> {
        let mut config = self.board.config()?;
        self.goal.apply(&mut config);
        Ok(Opening {
            source: self.source.clone(),
            backend: self.backend.map(Into::into),
            config,
            session: self.session.clone(),
            against: self.against.clone(),
            hold: self.hold,
            out: self.out.clone(),
            record_stream: self.record_stream,
            max_frames: self.max_frames,
        })
    }
}

/// Runs a session in the terminal; prints the result as JSON with `json`.
pub(super) fn run(opening: &Opening, json: bool) -> anyhow::Result<Exit> {
    let announcer = announcer();
    let concluded =
        opening.open(&announcer)?.carry_out(&*stop_flag()?, &announcer)?.conclude(&announcer)?;
    if json {
        print(&concluded.result.to_json()?.to_string())?;
    }
    Ok(concluded.exit)
}
