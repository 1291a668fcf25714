//! Calibrations of other programs, as files.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod imports;
