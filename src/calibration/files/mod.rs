//! Calibrations as files: the formats of other programs, read and written.

pub mod export;
pub mod import;
