//! `boresight check`.

use std::{
    io::{BufRead, IsTerminal},
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;

use super::{backend, guide, rig, stream_args::StreamArguments};
use boresight_app::{
    Exit, Host, Opening,
    session::{
        comparison::{self, Checked, NoVerdict},
        source::SourceName,
    },
};
use boresight_calibrate::{DriftVerdict, NoDrift};
use boresight_capture::without_secrets;
use boresight_formats::import::OldCalibration;
use boresight_geometry::device::Control;
use boresight_present::text;
use boresight_run::config::{Backend, Config, PlanName};
use boresight_terminal::{
    announcer,
    board_args::{BoardArguments, Size},
    print, say, stop_flag,
};

/// Check an installed camera against its old calibration.
///
/// Guides through two opposed pairs, then compares: OK if any change is surely within the limit,
/// RECALIBRATE if it's surely beyond, else CAN'T TELL, with what would tell. There is no verdict
/// for a different picture size, a different camera, or views outside the part of the picture that
/// the old calibration covers. The old file is never changed.
///
/// The old calibration is boresight's, which states its uncertainty. What other programs write may
/// never have been right: `boresight judge FILE PICTURES --out calibration.json` says whether it
/// was, and writes the lens of its pictures, which can be checked.
#[derive(Debug, Args)]
#[command(
    after_help = EXAMPLES
)]
pub(super) struct Arguments {
    /// The old calibration: a file, or the folder of its session.
    #[arg(long, value_name = "OLD")]
    against: PathBuf,
    /// Pictures of a rig's cameras, as for calibrate --rig, against its rig.json: has a camera
    /// moved against the others? Four places of the board do.
    #[arg(long, value_name = "NAME=FOLDER", num_args = 1.., conflicts_with_all = ["source", "out", "max_frames", "recalibrate", "json"])]
    rig: Vec<PathBuf>,
    /// Width and height of the pictures of a rig's corner tables.
    #[arg(long, value_name = "WxH", requires = "rig")]
    image_size: Option<Size>,
    /// Source of the pictures, as for guide.
    #[arg(long, default_value = "auto", value_name = "SOURCE")]
    source: String,
    /// Camera backend [default: the first one below that this build has and that knows the camera].
    #[arg(long, value_name = "BACKEND", value_parser = backend::names())]
    backend: Option<Backend>,
    #[command(flatten)]
    stream: StreamArguments,
    #[command(flatten)]
    board: BoardArguments,
    /// Displacement in the picture above which a change matters, in pixels [default: 0.08 % of the
    /// width; 1 px between a rig's cameras].
    #[arg(long, value_name = "PX", value_parser = pixels)]
    limit: Option<f64>,
    /// Treat it as the same camera even if its name differs.
    #[arg(long)]
    same_camera: bool,
    /// If the camera has changed, continue to a full calibration without asking.
    #[arg(long)]
    recalibrate: bool,
    /// Folder for the check's session [default: a new one in ./sessions].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Stop after this many pictures [default: 18000 of a simulation, all of any other source].
    #[arg(long, value_name = "N")]
    max_frames: Option<u64>,
    /// Print the verdict as JSON on the last line of stdout.
    #[arg(long)]
    json: bool,
}

/// Displacement between two cameras above which a change matters, in pixels.
const RIG_LIMIT_PX: f64 = 1.0;

