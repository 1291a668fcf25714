//! `boresight plan-board`.

use std::str::FromStr;

use clap::{ArgGroup, Args};

use boresight_app::{
    Exit,
    commands::plan_board::{Place, plan_board},
};
use boresight_geometry::boards::{BoardChoice, InvalidChoice, length_m};
use boresight_guide::guidance::GuidanceParams;
use boresight_terminal::{board_args::Size, print, say, usage::WrongUsage};

/// Say which board to print for a distance and a field of view.
///
/// The board should fill the picture where it's held. For each paper, the command says how large
/// its board looks there and what it's expected to measure after eight views, and names the
/// smallest paper that is enough.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group(ArgGroup::new("view").required(true)))]
pub(super) struct Arguments {
    /// Distance between camera and board, with its unit: 50cm, 1.5m.
    #[arg(long, value_name = "LENGTH")]
    distance: Metres,
    /// Field of view across the picture's width: 60deg.
    #[arg(long, value_name = "ANGLE", group = "view")]
    fov: Option<Degrees>,
    /// Field of view across the diagonal, as webcams are sold: 78deg.
    #[arg(long, value_name = "ANGLE", group = "view")]
    fov_diagonal: Option<Degrees>,
    /// Focal length in pixels instead.
    #[arg(long, value_name = "NUMBER", group = "view", value_parser = focal_length)]
    f_px: Option<f64>,
    /// Size of the picture.
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    image_size: Size,
    /// The board's inner corners, or a ChArUco board.
    #[arg(long, value_name = "BOARD", default_value = "9x6")]
    board: BoardChoice,
    /// Print the plan as JSON on stdout.
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  boresight plan-board --distance 50cm --fov 60deg
  boresight plan-board --distance 3m --fov-diagonal 78deg --image-size 1920x1080
  boresight plan-board --distance 1m --f-px 980 --board 11x8";

const NO_SQUARES: &str =
    "plan-board plans checkerboards and ChArUco boards, not AprilGrids and circles";

/// A length in metres.
#[derive(Clone, Copy, Debug)]
struct Metres(f64);

impl FromStr for Metres {
    type Err = InvalidChoice;

    fn from_str(text: &str) -> Result<Self, InvalidChoice> {
        Ok(Self(length_m(text)?))
    }
}

/// An angle in degrees.
#[derive(Clone, Copy, Debug)]
struct Degrees(f64);

impl FromStr for Degrees {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.trim().trim_end_matches("deg").trim_end_matches('°').trim();
        match number.parse() {
            Ok(degrees) if (1.0..=150.0).contains(&degrees) => Ok(Self(degrees)),
            _ => {
                Err("expected an angle from 1deg to 150deg; for a fisheye lens, give --f-px".into())
            }
        }
    }
}

fn focal_length(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|f_px| (1.0..=1e6).contains(f_px));
    number.ok_or_else(|| "expected a focal length in pixels, for example 980".into())
}

impl Arguments {
    pub(super) fn run(self) -> anyhow::Result<Exit> {
        if !self.board.pattern.is_squares() {
            return Err(WrongUsage(NO_SQUARES.into()).into());
        }
        let Size(image_size) = self.image_size;
        let (width, height) = (f64::from(image_size.width_px), f64::from(image_size.height_px));
        let of =
            |side: f64, Degrees(degrees): Degrees| 0.5 * side / (0.5 * degrees.to_radians()).tan();
        let across = self.fov.map(|fov| of(width, fov));
        let diagonal = self.fov_diagonal.map(|fov| of(width.hypot(height), fov));
        let f_px = self.f_px.or(across).or(diagonal).unwrap_or(width);
        let place = Place { image_size, f_px, distance_m: self.distance.0 };
        let plan = plan_board(self.board, &place, &GuidanceParams::default());
        plan.lines().iter().for_each(|line| say(line));
        if self.json {
            print(&serde_json::to_string(&plan)?)?;
        }
        Ok(Exit::Good)
    }
}
