//! Hostile input: all input is accepted or refused, quickly, in little memory, and accepted input
//! makes sense. One target a file; each mutates good inputs for a second, or for
//! `BORESIGHT_FUZZ_SECS`.
//!
//! A failure prints its seed and writes the input to a file; put the file into `corpus/<target>/`,
//! to be tried first from then on.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

mod harness;
mod mutator;

mod bag;
mod corners;
mod exif;
mod header;
mod import;
mod journal;
mod jpeg;
mod message;
mod page;
mod picture;
mod rig;
mod scene;
mod settings;
mod store;
mod table;

use boresight_testkit::world;
