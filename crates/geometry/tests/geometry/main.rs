//! Homographies, principal lines and poses: known values, properties, and honest covariance.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod geometry_monte_carlo;
mod geometry_properties;
mod geometry_reference;
