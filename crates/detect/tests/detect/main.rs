//! Boards in pictures: corners where they are, true reasons for a miss, no board where
//! there is none.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod aprilgrid;
mod charuco;
mod circles;
mod detection;
mod detector_baseline;
mod larger_patterns;
mod other_boards;
mod partial_boards;
mod printed_code;
mod reasons;
mod steady_state;
mod turned;
