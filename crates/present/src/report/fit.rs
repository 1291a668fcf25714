//! Fit of the views and meaning of the lens's uncertainty: drawings for a screen.

use nalgebra::{Point2, Point3};

use super::{
    Report,
    number::brief,
    picture_maps::{LABELS, MOST_ARROWS, arrows},
    section::missing,
};
use crate::{
    chart::{COLOURS, Canvas, Stroke},
    reading::fit::{BARS, Histogram, SPAN, field, from_aside, outwards, rings},
    text::charts::{self as words, Chart},
};
use boresight_formats::{CalibrationFile, LensEntry};
use boresight_geometry::LensParameter;

/// Size of a drawing without axes, in drawing units.
const SIZE: (f64, f64) = (300.0, 204.0);
/// Colour of ordinary views, and of the background of the data.
const USUAL: &str = COLOURS[5];
const GREY: &str = "#999";
/// Colour of outstanding views.
const WORST: &str = COLOURS[1];
/// Viewing angle of the boards from the side, rad.
const ASIDE_RAD: f64 = 0.7;
/// Maximum distance of the uncertainty's curve, metres.
const FAR_M: f64 = 10.0;

/// Section of the fit; empty without a result.
pub(super) fn section(report: &Report) -> String {
    let calibration = &report.calibration;
    let Some(lens) = &calibration.result else { return String::new() };
    let charts = [
        ("chart-views", Chart::Views, bars(calibration)),
        ("chart-poses", Chart::Poses, poses(calibration, lens)),
        ("chart-scatter", Chart::Scatter, scatter(report)),
        ("chart-radius", Chart::Radius, radius(report, lens)),
        ("chart-distance", Chart::Distance, distance(calibration, lens)),
        ("chart-correlations", Chart::Correlations, correlations(lens)),
    ];
    let figures = charts.map(|(id, chart, drawn)| {
        let (drawing, note) = drawn.unwrap_or_else(|| (missing(words::NOT_KNOWN), String::new()));
        format!(
            "<figure id=\"{id}\"><h2>{}</h2>\n{drawing}<p class=\"note\">{note} {}</p></figure>\n",
            chart.name(),
            chart.tip()
        )
    });
    format!(
        "<section class=\"screen\" id=\"fit\"><h2>{}</h2><div class=\"three\">{}</div></section>\n",
        words::FIT,
        figures.concat()
    )
}

/// SVG drawing, and a sentence about the numbers.
type Drawn = Option<(String, String)>;

/// Residual of each view, the largest marked.
fn bars(calibration: &CalibrationFile) -> Drawn {
    let views: Vec<(usize, f64)> =
        calibration.used().filter_map(|(number, view)| Some((number, view.rms_px?))).collect();
    let (worst, worst_px) = views.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut sorted: Vec<f64> = views.iter().map(|(_, rms_px)| *rms_px).collect();
    sorted.sort_by(f64::total_cmp);
    let usual_px = sorted[sorted.len() / 2];
    let last = views.last()?.0 as f64;
    let corners = [Point2::new(0.5, 0.0), Point2::new(last + 0.5, worst_px)];
    let mut canvas = Canvas::chart(&corners, words::VIEWS_AXES, Chart::Views.name());
    for (number, rms_px) in &views {
        let (x, fill) = (*number as f64, if *number == worst { WORST } else { USUAL });
        let bar = [(-0.4, 0.0), (0.4, 0.0), (0.4, *rms_px), (-0.4, *rms_px)];
        canvas.area(&bar.map(|(off, y)| Point2::new(x + off, y)), fill, Stroke::thin("none"));
        if views.len() <= LABELS || *number == worst {
            canvas.number(Point2::new(x, *rms_px), "#111", &number.to_string());
        }
    }
    let level = [0.5, last + 0.5].map(|x| Point2::new(x, usual_px));
    canvas.curve(&level, Stroke { colour: "#111", width: 0.8, dash: 1 });
    let note = format!(
        "{}. {}.",
        words::worst(&words::view(&worst.to_string())),
        words::per_view(worst_px / usual_px.max(1e-12))
    );
    Some((canvas.svg(), note))
}

