//! The stages in order.

use image::GrayImage;

use super::{
    Detection, Miss, Quality,
    board_match::{NumberedCorners, match_board},
    edge_model::{self, EdgeFit, RADIUS_LIMIT_PX},
    junction::{self, Junction},
    lattice::{Neighbourhood, grow_all},
    reduce::halve,
    response::{Peak, peaks, respond},
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
            min_square_px: 8.0,
            max_residual: 0.5,
        }
    }
}

/// Searches wider than this are left to half the size first.
const SEARCH_WIDTH_PX: u32 = 1000;

/// Finds boards. Keeps buffers between pictures, but nothing that could change a result.
#[derive(Clone, Debug)]
pub struct Detector {
    params: DetectorParams,
    /// `levels[0]` is half the picture.
    levels: Vec<GrayImage>,
    response: Vec<i16>,
    peaks: Vec<Peak>,
    junctions: Vec<Junction>,
    scratch: edge_model::Scratch,
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
        Self {
            params,
            levels: Vec::new(),
            response: Vec::new(),
            peaks: Vec::new(),
            junctions: Vec::new(),
            scratch: edge_model::Scratch::default(),
        }
    }

    /// Finds `board` in `image`. All of its corners, or a reason.
    ///
    /// # Errors
    ///
    /// [`Miss`]: of several reasons the one of the grid that came closest to the board.
    pub fn detect(&mut self, image: &GrayImage, board: &Checkerboard) -> Result<Detection, Miss> {
        let mut best_miss = Miss::NoBoard;
        for level in self.search_levels(image) {
            let picture = if level == 0 { image } else { &self.levels[level - 1] };
            match search(
                picture,
                board,
                &self.params,
                (&mut self.response, &mut self.peaks, &mut self.junctions),
            ) {
                Ok(corners) => {
                    let scale = f64::from(1_u32 << level);
                    let full: Vec<[f64; 2]> = corners
                        .iter()
                        .map(|corner| corner.map(|v| (f64::from(v) + 0.5) * scale - 0.5))
                        .collect();
                    match self.refine(image, board, &full) {
                        Ok(detection) => return Ok(detection),
                        Err(miss) => best_miss = miss,
                    }
                }
                Err(miss) if closeness(&miss) > closeness(&best_miss) => best_miss = miss,
                Err(_) => {}
            }
        }
        Err(best_miss)
    }

    /// Builds the halved pictures; the levels to search, most promising first.
    fn search_levels(&mut self, image: &GrayImage) -> Vec<usize> {
        let mut primary = 0;
        while image.width() >> primary > SEARCH_WIDTH_PX {
            primary += 1;
        }
        let coarsest = primary + 1;
        self.levels.resize_with(coarsest, GrayImage::default);
        for level in 0..coarsest {
            let (finer, coarser) = self.levels.split_at_mut(level);
            halve(finer.last().unwrap_or(image), &mut coarser[0]);
        }
        let mut order = vec![primary];
        if image.width() >> coarsest >= 160 {
            order.push(coarsest);
        }
        if primary > 0 {
            order.push(primary - 1);
        }
        order
    }

    /// Fits the edge model to every corner at full size, then checks that they form one lattice.
    fn refine(
        &mut self,
        image: &GrayImage,
        board: &Checkerboard,
        rough: &[[f64; 2]],
    ) -> Result<Detection, Miss> {
        let (columns, rows) = (board.columns(), board.rows());
        let limit = self.params.max_residual;
        let mut shortest_px = f64::MAX;
        let mut fits: Vec<Option<EdgeFit>> = Vec::with_capacity(rough.len());
        for index in 0..rough.len() {
            let window = Window::around(rough, columns, index);
            shortest_px = shortest_px.min(window.side_px);
            fits.push(window.fit(image, rough[index], limit, None, &mut self.scratch));
        }
        let usual_blur_px = median(fits.iter().flatten().map(|fit| fit.blur_px));
        // Where blur hides a small square's edges from one fit, its neighbours tell where to look again.
        for index in 0..rough.len() {
            let Some(expected) = expected_px(&fits, columns, index) else { continue };
            let window = Window::around(rough, columns, index);
            let allowed_px = 0.08 * window.side_px + 0.3;
            let off_px = |fit: &EdgeFit| {
                (fit.corner.px.x - expected[0]).hypot(fit.corner.px.y - expected[1])
            };
            if fits[index].as_ref().is_none_or(|fit| off_px(fit) > allowed_px) {
                let again = [None, usual_blur_px].into_iter().find_map(|known_blur_px| {
                    window
                        .fit(image, expected, limit, known_blur_px, &mut self.scratch)
                        .filter(|fit| off_px(fit) <= allowed_px)
                });
                if again.is_some() {
                    fits[index] = again;
                }
            }
        }
        let fits: Vec<EdgeFit> = fits.into_iter().flatten().collect();
        let needed_px = self.params.min_square_px;
        if shortest_px < needed_px {
            return Err(Miss::TooSmall { square_px: shortest_px, needed_px });
        }
        let (found, wanted) = (fits.len(), rough.len());
        if found < wanted {
            return Err(Miss::PartialBoard { found, wanted, cut_off_by: None });
        }
        let middle = |value: fn(&EdgeFit) -> f64| median(fits.iter().map(value)).unwrap_or(0.0);
        let (blur_px, contrast) = (middle(|fit| fit.blur_px), middle(|fit| fit.contrast));
        if contrast < self.params.min_contrast {
            return Err(Miss::LowContrast { contrast, needed: self.params.min_contrast });
        }
        if blur_px > self.params.max_blur_px {
            return Err(Miss::Blurred { blur_px, limit_px: self.params.max_blur_px });
        }
        if !smooth(&fits, columns, rows) {
            return Err(Miss::NoBoard);
        }
        let clipped = fits.iter().filter(|fit| fit.light >= 252.0).count();
        let quality = Quality { blur_px, contrast, glare: clipped as f64 / wanted as f64 };
        Ok(Detection { corners: fits.into_iter().map(|fit| fit.corner).collect(), quality })
    }
}

