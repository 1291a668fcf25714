//! Rows of a circle grid.

use serde::{Deserialize, Serialize};

use crate::coded::coded;

coded! {
    /// Layout of the rows of a circle grid, in OpenCV's words.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum CircleRows {
        /// Rows below each other (`cv2.CALIB_CB_SYMMETRIC_GRID`).
        Symmetric = "symmetric",
        /// Every second row shifted by half the distance of the circles, and rows half that
        /// distance apart (`cv2.CALIB_CB_ASYMMETRIC_GRID`).
        Asymmetric = "asymmetric",
    }
    /// Both layouts.
    ALL
    /// Name in files and settings.
    name
}

impl CircleRows {
    /// Layout with the given name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|rows| rows.name() == name)
    }
}