/// Boards before the camera, and the field of view, from above and the side.
fn poses(calibration: &CalibrationFile, lens: &LensEntry) -> Drawn {
    let board = calibration.checkerboard()?;
    let corners_m = board.corners_in_board_m();
    let boards: Vec<(usize, [Point3<f64>; 4])> = calibration
        .used()
        .filter_map(|(number, view)| {
            let pose = view.pose()?;
            let rim = board.target().rim();
            Some((number, rim.map(|i| pose * Point3::new(corners_m[i].x, corners_m[i].y, 0.0))))
        })
        .collect();
    // For a fisheye lens, near boards needn't be in front.
    let away_m = boards.iter().flat_map(|(_, corners)| corners).map(|point| point.coords.norm());
    let (nearest_m, farthest_m) = away_m
        .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), away| {
            (low.min(away), high.max(away))
        });
    if boards.is_empty() || farthest_m <= 0.0 {
        return None;
    }
    let field = field(&lens.camera(), calibration.size_px(), farthest_m);
    let turn = from_aside(ASIDE_RAD);
    // No perspective, so sizes compare.
    let seen = |point: &Point3<f64>| (turn * point).xy();
    let all = boards.iter().flat_map(|(_, corners)| corners).chain(&field);
    let places: Vec<Point2<f64>> = all.map(seen).chain(std::iter::once(Point2::origin())).collect();
    let least = places.iter().fold(places[0], |a, b| a.inf(b));
    let span = places.iter().fold(places[0], |a, b| a.sup(b)) - least;
    let scale = 0.92 * (SIZE.0 / span.x.max(1e-9)).min(SIZE.1 / span.y.max(1e-9));
    let middle = least + 0.5 * span;
    let on_page = |point: &Point3<f64>| {
        Point2::new(0.5 * SIZE.0, 0.5 * SIZE.1) + (seen(point) - middle) * scale
    };
    let mut canvas = Canvas::picture(SIZE, Chart::Poses.name());
    let eye = on_page(&Point3::origin());
    for edge in &field {
        canvas.curve(&[eye, on_page(edge)], Stroke::thin(GREY));
    }
    let around: Vec<Point2<f64>> = field.iter().map(on_page).collect();
    canvas.area(&around, "none", Stroke::thin(GREY));
    canvas.dot(eye, 3.0);
    // Farthest first.
    let mut order: Vec<usize> = (0..boards.len()).collect();
    let depth = |i: usize| boards[i].1.iter().map(|point| (turn * point).z).sum::<f64>();
    order.sort_by(|a, b| depth(*b).total_cmp(&depth(*a)));
    for (number, corners) in order.into_iter().map(|i| &boards[i]) {
        let colour = COLOURS[number % COLOURS.len()];
        let points = corners.map(|corner| on_page(&corner));
        canvas.area(&points, &format!("{colour}30"), Stroke { colour, width: 1.1, dash: 0 });
        if boards.len() <= LABELS {
            canvas.number(points[0], "#111", &number.to_string());
        }
    }
    Some((canvas.svg(), format!("{}.", words::poses(boards.len(), nearest_m, farthest_m))))
}

/// Corner residuals as a cloud and a histogram, beside the normal distribution.
fn scatter(report: &Report) -> Drawn {
    let offs: Vec<_> = arrows(report).into_iter().map(|(_, off_px)| off_px).collect();
    let squares: f64 = offs.iter().map(nalgebra::Vector2::norm_squared).sum();
    let rms_px = (squares / (2.0 * offs.len() as f64)).sqrt();
    if !(rms_px > 0.0) {
        return None;
    }
    let reach_px = SPAN * rms_px;
    let square = [-reach_px, reach_px].map(|px| Point2::new(px, px));
    let mut cloud = Canvas::chart(&square, words::OFF_AXES, Chart::Scatter.name());
    for off in offs.iter().step_by(offs.len().div_ceil(MOST_ARROWS)) {
        cloud.dot(Point2::from(*off), 0.9);
    }
    for sds in [1.0, 2.0] {
        let variance = nalgebra::Matrix2::from_diagonal_element((sds * rms_px).powi(2));
        let ring = Canvas::ellipse_points(Point2::origin(), &variance, 1.0);
        cloud.area(&ring, "none", Stroke::thin(WORST));
    }
    let histogram = Histogram::of(&offs, rms_px);
    let corners = [Point2::new(-reach_px, 0.0), Point2::new(reach_px, histogram.most())];
    let mut often = Canvas::chart(&corners, words::OFTEN_AXES, Chart::Scatter.name());
    let step = 2.0 * SPAN / BARS as f64;
    for (i, count) in histogram.counts.iter().enumerate() {
        let (left, count) = (step * i as f64 - SPAN, f64::from(*count));
        let bar = [(left, 0.0), (left + step, 0.0), (left + step, count), (left, count)];
        let bar = bar.map(|(sds, y)| Point2::new(sds * rms_px, y));
        often.area(&bar, USUAL, Stroke::thin("#fff"));
    }
    let curve: Vec<Point2<f64>> = (-40..=40)
        .map(|i| SPAN * f64::from(i) / 40.0)
        .map(|sds| Point2::new(sds * rms_px, histogram.normal(sds)))
        .collect();
    often.curve(&curve, Stroke { colour: WORST, width: 1.4, dash: 0 });
    Some((cloud.svg() + &often.svg(), format!("{}.", words::scatter(offs.len(), rms_px))))
}

