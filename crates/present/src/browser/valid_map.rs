//! Map of the part of the picture that meets the goal, for a page.

use serde::Serialize;

use crate::{known::Known, text::result::met_in_green};
use boresight_calibrate::Calibration;

/// Uncertainty of projection over the picture, against the goal.
#[derive(Clone, Debug, Serialize)]
pub struct ValidMap {
    /// x, y and standard deviation at each cell's centre, in pixels; 1 where the goal is met and a
    /// board was, else 0.
    pub cells: Vec<[f64; 4]>,
    /// Legend of the colours.
    pub legend: String,
}

impl ValidMap {
    /// Map of `calibration` by what is known of the picture; `None` while its uncertainty isn't.
    pub fn of(calibration: &Calibration, known: &Known) -> Option<Self> {
        // Fewer digits, for slow links.
        let short = |px: f64| (1e4 * px).round() / 1e4;
        let cells = calibration.projection_sd.grid.iter().map(|cell| {
            let is_met = f64::from(u8::from(known.is_met(calibration.image_size, &cell.px)));
            [cell.px.x, cell.px.y, cell.sd_px, is_met].map(short)
        });
        Some(Self { legend: met_in_green(&known.met()?), cells: cells.collect() })
    }
}
