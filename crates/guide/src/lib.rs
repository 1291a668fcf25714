//! What a view is worth, which pose comes next, when to stop: a calibration session as a fold.

#![forbid(unsafe_code)]

pub mod guidance;
pub mod session;
