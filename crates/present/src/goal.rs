//! Goal of a result: the person's, in the person's unit, as one value for every surface.

use boresight_calibrate::{AcceptanceGoal, Calibration, DEFAULT_TYPICAL_GOAL_PX};
use boresight_formats::CalibrationFile;

use crate::{
    reading::valid_up_to_px,
    text::{acceptance::small, is_sd_known},
};

/// Largest accepted error, with the error that was reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// Largest accepted error.
    pub limit: f64,
    /// Unit of errors: `px` or `mm`.
    pub unit: &'static str,
    /// True if the error is the 95 % bound, false if it's the typical one.
    pub is_bound: bool,
    /// The result's error; `None` while unknown.
    pub reached: Option<f64>,
    /// Largest typical error of a place in the picture that meets the goal, in pixels.
    pub place_px: f64,
}

/// A goal set for the result: limit, unit and reached bound.
type Judged = (f64, &'static str, Option<f64>);

/// What a result says of errors, in pixels.
struct Errors {
    mean_px: f64,
    max_px: f64,
    sds_px: Vec<f64>,
    /// Share of the picture within a goal in pixels.
    share: f64,
    is_known: bool,
}

impl Goal {
    /// Goal of `calibration`: the one that was set for it, else `typical_px` for the typical error.
    pub fn of(calibration: &Calibration, typical_px: f64) -> Self {
        let judged = calibration.acceptance.as_ref().map(|judged| {
            let (scale, unit) = match judged.goal {
                AcceptanceGoal::Projection { .. } => (1.0, "px"),
                AcceptanceGoal::Length { .. } => (1e3, "mm"),
            };
            let bound = judged.bound.as_ref().map(|bound| scale * bound.total);
            (scale * judged.goal.limit(), unit, bound)
        });
        let sd = &calibration.projection_sd;
        let codes = calibration.findings.iter().map(|finding| finding.code.code());
        let errors = Errors {
            mean_px: sd.mean_px,
            max_px: sd.max_px,
            sds_px: sd.grid.iter().map(|place| place.sd_px).collect(),
            share: calibration.valid_area.share,
            is_known: is_sd_known(codes),
        };
        Self::by(judged, typical_px, errors)
    }

    /// The same of a calibration in a file; `None` if the file states no uncertainty.
    pub fn of_file(file: &CalibrationFile) -> Option<Self> {
        let sd = file.projection_sd_px.as_ref()?;
        let judged = file.acceptance.as_ref().map(|judged| {
            (judged.limit, if judged.unit == "mm" { "mm" } else { "px" }, judged.bound)
        });
        let errors = Errors {
            mean_px: sd.mean,
            max_px: sd.max,
            sds_px: sd.grid.iter().map(|[_, _, sd_px]| *sd_px).collect(),
            share: file.valid_area.as_ref().map_or(0.0, |area| area.share),
            is_known: is_sd_known(file.findings.iter().map(|finding| finding.code.as_str())),
        };
        let typical_px = file.typical_goal_px.unwrap_or(DEFAULT_TYPICAL_GOAL_PX);
        Some(Self::by(judged, typical_px, errors))
    }

    fn by(judged: Option<Judged>, typical_px: f64, errors: Errors) -> Self {
        let (limit, unit, reached) = judged.unwrap_or((typical_px, "px", Some(errors.mean_px)));
        let place_px = match judged {
            None => typical_px,
            Some((_, "px", _)) => valid_up_to_px(errors.sds_px, errors.share),
            // Errors of a length grow with those of its ends.
            Some((limit, _, bound)) => {
                bound.map_or(f64::NEG_INFINITY, |bound| errors.max_px * limit / bound)
            }
        };
        let reached = reached.filter(|reached| errors.is_known && reached.is_finite());
        Self { limit, unit, is_bound: judged.is_some(), reached, place_px }
    }

    /// True if the reached error is known and within the limit.
    pub fn is_met(&self) -> bool {
        self.reached.is_some_and(|reached| reached <= self.limit)
    }

    /// Largest accepted error, with its unit.
    pub fn said(&self) -> String {
        format!("{} {}", small(self.limit), self.unit)
    }
}
