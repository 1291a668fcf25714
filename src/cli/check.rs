//! `boresight check`.

use std::{
    io::{BufRead, IsTerminal},
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;

use super::{
    Exit,
    board_args::BoardArguments,
    camera::BackendName,
    compare::{self, Checked, NoVerdict},
    guide::{self, new_session_path, open, spelled},
    print,
    run::Run,
    say, session_report,
    source::SourceName,
};
use crate::{
    calibration::{DriftVerdict, NoDrift, import::OldCalibration},
    config::{BoardConfig, Config, PlanName},
    device::Control,
    recording::{Header, SessionFolder},
    session::Session,
    text,
};

/// Check an installed camera against its old calibration: OK, WATCH or RECALIBRATE.
///
/// Guides through two opposed pairs, then compares. It says how large a change it could have seen; it gives
/// no verdict for another picture size, another camera, or boards where the old calibration had none. The
/// old file is never changed.
///
/// Example: boresight check --against calibration.json --source /dev/video0
///
/// Reads this program's calibration.json, OpenCV YAML and JSON, ROS camera_info, Kalibr camchain and mrcal
/// .cameramodel; only the first states its uncertainty, which makes the sharpest test.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// The old calibration.
    #[arg(long, value_name = "OLD")]
    against: PathBuf,
    /// Where pictures come from, as for guide.
    #[arg(long, default_value = "auto", value_name = "SOURCE")]
    source: String,
    /// Through what a live camera is read [default: v4l on Linux, nokhwa elsewhere].
    #[arg(long, value_name = "BACKEND")]
    backend: Option<BackendName>,
    #[command(flatten)]
    board: BoardArguments,
    /// It is the same camera, though its name differs from the one in the file.
    #[arg(long)]
    same_camera: bool,
    /// Go on to a full calibration, without asking, if the camera has changed.
    #[arg(long)]
    recalibrate: bool,
    /// Folder of the check's session; by default a new one in ./sessions.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Stop after this many pictures.
    #[arg(long, value_name = "N", default_value_t = 18_000)]
    max_frames: u64,
    /// Print the verdict as JSON, as the last line on stdout.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let old = compare::read(&self.against)?;
        for doubt in text::doubts_of_old(&old) {
            say(&format!("{doubt}."));
        }
        let mut config = self.board.config()?;
        config.guidance.plan = PlanName::Quick;
        if let Some(backend) = self.backend {
            config.camera.backend = backend.into();
        }
        let name = SourceName::parse(&self.source, &config)?;
        let source_name = spelled(&name, &self.source);
        if old.focal_varies {
            return self.tell(&old, &source_name, None, &Err(NoVerdict::FocalVaries));
        }
        if let Some(named) = self.other_camera(&old, &source_name)? {
            return self.tell(&old, &source_name, None, &Err(named));
        }
        let (source, judged, truth) = open(&name, self.max_frames)?;
        let image_size =
            source.identity().image_size.context("the source does not say its picture size")?;
        if image_size != old.image_size {
            let reason = NoDrift::OtherSize { new: image_size, old: old.image_size };
            return self.tell(&old, &source_name, None, &Err(NoVerdict::NoDrift(reason)));
        }
        let path = self.out.clone().unwrap_or_else(new_session_path);
        let header = Header::new(&source_name, image_size, config.clone())
            .against(&self.against)
            .of_camera(source.camera_facts());
        let run = Run {
            folder: SessionFolder::create(&path, &header)?,
            session: Session::new(config.session(image_size)?),
            source,
            judged,
            truth,
            record_stream: false,
            first_frame: 0,
            resumed: false,
        };
        let ran = run.carry_out()?;
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
        let found = compare::compare(&ran.session, &old);
        let changed = found.as_ref().is_ok_and(|drift| drift.verdict != DriftVerdict::Ok);
        let exit = self.tell(&old, &source_name, Some(&ran.path), &found)?;
        session_report::write_and_tell(&ran.path, &ran.session);
        if changed && self.goes_on(&config)? {
            return self.full_calibration();
        }
        Ok(exit)
    }

    /// The name in the file, if it is another than `source`'s and nobody says that this is right.
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

    /// Says what was found and writes it into the session's folder; the exit code that it deserves.
    fn tell(
        &self,
        old: &OldCalibration,
        source: &str,
        session: Option<&Path>,
        found: &Checked,
    ) -> anyhow::Result<Exit> {
        let (_, action) = compare::words(found);
        compare::tell(found, action);
        let report = compare::check_json(&self.against, source, old, found, action);
        let exit = match found.as_ref().map(|drift| drift.verdict) {
            Ok(DriftVerdict::Ok | DriftVerdict::Watch) => Exit::Good,
            Ok(DriftVerdict::Recalibrate) => Exit::Recalibrate,
            Err(_) => Exit::NotTrustworthy,
        };
        if let Some(path) = session {
            let file = compare::store(path, &report)?;
            say(&format!("Result: {}", file.display()));
        }
        if self.json {
            print(&report.to_string())?;
        }
        Ok(exit)
    }

    /// Whether to calibrate anew right away.
    fn goes_on(&self, config: &Config) -> anyhow::Result<bool> {
        if self.recalibrate || agreed("Go on to a full calibration now?")? {
            return Ok(true);
        }
        let BoardConfig { columns, rows, square_mm } = config.board;
        say(&format!(
            "To calibrate anew: boresight guide --source {} --board {columns}x{rows} --square {square_mm}mm --against {}",
            self.source,
            self.against.display()
        ));
        Ok(false)
    }

    /// A full session with the same source and board; its result names the old file.
    fn full_calibration(self) -> anyhow::Result<Exit> {
        guide::Arguments::full(
            self.source,
            self.board,
            self.against,
            (self.backend, self.max_frames),
            self.json,
        )
        .run()
    }
}

/// Asks on a terminal; without one nobody can agree.
fn agreed(question: &str) -> anyhow::Result<bool> {
    if !(std::io::stdin().is_terminal() && std::io::stderr().is_terminal()) {
        return Ok(false);
    }
    say(&format!("{question} [y/N]"));
    let mut answer = String::new();
    std::io::stdin().lock().read_line(&mut answer).context("could not read the answer")?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes" | "Yes"))
}
