//! Measurements of the newest frame beside the requested values, and data for a fit's drawings.

pub mod fit;

use nalgebra::Point2;

use crate::text::window::Gauge;
use boresight_geometry::{GRID_COLUMNS, GRID_ROWS};
use boresight_guide::{
    guidance::{HOLD_WIDTHS_PER_SEC, direction_difference_rad},
    session::{Snapshot, lateral_offset_px},
};

/// Largest valid standard deviation of a cell, such that a `share` of the picture's cells is valid.
/// `sds_px` are those of the cells mapped by the lens.
pub fn valid_up_to_px(sds_px: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = sds_px.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let count = (share * f64::from(GRID_COLUMNS * GRID_ROWS)).round() as usize;
    count.checked_sub(1).and_then(|last| sorted.get(last)).map_or(f64::NEG_INFINITY, |sd| *sd)
}

/// Measurement on its scale, in the unit of its gauge: radians, shares of the picture, or pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Measured value, if any.
    pub value: Option<f64>,
    /// Requested value; for a gauge with only a limit, the limit.
    pub aim: f64,
    /// Lowest and highest good value.
    pub good: (f64, f64),
    /// Ends of the scale.
    pub scale: (f64, f64),
}

/// Reading of `gauge` in the snapshot.
pub fn reading(gauge: Gauge, snapshot: &Snapshot) -> Reading {
    let live = snapshot.live.as_deref();
    let measured = live.and_then(|live| live.measured.as_ref());
    let target = snapshot.target.as_ref();
    let width_px = f64::from(snapshot.setup.image_size.width_px);
    let read = |value, aim, good, scale| Reading { value, aim, good, scale };
    match gauge {
        Gauge::Tilt => {
            let asked_rad = target.map_or(0.0, |target| target.tilt_rad);
            read(
                measured.and_then(|measured| measured.tilt_rad),
                asked_rad,
                (NEAR.0 * asked_rad, NEAR.1 * asked_rad),
                (0.0, 75_f64.to_radians()),
            )
        }
        Gauge::Direction => {
            let off = measured.zip(target).map(|(m, target)| {
                direction_difference_rad(m.tilt_azimuth_rad, target.tilt_azimuth_rad)
            });
            let limit = NEAR_DIRECTION_RAD;
            read(
                off,
                limit,
                (-limit, limit),
                (-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2),
            )
        }
        Gauge::Size => {
            let asked =
                target.map_or(0.0, |target| target.span_fraction(snapshot.setup.image_size));
            let size = measured.map(|m| m.span_fraction);
            read(size, asked, (NEAR.0 * asked, (NEAR.1 * asked).min(1.0)), (0.0, 1.0))
        }
        Gauge::Across => {
            let pp = &snapshot.pp_px;
            let wanted = target.map_or(0.0, |target| {
                lateral_offset_px(target.tilt_azimuth_rad, &middle(&target.ghost_px), pp)
            });
            let limit = NEAR_PLACE_WIDTHS * width_px;
            let off = measured.map(|m| m.lateral_offset_px - wanted);
            read(off, limit, (-limit, limit), (-4.0 * limit, 4.0 * limit))
        }
        Gauge::Still => {
            let limit = HOLD_WIDTHS_PER_SEC * width_px;
            read(live.and_then(|live| live.speed_px_per_s), limit, (0.0, limit), (0.0, 4.0 * limit))
        }
        Gauge::Sharp => {
            let limit = SHARP_PX;
            read(live.and_then(|live| live.blur_px), limit, (0.0, limit), (0.0, 2.0 * limit))
        }
    }
}

fn middle(points: &[Point2<f64>]) -> Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
    Point2::from(sum / points.len().max(1) as f64)
}

/// Range drawn as good, relative to the requested tilt and size. A gauge limits nothing.
const NEAR: (f64, f64) = (0.75, 1.4);
const NEAR_DIRECTION_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;
const NEAR_PLACE_WIDTHS: f64 = 0.04;
const SHARP_PX: f64 = 3.5;
