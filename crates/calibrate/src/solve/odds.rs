//! What evidence is worth: one scale for lens models and causes of a misfit.
//!
//! All are twice the logarithm of odds, as differences of BIC are (Kass & Raftery 1995).

/// Odds against a hypothesis that isn't rare, before the corners are seen: one in four.
pub(crate) const LIKELY: f64 = 2.0;
/// Odds against an unlikely hypothesis: e⁵ to 1.
pub(crate) const UNLIKELY: f64 = 10.0;
/// Odds over every other hypothesis from which one is taken for true: e⁵ to 1.
pub(crate) const CLEAR: f64 = 10.0;
