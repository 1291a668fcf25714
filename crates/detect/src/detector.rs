//! Runs the stages of the detector in order.

use image::GrayImage;

use super::{
    circles::CircleSearch,
    explain::{Searched, WeighedGrid},
    grid_search::GridSearch,
    marker_cells::Polarity,
    outcome::{Detection, Miss, OtherBoard},
    params::DetectorParams,
    picture_quality,
    reduce::{Grow, Halved, double, grow, halve, negate},
    refine::Refiner,
    track::{Expected, Prediction, Tracker, shortest_side_px},
};
use boresight_geometry::{
    boards::Board,
    boards::{Circles, PartTells},
    seen_count,
};

/// Largest width of a picture searched without halving.
const SEARCH_WIDTH_PX: u32 = 1000;
/// Largest number of pixels in a doubled picture.
const MOST_DOUBLED_PX: usize = 2_200_000;
/// Side of squares in pixels below which the squares of a larger pattern beyond the board may be
/// too small to be seen.
const SMALL_SQUARE_PX: f64 = 8.0;

/// Start and limits of a [`Detector::search`].
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Prediction of the first place to search, before the whole picture; also determines the
    /// corners in a part of the board.
    pub near: Option<&'a Prediction>,
    /// Callback between steps of the work, every few tenths of a millisecond; returning `false`
    /// ends the search with [`Miss::OutOfTime`].
    pub keep_on: &'a dyn Fn() -> bool,
    /// True to search for usual boards only, in a quarter of the time: neither for small squares
    /// nor for those that don't touch.
    pub is_quick: bool,
}

impl Search<'_> {
    /// Search of the whole picture, without a time limit.
    pub const FULL: Self = Self { near: None, keep_on: &|| true, is_quick: false };
}

/// Picture to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    /// Picture halved the given number of times.
    Level(usize),
    /// Halved picture with dark or light squares grown.
    Grown(usize, Grow),
    /// Picture at twice the size.
    Doubled,
}

impl Pass {
    fn level(self) -> Option<usize> {
        match self {
            Self::Level(level) | Self::Grown(level, _) => Some(level),
            Self::Doubled => None,
        }
    }

    fn halved(self) -> Halved {
        self.level().map_or(Halved::doubled(), Halved::whole)
    }

    fn searched(self) -> Searched {
        Searched { scale: self.halved().scale, grown: matches!(self, Self::Grown(..)) }
    }
}

/// Finds boards in pictures. Reuses its buffers, but keeps nothing between pictures that could
/// change a result.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    pub(super) params: DetectorParams,
    /// Halved pictures; `levels[0]` is half the picture.
    pub(super) levels: Vec<GrayImage>,
    /// Doubled level, or level with dark or light squares grown, and a buffer.
    pub(super) grown: GrayImage,
    grown_rows: Vec<u8>,
    /// Picture with black and white exchanged, for a board printed white on black.
    negative: GrayImage,
    pub(super) grids: GridSearch,
    pub(super) circles: CircleSearch,
    /// Corners in the full picture, as found by the search.
    rough: Vec<Option<[f64; 2]>>,
    /// Corners in the full picture of the grid with the reason for the missing board.
    closest: Vec<[f64; 2]>,
    /// Mean length of its squares' longer sides in the full picture.
    closest_side_px: f64,
    /// Predicted corners at search size; none without a prediction.
    expected: Expected,
    /// Widths of edges in a picture without a board.
    edge_widths: Vec<f32>,
    tracker: Tracker,
    refiner: Refiner,
}

/// Finds `board` anywhere in `image`: the corners, or the reason for their absence.
///
/// Allocates its buffers; for a stream of pictures use a [`Detector`].
///
/// # Errors
///
/// [`Miss`], as [`Detector::detect`].
pub fn detect(image: &GrayImage, board: &Board, params: DetectorParams) -> Result<Detection, Miss> {
    Detector::new(params).detect(image, board)
}

impl Detector {
    /// Creates a detector with empty buffers.
    pub fn new(params: DetectorParams) -> Self {
        Self { params, ..Self::default() }
    }

