//! Tags of an AprilGrid.

use serde::{Deserialize, Serialize};

use super::Dictionary;

/// Layout of the tags of an AprilGrid.
///
/// Rows of AprilTags of the family 36h11 with a black frame two cells wide. A dark square as wide
/// as the white between them touches each corner of a tag, so that the corners are saddle points,
/// as on a checkerboard. Made by Kalibr (Furgale, Rehder, Siegwart: "Unified temporal and spatial
/// calibration for multi-sensor systems", 2013); the tags by the April Robotics Laboratory.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tags {
    /// White between tags, as a share of a tag's side.
    pub spacing: f64,
    /// Number of the first tag.
    #[serde(default)]
    pub first: u16,
}

impl Default for Tags {
    /// Layout of Kalibr's default grid.
    fn default() -> Self {
        Self { spacing: 0.3, first: 0 }
    }
}

impl Tags {
    /// Width of a tag's black frame, in cells.
    pub const FRAME_CELLS: usize = 2;

    /// Dictionary of the tags.
    pub fn dictionary() -> Dictionary {
        Dictionary::of_tags()
    }
}
