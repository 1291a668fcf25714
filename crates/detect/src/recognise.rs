//! Recognises a board of any size or kind.

use image::GrayImage;

use super::{
    detector::{Detector, Pass, Search, at_level, doubled, picture_of},
    outcome::OtherBoard,
};
use boresight_geometry::{
    boards::{Board, BoardChoice, MarkerSide, Pattern},
    markers::{Dictionary, Markers, Tags},
};

/// Sides of markers tried after the usual side, in squares.
const OTHER_SIDES: [f64; 3] = [0.5, 0.6, 0.9];
/// Difference of sides, in squares, from which markers of one side aren't read as those of another.
const APART_SQUARES: f64 = 0.13;
/// Longest side of a counted grid of circles.
const LONGEST_COUNTED: usize = 20;
/// Squares less one, or tags, of the boards with markers compared with a picture. Another board of
/// the kind shows such markers in other places.
const USUAL: [u16; 2] = [7, 10];

impl Detector {
    /// Counts the inner corners of any whole board surrounded by white: columns and rows, at least
    /// as many columns as rows. `None` without such a board.
    ///
    /// ```
    /// # use boresight_detect::{Detector, DetectorParams};
    /// # use image::{GrayImage, Luma, imageops};
    /// // 8 by 6 squares of 50 pixels.
    /// let drawn = GrayImage::from_fn(640, 480, |x, y| {
    ///     let (column, row) = (x.wrapping_sub(120) / 50, y.wrapping_sub(90) / 50);
    ///     Luma([if column < 8 && row < 6 && (column + row) % 2 == 0 { 40 } else { 210 }])
    /// });
    /// let mut detector = Detector::new(DetectorParams::default());
    /// assert_eq!(detector.count(&imageops::blur(&drawn, 0.8)), Some((7, 5)));
    /// ```
    pub fn count(&mut self, image: &GrayImage) -> Option<(usize, usize)> {
        self.search_levels(image).into_iter().flatten().find_map(|level| {
            let picture = at_level(image, &self.levels, level);
            self.grids.start(picture, &self.params);
            match self.grids.count(picture, &self.params)? {
                OtherBoard::Plain { columns, rows } => Some((columns, rows)),
                _ => None,
            }
        })
    }

    /// Recognises a board of another kind than `named`, or of any kind without `named`: a board
    /// with markers of another family or side, an AprilGrid like Kalibr's, squares with white
    /// around them, or a whole grid of circles of another layout. `None` if the picture shows none
    /// of these, or if `keep_on` ends the search.
    pub fn recognise(
        &mut self,
        image: &GrayImage,
        named: Option<&Board>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        self.recognise_from(&mut 0, image, named, keep_on)
    }

    /// [`recognise`](Self::recognise) in steps of some milliseconds. A search that `keep_on` ends
    /// goes on in another picture from `step` on, which is 0 at the start and after the last step.
    pub fn recognise_from(
        &mut self,
        step: &mut usize,
        image: &GrayImage,
        named: Option<&Board>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        let named_markers = named.and_then(Board::markers);
        let named = named.map(Board::pattern);
        let (charucos, tags) = (other_charucos(named_markers), other_tags(named));
        let mut plain = None;
        let mut has_grid = false;
        let [primary, ..] = self.search_levels(image);
        // Wider pictures show the gaps around markers by themselves.
        let doubled = doubled(image).filter(|_| primary == Some(0));
        let levels = self.fine_levels(image).into_iter().flatten().map(Pass::Level);
        for pass in levels.chain(doubled).skip(*step) {
            if !keep_on() {
                return None;
            }
            *step += 1;
            if pass == Pass::Doubled && !has_grid {
                break;
            }
            let picture = picture_of(pass, image, &self.levels, &mut self.grown);
            let params = &self.params;
            self.grids.start(picture, params);
            let marked =
                [&charucos, &tags].map(|others| self.grids.read_others(picture, others, params));
            let [(seen, is_charuco), (_, is_tags)] = marked;
            if is_charuco.is_some() || is_tags.is_some() {
                *step = 0;
                // Some tags are read in squares between them, too.
                return is_tags.or(is_charuco);
            }
            has_grid |= seen;
            if named != Some(Pattern::Plain) && pass != Pass::Doubled {
                plain = plain.or_else(|| self.grids.count(picture, params));
            }
        }
        let other = plain.or_else(|| self.whole_circles(image, named, keep_on));
        if other.is_some() || keep_on() {
            *step = 0;
        }
        other
    }

    /// Whole grid of circles with another layout than a `named` one.
    fn whole_circles(
        &mut self,
        image: &GrayImage,
        named: Option<Pattern>,
        keep_on: &dyn Fn() -> bool,
    ) -> Option<OtherBoard> {
        let [primary, coarser, _] = self.search_levels(image);
        for level in [primary, coarser].into_iter().flatten().filter(|_| keep_on()) {
            let picture = at_level(image, &self.levels, level);
            for grid in self.circles.whole_grids(picture, LONGEST_COUNTED) {
                let choice = grid.choice()?;
                // Squares can look like circles until their outlines are measured.
                let board = choice.drawn(1.0).filter(|_| Some(choice.pattern) != named);
                let search = Search { keep_on, ..Search::FULL };
                if board.is_some_and(|board| self.search(image, &board, search).is_ok()) {
                    return Some(grid);
                }
            }
        }
        None
    }
}

/// Boards with markers in the light squares, of other families or sides than the named ones.
fn other_charucos(named: Option<Markers>) -> Vec<(OtherBoard, Board)> {
    let sides = std::iter::once(MarkerSide::Usual).chain(OTHER_SIDES.map(MarkerSide::Squares));
    let all = sides.flat_map(|side| Dictionary::families().map(move |it| (it, side)));
    let others = all.filter(|(dictionary, side)| {
        !named.is_some_and(|named| {
            let apart = (named.side_squares - side.in_squares_of(1.0)).abs();
            named.dictionary.family() == *dictionary && apart < APART_SQUARES
        })
    });
    let boards = others.filter_map(|(dictionary, side)| {
        let is_usual_side = side == MarkerSide::Usual;
        let board = BoardChoice::of(USUAL, Pattern::Charuco { dictionary, side }).drawn(1.0)?;
        Some((OtherBoard::Charuco { dictionary, is_usual_side }, board))
    });
    let mut boards: Vec<_> = boards.collect();
    // The usual side first; boards of the same cells are read at once.
    boards.sort_by_key(|(other, board)| {
        let is_usual = matches!(other, OtherBoard::Charuco { is_usual_side: true, .. });
        (!is_usual, board.markers().map(|it| (it.side_squares.to_bits(), it.cells())))
    });
    boards
}

/// AprilGrid like Kalibr's, unless named.
fn other_tags(named: Option<Pattern>) -> Vec<(OtherBoard, Board)> {
    let usual = Pattern::AprilGrid(Tags::default());
    // Two corners per tag.
    let board = BoardChoice::of(USUAL.map(|tags| 2 * tags), usual).drawn(1.0);
    let board = board.filter(|_| named != Some(usual));
    board.map(|board| (OtherBoard::AprilGrid, board)).into_iter().collect()
}
