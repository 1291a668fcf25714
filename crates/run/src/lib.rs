//! Settings, recordings, and the threads of a calibration session.
//!
//! | module | holds |
//! |---|---|
//! | [`config`] | TOML → parameters |
//! | [`recording`] | sessions as bytes: journal, pictures, replay |
//! | [`pipeline`] | the threads and the links between them |
//!
//! The feature `live` is that of `boresight-capture`; `schemas` is for the test of docs/schemas.

#![forbid(unsafe_code)]

pub mod config;
pub mod pipeline;
pub mod recording;
