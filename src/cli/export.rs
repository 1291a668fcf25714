//! `boresight export`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use boresight_app::{
    BagCopy, Exit,
    session::export::{Format, export, save_board},
    set_camera_info,
};
use boresight_files::{Overwrite, save};
use boresight_formats::export::CameraFormat;
use boresight_geometry::frame::ImageSize;
use boresight_terminal::{announcer, board_args::Size, format_name, print, say, stdin::Given};

/// Export a calibration for other programs.
///
/// Numbers have 17 significant digits. A format that can't hold the lens model is refused. If the
/// board was bent or uneven, the file says so in a comment; beside a file without comments,
/// OUT-board.csv gets the board's points as found.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// A session folder, or a calibration of boresight or another program; - reads one from
    /// standard input.
    #[arg(value_name = "SESSION|FILE")]
    input: PathBuf,
    /// Format to write [default: what FILE's name tells, else opencv-yaml].
    #[arg(long, value_parser = format_name())]
    format: Option<Format>,
    /// Camera name in the file [default: the name of the session or file].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Size of the pictures, for a FILE that doesn't state it.
    #[arg(long, value_name = "WxH", conflicts_with_all = ["bag", "set_camera_info"])]
    image_size: Option<Size>,
    /// File to write [default: stdout].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Overwrite an existing file.
    #[arg(long)]
    force: bool,
    /// Write a copy of this recorded bag (MCAP, .db3) to FILE instead, with the calibration as
    /// sensor_msgs/msg/CameraInfo beside each picture.
    #[arg(long, value_name = "BAG", requires = "out", conflicts_with_all = ["format", "name", "force", "json"])]
    bag: Option<PathBuf>,
    /// Topic of the bag's pictures [default: the only one with pictures].
    #[arg(long, value_name = "TOPIC", requires = "bag")]
    topic: Option<String>,
    /// Give the calibration to the driver of this ROS 2 camera instead: its service set_camera_info
    /// keeps and publishes it. A calibration that's untrustworthy is kept back.
    #[arg(long, value_name = "ros2:/TOPIC", conflicts_with_all = ["format", "name", "out", "force", "bag", "json"])]
    set_camera_info: Option<String>,
    /// Same as --format json.
    #[arg(long, conflicts_with = "format")]
    json: bool,
}

/// Default format.
const USUAL: Format = Format::Camera(CameraFormat::OpencvYaml);

const EXAMPLES: &str = "\
Examples:
  boresight export sessions/2026-11-21T08-00-00Z --format opencv-yaml --out camera.yaml
  boresight export calibration.json --format ros-yaml --name front > front.yaml
  boresight export calibration.json --bag drive.mcap --out drive-calibrated.mcap
  boresight export calibration.json --set-camera-info ros2:/camera/image_raw";

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if let (Some(from), Some(to)) = (self.bag, self.out.clone()) {
            let untrustworthy =
                BagCopy { from, topic: self.topic, to }.write(&self.input, &announcer())?;
            return Ok(ended(untrustworthy));
        }
        if let Some(source) = &self.set_camera_info {
            return Ok(ended(set_camera_info(&self.input, source, &announcer())?));
        }
        let format = match (self.format, &self.out) {
            _ if self.json => Format::Json,
            (Some(format), _) => format,
            (None, Some(out)) if Format::of_file(out).is_some() || is_anothers(out) => {
                told_by(out)?
            }
            (None, _) => USUAL,
        };
        let image_size = self.image_size.map(|Size(size)| size);
        let out = self.out.as_deref();
        written(&self.input, format, self.name.as_deref(), image_size, out, self.force)
    }
}

/// Format from a file name.
pub(super) fn told_by(out: &Path) -> anyhow::Result<Format> {
    Format::of_file(out)
        .with_context(|| format!("the name {out:?} doesn't tell its format: add --format"))
}

/// True if the file name has an extension of formats other than the default.
fn is_anothers(out: &Path) -> bool {
    let ends_so = |format: Format| Path::new(format.file()).extension() == out.extension();
    !ends_so(USUAL) && Format::all().any(ends_so)
}

/// Writes the calibration in `input` to `out`, or to stdout.
pub(super) fn written(
    input: &Path,
    format: Format,
    name: Option<&str>,
    image_size: Option<ImageSize>,
    out: Option<&Path>,
    force: bool,
) -> anyhow::Result<Exit> {
    let given = Given::one(input)?;
    let exported = export(given.file(), format, name, image_size, &announcer())?;
    match out {
        None => print(exported.text.trim_end())?,
        Some(path) => {
            let overwrite = if force { Overwrite::Allowed } else { Overwrite::Never };
            save(path, exported.text.as_bytes(), overwrite)?;
            say(&format!("Written: {}", path.display()));
            let board = exported.board.as_ref();
            let beside = board.map(|board| save_board(path, board, overwrite)).transpose()?;
            if let Some(file) = beside.flatten() {
                say(&format!("Written: {}", file.display()));
            }
        }
    }
    if let Some(board) = &exported.board {
        say(&board.note);
    }
    Ok(ended(exported.untrustworthy))
}

fn ended(untrustworthy: bool) -> Exit {
    if untrustworthy {
        say("This calibration isn't trustworthy; its findings say why.");
        return Exit::NotTrustworthy;
    }
    Exit::Good
}
