use std::fmt;

use serde::{Deserialize, Serialize};

/// Number of a view in order of acceptance, from 0. Never reused, so a view keeps its name when
/// others are removed or restored.
///
/// Displayed from 1 by [`fmt::Display`]; files hold the plain number.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct ViewNumber(pub u32);

impl ViewNumber {
    /// Number of the view accepted next.
    ///
    /// ```
    /// # use boresight_guide::session::ViewNumber;
    /// let first = ViewNumber::default();
    /// // People count from 1.
    /// assert_eq!(first.to_string(), "1");
    /// assert_eq!(first.next(), ViewNumber(1));
    /// ```
    #[must_use]
    pub fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }
}

impl fmt::Display for ViewNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (u64::from(self.0) + 1).fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_count_from_one_and_files_from_zero() {
        assert_eq!(format!("{:<3}|", ViewNumber(3)), "4  |");
        assert_eq!(serde_json::to_string(&ViewNumber(3)).expect("a number"), "3");
        assert_eq!(serde_json::from_str::<ViewNumber>("3").expect("a number"), ViewNumber(3));
    }
}
