//! Live pose guidance for camera calibration with principal lines.

pub mod board;
pub mod calibration;
pub mod capture;
pub mod detection;
pub mod frame;
pub mod geometry;
