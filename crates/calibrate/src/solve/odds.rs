//! Scale of evidence for lens models and causes of a misfit.
//!
//! All are twice the logarithm of odds, like differences of BIC (Kass & Raftery 1995).

/// Prior odds against a common hypothesis: one in four.
pub(crate) const LIKELY: f64 = 2.0;
/// Prior odds against an unlikely hypothesis: e⁵ to 1.
pub(crate) const UNLIKELY: f64 = 10.0;
/// Least odds of an accepted hypothesis over every other: e⁵ to 1.
pub(crate) const CLEAR: f64 = 10.0;
