//! Many sessions at once, and many cameras over time.

#![forbid(unsafe_code)]

pub mod batch;
mod explained;
#[cfg(feature = "history")]
pub mod history;

pub use explained::{ERRORS, error_code, explain};
