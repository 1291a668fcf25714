//! Settings, recordings, and the threads of a calibration session.

#![forbid(unsafe_code)]

pub mod config;
pub mod pipeline;
pub mod recording;
