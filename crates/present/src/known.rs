//! What is known of the picture: each part by the uncertainty of projection against the goal, and
//! by the boards that were there.

use nalgebra::Point2;

use boresight_calibrate::Calibration;
use boresight_geometry::{
    BoardOutline, GRID_COLUMNS, GRID_ROWS, cell_centres_px, frame::ImageSize,
};
use boresight_guide::{guidance::GuidanceParams, session::Snapshot};

use crate::{grade::Grade, reading::valid_up_to_px, text::knows_sd};

/// Brightness of a part of the picture that no board has reached.
const UNSEEN: f32 = 0.44;
/// Brightness of a part that boards have reached, and that misses the goal.
const SEEN: f32 = 0.68;
/// Width of the margin from dim to bright.
const EDGE: f32 = 0.25;
const COLUMNS: usize = GRID_COLUMNS as usize;
const ROWS: usize = GRID_ROWS as usize;

/// A map over the picture, bilinear between the middles of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Logarithm of the goal over the typical error, per cell: above zero where the goal is met.
    margin: Vec<f32>,
    /// 1 where a board was, else 0.
    seen: Vec<f32>,
}

impl Known {
    /// Map of a session. `None` before its first view.
    pub fn of(snapshot: &Snapshot) -> Option<Self> {
        let outlines: Vec<BoardOutline> =
            snapshot.views.iter().filter_map(|view| view.outline).collect();
        let calibration = snapshot.calibration.as_deref().filter(|it| is_believed(it));
        let goal_px = calibration.map_or(0.0, |it| goal_sd_px(it, &snapshot.limits));
        let cells = calibration.into_iter().flat_map(|it| &it.projection_sd.grid);
        let cells = cells.map(|cell| (cell.px, cell.sd_px));
        let image_size = snapshot.setup.image_size;
        (!outlines.is_empty()).then(|| Self::by(image_size, &outlines, cells, goal_px))
    }

    /// Map by the places of boards, and by the typical errors at the middles of cells, in pixels.
    pub fn by(
        image_size: ImageSize,
        outlines: &[BoardOutline],
        sds_px: impl Iterator<Item = (Point2<f64>, f64)>,
        goal_px: f64,
    ) -> Self {
        let mut margin = vec![-1.0; COLUMNS * ROWS];
        let cell = |px: f64, side_px: u32, count: usize| {
            (((px + 0.5) / f64::from(side_px) * count as f64) as usize).min(count - 1)
        };
        for (px, sd_px) in sds_px {
            let column = cell(px.x, image_size.width_px, COLUMNS);
            let row = cell(px.y, image_size.height_px, ROWS);
            let met = libm::log(goal_px / sd_px.max(1e-9)).clamp(-1.0, 1.0);
            margin[row * COLUMNS + column] = met as f32;
        }
        let is_seen = |px| f32::from(u8::from(outlines.iter().any(|it| it.covers(&px))));
        Self { margin, seen: cell_centres_px(image_size).map(is_seen).collect() }
    }

    /// Value of a map at a place, in shares of the picture.
    fn between(cells: &[f32], [x, y]: [f32; 2]) -> f32 {
        let place = |share: f32, count: usize| {
            let at = (share * count as f32 - 0.5).clamp(0.0, (count - 1) as f32);
            let first = (at as usize).min(count - 2);
            (first, at - first as f32)
        };
        let ((column, across), (row, down)) = (place(x, COLUMNS), place(y, ROWS));
        let at = |row: usize| {
            let from = cells[row * COLUMNS + column];
            from + across * (cells[row * COLUMNS + column + 1] - from)
        };
        at(row) + down * (at(row + 1) - at(row))
    }

    /// Above zero where the goal is met and a board was: what's stated elsewhere rests on the lens
    /// model alone. `at` is in shares of the picture.
    pub fn margin(&self, at: [f32; 2]) -> f32 {
        Self::between(&self.margin, at).min(Self::between(&self.seen, at) - 0.5)
    }

    /// True if a board was at a place, in shares of the picture.
    pub fn is_seen(&self, at: [f32; 2]) -> bool {
        Self::between(&self.seen, at) > 0.5
    }

    /// Brightness of the picture at a place, in shares of the picture: 1 where [`Self::margin`] is
    /// well above zero.
    pub fn brightness(&self, at: [f32; 2]) -> f32 {
        let dim = UNSEEN + (SEEN - UNSEEN) * Self::between(&self.seen, at);
        dim + (1.0 - dim) * (0.5 + self.margin(at) / EDGE).clamp(0.0, 1.0)
    }

    /// Share of the cells where the goal is met and a board was.
    pub fn share(&self) -> f64 {
        let cells = self.margin.iter().zip(&self.seen);
        cells.filter(|(margin, seen)| **margin >= 0.0 && **seen > 0.5).count() as f64
            / self.margin.len() as f64
    }
}

/// Typical error that meets the goal, in pixels.
fn goal_sd_px(calibration: &Calibration, guidance: &GuidanceParams) -> f64 {
    if calibration.acceptance.is_none() {
        return guidance.stop_projection_sigma_px;
    }
    let sds_px = calibration.projection_sd.grid.iter().map(|cell| cell.sd_px);
    valid_up_to_px(sds_px, calibration.valid_area.share)
}

/// True if the uncertainty of `calibration` is known, and nothing says that it's wrong.
fn is_believed(calibration: &Calibration) -> bool {
    knows_sd(calibration) && Grade::of(calibration) != Grade::NotTrustworthy
}
