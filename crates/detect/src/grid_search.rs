//! Searches a picture for the board: junctions, grids of them, and the matching grid.

use image::GrayImage;

use super::{
    board_match::{count_board, is_no_part, match_board},
    colours::{Cells, cells},
    complete::prune,
    explain::{GridOutcome, WeighedGrid},
    grow::{Grower, Limits},
    junction::{self, Junction},
    lattice::Lattice,
    marked_board::{LEAST_OTHER, name_corners},
    marker_cells::Polarity,
    marker_votes::{Verdict, place, read_markers, votes},
    missing::Behind,
    outcome::{Miss, OtherBoard},
    params::DetectorParams,
    response::{Peak, peaks as find_peaks, respond},
    track::Expected,
};
use boresight_geometry::{boards::Board, markers::Markers};

/// Most grids tried with most of the board (a tiled wall has no end of them), and most smaller
/// ones; and least size.
const MOST_GRIDS: usize = 4;
const LEAST_GRID: usize = 6;
/// Least size of a grid for reading markers.
const LEAST_MARKED_GRID: usize = 4;
/// Side of a marker's cells, in pixels of the full-size picture, below which readings are
/// unreliable.
const LEAST_CELL_PX: f64 = 2.5;
/// Longest side of a counted board, and most corners.
const LONGEST_COUNTED: usize = 40;
const MOST_COUNTED: usize = 1000;

/// Finds the board in a picture, to about a pixel. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct GridSearch {
    response: Vec<i16>,
    peaks: Vec<Peak>,
    junctions: Vec<Junction>,
    grower: Grower,
    lattice: Lattice,
    /// Grids with less than most of the board, largest first.
    kept: Vec<Lattice>,
    corners: Vec<Option<[f32; 2]>>,
    /// Largest part of the board so far.
    part: Vec<Option<[f32; 2]>>,
    /// Corners of the grid with the reason of the last search.
    pub(super) closest: Vec<[f32; 2]>,
    /// Mean length of its squares' longer sides.
    pub(super) closest_side_px: f64,
    /// Weighed grids, if requested.
    pub(super) weighed: Option<Vec<WeighedGrid>>,
}

impl GridSearch {
    /// Corners found by [`find`](Self::find): of the whole board, or of the largest part, row by
    /// row in pixels of the searched picture; `None` for unseen corners.
    pub(super) fn corners(&self) -> &[Option<[f32; 2]>] {
        &self.corners
    }

