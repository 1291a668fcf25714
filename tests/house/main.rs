//! Rules for all sources: layers, words, and the build's name; and recordings of earlier versions,
//! which the whole program must read.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod build_id;
mod layering;
mod recordings;
mod words;