/// Corner residuals outwards against the distance from the principal point, with rings.
fn radius(report: &Report, lens: &LensEntry) -> Drawn {
    let pp_px = lens.camera().pp_px;
    let corners: Vec<[f64; 2]> =
        arrows(report).iter().map(|(at, off)| outwards(&pp_px, at, off)).collect();
    let rings = rings(corners.clone());
    let (far_px, most_px) = (rings.last()?.to_px, corners.iter().map(|it| it[1].abs()));
    let most_px = most_px.fold(0.0, f64::max);
    let ends = [Point2::new(0.0, -most_px), Point2::new(far_px, most_px)];
    let mut canvas = Canvas::chart(&ends, words::RADIUS_AXES, Chart::Radius.name());
    for corner in corners.iter().step_by(corners.len().div_ceil(MOST_ARROWS)) {
        canvas.dot(Point2::from(*corner), 0.9);
    }
    for ring in &rings {
        for (off_px, dash) in [(ring.mean_px, 0), (ring.rms_px, 1), (-ring.rms_px, 1)] {
            let ends = [ring.from_px, ring.to_px].map(|px| Point2::new(px, off_px));
            canvas.curve(&ends, Stroke { colour: WORST, width: 1.8, dash });
        }
    }
    Some((canvas.svg(), format!("{}.", words::by_radius(&rings))))
}

/// Sideways error of a point against its distance: mean over the picture and worst place.
fn distance(calibration: &CalibrationFile, lens: &LensEntry) -> Drawn {
    let projection = calibration.projection_sd_px.as_ref().filter(|map| !map.grid.is_empty())?;
    let f_px = 0.5 * (lens.f_px[0] + lens.f_px[1]);
    let off_m = |sd_px: f64, distance_m: f64| distance_m * sd_px / f_px;
    let far_mm = 1e3 * off_m(projection.max, FAR_M);
    let corners = [Point2::origin(), Point2::new(FAR_M, far_mm)];
    let mut canvas = Canvas::chart(&corners, words::DISTANCE_AXES, Chart::Distance.name());
    for (sd_px, colour, dash) in [(projection.mean, USUAL, 0), (projection.max, WORST, 1)] {
        let ends = [Point2::origin(), Point2::new(FAR_M, 1e3 * off_m(sd_px, FAR_M))];
        canvas.curve(&ends, Stroke { colour, width: 1.8, dash });
    }
    canvas.legend(&[(0, USUAL, words::MEAN.into()), (1, WORST, words::WORST_PLACE.into())]);
    let note = words::at_a_distance(off_m(projection.mean, 1.0), off_m(projection.max, 1.0));
    Some((canvas.svg(), format!("{note}.")))
}

/// Correlations of the lens parameters determined by the corners.
fn correlations(lens: &LensEntry) -> Drawn {
    let covariance = lens.covariance.as_ref()?.full()?;
    let sd = |parameter: LensParameter| {
        covariance[(parameter.index(), parameter.index())].max(0.0).sqrt()
    };
    let used: Vec<LensParameter> = LensParameter::ALL
        .into_iter()
        // With square pixels, both focal lengths are the same.
        .filter(|parameter| !(lens.square_pixels() && *parameter == LensParameter::Fy))
        .filter(|parameter| sd(*parameter) > 0.0)
        .collect();
    let correlation = |a: LensParameter, b: LensParameter| {
        (covariance[(a.index(), b.index())] / (sd(a) * sd(b))).clamp(-1.0, 1.0)
    };
    let pairs = used.iter().enumerate().flat_map(|(i, a)| used[..i].iter().map(move |b| (*b, *a)));
    let (a, b) =
        pairs.max_by(|x, y| correlation(x.0, x.1).abs().total_cmp(&correlation(y.0, y.1).abs()))?;
    let cells = used.len() as f64 + 1.0;
    let [across, down] = [SIZE.0 / cells, SIZE.1 / cells];
    let middle = |column: usize, row: usize| {
        Point2::new((column as f64 + 0.5) * across, (row as f64 + 0.5) * down)
    };
    let mut canvas = Canvas::picture(SIZE, Chart::Correlations.name());
    for (i, row) in used.iter().enumerate() {
        canvas.number(middle(0, i + 1), "#111", row.name());
        canvas.number(middle(i + 1, 0), "#111", row.name());
        for (j, column) in used.iter().enumerate() {
            let value = correlation(*row, *column);
            let colour = if value < 0.0 { WORST } else { USUAL };
            // Two hexadecimal digits of opacity.
            let fill = format!("{colour}{:02x}", (200.0 * value.abs()) as u8);
            let at = middle(j + 1, i + 1);
            let half = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
            let cell = half.map(|(x, y)| at + nalgebra::Vector2::new(x * across, y * down));
            canvas.area(&cell, &fill, Stroke::thin("#fff"));
            canvas.number(at, "#111", &brief(value, 2));
        }
    }
    Some((canvas.svg(), format!("{}.", words::strongest(a.name(), b.name(), correlation(a, b)))))
}
