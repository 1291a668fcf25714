//! What a person sees, hears and reads of a calibration session.

#![forbid(unsafe_code)]

pub mod chart;
pub mod ghost;
#[cfg(feature = "report")]
pub mod report;
pub mod speech;
pub mod target;
pub mod text;
