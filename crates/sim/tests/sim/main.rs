//! The simulated camera and person agree with the truth.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod bent_board;
mod habits;
mod ordinary_webcam;
mod rolling_shutter;
mod simulation;
mod technician;
