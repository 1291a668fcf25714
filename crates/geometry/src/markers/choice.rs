//! Choice of markers, before the size of a square is settled.

use serde::{Deserialize, Serialize};

use super::{CircleRows, Dictionary, Markers, Tags};

/// Choice of the print in or instead of the squares of a board, beside the squares' side: the
/// markers of a ChArUco board, the tags of an AprilGrid, or circles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerChoice {
    /// Dictionary of the markers.
    pub dictionary: Dictionary,
    /// Side of a marker with the black frame, in metres; `None` for the usual share of a square's,
    /// and for tags.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub side_m: Option<f64>,
    /// Layout of the tags of an AprilGrid; `None` on a ChArUco board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tags: Option<Tags>,
    /// Layout of circles instead of squares and markers; the dictionary is then meaningless. `None`
    /// on other boards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub circles: Option<CircleRows>,
}

impl MarkerChoice {
    /// Choice of markers in the light squares of a board.
    pub fn in_squares(dictionary: Dictionary, side_m: Option<f64>) -> Self {
        Self { dictionary, side_m, tags: None, circles: None }
    }

    /// Choice of an AprilGrid's tags.
    pub fn tags(tags: Tags) -> Self {
        let dictionary = Tags::dictionary();
        Self { dictionary, side_m: None, tags: Some(tags), circles: None }
    }

    /// Choice of a grid of circles.
    pub fn circles(rows: CircleRows) -> Self {
        Self { circles: Some(rows), ..Self::in_squares(Dictionary::default(), None) }
    }

    /// Choice for `markers` in squares with a side of `square_m` metres.
    pub fn of(markers: Markers, square_m: f64) -> Self {
        let Markers { dictionary, side_squares, tags, circles } = markers;
        let side_m = markers.are_in_squares().then_some(side_squares * square_m);
        Self { dictionary, side_m, tags, circles }
    }

    /// True if there are markers in the light squares, as on a ChArUco board.
    pub fn are_in_squares(&self) -> bool {
        self.tags.is_none() && self.circles.is_none()
    }

    /// Markers in squares with a side of `square_m` metres.
    pub fn in_squares_of(self, square_m: f64) -> Markers {
        let side_squares = self.side_m.map(|side_m| side_m / square_m);
        let sized = Markers::sized(self.dictionary, side_squares);
        Markers { tags: self.tags, circles: self.circles, ..sized }
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
