//! `boresight check`.

use std::{
    io::{BufRead, IsTerminal},
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;
use serde_json::{Value, json};

use super::{
    Exit,
    board_args::BoardArguments,
    camera::BackendName,
    guide::{self, Run, new_session_path, open, spelled},
    print, say, session_report,
    source::SourceName,
};
use crate::{
    calibration::{
        Drift, DriftVerdict, NoDrift, OldLens, drift,
        import::{self, OldCalibration},
    },
    config::{BoardConfig, Config, PlanName},
    device::Control,
    frame::ImageSize,
    geometry::Corner,
    recording::{
        Header, SessionFolder,
        save::{Overwrite, save},
    },
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

/// Why there is no verdict.
enum NoVerdict {
    /// The file names another camera.
    OtherCamera { old: String, new: String },
    /// The file has a focal length for every view and none for the camera.
    FocalVaries,
    /// The views do not allow one.
    NoDrift(NoDrift),
}

/// What came of a check.
type Checked = Result<Drift, NoVerdict>;

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let old = read(&self.against)?;
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
        let found = self.compare(&ran.session, &config, image_size, &old)?;
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

    fn compare(
        &self,
        session: &Session,
        config: &Config,
        image_size: ImageSize,
        old: &OldCalibration,
    ) -> anyhow::Result<Checked> {
        let views: Vec<Vec<Corner>> =
            session.accepted().iter().map(|accepted| accepted.view.corners.clone()).collect();
        let lens = OldLens {
            camera: old.camera,
            covariance: old.covariance,
            outlines: &old.outlines,
            image_size: old.image_size,
        };
        Ok(drift(&views, &config.board()?, image_size, &lens).map_err(NoVerdict::NoDrift))
    }

    /// Says what was found and writes it into the session's folder; the exit code that it deserves.
    fn tell(
        &self,
        old: &OldCalibration,
        source: &str,
        session: Option<&Path>,
        found: &Checked,
    ) -> anyhow::Result<Exit> {
        let (what, action) = match found {
            Ok(drift) => text::drift(drift),
            Err(NoVerdict::NoDrift(reason)) => text::no_drift(reason),
            Err(NoVerdict::FocalVaries) => text::focal_varied(),
            Err(NoVerdict::OtherCamera { old, new }) => text::other_camera(old, new),
        };
        say(&format!("{what}. {action}"));
        let mut report = json!({
            "schema": "boresight.check/1",
            "against": self.against.display().to_string(),
            "source": source,
            "image_size": [old.image_size.width_px, old.image_size.height_px],
            "message": what, "action": action,
        });
        let exit = match found {
            Ok(drift) => {
                for line in text::drift_numbers(drift) {
                    say(&format!("  {line}"));
                }
                if drift.assumed {
                    say(&format!("  {}.", text::drift_is_weak()));
                }
                merge(&mut report, numbers(drift));
                match drift.verdict {
                    DriftVerdict::Ok | DriftVerdict::Watch => Exit::Good,
                    DriftVerdict::Recalibrate => Exit::Recalibrate,
                }
            }
            Err(reason) => {
                let code = match reason {
                    NoVerdict::FocalVaries => "FOCAL-VARIES",
                    NoVerdict::OtherCamera { .. } => "OTHER-CAMERA",
                    NoVerdict::NoDrift(reason) => reason.code(),
                };
                merge(&mut report, json!({ "verdict": null, "reason": code }));
                Exit::NotTrustworthy
            }
        };
        if let Some(path) = session {
            let file = path.join("check.json");
            save(&file, serde_json::to_string_pretty(&report)?.as_bytes(), Overwrite::Allowed)?;
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
            "To calibrate anew: boresight guide --source {} --board {columns}x{rows} --square {square_mm}mm --replaces {}",
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

fn read(path: &Path) -> anyhow::Result<OldCalibration> {
    let text = std::fs::read_to_string(path).with_context(|| format!("could not read {path:?}"))?;
    import::read(&text).with_context(|| format!("could not use {path:?}"))
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

fn merge(report: &mut Value, more: Value) {
    if let (Value::Object(report), Value::Object(more)) = (report, more) {
        report.extend(more);
    }
}

fn numbers(drift: &Drift) -> Value {
    let [f, x, y]: [f64; 3] = drift.change_px.into();
    let [sd_f, sd_x, sd_y]: [f64; 3] = drift.sd_px.into();
    let camera = &drift.camera;
    json!({
        "verdict": drift.verdict.code(),
        "change": {
            "f_px": f, "pp_px": [x, y], "sigma": { "f_px": sd_f, "pp_px": [sd_x, sd_y] },
        },
        "statistic": drift.statistic, "limit": drift.limit,
        "pp_changed": drift.pp_changed, "f_changed": drift.f_changed,
        "lens_changed": drift.lens_changed, "residual_ratio": drift.residual_ratio,
        "visible": { "pp_px": drift.visible_pp_px, "f_px": drift.visible_f_px },
        "displacement_px": drift.displacement_px, "matters_px": drift.matters_px,
        "uncertainty_of_old": if drift.assumed { "assumed" } else { "stated" },
        "now": {
            "f_px": [camera.f_px.x, camera.f_px.y], "pp_px": [camera.pp_px.x, camera.pp_px.y],
        },
        "views_used": drift.used.len(),
    })
}
