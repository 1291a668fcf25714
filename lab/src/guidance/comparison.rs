//! The comparison of all runs as tables and figures.

use super::{
    claims::{claims, times_the_limit},
    course::{Course, F_PX, IMAGE_SIZE, planned_margin_px, seen_margin_px},
    limit::{Limit, limits},
    race::Mark,
    strategy::STRATEGIES,
    summary::{Arrival, COMPARED_AFTER, Row, Runs, Spread, find, median_after},
};
use crate::{
    outcome::{Figure, Outcome, Table},
    params::{Hand, Params},
};
use boresight_guide::guidance::GuidanceParams;
use boresight_present::chart::{Plot, Series};

/// Comparison of all parts.
pub fn outcome(params: &Params, parts: &[Runs]) -> Outcome {
    let limits = limits(params.noise_px, GuidanceParams::default().hold_secs);
    let rows = |hand: Hand| -> Vec<Row> {
        STRATEGIES.iter().filter_map(|strategy| Row::of(parts, strategy, hand)).collect()
    };
    let by_hand: Vec<Vec<Row>> = params.guidance_hands.iter().map(|hand| rows(*hand)).collect();
    let all = || by_hand.iter().flatten();
    Outcome {
        name: "guidance".into(),
        title: "Strategies of guidance".into(),
        method: method(params),
        claims: by_hand.iter().flat_map(|rows| claims(rows, &limits)).collect(),
        checks: Vec::new(),
        tables: vec![
            effort_table(all(), &limits),
            lens_table(all()),
            limit_table(&limits),
            marks_table(parts),
        ],
        figures: params
            .guidance_hands
            .iter()
            .flat_map(|hand| figures(params, parts, *hand, &limits))
            .collect(),
    }
}

fn method(params: &Params) -> String {
    let words: Vec<String> = params.guidance_hands.iter().map(|hand| words(*hand)).collect();
    format!(
        "{} runs per strategy, lens and hand, at most {} views each: {}×{}, f = {F_PX} px, principal point up to 60 px off centre, 9×6 corners, corner noise {} px. For every strategy alike, a board is found if all its corners lie {:.0} px inside the picture; all plan on {:.0} px, hold a view for {:.1} s, and pay for reacting, moving (0.5 m/s), tilting (60°/s), turning in the plane (45°/s) and aligning. A refused view costs as much as one that counts. {} Lenses: {}. After four and eight views the lens is also calibrated as the program does it, its model chosen by BIC. Stated deviations are those of the right model, fitted with it; doubt about the model, which the program adds, makes them larger. Errors of the principal point are root mean squares; one beyond 100 px counts as 100 px. Peers take a view by the rules of their sources; where those search fewer or smaller poses, they get the better of the two.",
        params.guidance_runs,
        params.guidance_views,
        IMAGE_SIZE.width_px,
        IMAGE_SIZE.height_px,
        params.noise_px,
        seen_margin_px(),
        planned_margin_px(),
        GuidanceParams::default().hold_secs,
        words.join(" "),
        Course::WORDS.join("; "),
    )
}

fn words(hand: Hand) -> String {
    match hand {
        Hand::Screen => "The screen hand matches the ghost in the picture, misses it by up to 4°, 20 px and 4 % of the distance, and steps back 5 % when a corner is cut.",
        Hand::Metric => "The metric hand goes to the pose that the believed lens computes, with the same errors.",
        Hand::Clumsy => "The clumsy hand matches the ghost in the picture and misses it by up to 10°, 10 % of the width and 15 % of the distance.",
    }
    .into()
}

fn arrived(arrival: &Arrival, digits: usize) -> String {
    let text = |value: f64| {
        if value.is_finite() { format!("{value:.digits$}") } else { "never".into() }
    };
    format!("{} ({}–{})", text(arrival.median), text(arrival.low), text(arrival.high))
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), |value| format!("{value:.2}"))
}

