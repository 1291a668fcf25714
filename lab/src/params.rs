//! Settings, with the paper's values if given there.

use serde::{Deserialize, Serialize};

use boresight_geometry::boards::{Board, InvalidBoard};

/// Parameters of all experiments, as in a TOML file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Seed of everything random.
    pub seed: u64,
    /// Detects corners in rendered pictures instead of computing corners, in the experiments on
    /// directions, shifts and pairs.
    pub rendered: bool,
    /// Camera and board of the paper's Figs 2 to 6.
    pub setup: SetupParams,
    /// Shift of the experiments on directions and pairs.
    pub shift_m: f64,
    /// Directions of shift over the full turn.
    pub directions: usize,
    /// Longest shift; `shift_step_m` is the step.
    pub longest_shift_m: f64,
    /// See `longest_shift_m`.
    pub shift_step_m: f64,
    /// Draws of noisy corners in the experiment on skipped slots; `skip_noise_px` is the corner
    /// error.
    pub skip_trials: usize,
    /// See `skip_trials`.
    pub skip_noise_px: f64,
    /// Draws per tilt.
    pub tilt_trials: usize,
    /// Draws per share of change of the focal length.
    pub focal_trials: usize,
    /// Runs per strategy, lens and hand in the comparison of strategies.
    pub guidance_runs: usize,
    /// Maximum number of views of a run.
    pub guidance_views: usize,
    /// Hands following the strategies.
    pub guidance_hands: Vec<Hand>,
    /// Corner error in the experiments on tilt, focal length, Table 1 and guidance.
    pub noise_px: f64,
}

/// Synthetic camera of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SetupParams {
    /// Focal length, in pixels.
    pub f_px: f64,
    /// Principal point x, y, in pixels.
    pub pp_px: [f64; 2],
    /// Width and height of the picture.
    pub image_size_px: [u32; 2],
    /// Distortion `k1 k2` of the OpenCV model.
    pub distortion: [f64; 2],
    /// Inner corners, columns and rows.
    pub board: [u16; 2],
    /// Side of a square.
    pub square_m: f64,
    /// Distance of the board along the optical axis.
    pub distance_m: f64,
    /// Angle between board and image plane.
    pub tilt_rad: f64,
}

/// Simulated person's way of bringing the board to the requested pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hand {
    /// Matches the ghost on the screen, so that the board looks as requested under any believed
    /// lens, and steps back when a corner leaves the picture. Errs by up to 4°, 20 px and 4 % of
    /// the distance.
    Screen,
    /// Goes to the pose in metres computed by the believed lens, with the same errors.
    Metric,
    /// Follows the ghost like [`Self::Screen`], but errs by up to 10°, 10 % of the picture's width
    /// and 15 % of the distance.
    Clumsy,
}

impl Hand {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Screen => "screen",
            Self::Metric => "metric",
            Self::Clumsy => "clumsy",
        }
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            seed: 1,
            rendered: false,
            setup: SetupParams::default(),
            shift_m: 0.05,
            directions: 72,
            longest_shift_m: 0.4,
            shift_step_m: 0.05,
            skip_trials: 400,
            skip_noise_px: 0.5,
            tilt_trials: 200,
            focal_trials: 200,
            guidance_runs: 200,
            guidance_views: 10,
            guidance_hands: vec![Hand::Screen, Hand::Metric],
            noise_px: 0.3,
        }
    }
}

impl Default for SetupParams {
    fn default() -> Self {
        Self {
            f_px: 1600.0,
            // Corners rounded to whole pixels depend on the fractional part of the principal point.
            pp_px: [640.0, 480.0],
            image_size_px: [1280, 960],
            distortion: [-0.1, -0.02],
            board: [9, 7],
            square_m: 0.06,
            distance_m: 2.6,
            tilt_rad: std::f64::consts::FRAC_PI_4,
        }
    }
}

impl Params {
    /// Mistake in the settings, in words; `None` without a mistake.
    pub fn problem(&self) -> Option<&'static str> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let setup = &self.setup;
        if ![setup.f_px, setup.square_m, setup.distance_m].into_iter().all(positive) {
            return Some("f_px, square_m and distance_m must be positive");
        }
        let [columns, rows] = setup.board;
        match Board::new(columns, rows, setup.square_m) {
            Ok(_) => {}
            Err(InvalidBoard::Count { .. }) => {
                return Some("board must be 3 to 99 inner corners each way");
            }
            Err(InvalidBoard::Square { .. }) => return Some("square_m must be less than 10"),
        }
        if !(0.02..1.5).contains(&setup.tilt_rad) {
            return Some("tilt_rad must lie between 0.02 and 1.5");
        }
        if !(positive(self.shift_step_m)
            && positive(self.longest_shift_m)
            && self.longest_shift_m / self.shift_step_m < 1e4)
        {
            return Some(
                "longest_shift_m and shift_step_m must be positive, the step not a tiny part of it",
            );
        }
        let numbers = [&setup.pp_px[..], &setup.distortion, &[self.shift_m]].concat();
        if !numbers.iter().all(|value| value.is_finite() && value.abs() < 1e5) {
            return Some("pp_px, distortion and shift_m must be numbers below 100000");
        }
        if !setup.image_size_px.iter().all(|side| (16..=16_384).contains(side)) {
            return Some("image_size_px needs sides of 16 to 16384");
        }
        if ![self.noise_px, self.skip_noise_px].into_iter().all(positive) {
            return Some("noise_px and skip_noise_px must be positive");
        }
        let counts = [self.skip_trials, self.tilt_trials, self.focal_trials, self.guidance_runs];
        if counts.iter().any(|count| !(4..=1_000_000).contains(count)) {
            return Some("trials and runs must be between 4 and a million");
        }
        if !(4..=100_000).contains(&self.directions) || !(4..=200).contains(&self.guidance_views) {
            return Some(
                "directions must be between 4 and 100000, guidance_views between 4 and 200",
            );
        }
        let hands = &self.guidance_hands;
        let repeated = hands.iter().enumerate().any(|(i, hand)| hands[..i].contains(hand));
        if hands.is_empty() || repeated {
            return Some("guidance_hands must name each hand once: screen, metric, clumsy");
        }
        None
    }
}
