//! What a person sees, hears and reads of a calibration session.
//!
//! | module | holds |
//! |---|---|
//! | [`text`] | the sentences; decides nothing |
//! | [`speech`] | what is said aloud, and when |
//! | [`ghost`] | the board as it should be held |
//! | [`chart`] | drawings as SVG text |
//! | `report` | a calibration as one HTML page, with the feature `report` |
//! | [`target`] | the printable board |

#![forbid(unsafe_code)]

pub mod chart;
pub mod ghost;
#[cfg(feature = "report")]
pub mod report;
pub mod speech;
pub mod target;
pub mod text;
