//! Displacement by the lens as a curve with uncertainty.

use nalgebra::Point2;

use super::{
    number::brief,
    section::{figure, missing},
};
use crate::{
    chart::{Axes, COLOURS, Canvas, Stroke},
    text::report::{self as words, Section},
};
use boresight_formats::{CalibrationFile, LensEntry};
use boresight_geometry::{Distortion, LensParameter};

const STEPS: usize = 80;

/// Radial distortion at one distance from the principal point.
#[derive(Clone, Copy, Debug)]
struct Shift {
    radius_px: f64,
    outwards_px: f64,
    sd_px: Option<f64>,
}

/// Curve out to the picture's farthest corner.
pub(super) fn drawing(calibration: &CalibrationFile) -> String {
    let Some(lens) = &calibration.result else {
        return figure(Section::Lens, &missing(words::NO_CALIBRATION), "");
    };
    let curve = curve(lens, farthest_corner_px(calibration, lens));
    let mut points: Vec<Point2<f64>> =
        curve.iter().map(|shift| Point2::new(shift.radius_px, shift.outwards_px)).collect();
    let edge = |side: f64| -> Vec<Point2<f64>> {
        let at = |shift: &Shift| {
            let sd_px = shift.sd_px?;
            Some(Point2::new(shift.radius_px, shift.outwards_px + side * 2.0 * sd_px))
        };
        curve.iter().filter_map(at).collect()
    };
    let line = points.clone();
    let (upper, lower) = (edge(1.0), edge(-1.0));
    points.extend(upper.iter().chain(&lower));
    // Minimum range, for a lens without distortion.
    points.extend([Point2::new(0.0, -0.5), Point2::new(0.0, 0.5)]);
    let axes = Axes { x: words::name::RADIUS, y: words::name::SHIFT, pixels: false };
    let mut canvas = Canvas::large_chart(&points, axes, Section::Lens.heading());
    let band: Vec<Point2<f64>> = upper.iter().chain(lower.iter().rev()).copied().collect();
    canvas.area(&band, "#cfe3f3", Stroke { colour: "#6baed6", width: 0.6, dash: 0 });
    canvas.curve(&line, Stroke { colour: COLOURS[0], width: 1.8, dash: 0 });
    if let Some(reach_px) = boards_reach_px(calibration, lens) {
        let bottom = Point2::new(reach_px, 0.0);
        canvas.line(bottom, nalgebra::Vector2::y(), Stroke { colour: "#444", width: 1.0, dash: 2 });
        canvas.at_top(reach_px, words::name::LAST_BOARD);
    }
    let mut note = words::LENS_NOTE.to_owned();
    if lens.distortion.fisheye {
        note += " ";
        note += words::FISHEYE_NOTE;
    }
    if lens.full_covariance().is_none() {
        note += " ";
        note += words::NEEDS_COVARIANCE;
    }
    let tangential_px = tangential_px(lens, farthest_corner_px(calibration, lens));
    if tangential_px > 0.0 {
        note += " ";
        note += &words::tangential(&brief(tangential_px, 2));
    }
    figure(Section::Lens, &canvas.svg(), &note)
}

/// `Δ = f r (m − 1)` at the observed radius `f r + Δ`, with `m` the radial factor of the lens model
/// and `r` the undistorted radius: `tan θ`, or θ of a fisheye lens. The sd comes from f and the
/// radial coefficients. Ends where the lens model folds over.
fn curve(lens: &LensEntry, reach_px: f64) -> Vec<Shift> {
    let f_px = 0.5 * (lens.f_px[0] + lens.f_px[1]);
    let radial = Distortion { p1: 0.0, p2: 0.0, ..lens.distortion.into() };
    let covariance = lens.full_covariance();
    let at = |r: f64| {
        let flat = Point2::new(r, 0.0);
        let outwards_px = f_px * (radial.apply(&flat).x - r);
        let mut by = radial.by_parameters(&flat).row(0) * f_px;
        let is_radial = |of: LensParameter| of.is_distortion() && !of.is_tangential();
        for other in LensParameter::ALL.into_iter().filter(|of| !is_radial(*of)) {
            by[other.index()] = 0.0;
        }
        by[LensParameter::Fx.index()] = outwards_px / f_px;
        let sd_px = covariance.map(|c| (by * c * by.transpose()).x.max(0.0).sqrt());
        Shift { radius_px: f_px * r + outwards_px, outwards_px, sd_px }
    };
    let mut shifts = vec![at(0.0)];
    let step = reach_px / f_px / STEPS as f64;
    // A lens that draws points inwards needs more steps to reach as far, but never four times as
    // many.
    for k in 1..4 * STEPS {
        let next = at(step * k as f64);
        let last = shifts.last().map_or(0.0, |shift| shift.radius_px);
        if !(next.radius_px > last) || last >= reach_px {
            break;
        }
        shifts.push(next);
    }
    shifts
}

fn farthest_corner_px(calibration: &CalibrationFile, lens: &LensEntry) -> f64 {
    let (width, height) = calibration.size_px();
    let [x, y] = lens.pp_px;
    let far = |at: f64, size: f64| at.abs().max((size - at).abs());
    libm::hypot(far(x, width), far(y, height))
}

/// Distance of the farthest board corner.
fn boards_reach_px(calibration: &CalibrationFile, lens: &LensEntry) -> Option<f64> {
    let pp_px = Point2::from(lens.pp_px);
    calibration
        .used()
        .filter_map(|(_, view)| view.outline())
        .flatten()
        .map(|corner| (corner - pp_px).norm())
        .max_by(f64::total_cmp)
}

/// Largest tangential shift at the distance of the farthest corner.
fn tangential_px(lens: &LensEntry, reach_px: f64) -> f64 {
    let r = reach_px / lens.f_px[0];
    // With q = (p2, p1) the shift at x is |x|² q + 2 (q·x) x: longest along q.
    3.0 * libm::hypot(lens.distortion.p1, lens.distortion.p2) * r * r * lens.f_px[0]
}
