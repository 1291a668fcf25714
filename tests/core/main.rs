//! Everything that decides: numbers, boards in pictures, sessions and files; no camera, window or
//! other process.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod bent_board;
mod build_id;
mod habits;
mod layering;
mod listener;
mod one_instruction;
#[cfg(feature = "report")]
mod one_truth;
mod ordinary_webcam;
mod plan_of_pages;
mod recordings;
mod rolling_shutter;
mod simulation;
mod target;
mod technician;
mod words;

use boresight_testkit::{asked_for, world};
