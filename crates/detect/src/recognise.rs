//! Recognises a board of any size or kind.

use image::GrayImage;

use super::{
    detector::{Detector, Search, at_level},
    outcome::{Detection, Miss, OtherBoard},
};
use boresight_geometry::{
    boards::{Board, BoardChoice, MarkerSide, Pattern},
    markers::{Dictionary, Tags},
};

/// Sides of markers tried after the usual side, in squares.
const OTHER_SIDES: [f64; 3] = [0.5, 0.6, 0.9];
/// Longest side of a counted grid of circles.
const LONGEST_COUNTED: usize = 20;
/// Squares less one, or tags, of the boards with markers compared with a picture. Another board of
/// the kind shows such markers in other places.
const USUAL: [u16; 2] = [7, 10];

impl Detector {
    /// Counts the inner corners of any whole board surrounded by white: columns and rows, at least
    /// as many columns as rows. `None` without such a board.
    pub fn count(&mut self, image: &GrayImage) -> Option<(usize, usize)> {
        self.search_levels(image).into_iter().flatten().find_map(|level| {
            let picture = at_level(image, &self.levels, level);
            self.grids.count(picture, &self.params)
        })
    }

    /// Recognises a board of another kind than `named`, or of any kind without `named`: a board
    /// with markers of another family or side, an AprilGrid like Kalibr's, squares with white
    /// around them, or a whole grid of circles of another layout. `None` if the picture shows none
    /// of these, or if `keep_on` ends the search. Takes as long as several searches.
    pub fn recognise(
        &mut self,
        image: &GrayImage,
        named: Option<&Board>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        let named = named.map(Board::pattern);
        let family = named.and_then(Pattern::dictionary).map(Dictionary::family);
        let charuco = self.charuco(image, family, keep_on);
        if charuco.is_some() {
            return charuco;
        }
        let usual = Pattern::AprilGrid(Tags::default());
        if named != Some(usual) {
            // Two corners per tag.
            match self.look(image, BoardChoice::of(USUAL.map(|tags| 2 * tags), usual), keep_on) {
                Ok(_) | Err(Miss::OtherSquares { .. } | Miss::OtherMarkers { markers: 1.. }) => {
                    return Some(OtherBoard::AprilGrid);
                }
                Err(_) => {}
            }
        }
        if named != Some(Pattern::Plain)
            && let Some((columns, rows)) = self.count(image)
        {
            return Some(OtherBoard::Plain { columns, rows });
        }
        self.whole_circles(image, named, keep_on)
    }

    /// Board with markers in the light squares, if not of the named family or the usual side.
    fn charuco(
        &mut self,
        image: &GrayImage,
        named_family: Option<Dictionary>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        for side in std::iter::once(MarkerSide::Usual).chain(OTHER_SIDES.map(MarkerSide::Squares)) {
            let is_usual_side = side == MarkerSide::Usual;
            for dictionary in Dictionary::families() {
                if is_usual_side && Some(dictionary) == named_family {
                    continue;
                }
                let choice = BoardChoice::of(USUAL, Pattern::Charuco { dictionary, side });
                match self.look(image, choice, keep_on) {
                    Ok(_) | Err(Miss::OtherSquares { .. }) => {
                        return Some(OtherBoard::Charuco { dictionary, is_usual_side });
                    }
                    // Markers of other families have a dark frame, too.
                    Err(Miss::OtherMarkers { markers: 1.. }) => {}
                    // Without a grid of squares, there's none for other sides, either.
                    Err(Miss::NoBoard) => return None,
                    Err(_) => break,
                }
            }
        }
        None
    }

    /// Whole grid of circles with another layout than a `named` one.
    fn whole_circles(
        &mut self,
        image: &GrayImage,
        named: Option<Pattern>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        for level in self.search_levels(image).into_iter().flatten() {
            let picture = at_level(image, &self.levels, level);
            for grid in self.circles.whole_grids(picture, LONGEST_COUNTED) {
                let choice = grid.choice()?;
                // Squares can look like circles until their outlines are measured.
                let is_other = Some(choice.pattern) != named;
                if is_other && self.look(image, choice, keep_on).is_ok() {
                    return Some(grid);
                }
            }
        }
        None
    }

    /// Searches a picture for `choice`.
    fn look(
        &mut self,
        image: &GrayImage,
        choice: BoardChoice,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let board = choice.drawn(1.0).ok_or(Miss::NoBoard)?;
        self.search(image, &board, Search { keep_on, ..Search::FULL })
    }
}