const EXAMPLES: &str = "\
Examples:
  boresight check --against sessions/gate
  boresight check --against calibration.json --source /dev/video0 --board 9x6 --square 25mm
  boresight check --against calibration.json --source rtsp://192.168.1.20/stream
  boresight check --against rig.json --rig left=today/left right=today/right";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if !self.rig.is_empty() {
            let limit_px = self.limit.unwrap_or(RIG_LIMIT_PX);
            let config = self.board.config()?;
            return rig::check(&self.against, &self.rig, &config, self.image_size, limit_px);
        }
        let old = comparison::read(&self.against)?;
        for doubt in text::doubts_of_old(&old) {
            say(&format!("{doubt}."));
        }
        let announcer = announcer();
        let mut asked = self.board.config()?;
        self.stream.apply(&mut asked);
        let mut config = asked.clone();
        config.guidance.plan = PlanName::Quick;
        let opening = Opening {
            backend: self.backend.clone(),
            against: Some(self.against.clone()),
            out: self.out.clone(),
            max_frames: self.max_frames,
            ..Opening::new(&self.source, config)
        };
        let config = opening.with_backend(&opening.config);
        let name = SourceName::parse(&self.source, &config, &announcer)?;
        let source_name = name.stable_name(&self.source);
        if let Some(reason) = comparison::not_comparable(&old) {
            return self.tell(&old, &source_name, None, &Err(reason));
        }
        if let Some(named) = self.other_camera(&old, &source_name)? {
            return self.tell(&old, &source_name, None, &Err(named));
        }
        let host = Host::new(announcer.clone(), stop_flag()?);
        let open = name.open(self.max_frames)?;
        let image_size = open.image_size()?;
        if image_size != old.image_size {
            let reason = NoDrift::OtherSize { new: image_size, old: old.image_size };
            return self.tell(&old, &source_name, None, &Err(NoVerdict::NoDrift(reason)));
        }
        let run = opening.begin_with(&source_name, open, config.clone())?;
        let ran = host.finish(run)?;
        for (worker, reason) in ran.session.failures() {
            say(&format!("The {worker} failed: {reason}"));
        }
        for (control, was) in [(Control::Focus, old.locked.focus), (Control::Zoom, old.locked.zoom)]
        {
            let is = ran.session.camera().locks.of(control);
            if let Some(line) = was.and_then(|was| text::lock_differs(control, was, is)) {
                say(&format!("{line}."));
            }
        }
        let found = comparison::compare(&ran.session, &old, self.limit);
        let changed = found.as_ref().is_ok_and(|drift| drift.is_significant);
        let exit = self.tell(&old, &source_name, Some(&ran.path), &found)?;
        #[cfg(feature = "report")]
        boresight_app::session::session_report::write_and_announce(
            &ran.path,
            &ran.session,
            &announcer,
        );
        if changed && self.goes_on(&config)? {
            return self.full_calibration(asked);
        }
        if !changed && found.is_ok_and(|drift| drift.verdict == DriftVerdict::CannotTell) {
            say(&format!("More views: {}", self.guide_command(&config)));
        }
        Ok(exit)
    }

    /// Camera name in the file, if it differs from `source`'s and the person hasn't confirmed the
    /// change.
    fn other_camera(
        &self,
        old: &OldCalibration,
        source: &str,
    ) -> anyhow::Result<Option<NoVerdict>> {
        let Some(named) = old.source.as_deref().filter(|named| *named != source) else {
            return Ok(None);
        };
        if self.same_camera {
            return Ok(None);
        }
        let asked = format!(
            "The calibration is of {named:?}, this camera is {source:?}. Are they the same camera?"
        );
        if agreed(&asked)? {
            return Ok(None);
        }
        Ok(Some(NoVerdict::OtherCamera { old: named.into(), new: source.into() }))
    }

    /// Announces the finding and writes a check into the session's folder; returns the exit code.
    fn tell(
        &self,
        old: &OldCalibration,
        source: &str,
        session: Option<&Path>,
        found: &Checked,
    ) -> anyhow::Result<Exit> {
        let (_, action) = comparison::words(found);
        comparison::announce(found, &action, source, &announcer());
        let report = comparison::check_file(&self.against, source, old, found, &action);
        let exit = match found.as_ref().map(|drift| drift.verdict) {
            Ok(DriftVerdict::Ok) => Exit::Good,
            Ok(DriftVerdict::Recalibrate) => Exit::Recalibrate,
            Ok(DriftVerdict::CannotTell) | Err(_) => Exit::NotTrustworthy,
        };
        if let Some(path) = session {
            let file = comparison::store(path, &report)?;
            say(&format!("Result: {}", file.display()));
        }
        if self.json {
            print(&report.to_json()?.to_string())?;
        }
        Ok(exit)
    }

    /// True to calibrate again right away.
    fn goes_on(&self, config: &Config) -> anyhow::Result<bool> {
        if self.recalibrate || agreed("Continue to a full calibration now?")? {
            return Ok(true);
        }
        say(&format!("To recalibrate: {}", self.guide_command(config)));
        Ok(false)
    }

    /// Command for a full session with the same source and board, compared with the same file.
    fn guide_command(&self, config: &Config) -> String {
        let (board, square_mm) = (config.board.choice(), config.board.square_mm);
        format!(
            "boresight guide --source {} --board {board} --square {square_mm}mm --against {}",
            without_secrets(&self.source),
            self.against.display()
        )
    }

    /// Runs a full session with the same source and board; its result names the old file.
    fn full_calibration(self, config: Config) -> anyhow::Result<Exit> {
        let opening = Opening {
            backend: self.backend.clone(),
            against: Some(self.against),
            max_frames: self.max_frames,
            ..Opening::new(&self.source, config)
        };
        let host = Host::new(announcer(), stop_flag()?);
        Ok(guide::printed(host.session(&opening)?, self.json)?.exit)
    }
}

/// A length in pixels, above 0.
pub(super) fn pixels(typed: &str) -> Result<f64, String> {
    let px: Result<f64, _> = typed.trim().trim_end_matches("px").trim_end().parse();
    px.ok().filter(|px| *px > 0.0 && px.is_finite()).ok_or_else(|| "needs pixels above 0".into())
}

/// Asks on a terminal; false without a terminal.
fn agreed(question: &str) -> anyhow::Result<bool> {
    if !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
        return Ok(false);
    }
    say(&format!("{question} [y/N]"));
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer).context("could not read the answer")?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes" | "Yes"))
}
