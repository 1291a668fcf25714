//! Medians and intervals of the results of a strategy with a hand.

use serde::{Deserialize, Serialize};

use super::{
    course::{Course, WANTED_PROJECTION_SD_PX, wanted_pp_sd_px},
    estimate::Errors,
    race::Mark,
    strategy::Strategy,
};
use crate::{
    params::Hand,
    statistics::{median, median_interval, rms},
};

/// Numbers of views for comparing the strategies.
pub(super) const COMPARED_AFTER: [usize; 2] = [4, 8];

/// All runs of a strategy on a course with a hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// [`Strategy::code`].
    pub strategy: String,
    /// Code from [`Course::CODES`].
    pub course: String,
    /// Hand of the person.
    pub hand: Hand,
    /// Marks of each run, per view.
    pub runs: Vec<Vec<Mark>>,
}

/// Median over runs, some possibly without arrival, with the 95 % interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    pub(super) median: f64,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) arrived: usize,
}

/// Root mean square with half the width of the 95 % interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    pub(super) rms: f64,
    pub(super) interval: f64,
}

/// Results after a number of views from [`COMPARED_AFTER`].
#[derive(Clone, Copy, Debug)]
pub(super) struct After {
    /// Median stated deviations, right model; `None` if fewer than half of the runs got so far.
    pub(super) pp_sd_px: Option<f64>,
    pub(super) projection_sd_px: Option<f64>,
    /// PP error with the model of each course.
    pub(super) fitted: [Option<Spread>; 3],
    /// PP error with the model chosen by BIC.
    pub(super) calibrated: [Option<Spread>; 3],
    /// Median stated PP deviation of the program, right lens: model doubt included.
    pub(super) calibrated_pp_sd_px: Option<f64>,
}

/// Summary of a strategy with a hand.
#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) strategy: &'static Strategy,
    pub(super) hand: Hand,
    /// Views, then seconds.
    pub(super) to_pp: [Arrival; 2],
    pub(super) to_projection: [Arrival; 2],
    pub(super) after: [After; 2],
    /// Views and seconds until the program's stop rule, for ours only.
    pub(super) complete: Option<[Arrival; 2]>,
    /// Seconds and tries per counted view, with the right lens.
    pub(super) secs_per_view: f64,
    pub(super) tries_per_view: f64,
    /// Mean share of the picture spanned by a view.
    pub(super) span_fraction: f64,
}

impl Row {
    /// Row of `strategy` with `hand`. `None` if a part is missing.
    pub(super) fn of(parts: &[Runs], strategy: &'static Strategy, hand: Hand) -> Option<Self> {
        let mut courses = Vec::with_capacity(Course::CODES.len());
        for course in 0..Course::CODES.len() {
            courses.push(find(parts, strategy.code, course, hand)?);
        }
        let right: &[Vec<Mark>] = &courses[0].runs;
        let pp = |mark: &Mark| mark.fitted.pp_sd_px <= wanted_pp_sd_px();
        let projection = |mark: &Mark| mark.fitted.projection_sd_px <= WANTED_PROJECTION_SD_PX;
        let both = |reached: &dyn Fn(&Mark) -> bool| {
            [
                arrival(right, reached, &|mark| mark.view as f64),
                arrival(right, reached, &|mark| mark.secs),
            ]
        };
        let marks = || right.iter().flatten();
        let last = |value: fn(&Mark) -> f64| -> f64 {
            right.iter().filter_map(|run| run.last()).map(value).sum::<f64>()
                / marks().count() as f64
        };
        Some(Self {
            strategy,
            hand,
            to_pp: both(&pp),
            to_projection: both(&projection),
            after: COMPARED_AFTER.map(|views| After {
                pp_sd_px: median_after(right, views, |mark| Some(mark.fitted.pp_sd_px)),
                projection_sd_px: median_after(right, views, |mark| {
                    Some(mark.fitted.projection_sd_px)
                }),
                fitted: [0, 1, 2]
                    .map(|course| pp_error(&courses[course].runs, views, |mark| Some(mark.fitted))),
                calibrated: [0, 1, 2]
                    .map(|course| pp_error(&courses[course].runs, views, |mark| mark.calibrated)),
                calibrated_pp_sd_px: median_after(right, views, |mark| {
                    mark.calibrated.map(|errors| errors.pp_sd_px)
                }),
            }),
            complete: strategy.is_ours().then(|| both(&|mark| mark.complete)),
            secs_per_view: last(|mark| mark.secs),
            tries_per_view: last(|mark| mark.tries as f64),
            span_fraction: marks().map(|mark| mark.span_fraction).sum::<f64>()
                / marks().count() as f64,
        })
    }
}

