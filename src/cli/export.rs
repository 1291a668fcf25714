//! `boresight export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::terminal::{announcer, print, say};
use boresight_app::{
    Exit,
    export::{self, export},
};
use boresight_files::{Overwrite, save};

/// Export a calibration for other programs.
///
/// Numbers have 17 significant digits. A format that can't hold the lens model is refused.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// A session folder, or its calibration.json.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    /// Format to write.
    #[arg(long, value_enum, default_value = "opencv-yaml")]
    format: FormatName,
    /// Camera name in the file [default: the name of the session or file].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// File to write [default: stdout].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
    /// Same as --format json.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FormatName {
    /// Everything, in boresight's schema.
    Json,
    /// OpenCV's FileStorage.
    OpencvYaml,
    /// ROS camera_info.
    RosYaml,
    /// Kalibr camchain (no k3).
    Kalibr,
    /// COLMAP cameras.txt.
    Colmap,
    /// mrcal .cameramodel.
    Mrcal,
    /// Script for MATLAB and Octave.
    Matlab,
    /// The result for each view, as comma-separated values.
    ViewsCsv,
    /// The corners of the accepted views, `filename x y level`; needs the session folder.
    Vnl,
}

impl From<FormatName> for export::Format {
    fn from(name: FormatName) -> Self {
        match name {
            FormatName::Json => Self::Json,
            FormatName::OpencvYaml => Self::OpencvYaml,
            FormatName::RosYaml => Self::RosYaml,
            FormatName::Kalibr => Self::Kalibr,
            FormatName::Colmap => Self::Colmap,
            FormatName::Mrcal => Self::Mrcal,
            FormatName::Matlab => Self::Matlab,
            FormatName::ViewsCsv => Self::ViewsCsv,
            FormatName::Vnl => Self::Vnl,
        }
    }
}

const EXAMPLES: &str = "\
Examples:
  boresight export sessions/2026-11-21T08-00-00Z --format opencv-yaml --out camera.yaml
  boresight export calibration.json --format ros-yaml --name front > front.yaml";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let format = if self.json { FormatName::Json } else { self.format };
        let exported = export(&self.input, format.into(), self.name.as_deref(), &announcer())?;
        match &self.out {
            None => print(exported.text.trim_end())?,
            Some(path) => {
                let overwrite = if self.force { Overwrite::Allowed } else { Overwrite::Never };
                save(path, exported.text.as_bytes(), overwrite)?;
                say(&format!("Written: {}", path.display()));
            }
        }
        if exported.untrustworthy {
            say("This calibration is NOT TRUSTWORTHY; its findings say why.");
            return Ok(Exit::NotTrustworthy);
        }
        Ok(Exit::Good)
    }
}
