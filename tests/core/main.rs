//! Everything that decides: numbers, boards in pictures, sessions and files; no camera, window or
//! other process.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod build_id;
mod layering;
mod recordings;
mod words;
