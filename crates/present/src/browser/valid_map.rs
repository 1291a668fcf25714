//! Map of the valid area of the picture, for a page.

use serde::Serialize;

use crate::{
    reading::valid_up_to_px,
    text::{knows_sd, report::within_goal},
};
use boresight_calibrate::Calibration;

/// Uncertainty of projection over the picture, against the goal.
#[derive(Clone, Debug, Serialize)]
pub struct ValidMap {
    /// x, y and standard deviation at each cell's centre, in pixels.
    pub cells: Vec<[f64; 3]>,
    /// Largest standard deviation that meets the goal, in pixels.
    pub valid_px: f64,
    /// Legend of the colours.
    pub legend: String,
}

impl ValidMap {
    /// Map of `calibration`; `None` while too few views determine its uncertainty.
    pub fn of(calibration: &Calibration) -> Option<Self> {
        let (sd, area) = (&calibration.projection_sd, &calibration.valid_area);
        // Fewer digits, for slow links.
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