    /// Finds `board` anywhere in `image`: the corners, or the reason for their absence. Corners
    /// that are covered or outside of the picture are [unseen](boresight_geometry::Corner::unseen).
    ///
    /// # Errors
    ///
    /// [`Miss`], never [`Miss::OutOfTime`]. With several candidate grids, the reason of the grid
    /// closest to the board.
    ///
    /// ```
    /// # use boresight_detect::{Detector, DetectorParams, Miss};
    /// # use boresight_geometry::boards::Board;
    /// # use image::GrayImage;
    /// // One detector keeps its buffers over all pictures of a stream.
    /// let mut detector = Detector::new(DetectorParams::default());
    /// let board = Board::new(9, 6, 0.025)?;
    /// let wall = GrayImage::from_pixel(640, 480, image::Luma([128]));
    /// assert!(matches!(detector.detect(&wall, &board), Err(Miss::NoBoard)));
    /// # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
    /// ```
    pub fn detect(&mut self, image: &GrayImage, board: &Board) -> Result<Detection, Miss> {
        self.search(image, board, Search::FULL)
    }

    /// [`detect`](Self::detect) with every grid of corners or circles compared with the board, in
    /// order. The result is refined from the last ones with corners of the board. Takes longer.
    ///
    /// # Errors
    ///
    /// [`Miss`], beside the weighed grids.
    pub fn explain(
        &mut self,
        image: &GrayImage,
        board: &Board,
    ) -> (Result<Detection, Miss>, Vec<WeighedGrid>) {
        self.grids.weighed = Some(Vec::new());
        let found = self.detect(image, board);
        (found, self.grids.weighed.take().unwrap_or_default())
    }

