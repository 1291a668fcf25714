//! Surfaces of one session agree: sentences, speech, card, pages, reports, and printed boards.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod listener;
mod one_instruction;
#[cfg(feature = "report")]
mod one_truth;
mod plan_of_pages;
mod target;
