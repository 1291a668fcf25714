//! `boresight serve`.

use std::path::PathBuf;

use clap::Args;

use super::{accept_args::AcceptArguments, backend, stream_args::StreamArguments};
use boresight_app::{Exit, Host, Opening};
use boresight_phone::session_page::Head;
use boresight_run::config::Backend;
use boresight_terminal::{
    announcer,
    beside::{NameArguments, VoiceArguments},
    board_args::BoardArguments,
    stop_flag,
};

/// Wait for a phone: choose camera, board and plan on its page, and calibrate.
///
/// For a camera that is out of reach of a screen. Prints a link with a secret key and a QR code;
/// only who has it is let in. Sessions are stored in ./sessions. If the phone is gone, the session
/// continues by itself. Ctrl-C ends.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// An address of this computer, a port (:8000), or both [default: every address, port 8417].
    #[arg(value_name = "ADDRESS", default_value = "", hide_default_value = true)]
    address: String,
    #[command(flatten)]
    names: NameArguments,
    /// The source that the page offers first, as in `boresight guide`.
    #[arg(long, value_name = "SOURCE", default_value = "auto", hide_default_value = true)]
    source: String,
    /// Camera backend [default: the first one below that this build has and that knows the camera].
    #[arg(long, value_name = "BACKEND", value_parser = backend::names())]
    backend: Option<Backend>,
    #[command(flatten)]
    stream: StreamArguments,
    #[command(flatten)]
    board: BoardArguments,
    #[command(flatten)]
    goal: AcceptArguments,
    /// Compare each result with this older calibration and report what has changed.
    #[arg(long, value_name = "OLD")]
    against: Option<PathBuf>,
    /// Save every picture, not only those of accepted views.
    #[arg(long)]
    record_stream: bool,
    #[command(flatten)]
    voice: VoiceArguments,
}

const EXAMPLES: &str = "\
Examples:
  boresight serve
  boresight serve 192.168.1.7 --board 9x6 --square 25mm";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let mut config = self.board.config()?;
        self.goal.apply(&mut config);
        self.stream.apply(&mut config);
        let opening = Opening {
            backend: self.backend.clone(),
            against: self.against,
            record_stream: self.record_stream,
            ..Opening::new(&self.source, config)
        };
        let voice = self.voice.start()?;
        let mut host = Host::new(self.voice.for_person(announcer()), stop_flag()?);
        if let Some(voice) = &voice {
            host = host.beside(voice.companion());
        }
        let phone = self.names.phone(&self.address)?;
        Ok(Head::new(phone, opening, host).run())
    }
}
