//! The source paper's experiments, repeated against known truth, and strategies of guidance compared.
//!
//! Source: J.-H. Chuang and H.-Y. Chen, "Visualizing and alleviating the effect of radial distortion on
//! camera calibration using principal lines". Each experiment is a pure function of its parameters and a
//! seed; it returns an [`Outcome`]: words, numbers against known ones, tables and figures.
//!
//! | experiment | asks |
//! |---|---|
//! | [`directionality`] | in which direction of shift does a principal line leave the principal point? |
//! | [`monotonicity`] | how does that grow with the shift? |
//! | [`pairs`] | does the opposed pose cancel it, and how many pairs does it take? |
//! | [`skip`] | what happens to the principal point when slots are left out, beside Zhang's method? |
//! | [`table1`] | can the scatter of such estimates tell which method is right? |
//! | [`tilt`] | which tilt is best? |
//! | [`varying_focal`] | what if the focal length changes between views? |
//! | [`guidance`] | what is each way of guiding a person worth, in views and seconds? |

#![forbid(unsafe_code)]

pub mod directionality;
mod estimate;
pub mod explore;
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
#[cfg(feature = "window")]
pub mod window;

pub use outcome::Outcome;
pub use params::{Hand, Params};
pub use study_folder::StudyFolder;

/// An experiment of one piece: name and function.
pub type Experiment = (&'static str, fn(&Params) -> Outcome);

/// All experiments but the comparison of strategies, which comes in parts.
pub const EXPERIMENTS: [Experiment; 7] = [
    ("directionality", directionality::outcome),
    ("monotonicity", monotonicity::outcome),
    ("pairs", pairs::outcome),
    ("skip", skip::outcome),
    ("table1", table1::outcome),
    ("tilt", tilt::outcome),
    ("varying-focal", varying_focal::outcome),
];