/// One level: response, junctions, grids, the known board.
fn search(
    picture: &GrayImage,
    board: &Checkerboard,
    params: &DetectorParams,
    buffers: (&mut Vec<i16>, &mut Vec<Peak>, &mut Vec<Junction>),
) -> Result<NumberedCorners, Miss> {
    let (response, candidates, junctions) = buffers;
    respond(picture, response);
    let limit = params.max_candidates;
    peaks(response, picture.width() as usize, params.min_response, limit, candidates);
    junctions.clear();
    junctions.extend(candidates.iter().filter_map(|peak| junction::read(picture, peak)));
    let near = Neighbourhood::new(junctions, picture.width(), picture.height());
    let largest = 4 * board.corner_count() + 200;
    let mut best_miss = Miss::NoBoard;
    for lattice in grow_all(&near, params.max_seeds, largest).into_iter().take(4) {
        match match_board(picture, lattice, board) {
            Ok(corners) => return Ok(corners),
            Err(miss) if closeness(&miss) > closeness(&best_miss) => best_miss = miss,
            Err(_) => {}
        }
    }
    Err(best_miss)
}

/// How much a miss says; the person hears the one that says most.
fn closeness(miss: &Miss) -> usize {
    match *miss {
        Miss::NoBoard | Miss::OutOfTime => 0,
        // A few corners are found in many pictures without a board.
        Miss::PartialBoard { found, wanted, .. } if 4 * found < wanted || found < 9 => 0,
        Miss::PartialBoard { found, .. } => found,
        Miss::OtherBoard { columns, rows } => 1000 + columns * rows,
        Miss::TooSmall { .. } | Miss::Blurred { .. } | Miss::LowContrast { .. } => 100_000,
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Where and how large to fit.
struct Window {
    axes_px: [[f64; 2]; 2],
    side_px: f64,
}

impl Window {
    /// Local axes and the side of the squares around a corner of the rough grid.
    fn around(rough: &[[f64; 2]], columns: usize, index: usize) -> Self {
        let rows = rough.len() / columns;
        let (column, row) = (index % columns, index / columns);
        let at = |column: usize, row: usize| rough[row * columns + column];
        let (left, right) = (column.saturating_sub(1), (column + 1).min(columns - 1));
        let (above, below) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let per_square = |from: [f64; 2], to: [f64; 2], steps: usize| {
            [(to[0] - from[0]) / steps as f64, (to[1] - from[1]) / steps as f64]
        };
        let u = per_square(at(left, row), at(right, row), right - left);
        let v = per_square(at(column, above), at(column, below), below - above);
        let (long, wide) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
        // The disc must stay inside the four squares around the corner, sheared as they are.
        let height = (u[0] * v[1] - u[1] * v[0]).abs() / long.max(wide).max(1e-9);
        Self { axes_px: [u, v], side_px: long.min(wide).min(height) }
    }

    fn fit(
        &self,
        image: &GrayImage,
        start: [f64; 2],
        max_residual: f64,
        known_blur_px: Option<f64>,
        scratch: &mut edge_model::Scratch,
    ) -> Option<EdgeFit> {
        let to_edge = |at: f64, size: u32| at.min(f64::from(size) - 1.0 - at);
        let room_px = to_edge(start[0], image.width()).min(to_edge(start[1], image.height()));
        let widest = RADIUS_LIMIT_PX.min((room_px - 1.0) as i32).max(3);
        let radius_px = ((0.45 * self.side_px).round() as i32).clamp(3, widest);
        edge_model::fit(image, start, self.axes_px, radius_px, known_blur_px, scratch)
            .filter(|fit| fit.residual <= max_residual)
    }
}

/// Where the fitted neighbours in row and column put a corner; `None` without enough of them.
fn expected_px(fits: &[Option<EdgeFit>], columns: usize, index: usize) -> Option<[f64; 2]> {
    let rows = fits.len() / columns;
    let (column, row) = ((index % columns) as isize, (index / columns) as isize);
    let at = |dc: isize, dr: isize| {
        let (column, row) = (column + dc, row + dr);
        let inside = (0..columns as isize).contains(&column) && (0..rows as isize).contains(&row);
        let fit = inside.then(|| fits[row as usize * columns + column as usize].as_ref())??;
        Some([fit.corner.px.x, fit.corner.px.y])
    };
    // Cubic between neighbours, parabolic beyond them; straight where there are too few for that.
    let along = |dc: isize, dr: isize| -> Option<([f64; 2], f64)> {
        let near = |step: isize| at(step * dc, step * dr);
        let mix = |terms: &[(f64, [f64; 2])]| {
            terms.iter().fold([0.0, 0.0], |sum, (w, p)| [sum[0] + w * p[0], sum[1] + w * p[1]])
        };
        if let (Some(before), Some(after)) = (near(-1), near(1)) {
            return Some(match (near(-2), near(2)) {
                (Some(first), Some(last)) => (
                    mix(&[
                        (-1.0 / 6.0, first),
                        (4.0 / 6.0, before),
                        (4.0 / 6.0, after),
                        (-1.0 / 6.0, last),
                    ]),
                    4.0,
                ),
                _ => (mix(&[(0.5, before), (0.5, after)]), 2.0),
            });
        }
        [1, -1].into_iter().find_map(|way| {
            let (one, two) = (near(way)?, near(2 * way)?);
            Some(match near(3 * way) {
                Some(three) => (mix(&[(3.0, one), (-3.0, two), (1.0, three)]), 1.0),
                None => (mix(&[(2.0, one), (-1.0, two)]), 0.5),
            })
        })
    };
    let guesses = [along(1, 0), along(0, 1)];
    let weight: f64 = guesses.iter().flatten().map(|(_, weight)| weight).sum();
    (weight > 0.0).then(|| {
        guesses.iter().flatten().fold([0.0, 0.0], |sum, (guess, w)| {
            [sum[0] + guess[0] * w / weight, sum[1] + guess[1] * w / weight]
        })
    })
}

/// Whether every corner lies where its neighbours in row and column put it: within a tenth of a square
/// of the curve through them. May only drop a board.
fn smooth(fits: &[EdgeFit], columns: usize, rows: usize) -> bool {
    let at = |column: usize, row: usize| fits[row * columns + column].corner.px;
    let bends = |line: &[nalgebra::Point2<f64>]| {
        line.windows(4).all(|p| {
            let step = (p[2] - p[1]).norm();
            // Third difference: zero for any parabola.
            let off = (p[3].coords - p[0].coords) - (p[2].coords - p[1].coords) * 3.0;
            off.norm() < 0.35 * step + 0.5
        })
    };
    (0..rows).all(|row| bends(&(0..columns).map(|column| at(column, row)).collect::<Vec<_>>()))
        && (0..columns)
            .all(|column| bends(&(0..rows).map(|row| at(column, row)).collect::<Vec<_>>()))
}
