//! Rows of a circle grid.

use serde::{Deserialize, Serialize};

/// Layout of the rows of a circle grid, in OpenCV's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CircleRows {
    /// Rows below each other (`cv2.CALIB_CB_SYMMETRIC_GRID`).
    Symmetric,
    /// Every second row shifted by half the distance of the circles, and rows half that distance
    /// apart (`cv2.CALIB_CB_ASYMMETRIC_GRID`).
    Asymmetric,
}

impl CircleRows {
    /// Both layouts.
    pub const ALL: [Self; 2] = [Self::Symmetric, Self::Asymmetric];

    /// Name in files and settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Symmetric => "symmetric",
            Self::Asymmetric => "asymmetric",
        }
    }

    /// Layout with the given name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rows| rows.name() == name)
    }
}
