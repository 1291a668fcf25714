//! What the runs say: medians, intervals, curves and words.

use super::{Course, Mark, Runs, STRATEGIES};
use crate::{
    chart::{Plot, Series},
    study::{
        outcome::{Claim, Figure, Outcome, Table, Verdict},
        params::Params,
        statistics::{median, median_interval, rms},
    },
};

/// Precision that a run is to reach.
const WANTED_PP_SD_PX: f64 = 1.0;
const WANTED_PROJECTION_SD_PX: f64 = 0.3;

/// A median over runs that may not all have arrived, and its 95 % interval.
struct Arrival {
    median: f64,
    low: f64,
    high: f64,
    arrived: usize,
}

fn arrival(
    runs: &[Vec<Mark>],
    reached: impl Fn(&Mark) -> bool,
    value: impl Fn(&Mark) -> f64,
) -> Arrival {
    let values: Vec<f64> = runs
        .iter()
        .map(|run| run.iter().find(|mark| reached(mark)).map_or(f64::INFINITY, &value))
        .collect();
    let arrived = values.iter().filter(|value| value.is_finite()).count();
    let (low, high) = median_interval(&values).unwrap_or((f64::INFINITY, f64::INFINITY));
    Arrival { median: median(&values).unwrap_or(f64::INFINITY), low, high, arrived }
}

/// Root mean square of an error after `views` views, and its 95 % interval for two coordinates a run.
fn rms_after(runs: &[Vec<Mark>], views: usize, value: impl Fn(&Mark) -> f64) -> (f64, f64) {
    let values: Vec<f64> = runs.iter().filter_map(|run| run.get(views - 1).map(&value)).collect();
    let rms = rms(&values).unwrap_or(f64::NAN);
    (rms, 1.96 * rms / (4.0 * values.len() as f64).sqrt())
}

/// Mean time a view that counts takes, over all `runs`; NaN without any.
fn pace_secs(runs: &[Vec<Mark>]) -> f64 {
    let last = || runs.iter().filter_map(|run| run.last());
    last().map(|mark| mark.secs).sum::<f64>() / last().map(|mark| mark.view as f64).sum::<f64>()
}

/// What strategies are ranked by; less is better.
type Value = fn(&Row) -> f64;

/// What is to be said where another strategy than ours is best: the best one's row, and ours.
type Remark = fn(&Row, &Row) -> String;

/// One strategy.
struct Row {
    code: &'static str,
    source: &'static str,
    /// Views and seconds.
    to_pp: [Arrival; 2],
    to_projection: [Arrival; 2],
    /// Of a view, with the right lens.
    pace_secs: f64,
    error_px: f64,
    bias_px: f64,
    bias_interval_px: f64,
}

