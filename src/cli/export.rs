//! `boresight export`.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::{Args, ValueEnum};
use serde_json::Value;

use super::{Exit, print, say};
use crate::{
    calibration::{
        export::{
            ExportedCamera, ViewRow, colmap_cameras, corner_table, kalibr_camchain, matlab_script,
            mrcal_cameramodel, opencv_yaml, ros_camera_info, views_csv,
        },
        import,
    },
    geometry::Corner,
    recording::{
        SessionFolder, replay,
        save::{Overwrite, save},
    },
    session::Session,
    text,
};

/// Write a calibration for other programs.
///
/// Example: boresight export sessions/2026-11-21T08-00-00Z --format opencv-yaml --out camera.yaml
///
/// Numbers have 17 significant digits; a format that cannot hold the lens is refused.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A session folder, or its calibration.json.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    /// What to write.
    #[arg(long, value_enum, default_value = "opencv-yaml")]
    format: Format,
    /// What the file calls the camera; by default the session's or file's name.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
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
    /// ROS camera_info.
    RosYaml,
    /// Kalibr camchain; holds no k3.
    Kalibr,
    /// COLMAP cameras.txt.
    Colmap,
    /// mrcal .cameramodel.
    Mrcal,
    /// Script for MATLAB and Octave.
    Matlab,
    /// What became of each view, as comma-separated values.
    ViewsCsv,
    /// The corners of the accepted views, `filename x y level`; needs the session folder.
    Vnl,
}

/// Names of the formats, and what a file of each is called.
const FILES: [(Format, &str, &str); 9] = [
    (Format::OpencvYaml, "OpenCV", "opencv.yaml"),
    (Format::RosYaml, "ROS", "ros.yaml"),
    (Format::Kalibr, "Kalibr", "kalibr.yaml"),
    (Format::Colmap, "COLMAP", "cameras.txt"),
    (Format::Mrcal, "mrcal", "camera.cameramodel"),
    (Format::Matlab, "MATLAB", "camera.m"),
    (Format::Json, "JSON", "camera.json"),
    (Format::ViewsCsv, "Views", "views.csv"),
    (Format::Vnl, "Corners", "corners.vnl"),
];

/// Names of the formats, in a fixed order.
pub(super) fn format_names() -> Vec<&'static str> {
    FILES.iter().map(|(_, name, _)| *name).collect()
}

/// Writes the result of the session in `folder` in the format of that number beside it, under a name that
/// is free.
pub(super) fn beside(folder: &Path, number: usize) -> anyhow::Result<PathBuf> {
    let (format, _, file) = FILES.get(number).context("there is no such format")?;
    let (stem, ending) = file.split_once('.').unwrap_or((file, ""));
    let out = (2..1000)
        .map(|n| folder.join(format!("{stem}-{n}.{ending}")))
        .fold(folder.join(file), |free, next| if free.exists() { next } else { free });
    let (input, out, format) = (folder.to_path_buf(), Some(out), *format);
    let arguments = Arguments { input, format, name: None, out, force: false, json: false };
    let written = arguments.out.clone().unwrap_or_default();
    arguments.run()?;
    Ok(written)
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let format = if self.json { Format::Json } else { self.format };
        if format == Format::Vnl {
            self.write(&self.corners()?)?;
            return Ok(Exit::Good);
        }
        let path = if self.input.is_dir() {
            self.input.join("calibration.json")
        } else {
            self.input.clone()
        };
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("could not read {path:?}"))?;
        let report: Value =
            serde_json::from_str(&text).with_context(|| format!("not a calibration: {path:?}"))?;
        let out = match format {
            Format::Json => text,
            Format::ViewsCsv => views_csv(&rows(&report)),
            _ => self.camera(format, &text, &path)?,
        };
        self.write(&out)?;
        if report["verdict"] == "untrustworthy" {
            say("This calibration is NOT TRUSTWORTHY; its findings say why.");
            return Ok(Exit::NotTrustworthy);
        }
        Ok(Exit::Good)
    }

    fn write(&self, text: &str) -> anyhow::Result<()> {
        let Some(path) = &self.out else {
            return print(text.trim_end());
        };
        let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
        save(path, text.as_bytes(), overwrite)?;
        say(&format!("Written: {}", path.display()));
        Ok(())
    }

    fn camera(&self, format: Format, text: &str, path: &Path) -> anyhow::Result<String> {
        let old = import::read(text).with_context(|| format!("could not use {path:?}"))?;
        if old.focal_varies {
            say(text::focal_is_a_mean());
        }
        let stem = self.input.file_stem().unwrap_or_default().to_string_lossy();
        let exported = ExportedCamera {
            name: self.name.as_deref().unwrap_or(&stem),
            camera: old.camera,
            image_size: old.image_size,
            rms_px: old.rms_px.unwrap_or(0.0),
        };
        Ok(match format {
            Format::OpencvYaml => opencv_yaml(&exported),
            Format::RosYaml => ros_camera_info(&exported),
            Format::Kalibr => kalibr_camchain(&exported).context("Kalibr cannot hold this lens")?,
            Format::Colmap => colmap_cameras(&exported),
            Format::Mrcal => mrcal_cameramodel(&exported),
            Format::Matlab => matlab_script(&exported),
            Format::Json | Format::ViewsCsv | Format::Vnl => bail!("no camera in this format"),
        })
    }

    /// The corners of the accepted views, from the session's journal.
    fn corners(&self) -> anyhow::Result<String> {
        let header = SessionFolder::header(&self.input)
            .context("a corner table is written from a session folder")?;
        let mut session = Session::new(header.config.session(header.image_size())?);
        replay(&mut session, SessionFolder::journal(&self.input)?.lines, |_, _| ());
        let views: Vec<(String, &[Corner])> = session
            .accepted()
            .iter()
            .map(|view| (view.picture_name(), view.view.corners.as_slice()))
            .collect();
        Ok(corner_table(views.iter().map(|(name, corners)| (name.as_str(), Some(*corners)))))
    }
}

fn rows(report: &Value) -> Vec<ViewRow> {
    let row = |view: &Value| {
        let number = |name: &str| view[name].as_f64();
        ViewRow {
            name: view["name"].as_str().unwrap_or_default().into(),
            used: view["used"] == true,
            reason: view["reason"].as_str().map(Into::into),
            tilt_deg: number("tilt_deg"),
            slot_deg: number("slot_deg"),
            rms_px: number("rms_px"),
            pl_residual_px: number("pl_residual_px"),
            focal_px: number("focal_px"),
            focal_sigma_px: number("focal_sigma_px"),
        }
    };
    report["views"].as_array().into_iter().flatten().map(row).collect()
}