/// Part of `strategy` on a course with `hand`.
pub(super) fn find<'a>(
    parts: &'a [Runs],
    strategy: &str,
    course: usize,
    hand: Hand,
) -> Option<&'a Runs> {
    let code = *Course::CODES.get(course)?;
    parts.iter().find(|p| p.strategy == strategy && p.course == code && p.hand == hand)
}

fn arrival(
    runs: &[Vec<Mark>],
    reached: &dyn Fn(&Mark) -> bool,
    value: &dyn Fn(&Mark) -> f64,
) -> Arrival {
    let values: Vec<f64> = runs
        .iter()
        .map(|run| run.iter().find(|mark| reached(mark)).map_or(f64::INFINITY, value))
        .collect();
    let arrived = values.iter().filter(|value| value.is_finite()).count();
    let (low, high) = median_interval(&values).unwrap_or((f64::INFINITY, f64::INFINITY));
    Arrival { median: median(&values).unwrap_or(f64::INFINITY), low, high, arrived }
}

/// Values of all runs after `views` views. `None` if fewer than half of the runs have a value.
fn values_after(
    runs: &[Vec<Mark>],
    views: usize,
    value: impl Fn(&Mark) -> Option<f64>,
) -> Option<Vec<f64>> {
    let values: Vec<f64> = runs
        .iter()
        .filter_map(|run| run.iter().find(|mark| mark.view == views))
        .filter_map(value)
        .collect();
    (2 * values.len() >= runs.len()).then_some(values)
}

/// Median of a value after `views` views; see [`values_after`].
pub(super) fn median_after(
    runs: &[Vec<Mark>],
    views: usize,
    value: impl Fn(&Mark) -> Option<f64>,
) -> Option<f64> {
    median(&values_after(runs, views, value)?)
}

/// Maximum counted error: beyond it the lens is useless, and a single such run must not hide the
/// others.
const USELESS_PX: f64 = 100.0;

/// Root mean square of the PP error after `views` views, with the 95 % interval for two coordinates
/// per run.
fn pp_error(
    runs: &[Vec<Mark>],
    views: usize,
    errors: impl Fn(&Mark) -> Option<Errors>,
) -> Option<Spread> {
    let values = values_after(runs, views, |mark| {
        errors(mark).map(|errors| errors.pp_error_px.min(USELESS_PX))
    })?;
    let rms = rms(&values)?;
    Some(Spread { rms, interval: 1.96 * rms / (4.0 * values.len() as f64).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(sds: &[f64]) -> Vec<Mark> {
        let mark = |(i, sd): (usize, &f64)| Mark {
            view: i + 1,
            secs: 2.0 * (i + 1) as f64,
            fitted: Errors { pp_sd_px: *sd, pp_error_px: *sd, ..Errors::default() },
            ..Mark::default()
        };
        sds.iter().enumerate().map(mark).collect()
    }

    #[test]
    fn arrivals_count_views_and_runs_that_never_arrive() {
        let runs = [marks(&[3.0, 0.9]), marks(&[0.5]), marks(&[4.0, 3.0])];
        let reached = |mark: &Mark| mark.fitted.pp_sd_px <= 1.0;
        let views = arrival(&runs, &reached, &|mark| mark.view as f64);
        assert_eq!((views.median, views.arrived), (2.0, 2));
        assert_eq!(views.high, f64::INFINITY);
        assert_eq!(arrival(&runs, &reached, &|mark| mark.secs).median, 4.0);
    }

    #[test]
    fn nothing_is_said_of_views_that_most_runs_do_not_have() {
        let runs = [marks(&[3.0, 4.0]), marks(&[1.0]), marks(&[5.0])];
        assert!(pp_error(&runs, 2, |mark| Some(mark.fitted)).is_none());
        let first = pp_error(&runs, 1, |mark| Some(mark.fitted)).expect("all have one");
        assert!((first.rms - (35.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!((first.interval / first.rms - 1.96 / 12.0_f64.sqrt()).abs() < 1e-12);
        assert!(pp_error(&runs, 1, |mark| mark.calibrated).is_none());
    }
}
