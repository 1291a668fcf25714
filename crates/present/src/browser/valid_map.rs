//! Where the picture is known well enough, as a page draws it.

use serde::Serialize;

use crate::{
    reading::valid_up_to_px,
    text::{knows_sd, report::within_goal},
};
use boresight_calibrate::Calibration;

/// The uncertainty of projection over the picture, against the goal.
#[derive(Clone, Debug, Serialize)]
pub struct ValidMap {
    /// x, y and standard deviation of each cell's middle, in pixels.
    pub cells: Vec<[f64; 3]>,
    /// Cells up to this standard deviation meet the goal, in pixels.
    pub valid_px: f64,
    /// What the colours mean.
    pub legend: String,
}

impl ValidMap {
    /// Of `calibration`; `None` while too few views tell its uncertainty.
    pub fn of(calibration: &Calibration) -> Option<Self> {
        let (sd, area) = (&calibration.projection_sd, &calibration.valid_area);
        // As many digits as somebody sees, for slow links.
        let short = |px: f64| (1e4 * px).round() / 1e4;
        let sds_px = sd.grid.iter().map(|cell| cell.sd_px);
        knows_sd(calibration).then(|| Self {
            // JSON has no infinity.
            valid_px: short(valid_up_to_px(sds_px, area.share).max(0.0)),
            cells: sd
                .grid
                .iter()
                .map(|cell| [cell.px.x, cell.px.y, cell.sd_px].map(short))
                .collect(),
            legend: within_goal(area.goal_px, area.share),
        })
    }
}
