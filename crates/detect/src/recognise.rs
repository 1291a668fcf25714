//! Recognises a board of any size or kind.

use image::GrayImage;

use super::{
    detector::{Detector, Search, at_level},
    outcome::{Detection, Miss, OtherBoard},
};
use boresight_geometry::{
    boards::Board,
    markers::{CircleRows, Dictionary, MarkerChoice, Markers, Tags},
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
        let named_markers = named.and_then(Board::markers);
        let charuco = self.charuco(image, named_markers.filter(Markers::are_in_squares), keep_on);
        if charuco.is_some() {
            return charuco;
        }
        let usual = Tags::default();
        let is_named = named_markers.and_then(|markers| markers.tags) == Some(usual);
        let tags = Some(MarkerChoice::tags(usual));
        if !is_named {
            // Two corners per tag.
            match self.look(image, USUAL.map(|tags| 2 * tags), tags, keep_on) {
                Ok(_) | Err(Miss::OtherSquares { .. } | Miss::OtherMarkers { markers: 1.. }) => {
                    return Some(OtherBoard::AprilGrid);
                }
                Err(_) => {}
            }
        }
        if !matches!(named, Some(Board::Plain(_)))
            && let Some((columns, rows)) = self.count(image)
        {
            return Some(OtherBoard::Plain { columns, rows });
        }
        self.whole_circles(image, named.and_then(Board::circles), keep_on)
    }

    /// Board with markers in the light squares, if of another family or side than the named
    /// markers.
    fn charuco(
        &mut self,
        image: &GrayImage,
        named: Option<Markers>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        let named_family = named.map(|markers| markers.dictionary.family());
        for side in std::iter::once(None).chain(OTHER_SIDES.map(Some)) {
            for dictionary in Dictionary::families() {
                if side.is_none() && Some(dictionary) == named_family {
                    continue;
                }
                let markers = MarkerChoice::in_squares(dictionary, side);
                match self.look(image, USUAL, Some(markers), keep_on) {
                    Ok(_) | Err(Miss::OtherSquares { .. }) => {
                        let is_usual_side = side.is_none();
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

    /// Whole grid of circles with another layout than `named`.
    fn whole_circles(
        &mut self,
        image: &GrayImage,
        named: Option<CircleRows>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        for level in self.search_levels(image).into_iter().flatten() {
            let picture = at_level(image, &self.levels, level);
            for grid in self.circles.whole_grids(picture, LONGEST_COUNTED) {
                let choice = grid.choice()?;
                let layout = choice.markers.and_then(|markers| markers.circles);
                // Squares can look like circles until their outlines are measured.
                let is_other = layout != named;
                let counts = [choice.columns, choice.rows];
                if is_other && self.look(image, counts, choice.markers, keep_on).is_ok() {
                    return Some(grid);
                }
            }
        }
        None
    }

    /// Searches a picture for a board of the given columns and rows.
    fn look(
        &mut self,
        image: &GrayImage,
        [columns, rows]: [u16; 2],
        markers: Option<MarkerChoice>,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Detection, Miss> {
        let squares = Board::new(columns, rows, 1.0).map_err(|_| Miss::NoBoard)?;
        let board = match markers {
            None => squares,
            Some(markers) => squares.drawn_with(markers.in_squares_of(1.0)),
        };
        self.search(image, &board, Search { keep_on, ..Search::FULL })
    }
}