fn effort_table<'a>(rows: impl Iterator<Item = &'a Row>, limits: &[Limit]) -> Table {
    let mut table = Table::new(
        "guidance",
        &[
            "hand",
            "strategy",
            "source",
            "views to PP sd 1 px",
            "seconds to PP sd 1 px",
            "arrived",
            "views to projection sd 0.3 px",
            "seconds to projection sd 0.3 px",
            "arrived",
            "PP sd, 4 views (px)",
            "projection sd, 4 views (px)",
            "× limit",
            "PP sd, 8 views (px)",
            "projection sd, 8 views (px)",
            "× limit",
            "views until it stops",
            "seconds until it stops",
            "s per view",
            "tries per view",
        ],
    );
    for row in rows {
        let [four, eight] = &row.after;
        let stops = |which: usize, digits: usize| {
            row.complete
                .as_ref()
                .map_or_else(|| "–".into(), |complete| arrived(&complete[which], digits))
        };
        table.push(&[
            &row.hand.code(),
            &row.strategy.code,
            &row.strategy.source,
            &arrived(&row.to_pp[0], 0),
            &arrived(&row.to_pp[1], 1),
            &row.to_pp[0].arrived,
            &arrived(&row.to_projection[0], 0),
            &arrived(&row.to_projection[1], 1),
            &row.to_projection[0].arrived,
            &number(four.pp_sd_px),
            &number(four.projection_sd_px),
            &number(times_the_limit(row, 0, limits)),
            &number(eight.pp_sd_px),
            &number(eight.projection_sd_px),
            &number(times_the_limit(row, 1, limits)),
            &stops(0, 0),
            &stops(1, 1),
            &number(Some(row.secs_per_view).filter(|secs| secs.is_finite())),
            &number(Some(row.tries_per_view).filter(|tries| tries.is_finite())),
        ]);
    }
    table
}

fn lens_table<'a>(rows: impl Iterator<Item = &'a Row>) -> Table {
    let mut columns = vec!["hand".to_string(), "strategy".into()];
    for views in COMPARED_AFTER {
        for lens in Course::WORDS {
            columns.push(format!("PP error, {views} views; {lens} (px)"));
        }
        for code in Course::CODES {
            columns.push(format!("PP error, {views} views; {code} lens, BIC (px)"));
        }
        columns.push(format!("PP sd stated, {views} views; right lens, BIC (px)"));
    }
    let names: Vec<&str> = columns.iter().map(String::as_str).collect();
    let mut table = Table::new("guidance_lenses", &names);
    let spread = |spread: Option<Spread>| {
        spread.map_or_else(|| "–".into(), |s| format!("{:.2} ±{:.2}", s.rms, s.interval))
    };
    for row in rows {
        let mut cells = vec![row.hand.code().to_string(), row.strategy.code.into()];
        for after in &row.after {
            cells.extend(after.fitted.iter().chain(&after.calibrated).map(|s| spread(*s)));
            cells.push(number(after.calibrated_pp_sd_px));
        }
        table.rows.push(cells);
    }
    table
}

fn limit_table(limits: &[Limit]) -> Table {
    let mut table = Table::new(
        "guidance_limit",
        &[
            "views",
            "PP sd (px)",
            "projection sd (px)",
            "seconds, no pose missed",
            "design: direction/tilt/turn at x, y; span",
        ],
    );
    for limit in limits {
        let design: Vec<String> = limit
            .design
            .iter()
            .map(|pose| {
                format!(
                    "{:.0}°/{:.0}°/{:.0}° at {:.2}, {:.2}; {:.0} %",
                    pose.slot_rad.to_degrees(),
                    pose.tilt_rad.to_degrees(),
                    pose.roll_rad.to_degrees(),
                    pose.centre[0],
                    pose.centre[1],
                    100.0 * pose.fill
                )
            })
            .collect();
        table.push(&[
            &limit.views,
            &format!("{:.3}", limit.pp_sd_px),
            &format!("{:.3}", limit.projection_sd_px),
            &format!("{:.1}", limit.secs),
            &design.join(" | "),
        ]);
    }
    table
}

