//! The capture code and whole sessions on the kernel's own drivers, in the test machine
//! (`tests/vm/run.sh`).

#![cfg(target_os = "linux")]
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod camera;
mod session;
mod slow_controls;
