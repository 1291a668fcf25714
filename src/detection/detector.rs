//! The stages in order.

use image::GrayImage;

use super::{
    Detection, Miss,
    board_match::match_board,
    grow::Grower,
    junction::{self, Junction},
    lattice::Lattice,
    reduce::{Halved, halve},
    refine::Refiner,
    response::{Peak, peaks as find_peaks, respond},
    track::{Prediction, Tracker},
};
use crate::board::Checkerboard;

/// Bounds and thresholds of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorParams {
    /// Least corner response; a corner with a brightness step of 20 levels has about 200.
    pub min_response: i16,
    /// Most corner candidates at one level.
    pub max_candidates: usize,
    /// Most grids that are started at one level.
    pub max_seeds: usize,
    /// Least half brightness step in grey levels.
    pub min_contrast: f64,
    /// Widest blur that is measured.
    pub max_blur_px: f64,
    /// Shortest side of a square, in pixels of the full picture.
    pub min_square_px: f64,
    /// Largest residual of the edge model, as a share of the contrast.
    pub max_residual: f64,
}

impl Default for DetectorParams {
    fn default() -> Self {
        Self {
            min_response: 90,
            max_candidates: 2500,
            max_seeds: 60,
            min_contrast: 6.0,
            max_blur_px: 6.0,
            min_square_px: 6.0,
            max_residual: 0.5,
        }
    }
}

/// Searches wider than this are left to half the size first.
const SEARCH_WIDTH_PX: u32 = 1000;
/// Grids that are tried at one level besides those that hold most of the board, and their least size.
const GRIDS_KEPT: usize = 4;
const LEAST_GRID: usize = 6;
/// Grids with most of the board that are tried at one level; a wall of squares has no end of them.
const LARGE_GRIDS: usize = 4;

/// A search may stop at a predicted place, or at a budget.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Where to look first.
    pub near: Option<&'a Prediction>,
    /// Asked between the steps of the work, every few tenths of a millisecond; `false` ends it with
    /// [`Miss::OutOfTime`].
    pub keep_on: &'a dyn Fn() -> bool,
}

impl Search<'_> {
    /// Everywhere, to the end.
    pub const FULL: Self = Self { near: None, keep_on: &|| true };
}

/// Finds boards. Keeps buffers between pictures, but nothing that could change a result.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    params: DetectorParams,
    /// `levels[0]` is half the picture.
    levels: Vec<GrayImage>,
    response: Vec<i16>,
    peaks: Vec<Peak>,
    junctions: Vec<Junction>,
    grower: Grower,
    lattice: Lattice,
    /// Grids smaller than most of the board, largest first.
    kept: Vec<Lattice>,
    /// Corners at search size, and in the full picture.
    corners: Vec<[f32; 2]>,
    rough: Vec<[f64; 2]>,
    tracker: Tracker,
    refiner: Refiner,
}

/// [`Detector::detect`] with buffers of its own.
///
/// # Errors
///
/// [`Miss`].
pub fn detect(
    image: &GrayImage,
    board: &Checkerboard,
    params: DetectorParams,
) -> Result<Detection, Miss> {
    Detector::new(params).detect(image, board)
}

impl Detector {
    /// A detector with empty buffers.
    pub fn new(params: DetectorParams) -> Self {
        Self { params, ..Self::default() }
    }

    /// Finds `board` anywhere in `image`. All of its corners, or a reason.
    ///
    /// # Errors
    ///
    /// [`Miss`]: of several reasons the one of the grid that came closest to the board.
    pub fn detect(&mut self, image: &GrayImage, board: &Checkerboard) -> Result<Detection, Miss> {
        self.search(image, board, Search::FULL)
    }

