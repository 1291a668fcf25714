//! What is known of the picture: each part by the uncertainty of projection against the goal, and
//! by the boards that were there.

use std::sync::Arc;

use nalgebra::Point2;

use boresight_calibrate::Calibration;
use boresight_formats::CalibrationFile;
use boresight_geometry::{
    BoardOutline, GRID_COLUMNS, GRID_ROWS, cell_centres_px, frame::ImageSize,
};
use boresight_guide::session::{Snapshot, ViewSummary};

use crate::{
    goal::Goal,
    grade::Grade,
    text::{knows_sd, result as words},
};

/// Brightness of a part of the picture that no board has reached.
const UNSEEN: f32 = 0.44;
/// Brightness of a part that boards have reached, and that misses the goal.
const SEEN: f32 = 0.68;
/// Width of the margin from dim to bright.
const EDGE: f32 = 0.25;
/// Cells of the border for each cell of the map, along a side.
const FINER: usize = 4;
const COLUMNS: usize = GRID_COLUMNS as usize;
const ROWS: usize = GRID_ROWS as usize;

/// A map over the picture, bilinear between the middles of its cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Logarithm of the goal over the typical error, per cell: above zero where the goal is met.
    margin: Vec<f32>,
    /// 1 where a board was, else 0.
    seen: Vec<f32>,
    /// Lines around the part where [`Self::margin`] is above zero, in shares of the picture.
    border: Vec<[[f32; 2]; 2]>,
    /// The goal, once there are errors to hold to it.
    goal: Option<Goal>,
}

/// What a map is made from: views, calibration, and goal in pixels.
type MadeFrom = (Arc<[ViewSummary]>, Option<Arc<Calibration>>, f64);

/// The newest map of a session: made again only if views, calibration or goal have changed.
#[derive(Debug, Default)]
pub struct NewestKnown {
    of: Option<MadeFrom>,
    known: Option<Arc<Known>>,
}

impl NewestKnown {
    /// As [`Known::of`].
    pub fn of(&mut self, snapshot: &Snapshot) -> Option<Arc<Known>> {
        let goal_px = snapshot.limits.stop_projection_sigma_px;
        let is_same = self.of.as_ref().is_some_and(|(views, calibration, goal_before_px)| {
            let ours = calibration.as_ref().map(Arc::as_ptr);
            Arc::ptr_eq(views, &snapshot.views)
                && ours == snapshot.calibration.as_ref().map(Arc::as_ptr)
                && goal_px.total_cmp(goal_before_px).is_eq()
        });
        if !is_same {
            self.of = Some((Arc::clone(&snapshot.views), snapshot.calibration.clone(), goal_px));
            self.known = Known::of(snapshot).map(Arc::new);
        }
        self.known.clone()
    }
}

impl Known {
    /// Map of a session. `None` before its first view.
    pub fn of(snapshot: &Snapshot) -> Option<Self> {
        let calibration = snapshot.calibration.as_deref();
        let outlines: Vec<BoardOutline> = match calibration {
            // As its file has them.
            Some(it) => it.outlines(&snapshot.setup.board).into_iter().flatten().collect(),
            None => snapshot.views.iter().filter_map(|view| view.outline).collect(),
        };
        let calibration = calibration.filter(|it| is_believed(it));
        let goal = calibration.map(|it| Goal::of(it, snapshot.limits.stop_projection_sigma_px));
        let cells = calibration.into_iter().flat_map(|it| &it.projection_sd.grid);
        let cells = cells.map(|cell| (cell.px, cell.sd_px));
        let image_size = snapshot.setup.image_size;
        (!outlines.is_empty()).then(|| Self::by(image_size, &outlines, cells, goal))
    }

