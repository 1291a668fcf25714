//! Ways of guiding a person: each a pure function from the situation to the next requested pose,
//! and the rule for counting a view.
//!
//! | strategy | acceptance rule | source |
//! |---|---|---|
//! | `ours-*` | our roles | |
//! | `range-bars` | X, Y, size, skew differ from every earlier view by more than 0.2 together | 1 |
//! | `information` | three free views; then the operator presses a key | 2 |
//! | `worst-pixel` | corners within one square of the requested ones on average | 3 |
//! | `per-parameter` | outlines share 85 % of their union | 4 |
//! | the others | none | |
//!
//! 1. `is_good_sample` of ROS `image_pipeline`, camera_calibration/calibrator.py.
//! 2. README of `pengsongyou/CalibrationWizard`.
//! 3. `scorePix` in AprilCal.java of the April toolkit; the first three views are chosen by the
//!    variance of the focal length.
//! 4. `pose_close_to_tgt` and `update` in ui.py of `paroj/pose_calib`; also flow below 2 px a
//!    frame, true for every held view.
//!
//! The sources' margins (30 px of Calibration Wizard, none of the others) are replaced by the
//! common rule; so are their waiting times (3.5 s of AprilCal). If a source searches fewer or
//! smaller poses (18 to 90 fixed ones of AprilCal, boards at 1.6 times their width of pose_calib),
//! the strategy here has the better of the two.

mod coverage;
mod hand_held;
mod information;
mod ours;
mod paper_plan;
mod per_parameter;
mod range_bars;
pub(super) mod sample;
mod worst_pixel;

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use super::{accept::Accept, situation::Situation};
use boresight_guide::guidance::Plan;

/// Way of guiding.
#[derive(Clone, Copy, Debug)]
pub struct Strategy {
    /// Stable name, for files and programs.
    pub code: &'static str,
    /// Source publication or program.
    pub source: &'static str,
    /// Function to the next requested pose, in the believed camera; `None` when the plan is
    /// complete.
    pub wish: fn(&Situation<'_>, &mut ChaCha8Rng) -> Option<Isometry3<f64>>,
    /// Acceptance rule for a view.
    pub accept: Accept,
    /// Plan of our planner; ignored by the others.
    pub plan: Plan,
}

impl Strategy {
    /// True for the program's own strategies.
    pub fn is_ours(&self) -> bool {
        self.accept == Accept::Role
    }
}

const fn other(
    code: &'static str,
    source: &'static str,
    accept: Accept,
    wish: fn(&Situation<'_>, &mut ChaCha8Rng) -> Option<Isometry3<f64>>,
) -> Strategy {
    Strategy { code, source, wish, accept, plan: Plan::Full }
}

const fn own(code: &'static str, plan: Plan) -> Strategy {
    Strategy { code, source: "boresight", wish: ours::wish, accept: Accept::Role, plan }
}

/// All strategies of the comparison.
pub const STRATEGIES: [Strategy; 12] = [
    own("ours-quick", Plan::Quick),
    own("ours-full", Plan::Full),
    own("ours-adaptive", Plan::Adaptive),
    other(
        "paper",
        "Chuang & Chen: eight slots, board turned, 45°",
        Accept::Found,
        paper_plan::wish,
    ),
    other(
        "paper-small",
        "the same with a board of 36 % of the width",
        Accept::Found,
        paper_plan::wish_small,
    ),
    other("hand-held", "what people do without guidance", Accept::Found, hand_held::wish),
    other(
        "range-bars",
        "ROS camera_calibration: X, Y, size and skew bars; a view must be novel by 0.2",
        Accept::Novel(0.2),
        range_bars::wish,
    ),
    other("coverage", "corners spread evenly over the picture", Accept::Found, coverage::wish),
    other("full-view", "board filling the whole view", Accept::Found, coverage::wish_full_view),
    other(
        "information",
        "Peng & Sturm 2019, Calibration Wizard: trace of the covariance, after three free views",
        Accept::Found,
        information::wish,
    ),
    other(
        "worst-pixel",
        "Richardson et al. 2013, AprilCal: Max ERE, after three views for the focal length; within a square of the asked pose",
        Accept::WithinASquare,
        worst_pixel::wish,
    ),
    other(
        "per-parameter",
        "Rojtberg & Kuijper 2018, pose_calib: least certain parameter; overlap with the asked pose above 85 %",
        Accept::Overlap(0.85),
        per_parameter::wish,
    ),
];
