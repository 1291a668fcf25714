//! The source paper's experiments, repeated against known truth, and strategies of guidance
//! compared.
//!
//! Source: J.-H. Chuang and H.-Y. Chen, "Visualizing and alleviating the effect of radial
//! distortion on camera calibration using principal lines". Each experiment is a pure function of
//! its parameters and a seed; it returns an [`Outcome`]: words, comparisons with known numbers,
//! tables and figures.
//!
//! | experiment | question |
//! |---|---|
//! | [`directionality`] | how does a principal line's offset depend on the direction of shift? |
//! | [`monotonicity`] | how does the offset grow with the shift? |
//! | [`pairs`] | does the opposed pose cancel the offset, and how many pairs are needed? |
//! | [`skip`] | how does leaving out slots move the principal point, also with Zhang's method? |
//! | [`table1`] | can the scatter of such estimates identify the right method? |
//! | [`tilt`] | where is the best tilt? |
//! | [`varying_focal`] | how does a changing focal length between views matter? |
//! | [`guidance`] | how much is each way of guiding a person worth, in views and seconds? |

#![forbid(unsafe_code)]

pub mod directionality;
mod estimate;
pub mod guidance;
pub mod monotonicity;
pub mod outcome;
pub mod page;
pub mod pairs;
mod parallel;
pub mod params;
pub mod setup;
pub mod skip;
mod statistics;
mod study_folder;
pub mod table1;
pub mod tilt;
pub mod varying_focal;

pub use outcome::Outcome;
pub use params::{Hand, Params};
pub use study_folder::StudyFolder;

/// Experiment without parts: name and function.
pub type Experiment = (&'static str, fn(&Params) -> Outcome);

/// All experiments except the comparison of strategies, which comes in parts.
pub const EXPERIMENTS: [Experiment; 7] = [
    ("directionality", directionality::outcome),
    ("monotonicity", monotonicity::outcome),
    ("pairs", pairs::outcome),
    ("skip", skip::outcome),
    ("table1", table1::outcome),
    ("tilt", tilt::outcome),
    ("varying-focal", varying_focal::outcome),
];
