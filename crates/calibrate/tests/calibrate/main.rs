//! Calibrations with known truth: the lens, its uncertainty, its findings, and its verdict.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod acceptance;
mod bad_calibrations;
mod calibration_anywhere;
mod calibration_cost;
mod calibration_monte_carlo;
mod calibration_reference;
mod drift;
mod natural_views;
mod rectified_pictures;
mod varying_focal;
mod verdict_monte_carlo;
mod wide_lenses;
