//! Everything that decides: numbers, boards in pictures, sessions and files; no camera, window or
//! other process.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod build_id;
mod layering;
mod listener;
mod one_instruction;
#[cfg(feature = "report")]
mod one_truth;
mod plan_of_pages;
mod recordings;
mod target;
mod words;

use boresight_testkit::{asked_for, world};