    /// Map of a calibration in a file. `None` without standard deviations, and for a result that
    /// isn't trustworthy.
    pub fn of_file(file: &CalibrationFile) -> Option<Self> {
        let projection = file.projection_sd_px.as_ref().filter(|map| !map.grid.is_empty())?;
        let goal = Goal::of_file(file).filter(|_| Grade::of_file(file) != Grade::NotTrustworthy)?;
        goal.reached?;
        let outlines: Vec<BoardOutline> =
            file.used().filter_map(|(_, view)| BoardOutline::around(view.outline()?)).collect();
        let cells = projection.grid.iter().map(|[x, y, sd_px]| (Point2::new(*x, *y), *sd_px));
        let [width_px, height_px] = file.image_size.map(|side| side.max(1));
        Some(Self::by(ImageSize { width_px, height_px }, &outlines, cells, Some(goal)))
    }

    /// Map by the places of boards, and by the typical errors at the middles of cells, in pixels.
    fn by(
        image_size: ImageSize,
        outlines: &[BoardOutline],
        sds_px: impl Iterator<Item = (Point2<f64>, f64)>,
        goal: Option<Goal>,
    ) -> Self {
        let mut margin = vec![-1.0; COLUMNS * ROWS];
        let goal_px = goal.as_ref().map_or(0.0, |goal| goal.place_px).max(0.0);
        for (px, sd_px) in sds_px {
            let met = libm::log(goal_px / sd_px.max(1e-9)).clamp(-1.0, 1.0);
            margin[cell_at(image_size, &px)] = met as f32;
        }
        let is_seen = |px| f32::from(u8::from(outlines.iter().any(|it| it.covers(&px))));
        let seen = cell_centres_px(image_size).map(is_seen).collect();
        let mut known = Self { margin, seen, border: Vec::new(), goal };
        known.border = known.traced();
        known
    }

    /// Goal that the map holds the picture to. `None` while no error is known.
    pub fn goal(&self) -> Option<&Goal> {
        self.goal.as_ref()
    }

    /// Share of the picture that meets the goal, in words. `None` while no error is known.
    pub fn met(&self) -> Option<String> {
        let goal = self.goal.as_ref()?;
        Some(words::met(self.share(), &goal.said()))
    }

    /// True if the goal is met and a board was in the cell of `px`, in a picture of `image_size`.
    pub fn is_met(&self, image_size: ImageSize, px: &Point2<f64>) -> bool {
        let cell = cell_at(image_size, px);
        self.margin[cell] >= 0.0 && self.seen[cell] > 0.5
    }

    /// Lines around the part where [`Self::margin`] is above zero, in shares of the picture.
    pub fn border(&self) -> &[[[f32; 2]; 2]] {
        &self.border
    }

    fn traced(&self) -> Vec<[[f32; 2]; 2]> {
        let [columns, rows] = [COLUMNS * FINER, ROWS * FINER];
        let mut lines = Vec::new();
        for cell in 0..columns * rows {
            let (column, row) = (cell % columns, cell / columns);
            let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| {
                let at = [(column + x) as f32 / columns as f32, (row + y) as f32 / rows as f32];
                (at, self.margin(at))
            });
            let sides = (0..4).map(|side| (corners[side], corners[(side + 1) % 4]));
            let crossings = sides.filter(|((_, a), (_, b))| (*a < 0.0) != (*b < 0.0));
            let crossings = crossings.map(|((from, a), (to, b))| {
                let share = a / (a - b);
                [0, 1].map(|axis: usize| from[axis] + share * (to[axis] - from[axis]))
            });
            lines.extend(
                crossings.collect::<Vec<_>>().chunks_exact(2).map(|ends| [ends[0], ends[1]]),
            );
        }
        lines
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

/// Cell of the map with the pixel `px`.
fn cell_at(image_size: ImageSize, px: &Point2<f64>) -> usize {
    let cell = |px: f64, side_px: u32, count: usize| {
        (((px + 0.5) / f64::from(side_px.max(1)) * count as f64) as usize).min(count - 1)
    };
    cell(px.y, image_size.height_px, ROWS) * COLUMNS + cell(px.x, image_size.width_px, COLUMNS)
}

/// True if the uncertainty of `calibration` is known, and nothing says that it's wrong.
fn is_believed(calibration: &Calibration) -> bool {
    knows_sd(calibration) && Grade::of(calibration) != Grade::NotTrustworthy
}
