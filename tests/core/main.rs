//! Everything that decides: numbers, boards in pictures, sessions and files; no camera, window or
//! other process.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod acceptance;
mod bad_calibrations;
mod bent_board;
mod beyond_edge;
mod build_id;
mod calibration_anywhere;
mod calibration_cost;
mod calibration_monte_carlo;
mod calibration_reference;
mod calm;
mod camera_events;
mod drift;
mod far_boards;
mod guided_session;
mod guided_wide;
mod habits;
mod imports;
mod layering;
mod listener;
mod natural_views;
mod one_instruction;
#[cfg(feature = "report")]
mod one_truth;
mod ordinary_webcam;
mod plan_of_pages;
mod recording;
mod recordings;
mod rectified_pictures;
mod rolling_shutter;
mod session;
mod session_properties;
mod simulation;
mod target;
mod technician;
mod varying_focal;
mod verdict_monte_carlo;
mod wide_lenses;
mod words;

use boresight_testkit::{asked_for, reference, trust, world};
