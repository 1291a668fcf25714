//! Live pose guidance for camera calibration with principal lines.

pub mod board;
pub mod calibration;
pub mod capture;
pub mod config;
pub mod detection;
pub mod frame;
pub mod geometry;
pub mod guidance;
pub mod recording;
pub mod session;