fn marks_table(parts: &[Runs]) -> Table {
    let mut tidy = Table::new(
        "guidance_marks",
        &[
            "hand",
            "strategy",
            "lens",
            "run",
            "view",
            "secs",
            "tries",
            "span",
            "pp_error_px",
            "f_error_px",
            "projection_error_px",
            "pp_sd_px",
            "projection_sd_px",
            "bic_pp_error_px",
            "bic_projection_error_px",
            "bic_pp_sd_px",
            "bic_projection_sd_px",
            "complete",
        ],
    );
    for part in parts {
        for (index, run) in part.runs.iter().enumerate() {
            for mark in run {
                let bic =
                    |value: f64| mark.calibrated.map_or_else(String::new, |_| value.to_string());
                let calibrated = mark.calibrated.unwrap_or_default();
                tidy.push(&[
                    &part.hand.code(),
                    &part.strategy,
                    &part.course,
                    &index,
                    &mark.view,
                    &mark.secs,
                    &mark.tries,
                    &mark.span_fraction,
                    &mark.fitted.pp_error_px,
                    &mark.fitted.f_error_px,
                    &mark.fitted.projection_error_px,
                    &mark.fitted.pp_sd_px,
                    &mark.fitted.projection_sd_px,
                    &bic(calibrated.pp_error_px),
                    &bic(calibrated.projection_error_px),
                    &bic(calibrated.pp_sd_px),
                    &bic(calibrated.projection_sd_px),
                    &u8::from(mark.complete),
                ]);
            }
        }
    }
    tidy
}

fn figures(params: &Params, parts: &[Runs], hand: Hand, limits: &[Limit]) -> Vec<Figure> {
    let curves = |course: usize, value: fn(&Mark) -> f64| -> Vec<Series> {
        STRATEGIES
            .iter()
            .filter_map(|strategy| {
                let part = find(parts, strategy.code, course, hand)?;
                let points = (1..=params.guidance_views.min(16))
                    .filter_map(|view| {
                        let median = median_after(&part.runs, view, |mark| Some(value(mark)))?;
                        Some((view as f64, median))
                    })
                    .collect();
                Some(Series::line(strategy.code, points))
            })
            .collect()
    };
    let limit = |value: fn(&Limit) -> f64| {
        Series::line(
            "limit",
            limits.iter().map(|limit| (limit.views as f64, value(limit))).collect(),
        )
    };
    let figure = |name: &str, title: &str, y: &str, series: Vec<Series>, caption: &str| Figure {
        name: format!("guidance_{name}_{}", hand.code()),
        caption: format!(
            "{} hand. Median over the runs after each view that counts; logarithmic scale. {caption}",
            hand.code()
        ),
        svg: Plot {
            log_y: true,
            ..Plot::new(&format!("{title}, {} hand", hand.code()), "views", y, series)
        }
        .svg(),
    };
    let (mut pp_sd, mut projection_sd) =
        (curves(0, |mark| mark.fitted.pp_sd_px), curves(0, |mark| mark.fitted.projection_sd_px));
    pp_sd.push(limit(|limit| limit.pp_sd_px));
    projection_sd.push(limit(|limit| limit.projection_sd_px));
    let stated = "Stated with the right model, k1 and k2, and without doubt about it. The limit is the best set of poses that a search finds; no strategy can lie far below it.";
    vec![
        figure("pp_sd", "Stated PP sd", "sd (px)", pp_sd, stated),
        figure("projection_sd", "Stated projection sd", "sd (px)", projection_sd, stated),
        figure(
            "k3",
            "PP error, k3 lens fitted with k1",
            "error (px)",
            curves(1, |mark| mark.fitted.pp_error_px),
            "The lens has k1, k2, k3 and is fitted with k1 alone.",
        ),
        figure(
            "fov",
            "PP error, field-of-view lens",
            "error (px)",
            curves(2, |mark| mark.fitted.pp_error_px),
            "The lens is from a different model family and is fitted with k1 and k2.",
        ),
    ]
}