    /// Searches `picture` for `board`. The picture is the `plain` one, perhaps with dark or light
    /// squares grown; a pixel is `full_px` wide in the full-size picture. The `expected` corners
    /// identify a part of a board. Returns the polarity of the board's markers, if any.
    ///
    /// # Errors
    ///
    /// [`Miss`] of the grid closest to the board.
    pub(super) fn find(
        &mut self,
        (picture, plain, full_px): (&GrayImage, &GrayImage, f64),
        board: &Board,
        params: &DetectorParams,
        expected: &Expected,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Polarity, Miss> {
        self.start(picture, params);
        self.closest.clear();
        self.closest_side_px = f64::INFINITY;
        if !keep_on() {
            return Err(Miss::OutOfTime);
        }
        match board.markers() {
            None => {
                self.match_grids([picture, plain], board, params.max_seeds, expected, keep_on)?;
                Ok(Polarity::Positive)
            }
            Some(markers) => {
                self.read_grids((picture, full_px), (board, markers), params.max_seeds, keep_on)
            }
        }
    }

    /// Counts the inner corners in the started `picture` of any whole board surrounded by white.
    pub(super) fn count(
        &mut self,
        picture: &GrayImage,
        params: &DetectorParams,
    ) -> Option<OtherBoard> {
        let Self { junctions, grower, lattice, .. } = self;
        grower.start(junctions, picture.width(), picture.height());
        let limits = Limits { longest: LONGEST_COUNTED, largest: MOST_COUNTED, longer: 1.0 };
        while grower.next_grid(junctions, params.max_seeds, limits, lattice).is_some() {
            let counted = count_board(picture, lattice, LONGEST_COUNTED);
            if counted.is_some() && cells(picture, lattice) == Cells::Squares {
                return counted;
            }
        }
        None
    }

    /// Checks that the `corners` of a whole board without markers, row by row in pixels of
    /// `picture`, are all of the pattern. Corners without a position are left out.
    ///
    /// # Errors
    ///
    /// [`Miss`] if they are a part of a larger pattern.
    pub(super) fn check_whole(
        &mut self,
        picture: &GrayImage,
        board: &Board,
        corners: impl Iterator<Item = [f32; 2]>,
    ) -> Result<(), Miss> {
        let columns = board.columns();
        self.lattice.clear(grid_limits(board).longest);
        for (index, at) in corners.enumerate().filter(|(_, at)| at[0].is_finite()) {
            self.lattice.insert(((index % columns) as i32, (index / columns) as i32), at);
        }
        if cells(picture, &self.lattice) != Cells::Squares {
            return Err(Miss::NoBoard);
        }
        is_no_part(picture, &mut self.lattice)
    }

    /// First of `others` whose markers are in one of the largest grids of the started `picture`;
    /// all have steps alike, and boards of the same cells come together. True if there's any grid.
    pub(super) fn read_others(
        &mut self,
        picture: &GrayImage,
        others: &[(OtherBoard, Board)],
        params: &DetectorParams,
    ) -> (bool, Option<OtherBoard>) {
        let Self { junctions, grower, lattice, kept, .. } = self;
        let Some((_, first)) = others.first() else { return (false, None) };
        let limits = grid_limits(first);
        grower.start(junctions, picture.width(), picture.height());
        clear(kept, limits);
        while grower.next_grid(junctions, params.max_seeds, limits, lattice).is_some() {
            keep(kept, lattice);
        }
        for lattice in kept.iter_mut().filter(|lattice| lattice.len() >= LEAST_MARKED_GRID) {
            prune(lattice);
            let mut read = (None, Vec::new());
            for (other, board) in others {
                let Some(markers) = board.markers() else { continue };
                let cells = Some((markers.cells(), markers.side_squares));
                if read.0 != cells {
                    read = (cells, read_markers(picture, lattice, markers));
                }
                let is_seen = match place(&read.1, lattice, board, markers, [Behind::default(); 4])
                {
                    Verdict::Clear(_) | Verdict::Ambiguous(_) | Verdict::OtherSquares => true,
                    // Tags are in no other grid.
                    Verdict::Unexplained => {
                        let sure = read.1.iter().filter(|reading| reading.is_sure).count();
                        *other == OtherBoard::AprilGrid && sure >= LEAST_OTHER
                    }
                };
                if is_seen {
                    return (true, Some(*other));
                }
            }
        }
        (kept.iter().any(|lattice| lattice.len() > 0), None)
    }

    /// Finds the junctions of `picture`.
    pub(super) fn start(&mut self, picture: &GrayImage, params: &DetectorParams) {
        let (width, height) = picture.dimensions();
        let response = respond(picture, &mut self.response);
        let limits = (params.min_response, params.max_candidates);
        find_peaks(response, width as usize, limits.0, limits.1, &mut self.peaks);
        self.junctions.clear();
        self.junctions.extend(self.peaks.iter().filter_map(|peak| junction::read(picture, peak)));
        self.grower.start(&self.junctions, width, height);
    }

    /// Finds the first grid placed on the board by markers.
    fn read_grids(
        &mut self,
        (picture, full_px): (&GrayImage, f64),
        (board, markers): (&Board, Markers),
        max_seeds: usize,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<Polarity, Miss> {
        let Self { junctions, grower, lattice, corners, closest, closest_side_px, weighed, .. } =
            self;
        let limits = grid_limits(board);
        let mut best_miss = Miss::NoBoard;
        while grower.next_grid(junctions, max_seeds, limits, lattice).is_some() {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            if lattice.len() < LEAST_MARKED_GRID {
                continue;
            }
            let square_px = lattice.mean_height() * full_px;
            prune(lattice);
            let readings = read_markers(picture, lattice, markers);
            let says = weighed.as_ref().map(|_| votes(&readings, lattice, board, markers));
            let named = name_corners(picture, lattice, &readings, board, markers, corners)
                .map_err(|miss| or_too_small(miss, markers, square_px));
            if let Some((weighed, says)) = weighed.as_mut().zip(says) {
                let outcome = outcome_of(named.map(|_| &**corners));
                weighed.push(WeighedGrid::marked(lattice, says, outcome));
            }
            match named {
                Ok(polarity) => return Ok(polarity),
                // A smaller piece of that other board may have only markers shared with ours.
                Err(miss @ Miss::OtherSquares { .. }) => return Err(miss),
                Err(miss) if miss.is_closer_than(best_miss) => {
                    best_miss = miss;
                    lattice.write(closest);
                    *closest_side_px = lattice.mean_length();
                }
                Err(_) => {}
            }
        }
        Err(best_miss)
    }

    /// Finds the first grid of the whole board, or the largest part.
    fn match_grids(
        &mut self,
        [picture, plain]: [&GrayImage; 2],
        board: &Board,
        max_seeds: usize,
        expected: &Expected,
        keep_on: &dyn Fn() -> bool,
    ) -> Result<(), Miss> {
        let Self { junctions, grower, lattice, kept, corners, part, closest, weighed, .. } = self;
        let closest_side_px = &mut self.closest_side_px;
        let (wanted, limits) = (board.corner_count(), grid_limits(board));
        clear(kept, limits);
        part.clear();
        let mut best_miss = Miss::NoBoard;
        let mut is_whole = |lattice: &mut Lattice| {
            let cells = cells(plain, lattice);
            let matched = match cells {
                Cells::Squares => match_board(picture, lattice, board, expected, corners),
                Cells::Discs | Cells::Several => Err(Miss::NoBoard),
            };
            if let Some(weighed) = weighed.as_mut().filter(|_| lattice.len() > 0) {
                let outcome = outcome_of(matched.map(|()| &**corners));
                let outcome = if cells == Cells::Discs { GridOutcome::Circles } else { outcome };
                weighed.push(WeighedGrid::of(picture, lattice, board, expected, outcome));
            }
            if let Err(miss) = matched {
                if miss.is_closer_than(best_miss) {
                    best_miss = miss;
                    lattice.write(closest);
                    *closest_side_px = lattice.mean_length();
                }
                return false;
            }
            let seen = |corners: &[Option<[f32; 2]>]| corners.iter().flatten().count();
            if seen(corners) > seen(part) {
                part.clone_from(corners);
            }
            seen(corners) == wanted
        };
        let mut large = 0;
        while grower.next_grid(junctions, max_seeds, limits, lattice).is_some() {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            // A grid with most of the board is judged at once; smaller ones wait for a better grid.
            if 4 * lattice.len() >= 3 * wanted && large < MOST_GRIDS {
                large += 1;
                if is_whole(lattice) {
                    return Ok(());
                }
            } else {
                keep(kept, lattice);
            }
        }
        for lattice in kept.iter_mut().filter(|lattice| lattice.len() >= LEAST_GRID) {
            if !keep_on() {
                return Err(Miss::OutOfTime);
            }
            if is_whole(lattice) {
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

fn clear(kept: &mut Vec<Lattice>, limits: Limits) {
    kept.resize_with(MOST_GRIDS, Lattice::default);
    kept.iter_mut().for_each(|lattice| lattice.clear(limits.longest));
}

/// Exchanges the grid for a smaller one of `kept`, largest first.
fn keep(kept: &mut [Lattice], lattice: &mut Lattice) {
    if let Some(place) = kept.iter().position(|kept| kept.len() < lattice.len()) {
        kept[place..].rotate_right(1);
        std::mem::swap(&mut kept[place], lattice);
    }
}

/// Outcome of a grid with the given corners of the board.
fn outcome_of(corners: Result<&[Option<[f32; 2]>], Miss>) -> GridOutcome {
    match corners {
        Ok(corners) => GridOutcome::Named(corners.iter().flatten().count()),
        Err(miss) => GridOutcome::Missed(miss),
    }
}

/// Limits of a grid for `board`.
fn grid_limits(board: &Board) -> Limits {
    let [one, other] = board.target().steps_m();
    Limits {
        longest: board.columns().max(board.rows()),
        largest: 3 * board.corner_count() + 100,
        longer: (one / other) as f32,
    }
}

/// Replaces [`Miss::OtherMarkers`] by [`Miss::TooSmall`] if the markers are too small to read.
fn or_too_small(miss: Miss, markers: Markers, square_px: f64) -> Miss {
    let needed_px = LEAST_CELL_PX / (markers.cell_side() * markers.square_steps);
    match miss {
        Miss::OtherMarkers { markers: 1.. } if square_px < needed_px => {
            Miss::TooSmall { square_px, needed_px }
        }
        miss => miss,
    }
}
