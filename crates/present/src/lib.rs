//! What a person sees, hears and reads of a calibration session.
//!
//! | module | holds |
//! |---|---|
//! | [`instruction`] | what a person is shown and told after a decision, as one value |
//! | [`reading`] | what the newest frame measures, beside what is asked for |
//! | [`text`] | the sentences; decides nothing |
//! | [`speech`] | what is said aloud, and when |
//! | [`browser`] | a session as pages in a browser show it |
//! | [`ghost`] | the board as it should be held |
//! | [`chart`] | drawings as SVG text |
//! | `report` | a calibration as one HTML page, with the feature `report` |
//! | [`target`] | the printable board |

#![forbid(unsafe_code)]

pub mod browser;
pub mod chart;
pub mod ghost;
pub mod instruction;
pub mod reading;
#[cfg(feature = "report")]
pub mod report;
pub mod speech;
pub mod target;
pub mod text;
