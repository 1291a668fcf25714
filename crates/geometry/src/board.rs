//! Calibration board, under the name of its usual kind.

pub use crate::target::{Board as Checkerboard, InvalidBoard};
