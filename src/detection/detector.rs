//! Runs the stages of the detector in order.

use image::GrayImage;

use super::{
    board_match::{count_board, match_board},
    grow::Grower,
    junction::{self, Junction},
    lattice::Lattice,
    marked_board::name_corners,
    outcome::{Detection, Miss},
    params::DetectorParams,
    picture_quality,
    reduce::{Grow, Halved, double, grow, halve},
    refine::Refiner,
    response::{Peak, peaks as find_peaks, respond},
    track::{Prediction, Tracker},
};
use crate::{board::Checkerboard, geometry::seen_count};

/// Wider pictures are halved before the search.
const SEARCH_WIDTH_PX: u32 = 1000;
/// Smaller grids tried at one level once no grid with most of the board matched, and their least size.
const GRIDS_KEPT: usize = 4;
const LEAST_GRID: usize = 6;
/// Smallest grid whose markers are read.
const LEAST_MARKED_GRID: usize = 4;
/// Grids with most of the board that are tried at one level; a tiled wall has no end of them.
const LARGE_GRIDS: usize = 4;
/// Larger pictures aren't doubled.
const MOST_DOUBLED_PX: usize = 2_200_000;
/// Longest side of a board that is counted, and most corners.
const LONGEST_COUNTED: usize = 40;
const MOST_COUNTED: usize = 1000;

/// Where [`Detector::search`] starts, and when it gives up.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// Where to search first, unless everywhere is wanted; everywhere if the board isn't there. Also says which corners
    /// a part of the board has.
    pub near: Option<&'a Prediction>,
    /// Called between steps of the work, every few tenths of a millisecond; returning `false` ends the search
    /// with [`Miss::OutOfTime`].
    pub keep_on: &'a dyn Fn() -> bool,
}

impl Search<'_> {
    /// The whole picture, without a time limit.
    pub const FULL: Self = Self { near: None, keep_on: &|| true };
}

/// What is done to a level before it's searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    Grown(Grow),
    Doubled,
}

/// Finds boards in pictures. Reuses its buffers, but keeps nothing between pictures that could change a result.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    params: DetectorParams,
    /// `levels[0]` is half the picture.
    levels: Vec<GrayImage>,
    /// A level in which dark or light squares were grown, or that was doubled, and a buffer for that.
    grown: GrayImage,
    grown_rows: Vec<u8>,
    response: Vec<i16>,
    peaks: Vec<Peak>,
    junctions: Vec<Junction>,
    grower: Grower,
    lattice: Lattice,
    /// Grids with less than most of the board, largest first.
    kept: Vec<Lattice>,
    /// Corners at search size, and in the full picture.
    corners: Vec<Option<[f32; 2]>>,
    /// The largest part of the board at one level.
    part: Vec<Option<[f32; 2]>>,
    rough: Vec<Option<[f64; 2]>>,
    /// Corners at search size where they were predicted; none without a prediction.
    expected: Vec<[f32; 2]>,
    /// Widths of edges in a picture without a board.
    edge_widths: Vec<f32>,
    tracker: Tracker,
    refiner: Refiner,
}

