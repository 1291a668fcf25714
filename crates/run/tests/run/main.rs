//! Recorded data comes back bit for bit.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod recording;
