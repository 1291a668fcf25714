//! Estimates with views left out: dependence of the result on single views.

use nalgebra::{Isometry3, Point2};

use super::{
    Report,
    line::unweighted_line,
    number::plain,
    section::{figure, missing},
};
use crate::{
    chart::{Axes, COLOURS, Canvas, Stroke, push},
    text::report::{self as words, Section},
};
use boresight_calibrate::{
    BundleState, LensModel, LensPrior, Observations, adjust,
    leave_out::{Spread, consecutive},
};
use boresight_formats::ViewEntry;
use boresight_geometry::{Corner, PrincipalLine, frame::ImageSize, intersect_unweighted};

/// Maximum number of views left out, as in the paper.
const MOST_SKIPPED: usize = 5;
/// Maximum number of bundle adjustments per number of views left out. Each takes as long as a
/// calibration with one lens.
const MOST_STARTS: usize = 24;
/// Minimum number of views without priors, as in a calibration: fewer views rely on weak priors on
/// the lens.
const VIEWS_WITHOUT_PRIOR: usize = 4;

/// Estimates with `skipped` views left out.
#[derive(Clone, Debug)]
struct Scatter {
    skipped: usize,
    /// Number of attempted estimates.
    starts: usize,
    points_px: Vec<Point2<f64>>,
    spread: Spread,
}

/// Drawing, table, and notes.
pub(super) fn section(report: &Report) -> (String, String, String) {
    let views = in_order_of_direction(report);
    let lines = by_lines(&views);
    let bundles = by_bundle(report, &views);
    if lines.is_empty() {
        let figure = figure(Section::Skip, &missing(words::TOO_FEW), "");
        return (figure, String::new(), String::new());
    }
    let mut note = words::SKIP_NOTE.to_owned();
    match &bundles {
        Bundles::Done(scatter) => {
            let starts = scatter.iter().map(|scatter| scatter.starts).max().unwrap_or(0);
            if starts < views.len() && views.len() > MOST_STARTS {
                note += " ";
                note += &words::skip_starts(starts, views.len());
            }
        }
        Bundles::NotDone(why) => {
            note += " ";
            note += why;
        }
    }
    let bundles = bundles.into_scatter();
    let figure = figure(Section::Skip, &cloud(&lines, &bundles), "");
    (figure, table(&lines, &bundles), format!("<p class=\"note\">{note}</p>\n"))
}

/// Used views with their positions in the list of corners, ordered by the direction in which the
/// boards recede.
fn in_order_of_direction(report: &Report) -> Vec<(usize, &ViewEntry)> {
    let mut views: Vec<(usize, &ViewEntry)> =
        report.calibration.used().map(|(_, view)| view).enumerate().collect();
    let slot = |view: &ViewEntry| view.slot_deg.unwrap_or_default().rem_euclid(360.0);
    views.sort_by(|(_, a), (_, b)| slot(a).total_cmp(&slot(b)));
    views
}

fn scatter(
    count: usize,
    starts: usize,
    estimate: impl Fn(&[usize]) -> Option<Point2<f64>>,
) -> Vec<Scatter> {
    (0..=MOST_SKIPPED)
        .take_while(|skipped| *skipped == 0 || skipped + 2 <= count)
        .filter_map(|skipped| {
            let all = consecutive(count, skipped);
            let step = all.len().div_ceil(starts.max(1)).max(1);
            let tried: Vec<_> = all.iter().step_by(step).collect();
            let points_px: Vec<Point2<f64>> =
                tried.iter().filter_map(|kept| estimate(kept)).collect();
            let spread = Spread::of(&points_px)?;
            Some(Scatter { skipped, starts: tried.len(), points_px, spread })
        })
        .collect()
}

/// Unweighted intersections of the principal lines, as in the paper.
fn by_lines(views: &[(usize, &ViewEntry)]) -> Vec<Scatter> {
    let lines: Vec<PrincipalLine> = views
        .iter()
        .filter_map(|(_, view)| {
            Some(unweighted_line(&view.pl?, view.slot_deg.unwrap_or_default().to_radians()))
        })
        .collect();
    scatter(lines.len(), usize::MAX, |kept| {
        let kept: Vec<PrincipalLine> = kept.iter().map(|i| lines[*i].clone()).collect();
        intersect_unweighted(&kept).ok().map(|point| point.px)
    })
}