    /// Finds `board` in `image`, first at the predicted place, then anywhere.
    ///
    /// The result depends on the arguments alone, not on earlier pictures.
    ///
    /// # Errors
    ///
    /// [`Miss`], as [`detect`](Self::detect), and [`Miss::OutOfTime`].
    pub fn search(
        &mut self,
        image: &GrayImage,
        board: &Board,
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        self.closest.clear();
        self.closest_side_px = f64::INFINITY;
        if let Board::Circles(circles) = board {
            return self.search_circles(image, (board, circles), search);
        }
        let names_points = board.target().part_tells() == PartTells::EachPoint;
        if let Some(near) = search.near.filter(|near| !near.everywhere && !names_points)
            && self.tracker.follow(image, board, near, &mut self.rough)
        {
            let seen = self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on);
            if let Ok(detection) = seen {
                return Ok(detection);
            }
        }
        let is_marked = board.markers().is_some();
        let mut best_miss = Miss::NoBoard;
        // Around tags there's room for the ring, as on a plain board; far tags are read in the
        // finer picture only, and the better of two counts.
        let is_tags = matches!(board, Board::AprilGrid(_));
        let ([primary, coarser, finer], takes_first) = match (is_marked, is_tags) {
            (_, true) if !search.is_quick => {
                let [primary, coarser, finer] = self.search_levels(image);
                ([primary, finer.or(coarser), None], false)
            }
            (true, false) if !search.is_quick => (self.fine_levels(image), true),
            _ => (self.search_levels(image), is_marked && !is_tags),
        };
        let finer = finer.filter(|_| !search.is_quick);
        let levels = [primary, coarser, finer].into_iter().flatten().map(Pass::Level);
        // Squares that don't touch: light has spread on a bright screen or in an overexposed
        // picture, or ink on paper. Markers don't survive growth.
        let grown = [(coarser, Grow::Dark), (primary, Grow::Dark), (coarser, Grow::Light)];
        let grown = grown.into_iter().filter(|_| !is_marked && !search.is_quick);
        let grown = grown.filter_map(|(level, what)| Some(Pass::Grown(level?, what)));
        // The gaps around markers may be narrower than the ring.
        let doubled = doubled(image).filter(|_| is_marked && !search.is_quick);
        let mut best_part: Option<Detection> = None;
        for pass in levels.chain(grown).chain(doubled) {
            if best_part.is_some() && pass.level() != coarser {
                break;
            }
            if matches!(pass, Pass::Grown(..)) && !may_be_grown(&best_miss) {
                break;
            }
            // A coarser picture would hide the contradicting markers.
            if matches!(best_miss, Miss::OtherSquares { .. }) {
                break;
            }
            let halved = pass.halved();
            self.expected.set(search.near, |corner| halved.at(corner));
            self.rough.clear();
            let found = self.search_pass(image, pass, board, search.keep_on).and_then(|polarity| {
                let full_px = |corner: &Option<[f32; 2]>| corner.map(|at| halved.full_px(at));
                self.rough.extend(self.grids.corners().iter().map(full_px));
                let mut image = image;
                if polarity == Polarity::Negative {
                    negate(image, &mut self.negative);
                    image = &self.negative;
                }
                self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on)
            });
            let is_coarse = matches!(pass, Pass::Grown(..)) || pass.level() > primary;
            let found = found.and_then(|detection| {
                if !is_marked && self.rough.iter().all(Option::is_some) {
                    let px = |index: usize| self.rough[index].unwrap_or([f64::NAN; 2]);
                    let is_small = || shortest_side_px(board, px) < SMALL_SQUARE_PX * halved.scale;
                    let sharper = if is_coarse { primary } else { finer.filter(|_| is_small()) };
                    self.check_whole(image, sharper, board, &detection)?;
                }
                Ok(detection)
            });
            match found {
                Ok(detection) => {
                    let seen = seen_count(&detection.corners);
                    if seen == detection.corners.len() || takes_first {
                        return Ok(detection);
                    }
                    if best_part.as_ref().is_none_or(|part| seen > seen_count(&part.corners)) {
                        best_part = Some(detection);
                    }
                }
                Err(Miss::OutOfTime) => return best_part.ok_or(Miss::OutOfTime),
                // Growth hides squares, so it doesn't show the ends of a part seen without it.
                Err(Miss::OtherBoard(OtherBoard::Plain { columns, rows }))
                    if matches!(pass, Pass::Grown(..)) && best_miss.found() >= columns * rows => {}
                Err(miss) if miss.is_closer_than(best_miss) => {
                    best_miss = miss;
                    let full_px = |at: &[f32; 2]| halved.full_px(*at);
                    let refined = self.rough.iter().flatten().copied();
                    self.closest_side_px = self.grids.closest_side_px * halved.scale;
                    self.closest.clear();
                    self.closest.extend(self.grids.closest.iter().map(full_px).chain(refined));
                }
                Err(_) => {}
            }
        }
        let is_other = matches!(
            best_miss,
            Miss::OtherBoard { .. } | Miss::OtherSquares { .. } | Miss::Mirrored
        );
        if let Some(part) = best_part.filter(|_| !is_other) {
            return Ok(part);
        }
        let finest = [primary, finer].into_iter().flatten().min().unwrap_or_default();
        let least_px = SMALL_SQUARE_PX * Halved::whole(finest).scale;
        // Small squares are missed by themselves.
        let is_vague = says_little(&best_miss) || matches!(best_miss, Miss::Glare { .. });
        if is_vague && self.closest_side_px < least_px {
            best_miss = Miss::NoBoard;
        }
        Err(self.clearer_reason(image, primary, search.near, best_miss))
    }

    /// Board of circles in the first picture with the whole board: a finer picture for small
    /// circles, a coarser one for large or noisy circles.
    fn search_circles(
        &mut self,
        image: &GrayImage,
        board: (&Board, &Circles),
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        let [primary, coarser, finer] = self.search_levels(image);
        let finer = finer.filter(|_| !search.is_quick);
        let mut best_miss = Miss::NoBoard;
        for level in [primary, finer, coarser].into_iter().flatten() {
            let halved = Halved::whole(level);
            self.expected.set(search.near, |corner| halved.at(corner));
            let picture = at_level(image, &self.levels, level);
            let place = (image, picture, halved);
            let Self { circles, grids, expected, params, closest, .. } = self;
            let weighed = &mut grids.weighed;
            let before = weighed.as_ref().map_or(0, Vec::len);
            let board = (board.0, board.1, best_miss);
            let notes = (&*expected, &mut *weighed, closest);
            let found = circles.find(place, board, notes, params, search.keep_on);
            for grid in weighed.iter_mut().flat_map(|weighed| &mut weighed[before..]) {
                grid.was_searched(Pass::Level(level).searched(), halved);
            }
            match found {
                Err(Miss::OutOfTime) => return Err(Miss::OutOfTime),
                Err(miss) => best_miss = miss,
                Ok(detection) => return Ok(detection),
            }
        }
        Err(self.clearer_reason(image, primary, search.near, best_miss))
    }

    /// Searches for more of the pattern in a sharper picture than the board's, because a coarse
    /// picture hides small or merged squares.
    fn check_whole(
        &mut self,
        image: &GrayImage,
        level: Option<usize>,
        board: &Board,
        detection: &Detection,
    ) -> Result<(), Miss> {
        let Some(level) = level else { return Ok(()) };
        let picture = at_level(image, &self.levels, level);
        let halved = Halved::whole(level);
        let corners = detection.corners.iter().map(|corner| halved.at([corner.px.x, corner.px.y]));
        self.grids.check_whole(picture, board, corners)
    }

    /// Reason from the picture, if that may be behind the `miss` of the closest grid: darkness and
    /// blur hide corners, rows and markers.
    fn clearer_reason(
        &mut self,
        image: &GrayImage,
        level: Option<usize>,
        near: Option<&Prediction>,
        miss: Miss,
    ) -> Miss {
        // Plain squares show that they hold no markers even when blurred.
        let may_hide = match miss {
            Miss::OtherMarkers { markers } => markers > 0,
            Miss::OtherBoard(_) => true,
            _ => miss.leaves_open(),
        };
        let Some(level) = level.filter(|_| may_hide) else { return miss };
        let picture = at_level(image, &self.levels, level);
        let halved = Halved::whole(level);
        let is_board = !self.closest.is_empty();
        let corners = if is_board { Some(&self.closest) } else { near.map(|it| &it.corners_px) };
        let region = corners.map(|corners| {
            let ends = corners.iter().map(|corner| halved.at(*corner));
            let start = [f32::MAX, f32::MAX, 0.0, 0.0];
            let ends = ends.fold(start, |[left, top, right, bottom], [x, y]| {
                [left.min(x), top.min(y), right.max(x), bottom.max(y)]
            });
            ends.map(|end| end.max(0.0) as usize)
        });
        let place = (region, is_board);
        picture_quality::reason(picture, place, halved.scale, &mut self.edge_widths).unwrap_or(miss)
    }

    /// Builds the halved pictures, and returns the levels to search, most promising first.
    pub(super) fn search_levels(&mut self, image: &GrayImage) -> [Option<usize>; 3] {
        let mut primary = 0;
        while image.width() >> primary > SEARCH_WIDTH_PX {
            primary += 1;
        }
        let coarsest = primary + 1;
        if self.levels.len() < coarsest {
            self.levels.resize_with(coarsest, GrayImage::default);
        }
        for level in 0..coarsest {
            let (finer, coarser) = self.levels.split_at_mut(level);
            halve(finer.last().unwrap_or(image), &mut coarser[0]);
        }
        let wide_enough = image.width() >> coarsest >= 160;
        [Some(primary), wide_enough.then_some(coarsest), primary.checked_sub(1)]
    }

    /// Levels of [`search_levels`](Self::search_levels) for boards with markers: the gap between
    /// corner and marker should hold the search ring, so the finest level comes first.
    pub(super) fn fine_levels(&mut self, image: &GrayImage) -> [Option<usize>; 3] {
        let [primary, coarser, finer] = self.search_levels(image);
        if finer.is_some() { [finer, primary, coarser] } else { [primary, coarser, None] }
    }

    fn search_pass(
        &mut self,
        image: &GrayImage,
        pass: Pass,
        board: &Board,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Polarity, Miss> {
        let Self { params, levels, grown, grown_rows, grids, expected, .. } = self;
        let (picture, plain) = match pass {
            Pass::Grown(level, what) => {
                let plain = at_level(image, levels, level);
                grow(plain, what, grown_rows, grown);
                (&*grown, plain)
            }
            _ => [picture_of(pass, image, levels, grown); 2].into(),
        };
        let halved = pass.halved();
        let before = grids.weighed.as_ref().map_or(0, Vec::len);
        let found = grids.find((picture, plain, halved.scale), board, params, expected, keep_on);
        for grid in grids.weighed.iter_mut().flat_map(|weighed| &mut weighed[before..]) {
            grid.was_searched(pass.searched(), halved);
        }
        found
    }
}

