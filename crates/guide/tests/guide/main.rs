//! Sessions as a fold: what is asked, taken and refused, and where a session ends.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod beyond_edge;
mod calm;
mod camera_events;
mod far_boards;
mod guided_session;
mod guided_wide;
mod session;
mod session_properties;
