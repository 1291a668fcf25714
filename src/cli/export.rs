//! `boresight export`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use serde_json::Value;

use super::{Exit, print, say};
use crate::{
    calibration::export::opencv_yaml,
    frame::ImageSize,
    geometry::{Camera, LENS_PARAMETERS},
    recording::save::{Overwrite, save},
};

/// Write a calibration for other programs.
///
/// Example: boresight export sessions/2026-11-21T08-00-00Z --format opencv-yaml --out camera.yaml
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A session folder, or its calibration.json.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    /// What to write.
    #[arg(long, value_enum, default_value = "opencv-yaml")]
    format: Format,
    /// Where to write it; without it, stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file if it exists.
    #[arg(long)]
    force: bool,
    /// The same as --format json.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Everything, in this program's own schema.
    Json,
    /// OpenCV's FileStorage.
    OpencvYaml,
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let path = if self.input.is_dir() {
            self.input.join("calibration.json")
        } else {
            self.input.clone()
        };
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("could not read {path:?}"))?;
        let report: Value =
            serde_json::from_str(&text).with_context(|| format!("not a calibration: {path:?}"))?;
        if report["schema"] != "boresight.calibration/1" {
            bail!(
                "its schema is {}, this version reads boresight.calibration/1: {path:?}",
                report["schema"]
            );
        }
        let out =
            if self.json || self.format == Format::Json { text } else { yaml(&report, &path)? };
        match &self.out {
            Some(out_path) => {
                let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
                save(out_path, out.as_bytes(), overwrite)?;
                say(&format!("Written: {}", out_path.display()));
            }
            None => print(out.trim_end())?,
        }
        if report["verdict"] == "untrustworthy" {
            say("This calibration is NOT TRUSTWORTHY; its findings say why.");
            return Ok(Exit::NotTrustworthy);
        }
        Ok(Exit::Good)
    }
}

fn yaml(report: &Value, path: &Path) -> anyhow::Result<String> {
    let number = |pointer: &str| {
        report
            .pointer(pointer)
            .and_then(Value::as_f64)
            .with_context(|| format!("it holds no result ({pointer}): {path:?}"))
    };
    let mut parameters = [0.0; LENS_PARAMETERS];
    for (parameter, pointer) in parameters.iter_mut().zip([
        "/result/f_px/0",
        "/result/f_px/1",
        "/result/pp_px/0",
        "/result/pp_px/1",
        "/result/distortion/k1",
        "/result/distortion/k2",
        "/result/distortion/p1",
        "/result/distortion/p2",
        "/result/distortion/k3",
    ]) {
        *parameter = number(pointer)?;
    }
    let size =
        |pointer: &str| -> anyhow::Result<u32> { Ok(u32::try_from(number(pointer)? as u64)?) };
    let image_size =
        ImageSize { width_px: size("/image_size/0")?, height_px: size("/image_size/1")? };
    Ok(opencv_yaml(
        &Camera::from_lens_parameters(&parameters),
        image_size,
        number("/result/rms_px")?,
    ))
}
