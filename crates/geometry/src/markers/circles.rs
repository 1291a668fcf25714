//! The rows of a circle grid.

use serde::{Deserialize, Serialize};

/// How the rows of a circle grid lie, in OpenCV's words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CircleRows {
    /// Below each other (`cv2.CALIB_CB_SYMMETRIC_GRID`).
    Symmetric,
    /// Every second one is shifted by half the distance of its circles, and rows are that half apart
    /// (`cv2.CALIB_CB_ASYMMETRIC_GRID`).
    Asymmetric,
}

impl CircleRows {
    /// Both ways.
    pub const ALL: [Self; 2] = [Self::Symmetric, Self::Asymmetric];

    /// The name in files and settings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Symmetric => "symmetric",
            Self::Asymmetric => "asymmetric",
        }
    }

    /// The one of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rows| rows.name() == name)
    }
}
