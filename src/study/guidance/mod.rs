//! What is each way of guiding a person worth?
//!
//! The same simulated person, camera, corner noise and budget of views for every strategy. After each view
//! that counts the lens is adjusted and compared with the truth. Two lenses: one that the model fits, and one
//! that is more than the model.

mod race;
mod strategy;

pub use race::{Course, Mark, run};
pub use strategy::{STRATEGIES, Situation, Strategy};

use serde::{Deserialize, Serialize};

use super::{
    outcome::{Check, Claim, Figure, Outcome, Table, Verdict, Within},
    parallel,
    params::Params,
    plot::{Plot, Series},
};

/// Precision that a run is to reach.
const WANTED_PP_SD_PX: f64 = 1.0;
const WANTED_PROJECTION_SD_PX: f64 = 0.3;

/// All runs of one strategy on one course.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// [`Strategy::code`].
    pub strategy: String,
    /// [`Course::code`].
    pub course: String,
    /// Marks of each run, one a view.
    pub runs: Vec<Vec<Mark>>,
}

/// Parts of the comparison: strategy and course by index.
pub fn parts() -> Vec<(usize, usize)> {
    let strategies = 0..STRATEGIES.len();
    strategies
        .flat_map(|strategy| (0..Course::COUNT).map(move |course| (strategy, course)))
        .collect()
}

/// Runs one part; `done` is told of each finished run, from any thread.
pub fn runs(params: &Params, part: (usize, usize), done: &(dyn Fn() + Sync)) -> Option<Runs> {
    let strategy = STRATEGIES.get(part.0)?;
    let code = Course::code_of(part.1);
    let runs = parallel::map(params.guidance_runs, |index| {
        let course = Course::random(part.1, params, index as u64);
        let marks = run(&course, strategy, params, index as u64);
        done();
        marks
    });
    Some(Runs { strategy: strategy.code.into(), course: code.into(), runs })
}

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
    // Quantiles between runs that arrived and runs that did not are "not".
    let median = parallel::median(&values).filter(|m| !m.is_nan()).unwrap_or(f64::INFINITY);
    let (low, high) = parallel::median_interval(&values).unwrap_or((f64::INFINITY, f64::INFINITY));
    let sure = |value: f64| if value.is_nan() { f64::INFINITY } else { value };
    Arrival { median, low: sure(low), high: sure(high), arrived }
}

/// Root mean square of an error after `views` views, and its 95 % interval for two coordinates a run.
fn rms_after(runs: &[Vec<Mark>], views: usize, value: impl Fn(&Mark) -> f64) -> (f64, f64, usize) {
    let values: Vec<f64> = runs.iter().filter_map(|run| run.get(views - 1).map(&value)).collect();
    let count = values.len();
    let rms = (values.iter().map(|v| v * v).sum::<f64>() / count.max(1) as f64).sqrt();
    (rms, 1.96 * rms / (4.0 * count.max(1) as f64).sqrt(), count)
}

