//! Markers as people choose them, before the size of a square is settled.

use serde::{Deserialize, Serialize};

use super::{Dictionary, Markers, Tags};

/// The markers of a ChArUco board or the tags of an AprilGrid, as they're chosen beside the side of a square or tag.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerChoice {
    /// What they look like.
    pub dictionary: Dictionary,
    /// Side of a marker with its black frame, in metres; `None` for the usual share of a square's, and for tags.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side_m: Option<f64>,
    /// How they're laid out as an AprilGrid; `None` on a ChArUco board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tags: Option<Tags>,
}

impl MarkerChoice {
    /// Markers in the light squares of a board.
    pub fn in_squares(dictionary: Dictionary, side_m: Option<f64>) -> Self {
        Self { dictionary, side_m, tags: None }
    }

    /// Tags of an AprilGrid.
    pub fn tags(tags: Tags) -> Self {
        Self { dictionary: Tags::dictionary(), side_m: None, tags: Some(tags) }
    }

    /// The markers in squares with a side of `square_m` metres.
    pub fn in_squares_of(self, square_m: f64) -> Markers {
        let side_squares = self.side_m.map(|side_m| side_m / square_m);
        Markers { tags: self.tags, ..Markers::sized(self.dictionary, side_squares) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_marker_without_a_size_grows_with_its_square() {
        let dictionary: Dictionary = "4x4_50".parse().expect("known");
        let usual = MarkerChoice::in_squares(dictionary, None);
        assert_eq!(usual.in_squares_of(0.02).side_squares, usual.in_squares_of(0.04).side_squares);
        let measured = MarkerChoice { side_m: Some(0.01), ..usual };
        assert_eq!(measured.in_squares_of(0.02).side_squares, 0.5);
    }
}
