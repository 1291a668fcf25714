//! A calibration as text for other programs. Numbers are written so that they read back bit for bit.

mod opencv;

pub use opencv::opencv_yaml;
