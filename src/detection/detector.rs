//! Runs the stages of the detector in order.

use image::GrayImage;

use super::{
    board_match::{count_board, match_board},
    grow::Grower,
    junction::{self, Junction},
    lattice::Lattice,
    outcome::{Detection, Miss},
    params::DetectorParams,
    reduce::{Halved, halve},
    refine::Refiner,
    response::{Peak, peaks as find_peaks, respond},
    track::{Prediction, Tracker},
};
use crate::board::Checkerboard;

/// Wider pictures are halved before the search.
const SEARCH_WIDTH_PX: u32 = 1000;
/// Smaller grids tried at one level once no grid with most of the board matched, and their least size.
const GRIDS_KEPT: usize = 4;
const LEAST_GRID: usize = 6;
/// Grids with most of the board that are tried at one level; a tiled wall has no end of them.
const LARGE_GRIDS: usize = 4;
/// Longest side of a board that is counted, and most corners.
const LONGEST_COUNTED: usize = 40;
const MOST_COUNTED: usize = 1000;

/// Where [`Detector::search`] starts, and when it gives up.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Where to search first; everywhere if `None`, or if the board isn't there.
    pub near: Option<&'a Prediction>,
    /// Called between steps of the work, every few tenths of a millisecond; returning `false` ends the search
    /// with [`Miss::OutOfTime`].
    pub keep_on: &'a dyn Fn() -> bool,
}

impl Search<'_> {
    /// The whole picture, without a time limit.
    pub const FULL: Self = Self { near: None, keep_on: &|| true };
}

/// Finds boards in pictures. Reuses its buffers, but keeps nothing between pictures that could change a result.
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
    /// Grids with less than most of the board, largest first.
    kept: Vec<Lattice>,
    /// Corners at search size, and in the full picture.
    corners: Vec<[f32; 2]>,
    rough: Vec<[f64; 2]>,
    tracker: Tracker,
    refiner: Refiner,
}

/// Finds `board` anywhere in `image`: all of its corners, or the reason why not.
///
/// Allocates its buffers; for a stream of pictures use a [`Detector`].
///
/// # Errors
///
/// [`Miss`], as [`Detector::detect`].
///
/// # Examples
///
/// ```
/// use boresight::{
///     detection::{DetectorParams, detect},
///     simulation::{Scene, render_view},
/// };
/// use nalgebra::{Isometry3, Vector3};
///
/// let scene = Scene::default_720p(1);
/// let cam_from_board = Isometry3::new(Vector3::new(0.01, 0.0, 0.35), Vector3::new(0.5, 0.3, 0.0));
/// let image = render_view(&scene, &cam_from_board);
///
/// let detection = detect(&image, &scene.board, DetectorParams::default()).expect("the board is visible");
/// for (corner, point_m) in detection.corners.iter().zip(scene.board.corners_in_board_m()) {
///     let truth_px = scene.camera.px_from_board(&cam_from_board, &point_m).expect("in front");
///     assert!((corner.px - truth_px).norm() < 0.3);
/// }
/// assert!(detection.quality.contrast > 20.0);
/// ```
pub fn detect(
    image: &GrayImage,
    board: &Checkerboard,
    params: DetectorParams,
) -> Result<Detection, Miss> {
    Detector::new(params).detect(image, board)
}

impl Detector {
    /// Creates a detector with empty buffers.
    pub fn new(params: DetectorParams) -> Self {
        Self { params, ..Self::default() }
    }

    /// Finds `board` anywhere in `image`: all of its corners, or the reason why not.
    ///
    /// # Errors
    ///
    /// [`Miss`], never [`Miss::OutOfTime`]. With several candidate grids, the reason of the one that came closest to
    /// the board.
    pub fn detect(&mut self, image: &GrayImage, board: &Checkerboard) -> Result<Detection, Miss> {
        self.search(image, board, Search::FULL)
    }

    /// Finds `board` in `image`, first where it is predicted, then anywhere.
    ///
    /// The result depends on the arguments alone, not on earlier pictures.
    ///
    /// # Errors
    ///
    /// [`Miss`], as [`detect`](Self::detect), and [`Miss::OutOfTime`].
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

    /// Counts the inner corners of any board that is seen whole, with white around it: columns and rows, at least as
    /// many columns as rows. `None` without such a board.
    pub fn count(&mut self, image: &GrayImage) -> Option<(usize, usize)> {
        self.search_levels(image).into_iter().flatten().find_map(|level| {
            let picture = if level == 0 { image } else { &self.levels[level - 1] };
            read_junctions(
                picture,
                &self.params,
                (&mut self.response, &mut self.peaks, &mut self.junctions),
            );
            let (width, height) = picture.dimensions();
            self.grower.start(&self.junctions, width, height);
            let (seeds, limits) = (self.params.max_seeds, (LONGEST_COUNTED, MOST_COUNTED));
            let lattice = &mut self.lattice;
            while self.grower.next_grid(&self.junctions, seeds, limits, lattice).is_some() {
                let counted = count_board(picture, lattice, LONGEST_COUNTED as i32);
                if counted.is_some() {
                    return counted;
                }
            }
            None
        })
    }

    /// Builds the halved pictures. Returns the levels to search, most promising first.
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

    /// Searches one level: response, junctions, grids, match. On success the corners are in `self.corners`.
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
        read_junctions(picture, params, (response, peaks, junctions));
        if !keep_on() {
            return Err(Miss::OutOfTime);
        }
        let (width, height) = picture.dimensions();
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
            // A grid with most of the board is judged at once; smaller ones wait for a better one.
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

/// Finds the junctions of `picture`.
fn read_junctions(
    picture: &GrayImage,
    params: &DetectorParams,
    (response, peaks, junctions): (&mut Vec<i16>, &mut Vec<Peak>, &mut Vec<Junction>),
) {
    respond(picture, response);
    let width = picture.width() as usize;
    find_peaks(response, width, params.min_response, params.max_candidates, peaks);
    junctions.clear();
    junctions.extend(peaks.iter().filter_map(|peak| junction::read(picture, peak)));
}

/// Rank of a miss by how much it tells; the highest one is reported.
fn closeness(miss: &Miss) -> usize {
    match *miss {
        Miss::NoBoard | Miss::OutOfTime => 0,
        // Many pictures without a board contain a few corners.
        Miss::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
        Miss::PartialBoard { found, .. } | Miss::Glare { found, .. } => found,
        Miss::OtherBoard { columns, rows } => columns * rows,
        Miss::TooSmall { .. } | Miss::Blurred { .. } | Miss::LowContrast { .. } => 100_000,
    }
}
