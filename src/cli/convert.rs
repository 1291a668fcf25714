//! `boresight convert`.

use std::path::PathBuf;

use clap::Args;

use super::export::{told_by, written};
use boresight_app::{Exit, session::export::Format};
use boresight_terminal::{board_args::Size, format_name};

/// Convert a calibration from one program's format to another's.
///
/// IN is recognised by its content. OUT's name tells its format if it's a usual one, such as
/// cameras.txt, transforms.json or front.cameramodel; else give --format. What the format can't
/// hold is refused.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// A calibration of boresight or another program, or a session folder; - reads one from
    /// standard input.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Format to write [default: what OUT's name tells].
    #[arg(long, value_parser = format_name())]
    format: Option<Format>,
    /// Camera name in the file [default: that of IN].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Size of the pictures, for an IN that doesn't state it: many files of OpenCV's tutorials.
    #[arg(long, value_name = "WxH")]
    image_size: Option<Size>,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight convert kalibr.yaml cameras.txt
  boresight convert mtx-dist.yaml front.yaml --format ros-yaml --image-size 1280x720
  boresight convert front.cameramodel front.yaml --format ros-yaml";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        let format = self.format.map_or_else(|| told_by(&self.out), Ok)?;
        let image_size = self.image_size.map(|Size(size)| size);
        let (name, out) = (self.name.as_deref(), Some(&*self.out));
        written(&self.input, format, name, image_size, out, self.force)
    }
}
