//! Ways of guiding a person: each a pure function from what is known to the pose that is asked for next, and the
//! rule by which a view counts.
//!
//! | strategy | rule, and where it stands in the source |
//! |---|---|
//! | `ours-*` | our roles |
//! | `range-bars` | X, Y, size and skew differ from every earlier view by more than 0.2 together: `is_good_sample` of ROS `image_pipeline`, camera_calibration/calibrator.py |
//! | `information` | the first three views are free; then the operator presses a key: README of `pengsongyou/CalibrationWizard` |
//! | `worst-pixel` | the first three views by the variance of the focal length; corners within one square of the asked ones on average: `scorePix` in AprilCal.java of the April toolkit |
//! | `per-parameter` | outlines share 85 % of their union, flow below 2 px a frame, which every held view has: `pose_close_to_tgt` and `update` in ui.py of `paroj/pose_calib` |
//! | the others | none |
//!
//! The margins of the sources (30 px of Calibration Wizard, none of the others) give way to the one rule for all;
//! so do their waiting times (3.5 s of AprilCal). Where a source searches fewer or smaller poses (18 to 90 fixed
//! ones of AprilCal, boards at 1.6 times their width of pose_calib), the strategy here has the better of the two.

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

/// A way of guiding.
#[derive(Clone, Copy, Debug)]
pub struct Strategy {
    /// Stable name, for files and programs.
    pub code: &'static str,
    /// Publication or program that it comes from.
    pub source: &'static str,
    /// The pose to ask for, in the camera that is believed; `None` when the plan is complete.
    pub wish: fn(&Situation<'_>, &mut ChaCha8Rng) -> Option<Isometry3<f64>>,
    /// Rule by which a view counts.
    pub accept: Accept,
    /// Plan of our planner; the others do not look at it.
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