/// Finds `board` anywhere in `image`: its corners, or the reason why not.
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

    /// Finds `board` anywhere in `image`: its corners, or the reason why not. Corners that are covered or outside of the
    /// picture are [unseen](crate::geometry::Corner::unseen).
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
        if let Some(near) = search.near.filter(|near| !near.everywhere && board.markers().is_none())
            && self.tracker.follow(image, board, near, &mut self.rough)
        {
            let seen = self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on);
            if let Ok(detection) = seen {
                return Ok(detection);
            }
        }
        let mut best_miss = Miss::NoBoard;
        let [primary, coarser, finer] = match board.markers() {
            None => self.search_levels(image),
            Some(_) => self.fine_levels(image),
        };
        let plain = [primary, coarser, finer].map(|level| (level, None));
        // Squares that don't touch: light has spread on a bright screen or in an overexposed picture, or ink on paper.
        let grown = [(coarser, Grow::Dark), (primary, Grow::Dark), (coarser, Grow::Light)];
        let grown = grown.map(|(level, what)| (level, Some(Change::Grown(what))));
        // Markers don't survive growth, but the gaps around them may be narrower than the ring.
        let is_small = image.len() <= MOST_DOUBLED_PX;
        let doubled = [(is_small.then_some(0), Some(Change::Doubled)), (None, None), (None, None)];
        let more = if board.markers().is_some() { doubled } else { grown };
        let passes = plain.into_iter().chain(more);
        let mut best_part: Option<Detection> = None;
        for (level, what) in passes.filter_map(|(level, what)| Some((level?, what))) {
            if best_part.is_some() && Some(level) != coarser {
                break;
            }
            if matches!(what, Some(Change::Grown(_))) && !may_be_grown(&best_miss) {
                break;
            }
            let halved = match what {
                Some(Change::Doubled) => Halved::doubled(),
                _ => Halved::whole(level),
            };
            self.expected.clear();
            if let Some(near) = search.near.filter(|near| near.names_corners) {
                self.expected.extend(near.corners_px.iter().map(|corner| halved.at(*corner)));
            }
            let found =
                self.search_level(image, (level, what), board, search.keep_on).and_then(|()| {
                    self.rough.clear();
                    let full_px = |corner: &Option<[f32; 2]>| corner.map(|at| halved.full_px(at));
                    self.rough.extend(self.corners.iter().map(full_px));
                    self.refiner.refine(image, board, &self.rough, &self.params, search.keep_on)
                });
            match found {
                Ok(detection) => {
                    let seen = seen_count(&detection.corners);
                    if seen == detection.corners.len() || board.markers().is_some() {
                        return Ok(detection);
                    }
                    if best_part.as_ref().is_none_or(|part| seen > seen_count(&part.corners)) {
                        best_part = Some(detection);
                    }
                }
                Err(Miss::OutOfTime) => return best_part.ok_or(Miss::OutOfTime),
                Err(miss) if closeness(&miss) > closeness(&best_miss) => best_miss = miss,
                Err(_) => {}
            }
        }
        if let Some(part) = best_part.filter(|_| !matches!(best_miss, Miss::OtherBoard { .. })) {
            return Ok(part);
        }
        let says_little =
            matches!(best_miss, Miss::NoBoard | Miss::PartialBoard { cut_off_by: None, .. });
        let clearer =
            says_little.then(|| self.clearer_reason(image, primary, search.near)).flatten();
        Err(clearer.unwrap_or(best_miss))
    }

    /// What the picture says, where no grid says why there is no board.
    fn clearer_reason(
        &mut self,
        image: &GrayImage,
        level: Option<usize>,
        near: Option<&Prediction>,
    ) -> Option<Miss> {
        let level = level?;
        let picture = if level == 0 { image } else { &self.levels[level - 1] };
        let halved = Halved::whole(level);
        let region = near.map(|near| {
            let ends = near.corners_px.iter().map(|corner| halved.at(*corner));
            let start = [f32::MAX, f32::MAX, 0.0, 0.0];
            let ends = ends.fold(start, |[left, top, right, bottom], [x, y]| {
                [left.min(x), top.min(y), right.max(x), bottom.max(y)]
            });
            ends.map(|end| end.max(0.0) as usize)
        });
        picture_quality::reason(picture, region, halved.scale, &mut self.edge_widths)
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

    /// As [`search_levels`](Self::search_levels), for boards with markers: the gap between corner and marker should hold
    /// the search ring, so the finest level comes first.
    fn fine_levels(&mut self, image: &GrayImage) -> [Option<usize>; 3] {
        let [primary, coarser, finer] = self.search_levels(image);
        if finer.is_some() { [finer, primary, coarser] } else { [primary, coarser, None] }
    }

    /// Searches one level, perhaps changed: response, junctions, grids, match. On success the
    /// corners are in `self.corners`: those of the whole board, or of the largest part.
    fn search_level(
        &mut self,
        image: &GrayImage,
        (level, what): (usize, Option<Change>),
        board: &Checkerboard,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<(), Miss> {
        let Self {
            params,
            levels,
            grown,
            grown_rows,
            response,
            peaks,
            junctions,
            grower,
            lattice,
            kept,
            corners,
            part,
            expected,
            ..
        } = self;
        let mut picture = if level == 0 { image } else { &levels[level - 1] };
        if let Some(what) = what {
            match what {
                Change::Grown(what) => grow(picture, what, grown_rows, grown),
                Change::Doubled => double(picture, grown),
            }
            picture = grown;
        }
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
        part.clear();
        if let Some(markers) = board.markers() {
            while grower.next_grid(junctions, params.max_seeds, limits, lattice).is_some() {
                if !keep_on() {
                    return Err(Miss::OutOfTime);
                }
                if lattice.len() < LEAST_MARKED_GRID {
                    continue;
                }
                match name_corners(picture, lattice, board, markers, corners) {
                    Ok(()) => return Ok(()),
                    Err(miss) if closeness(&miss) > closeness(&best_miss) => best_miss = miss,
                    Err(_) => {}
                }
            }
            return Err(best_miss);
        }
        let mut judge = |lattice: &mut Lattice| {
            let matched = match_board(picture, lattice, board, expected, corners);
            match matched {
                Ok(()) => {
                    let seen = |corners: &[Option<[f32; 2]>]| corners.iter().flatten().count();
                    if seen(corners) > seen(part) {
                        part.clone_from(corners);
                    }
                    seen(corners) == wanted
                }
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
        // Beside another board, a part of this one is probably something else.
        if part.is_empty() || matches!(best_miss, Miss::OtherBoard { .. }) {
            return Err(best_miss);
        }
        corners.clone_from(part);
        Ok(())
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

/// Whether squares that don't touch may be the reason.
fn may_be_grown(miss: &Miss) -> bool {
    match miss {
        Miss::NoBoard => true,
        Miss::PartialBoard { cut_off_by, .. } => cut_off_by.is_none(),
        Miss::Glare { .. } => true,
        _ => false,
    }
}

/// Rank of a miss by how much it tells; the highest one is reported.
fn closeness(miss: &Miss) -> usize {
    match *miss {
        Miss::NoBoard | Miss::OutOfTime => 0,
        // Many pictures without a board contain a few corners.
        Miss::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
        Miss::PartialBoard { found, .. } | Miss::Glare { found, .. } => found,
        Miss::OtherBoard { columns, rows } => columns * rows,
        Miss::OtherMarkers { markers } => 10 + markers,
        Miss::TooSmall { .. } | Miss::Blurred { .. } | Miss::LowContrast { .. } => 100_000,
    }
}