/// Bundle adjustments, or the reason for having none.
enum Bundles {
    Done(Vec<Scatter>),
    NotDone(&'static str),
}

impl Bundles {
    fn into_scatter(self) -> Vec<Scatter> {
        match self {
            Self::Done(scatter) => scatter,
            Self::NotDone(_) => Vec::new(),
        }
    }
}

/// Bundle adjustments with the result's lens model, started from the result.
fn by_bundle(report: &Report, views: &[(usize, &ViewEntry)]) -> Bundles {
    let Some(lens) = &report.calibration.result else { return Bundles::NotDone(words::TOO_FEW) };
    if lens.focal_varies() {
        return Bundles::NotDone(words::SKIP_NO_BUNDLE);
    }
    let poses: Option<Vec<Isometry3<f64>>> = views.iter().map(|(_, view)| view.pose()).collect();
    let corners: Option<Vec<Vec<Corner>>> = views
        .iter()
        .map(|(place, view)| {
            let corners = lens.weighted(report.corners.get(*place)?, view);
            report.calibration.as_flat(lens, view, corners)
        })
        .collect();
    let (Some(board_m), Some(model), Some(poses), Some(corners)) =
        (report.calibration.board_m(), lens.lens_model(), poses, corners)
    else {
        return Bundles::NotDone(words::SKIP_NEEDS_CORNERS);
    };
    let board_m: Vec<Point2<f64>> = board_m.iter().map(nalgebra::Point3::xy).collect();
    let camera = lens.camera();
    let [width_px, height_px] = report.calibration.image_size;
    let prior = LensPrior::weak(ImageSize { width_px, height_px });
    Bundles::Done(scatter(views.len(), MOST_STARTS, |kept| {
        let corners: Vec<&[Corner]> = kept.iter().map(|i| corners[*i].as_slice()).collect();
        let observations = Observations::new(&board_m, &corners).ok()?;
        let cam_from_board = kept.iter().map(|i| poses[*i]).collect();
        let start = BundleState { camera, cam_from_board };
        let few = kept.len() < VIEWS_WITHOUT_PRIOR;
        // A single view can't determine further parameters of a rich lens model.
        let model = if kept.len() < 2 { model.min(LensModel::K1) } else { model };
        let freedom = model.freedom(lens.square_pixels());
        let bundle = adjust(&observations, &freedom, few.then_some(&prior), start)?;
        Some(bundle.state.camera.pp_px)
    }))
}

/// Both clouds in different colours and marks; the full estimates are crosses.
fn cloud(lines: &[Scatter], bundles: &[Scatter]) -> String {
    let points: Vec<Point2<f64>> =
        lines.iter().chain(bundles).flat_map(|scatter| scatter.points_px.clone()).collect();
    let axes = Axes { x: words::name::X, y: words::name::Y, pixels: true };
    let mut canvas = Canvas::chart(&points, axes, Section::Skip.heading());
    let mut legend = Vec::new();
    for (kind, code, method) in [(0, "pl_unweighted", lines), (2, "bundle", bundles)] {
        for scatter in method {
            for point in &scatter.points_px {
                canvas.mark(kind, *point, COLOURS[kind]);
            }
        }
        // Path of the centroids.
        let centroids: Vec<Point2<f64>> =
            method.iter().map(|scatter| scatter.spread.centroid_px).collect();
        canvas.curve(&centroids, Stroke::thin("#000"));
        if let Some(full) = centroids.first() {
            canvas.cross(*full, 7.0);
            legend.push((kind, COLOURS[kind], words::method(code).to_owned()));
        }
    }
    canvas.legend(&legend);
    canvas.svg()
}

/// The paper's table: centroid and spread for every n.
fn table(lines: &[Scatter], bundles: &[Scatter]) -> String {
    let [estimates, centroid, sd] = words::SKIP_COLUMNS;
    let heads = format!("<th>{centroid}</th><th>{sd}</th>");
    let mut html = format!(
        "<table id=\"skip-table\"><caption>{}</caption><thead><tr><th rowspan=\"2\">{}</th><th rowspan=\"2\">{estimates}</th><th colspan=\"2\">{}</th><th colspan=\"2\">{}</th></tr><tr>{heads}{heads}</tr></thead><tbody>\n",
        words::SKIP_CAPTION,
        words::name::SKIPPED,
        words::method("pl_unweighted"),
        words::method("bundle"),
    );
    for skipped in 0..=MOST_SKIPPED {
        let of = |method: &[Scatter]| method.iter().find(|s| s.skipped == skipped).cloned();
        let (line, bundle) = (of(lines), of(bundles));
        let counts: Vec<usize> =
            [&line, &bundle].into_iter().flatten().map(|scatter| scatter.points_px.len()).collect();
        let count = match counts.as_slice() {
            [] => continue,
            [lines, bundles] if lines != bundles => format!("{lines}, {bundles}"),
            [count, ..] => count.to_string(),
        };
        push(
            &mut html,
            format_args!("<tr><th scope=\"row\">{skipped}</th><td class=\"n\">{count}</td>"),
        );
        for scatter in [line, bundle] {
            html += &cells(scatter.as_ref());
        }
        html += "</tr>\n";
    }
    html + "</tbody></table>\n"
}

fn cells(scatter: Option<&Scatter>) -> String {
    let Some(Scatter { spread, .. }) = scatter else {
        return "<td class=\"n\">–</td>".repeat(2);
    };
    let decimals = if spread.sd_px.norm() < 0.05 { 3 } else { 2 };
    format!(
        "<td class=\"n\">{}, {}</td><td class=\"n\">{}, {}</td>",
        plain(spread.centroid_px.x, decimals),
        plain(spread.centroid_px.y, decimals),
        plain(spread.sd_px.x, decimals),
        plain(spread.sd_px.y, decimals),
    )
}