/// Doubled picture, if it isn't too large.
pub(super) fn doubled(image: &GrayImage) -> Option<Pass> {
    (image.len() <= MOST_DOUBLED_PX).then_some(Pass::Doubled)
}

/// Picture of a pass, halved, or doubled in the buffer `grown`.
pub(super) fn picture_of<'a>(
    pass: Pass,
    image: &'a GrayImage,
    levels: &'a [GrayImage],
    grown: &'a mut GrayImage,
) -> &'a GrayImage {
    match pass.level() {
        Some(level) => at_level(image, levels, level),
        None => {
            double(image, grown);
            grown
        }
    }
}

/// Picture halved `level` times.
pub(super) fn at_level<'a>(
    image: &'a GrayImage,
    levels: &'a [GrayImage],
    level: usize,
) -> &'a GrayImage {
    if level == 0 { image } else { &levels[level - 1] }
}

/// True if squares that don't touch may be the reason.
fn may_be_grown(miss: &Miss) -> bool {
    says_little(miss) || matches!(miss, Miss::Glare { .. } | Miss::Blurred { .. })
}

/// True if the picture may have a clearer reason.
fn says_little(miss: &Miss) -> bool {
    matches!(miss, Miss::NoBoard | Miss::PartialBoard { cut_off_by: None, .. })
}
