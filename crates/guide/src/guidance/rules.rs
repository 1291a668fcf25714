//! Version of the rules for taking views.
//!
//! A recording keeps its decisions and its views under all later rules. Where the rules have
//! changed, a replay decides differently, and says why.

/// Version of the rules. Recordings from before the first release state lower ones.
///
/// | version | rules |
/// |---|---|
/// | 8 | of the trials before the first release: the goals yielded to the camera's noise |
/// | 9 | of the first release |
pub const RULES: u32 = 9;