/// The comparison of all parts.
pub fn outcome(params: &Params, parts: &[Runs]) -> Outcome {
    let mut table = Table::new(
        "guidance",
        &[
            "strategy",
            "source",
            "views to PP sd 1 px",
            "95 %",
            "seconds",
            "95 %",
            "views to projection sd 0.3 px",
            "95 %",
            "seconds",
            "95 %",
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
    let mut rows = Vec::new();
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
        let (error, _, _) = eight(right);
        let (bias, bias_interval, _) = eight(wrong);
        rows.push((strategy.code, to_pp, to_projection, error, bias, bias_interval));
    }
    let told = |arrival: &Arrival, digits: usize| {
        if arrival.median.is_finite() {
            format!("{:.*}", digits, arrival.median)
        } else {
            "not reached".into()
        }
    };
    let range = |arrival: &Arrival, digits: usize| {
        let end = |value: f64| {
            if value.is_finite() { format!("{:.*}", digits, value) } else { "never".into() }
        };
        format!("{}–{} ({} arrived)", end(arrival.low), end(arrival.high), arrival.arrived)
    };
    for ((code, pp, projection, error, bias, interval), strategy) in
        rows.iter().filter_map(|row| Some((row, STRATEGIES.iter().find(|s| s.code == row.0)?)))
    {
        table.push(&[
            code,
            &strategy.source,
            &told(&pp[0], 0),
            &range(&pp[0], 0),
            &told(&pp[1], 0),
            &range(&pp[1], 0),
            &told(&projection[0], 0),
            &range(&projection[0], 0),
            &told(&projection[1], 0),
            &range(&projection[1], 0),
            &format!("{error:.2}"),
            &format!("{bias:.2}"),
            &format!("{interval:.2}"),
        ]);
    }
    let ours = ["ours-quick", "ours-full", "ours-adaptive"];
    let best =
        |value: &dyn Fn(&(&'static str, [Arrival; 2], [Arrival; 2], f64, f64, f64)) -> f64| {
            let least = rows.iter().min_by(|a, b| value(a).total_cmp(&value(b)));
            let own = rows
                .iter()
                .filter(|row| ours.contains(&row.0))
                .min_by(|a, b| value(a).total_cmp(&value(b)));
            least.zip(own).map(|(least, own)| (least.0, value(least), own.0, value(own)))
        };
    let quantities: [(
        &str,
        &dyn Fn(&(&'static str, [Arrival; 2], [Arrival; 2], f64, f64, f64)) -> f64,
    ); 5] = [
        ("views to PP sd 1 px", &|row| row.1[0].median),
        ("seconds to PP sd 1 px", &|row| row.1[1].median),
        ("views to mean projection sd 0.3 px", &|row| row.2[0].median),
        ("seconds to mean projection sd 0.3 px", &|row| row.2[1].median),
        ("PP error under a wrong lens model (px)", &|row| row.4),
    ];
    let mut claims = Vec::new();
    for (what, value) in quantities {
        let Some((code, least, own, mine)) = best(value) else { continue };
        let measured = if ours.contains(&code) {
            format!("Ours is best: {code}, {least:.2}.")
        } else {
            format!("{code} is best with {least:.2}; ours, {own}, has {mine:.2}. {}", why(what))
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
                        enough.then(|| parallel::median(&values).map(|m| (view as f64, m)))?
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
    let known = [("ours-full", 2.0), ("hand-held", 14.0)];
    let checks = known
        .into_iter()
        .filter_map(|(code, reference)| {
            let row = rows.iter().find(|row| row.0 == code)?;
            Some(Check {
                what: format!("{code}: views to PP sd 1 px, five intrinsics (METHOD section 3)"),
                reference,
                measured: row.1[0].median,
                within: Within::Share(0.5, 0.5),
            })
        })
        .collect();
    Outcome {
        name: "guidance".into(),
        title: "Strategies of guidance".into(),
        method: format!(
            "{} runs per strategy and lens, at most {} views each: 1920×1080, f = 1400 px, principal point up to 60 px off centre, 9×6 corners, corner noise {} px. A person misses each asked pose by up to 4° and 20 px, needs time to react, to move at 0.5 m/s and 60°/s and to hold still. The right lens has k1, k2 and is fitted with k1, k2; the wrong one has k1, k2, k3 and is fitted with k1 alone.",
            params.guidance_runs, params.guidance_views, params.noise_px
        ),
        claims,
        checks,
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

/// Why ours is not best at something.
fn why(what: &str) -> &'static str {
    if what.contains("wrong") {
        "Reflected pairs cancel what a radial model leaves only about the principal point that is believed; boards that fill the whole picture leave less to cancel."
    } else if what.contains("seconds") {
        "Ours asks for a board at the opposite side each time, and refuses views that add no direction: each view costs more movement."
    } else {
        "Strategies that choose each view for its information alone are not bound to come in reflected pairs; the pair is what protects against a wrong lens model."
    }
}
