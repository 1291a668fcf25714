//! Print of a board, which makes its kind.

use serde::{Deserialize, Serialize};

use crate::markers::{CircleRows, Dictionary, Tags};

/// Print at the points of a board; each variant is a kind of board. Stored in the form of `Stored`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Option<Stored>", into = "Option<Stored>")]
pub enum Pattern {
    /// Squares, of a plain checkerboard.
    #[default]
    Plain,
    /// Squares with a marker in each light one.
    Charuco {
        /// Dictionary of the markers.
        dictionary: Dictionary,
        /// Side of a marker with the black frame.
        side: MarkerSide,
    },
    /// Tags with dark squares at their corners.
    AprilGrid(Tags),
    /// Circles.
    Circles(CircleRows),
}

/// Side of a marker with the black frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MarkerSide {
    /// The usual share of a square's side.
    #[default]
    Usual,
    /// In metres, whatever the squares.
    Metres(f64),
    /// As a share of a square's side. Never stored.
    Squares(f64),
}

impl MarkerSide {
    /// Side as a share of a square's side of `square_m` metres.
    pub fn in_squares_of(self, square_m: f64) -> f64 {
        match self {
            Self::Usual => 0.75,
            Self::Metres(side_m) => side_m / square_m,
            Self::Squares(side_squares) => side_squares,
        }
    }
}

impl Pattern {
    /// True on a plain checkerboard.
    pub fn is_plain(&self) -> bool {
        *self == Self::Plain
    }

    /// True for squares, with markers or without.
    pub fn is_squares(&self) -> bool {
        matches!(self, Self::Plain | Self::Charuco { .. })
    }

    /// Pattern with the side of markers as a share of a square's side of `square_m` metres.
    #[must_use]
    pub fn in_squares_of(self, square_m: f64) -> Self {
        match self {
            Self::Charuco { dictionary, side } => {
                let side = MarkerSide::Squares(side.in_squares_of(square_m));
                Self::Charuco { dictionary, side }
            }
            _ => self,
        }
    }

    /// Dictionary of a ChArUco board's markers.
    pub fn dictionary(self) -> Option<Dictionary> {
        if let Self::Charuco { dictionary, .. } = self { Some(dictionary) } else { None }
    }

    /// Side of a ChArUco board's markers, if chosen in metres.
    pub fn side_m(self) -> Option<f64> {
        match self {
            Self::Charuco { side: MarkerSide::Metres(side_m), .. } => Some(side_m),
            _ => None,
        }
    }

    /// Tags of an AprilGrid.
    pub fn tags(self) -> Option<Tags> {
        if let Self::AprilGrid(tags) = self { Some(tags) } else { None }
    }

    /// Layout of circles.
    pub fn circles(self) -> Option<CircleRows> {
        if let Self::Circles(rows) = self { Some(rows) } else { None }
    }
}

/// Form of a pattern in files and requests, or nothing for a plain checkerboard.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    /// Meaningless for circles.
    dictionary: Dictionary,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    side_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tags: Option<Tags>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    circles: Option<CircleRows>,
}

impl From<Pattern> for Option<Stored> {
    fn from(pattern: Pattern) -> Self {
        let (side_m, tags, circles) = (pattern.side_m(), pattern.tags(), pattern.circles());
        let of_tags = tags.map(|_| Tags::dictionary());
        let dictionary = pattern.dictionary().or(of_tags).unwrap_or_default();
        (!pattern.is_plain()).then_some(Stored { dictionary, side_m, tags, circles })
    }
}

impl From<Option<Stored>> for Pattern {
    fn from(stored: Option<Stored>) -> Self {
        match stored {
            None => Self::Plain,
            Some(Stored { circles: Some(rows), .. }) => Self::Circles(rows),
            Some(Stored { tags: Some(tags), .. }) => Self::AprilGrid(tags),
            Some(Stored { dictionary, side_m, .. }) => {
                let side = side_m.map_or(MarkerSide::Usual, MarkerSide::Metres);
                Self::Charuco { dictionary, side }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boards::BoardChoice;

    #[test]
    fn the_stored_form_stays() -> Result<(), Box<dyn std::error::Error>> {
        for (name, stored) in [
            ("9x6", "null"),
            ("charuco:8x11:5x5_50", r#"{"dictionary":"DICT_5X5_50"}"#),
            ("charuco:8x11:5x5_50:0.5m", r#"{"dictionary":"DICT_5X5_50","side_m":0.5}"#),
            (
                "aprilgrid:6x6",
                r#"{"dictionary":"DICT_APRILTAG_36h11","tags":{"spacing":0.3,"first":0}}"#,
            ),
            ("acircles:4x11", r#"{"dictionary":"DICT_4X4_50","circles":"asymmetric"}"#),
        ] {
            let BoardChoice { pattern, .. } = name.parse()?;
            assert_eq!(serde_json::to_string(&pattern)?, stored);
            assert_eq!(serde_json::from_str::<Pattern>(stored)?, pattern);
        }
        Ok(())
    }
}