/// The comparison of all parts.
pub fn outcome(params: &Params, parts: &[Runs]) -> Outcome {
    let mut table = Table::new(
        "guidance",
        &[
            "strategy",
            "source",
            "views to PP sd 1 px",
            "seconds to PP sd 1 px",
            "arrived",
            "views to projection sd 0.3 px",
            "seconds to projection sd 0.3 px",
            "arrived",
            "rms PP error, 8 views (px)",
            "PP bias, wrong lens, 8 views (px)",
            "±",
        ],
    );
    let mut tidy = Table::new(
        "guidance_marks",
        &[
            "strategy",
            "course",
            "run",
            "view",
            "secs",
            "pp_error_px",
            "f_error_px",
            "projection_error_px",
            "pp_sd_px",
            "projection_sd_px",
        ],
    );
    let find = |strategy: &str, course: usize| {
        parts
            .iter()
            .find(|part| part.strategy == strategy && part.course == Course::code_of(course))
    };
    for part in parts {
        for (index, run) in part.runs.iter().enumerate() {
            for (view, mark) in run.iter().enumerate() {
                tidy.push(&[
                    &part.strategy,
                    &part.course,
                    &index,
                    &(view + 1),
                    &mark.secs,
                    &mark.pp_error_px,
                    &mark.f_error_px,
                    &mark.projection_error_px,
                    &mark.pp_sd_px,
                    &mark.projection_sd_px,
                ]);
            }
        }
    }
    let mut rows: Vec<Row> = Vec::new();
    for strategy in &STRATEGIES {
        let (Some(right), Some(wrong)) = (find(strategy.code, 0), find(strategy.code, 1)) else {
            continue;
        };
        let pp = |mark: &Mark| mark.pp_sd_px <= WANTED_PP_SD_PX;
        let projection = |mark: &Mark| mark.projection_sd_px <= WANTED_PROJECTION_SD_PX;
        let views = |mark: &Mark| mark.view as f64;
        let secs = |mark: &Mark| mark.secs;
        let to_pp = [arrival(&right.runs, pp, views), arrival(&right.runs, pp, secs)];
        let to_projection =
            [arrival(&right.runs, projection, views), arrival(&right.runs, projection, secs)];
        let eight = |runs: &Runs| {
            // Plans of four views are judged by what they end with.
            let most = runs.runs.iter().map(Vec::len).max().unwrap_or(0).clamp(1, 8);
            rms_after(&runs.runs, most, |mark| mark.pp_error_px)
        };
        let (error, _) = eight(right);
        let (bias, bias_interval) = eight(wrong);
        rows.push(Row {
            code: strategy.code,
            source: strategy.source,
            to_pp,
            to_projection,
            pace_secs: pace_secs(&right.runs),
            error_px: error,
            bias_px: bias,
            bias_interval_px: bias_interval,
        });
    }
    let told = |arrival: &Arrival, digits: usize| {
        let text = |value: f64| {
            if value.is_finite() { format!("{value:.digits$}") } else { "never".into() }
        };
        format!("{} ({}–{})", text(arrival.median), text(arrival.low), text(arrival.high))
    };
    for row in &rows {
        table.push(&[
            &row.code,
            &row.source,
            &told(&row.to_pp[0], 0),
            &told(&row.to_pp[1], 0),
            &row.to_pp[0].arrived,
            &told(&row.to_projection[0], 0),
            &told(&row.to_projection[1], 0),
            &row.to_projection[0].arrived,
            &format!("{:.2}", row.error_px),
            &format!("{:.2}", row.bias_px),
            &format!("{:.2}", row.bias_interval_px),
        ]);
    }
    let ours = ["ours-quick", "ours-full", "ours-adaptive"];
    let best = |value: Value| {
        let least = rows.iter().min_by(|a, b| value(a).total_cmp(&value(b)));
        let own = rows
            .iter()
            .filter(|row| ours.contains(&row.code))
            .min_by(|a, b| value(a).total_cmp(&value(b)));
        least.zip(own)
    };
    let quantities: [(&str, Value, Remark); 5] = [
        ("views to PP sd 1 px", |row| row.to_pp[0].median, of_views),
        ("seconds to PP sd 1 px", |row| row.to_pp[1].median, of_seconds),
        ("views to mean projection sd 0.3 px", |row| row.to_projection[0].median, of_views),
        ("seconds to mean projection sd 0.3 px", |row| row.to_projection[1].median, of_seconds),
        ("PP error under a wrong lens model (px)", |row| row.bias_px, of_bias),
    ];
    let mut claims = Vec::new();
    for (what, value, remark) in quantities {
        let Some((best, own)) = best(value) else { continue };
        let (code, least, mine) = (best.code, value(best), value(own));
        let measured = if ours.contains(&code) {
            format!("Ours is best: {code}, {least:.2}.")
        } else {
            let remark = remark(best, own);
            format!("{code} is best with {least:.2}; ours, {}, has {mine:.2}. {remark}", own.code)
        };
        claims.push(Claim {
            claim: format!("Least {what}."),
            measured,
            verdict: if ours.contains(&code) {
                Verdict::Holds
            } else if mine <= 1.25 * least {
                Verdict::Partly
            } else {
                Verdict::Fails
            },
        });
    }
    let curve = |course: usize, value: &dyn Fn(&Mark) -> f64| -> Vec<Series> {
        STRATEGIES
            .iter()
            .filter_map(|strategy| {
                let part = find(strategy.code, course)?;
                let points = (1..=params.guidance_views.min(16))
                    .filter_map(|view| {
                        let values: Vec<f64> = part
                            .runs
                            .iter()
                            .filter_map(|run| run.get(view - 1).map(value))
                            .collect();
                        let enough = 2 * values.len() >= part.runs.len();
                        enough.then(|| median(&values).map(|m| (view as f64, m)))?
                    })
                    .collect();
                Some(Series::line(strategy.code, points))
            })
            .collect()
    };
    let figure =
        |name: &str, title: &str, y: &str, course: usize, value: &dyn Fn(&Mark) -> f64| Figure {
            name: name.into(),
            caption: "Median over the runs after each view that counts; logarithmic scale.".into(),
            svg: Plot { log_y: true, ..Plot::new(title, "views", y, curve(course, value)) }.svg(),
        };
    Outcome {
        name: "guidance".into(),
        title: "Strategies of guidance".into(),
        method: format!(
            "{} runs per strategy and lens, at most {} views each: 1920×1080, f = 1400 px, principal point up to 60 px off centre, 9×6 corners, corner noise {} px. A person misses each asked pose by up to 4° and 20 px, needs time to react, to move at 0.5 m/s and 60°/s and to hold still. The right lens has k1, k2 and is fitted with k1, k2; the wrong one has k1, k2, k3 and is fitted with k1 alone.",
            params.guidance_runs, params.guidance_views, params.noise_px
        ),
        claims,
        checks: Vec::new(),
        tables: vec![table, tidy],
        figures: vec![
            figure("guidance_pp_sd", "Stated sd of the principal point", "sd (px)", 0, &|mark| {
                mark.pp_sd_px
            }),
            figure(
                "guidance_projection",
                "Projection error against the truth",
                "error (px)",
                0,
                &|mark| mark.projection_error_px,
            ),
            figure("guidance_pp", "PP error, right lens model", "error (px)", 0, &|mark| {
                mark.pp_error_px
            }),
            figure("guidance_wrong", "PP error, wrong lens model", "error (px)", 1, &|mark| {
                mark.pp_error_px
            }),
        ],
    }
}

fn of_views(_: &Row, _: &Row) -> String {
    "A choice by information alone may ask for boards of up to 90 % of the picture anywhere in it; ours asks for 72 %, and for the mirrored place next, which is what keeps the principal point when the lens model is wrong.".into()
}

fn of_seconds(best: &Row, own: &Row) -> String {
    format!(
        "Over all runs a view that counts takes {:.2} s with {}, {:.2} s with {}.",
        best.pace_secs, best.code, own.pace_secs, own.code
    )
}

fn of_bias(_: &Row, _: &Row) -> String {
    "Reflected pairs cancel what a radial model leaves only about the principal point that is believed; boards that fill the whole picture leave less to cancel.".into()
}
