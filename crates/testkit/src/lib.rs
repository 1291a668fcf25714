//! Fixtures for tests of several crates; a dev-dependency only, so no program contains it.
//!
//! | module | holds |
//! |---|---|
//! | [`world`] | a person with a camera: whole sessions on projected corners |
//! | [`trust`] | cameras, boards and hands drawn at random, corners only |
//! | [`pictures`] | rendered views of a board |
//! | [`numbered`] | pictures of a camera, with their number in the pixels |
//! | `paint` | the window's triangles, painted without a graphics card |
//! | `eyes` | what a person sees there |
//! | [`reference`](mod@reference) | independently computed numbers |

#![forbid(unsafe_code)]
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod distance;
#[cfg(feature = "paint")]
pub mod eyes;
pub mod numbered;
#[cfg(feature = "paint")]
pub mod paint;
pub mod pictures;
pub mod reference;
pub mod trust;
pub mod world;

use std::path::{Path, PathBuf};

pub use distance::error_px;

/// A number from the environment, for longer tests that measure.
pub fn asked_for(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// Path of `name` below the checkout's `fixtures`.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(name)
}