    /// Finds `board` in `image`: where it is predicted, or else anywhere.
    ///
    /// The result depends on the arguments alone, not on earlier pictures.
    ///
    /// # Errors
    ///
    /// As [`detect`](Self::detect), and [`Miss::OutOfTime`].
    pub fn search(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        search: Search<'_>,
    ) -> Result<Detection, Miss> {
        if let Some(near) = search.near
            && self.tracker.follow(image, board, near, &mut self.rough)
        {
            let seen = self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on);
            if let Ok(detection) = seen {
                return Ok(detection);
            }
        }
        let mut best_miss = Miss::NoBoard;
        for level in self.search_levels(image).into_iter().flatten() {
            let found = self.search_level(image, level, board, search.keep_on).and_then(|()| {
                let halved = Halved::whole(level);
                self.rough.clear();
                self.rough.extend(self.corners.iter().map(|corner| halved.full_px(*corner)));
                self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on)
            });
            match found {
                Ok(detection) => return Ok(detection),
                Err(Miss::OutOfTime) => return Err(Miss::OutOfTime),
                Err(miss) if closeness(&miss) > closeness(&best_miss) => best_miss = miss,
                Err(_) => {}
            }
        }
        Err(best_miss)
    }

    /// Builds the halved pictures; the levels to search, most promising first.
    fn search_levels(&mut self, image: &GrayImage) -> [Option<usize>; 3] {
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

    /// One level: response, junctions, grids, the known board; its corners are then in `corners`.
    fn search_level(
        &mut self,
        image: &GrayImage,
        level: usize,
        board: &Checkerboard,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<(), Miss> {
        let Self {
            params, levels, response, peaks, junctions, grower, lattice, kept, corners, ..
        } = self;
        let picture = if level == 0 { image } else { &levels[level - 1] };
        respond(picture, response);
        let (width, height) = picture.dimensions();
        find_peaks(response, width as usize, params.min_response, params.max_candidates, peaks);
        if !keep_on() {
            return Err(Miss::OutOfTime);
        }
        junctions.clear();
        junctions.extend(peaks.iter().filter_map(|peak| junction::read(picture, peak)));
        grower.start(junctions, width, height);
        let wanted = board.corner_count();
        let limits = (board.columns().max(board.rows()), 3 * wanted + 100);
        kept.resize_with(GRIDS_KEPT, Lattice::default);
        kept.iter_mut().for_each(|lattice| lattice.clear(limits.0));
        let mut large = 0;
        let mut best_miss = Miss::NoBoard;
        let mut judge = |lattice: &mut Lattice| {
            let matched = match_board(picture, lattice, board, corners);
            match matched {
                Ok(()) => true,
                Err(miss) => {
                    if closeness(&miss) > closeness(&best_miss) {
                        best_miss = miss;
                    }
                    false
                }
            }
        };
        while grower.next_grid(junctions, params.max_seeds, limits, lattice).is_some() {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            // Most of the board in one grid: no need to look for a better one first.
            if 4 * lattice.len() >= 3 * wanted && large < LARGE_GRIDS {
                large += 1;
                if judge(lattice) {
                    return Ok(());
                }
            } else if let Some(place) = kept.iter().position(|kept| kept.len() < lattice.len()) {
                kept[place..].rotate_right(1);
                std::mem::swap(&mut kept[place], lattice);
            }
        }
        for lattice in kept.iter_mut().filter(|lattice| lattice.len() >= LEAST_GRID) {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            if judge(lattice) {
                return Ok(());
            }
        }
        Err(best_miss)
    }
}

/// How much a miss says; the person hears the one that says most.
fn closeness(miss: &Miss) -> usize {
    match *miss {
        Miss::NoBoard | Miss::OutOfTime => 0,
        // A few corners are found in many pictures without a board.
        Miss::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
        Miss::PartialBoard { found, .. } | Miss::Glare { found, .. } => found,
        Miss::OtherBoard { columns, rows } => 1000 + columns * rows,
        Miss::TooSmall { .. } | Miss::Blurred { .. } | Miss::LowContrast { .. } => 100_000,
    }
}
