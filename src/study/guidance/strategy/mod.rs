//! Ways of guiding a person: each a pure function from what is known to the pose that is asked for next.

mod coverage;
mod hand_held;
mod information;
mod ours;
mod paper_plan;
mod per_parameter;
mod range_bars;
mod sample;
mod situation;
mod worst_pixel;

pub use situation::Situation;

use nalgebra::Isometry3;
use rand_chacha::ChaCha8Rng;

use crate::guidance::Plan;

/// A way of guiding.
#[derive(Clone, Copy, Debug)]
pub struct Strategy {
    /// Stable name.
    pub code: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// The pose to ask for, in the camera that is believed; `None` when the plan is complete.
    pub wish: fn(&Situation<'_>, &mut ChaCha8Rng) -> Option<Isometry3<f64>>,
    /// Whether views are taken only if they fulfil our gate and add a direction or a partner.
    pub picky: bool,
    /// Plan of our planner; the others do not look at it.
    pub plan: Plan,
}

const fn other(
    code: &'static str,
    source: &'static str,
    wish: fn(&Situation<'_>, &mut ChaCha8Rng) -> Option<Isometry3<f64>>,
) -> Strategy {
    Strategy { code, source, wish, picky: false, plan: Plan::Full }
}

const fn own(code: &'static str, plan: Plan) -> Strategy {
    Strategy { code, source: "boresight", wish: ours::wish, picky: true, plan }
}

/// All that are compared.
pub const STRATEGIES: [Strategy; 12] = [
    own("ours-quick", Plan::Quick),
    own("ours-full", Plan::Full),
    own("ours-adaptive", Plan::Adaptive),
    other("paper", "Chuang & Chen: eight slots, board turned, 45°", paper_plan::wish),
    other("paper-small", "the same with a board of 36 % of the width", paper_plan::wish_small),
    other("hand-held", "what people do without guidance", hand_held::wish),
    other("range-bars", "ROS camera_calibration: X, Y, size and skew bars", range_bars::wish),
    other("coverage", "corners spread evenly over the picture", coverage::wish),
    other("full-view", "board filling the whole view", coverage::wish_full_view),
    other(
        "information",
        "Peng & Sturm 2019, Calibration Wizard: trace of the covariance",
        information::wish,
    ),
    other("worst-pixel", "Richardson et al. 2013, AprilCal: Max ERE", worst_pixel::wish),
    other(
        "per-parameter",
        "Rojtberg & Kuijper 2018, pose_calib: least certain parameter",
        per_parameter::wish,
    ),
];
