//! Live pose guidance for camera calibration with principal lines.

pub mod board;
pub mod frame;
pub mod geometry;
