//! Precision that a calibration can reach if the board stays small in the picture.
//!
//! An installed camera is far from where a person can stand. The noise of the principal point falls with the second
//! power of the board's size, so a small board can't fix it in any pose; but it can fix the projection, if pairs stand
//! in several places of the picture. Source: `docs/method.md`, section 3.7.

use nalgebra::{Isometry3, Vector2};

use super::{
    information::{CORNER_SIGMA_PX, known_information, pp_places, projection_weight, reflected},
    params::GuidanceParams,
    slots::slots_deg,
    view::LensEstimate,
    wanted_pose::{WantedPose, place_board},
};
use boresight_geometry::board::Checkerboard;

/// Focal length, in picture widths, from which pairs stand across their principal line.
const LONG_LENS: f64 = 1.5;
/// Distance of pairs from the principal point, in picture widths: along their line, and across it with a long lens.
const ALONG_WIDTHS: f64 = 0.32;
const ACROSS_WIDTHS: f64 = 0.2;
/// Tilt of a far board, which makes up for its lack of perspective.
const FAR_TILT_RAD: f64 = std::f64::consts::FRAC_PI_4;

/// Standard deviations that a plan is expected to reach.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Reach {
    /// Standard deviation of the principal point, worse axis.
    pub pp_sigma_px: f64,
    /// Standard deviation of projection, mean over the picture.
    pub projection_sigma_px: f64,
}

/// The poses of the pair with that index (from 0), in the order of preference, for a board that spans at most
/// `target_span_fraction` of the picture: near boards in the middle, far ones in several places.
pub(super) fn wanted_poses(
    tilt_azimuth_rad: f64,
    pair: usize,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Vec<WantedPose> {
    let f_to_width = lens_estimate.f_to_width();
    let centred = WantedPose {
        tilt_azimuth_rad,
        tilt_rad: params.wanted_tilt_rad(f_to_width),
        offset_px: Vector2::zeros(),
        is_reflected: true,
    };
    if !params.is_far() {
        return vec![centred];
    }
    let width_px = f64::from(lens_estimate.image_size.width_px);
    let (sin, cos) = tilt_azimuth_rad.sin_cos();
    let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
    let offset_px = if f_to_width > LONG_LENS {
        let side = if pair.is_multiple_of(2) { 1.0 } else { -1.0 };
        across * (side * ACROSS_WIDTHS * width_px)
    } else if pair < 2 {
        Vector2::zeros()
    } else {
        along * (ALONG_WIDTHS * width_px)
    };
    // As far out as the picture allows.
    [1.0, 0.75, 0.5, 0.25, 0.0]
        .map(|share| WantedPose {
            tilt_rad: FAR_TILT_RAD.clamp(params.min_tilt_rad, params.max_tilt_rad),
            offset_px: offset_px * share,
            ..centred
        })
        .to_vec()
}

/// The first of the wanted poses that fits into the picture.
pub(super) fn place_first(
    wanted: &[WantedPose],
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Option<(WantedPose, Isometry3<f64>)> {
    wanted
        .iter()
        .find_map(|wanted| Some((*wanted, place_board(wanted, board, lens_estimate, params)?)))
}

/// Expected precision of four reflected pairs whose boards span at most `target_span_fraction` of the picture, with
/// corner errors of `noise_px` per axis, or of a tenth of a pixel while they are unknown. `None` if the board fits
/// nowhere.
pub fn reach(
    board: &Checkerboard,
    lens_estimate: &LensEstimate,
    noise_px: Option<f64>,
    params: &GuidanceParams,
) -> Option<Reach> {
    let slots_rad = slots_deg(lens_estimate.image_size).map(f64::to_radians);
    let mut poses = Vec::new();
    for (pair, slot_rad) in slots_rad.into_iter().step_by(2).enumerate() {
        let wanted = wanted_poses(slot_rad, pair, lens_estimate, params);
        let (_, pose) = place_first(&wanted, board, lens_estimate, params)?;
        poses.extend([pose, reflected(&pose)]);
    }
    let sigma_px = noise_px.unwrap_or(CORNER_SIGMA_PX);
    let covariance = known_information(poses, board, lens_estimate, sigma_px).cholesky()?.inverse();
    let (weight, pixels) = projection_weight(lens_estimate);
    let projection_px2 = (weight * covariance).trace() / (2.0 * pixels.max(1) as f64);
    let [x, y] = pp_places();
    let pp_px2 = covariance[(x, x)].max(covariance[(y, y)]);
    Some(Reach {
        pp_sigma_px: pp_px2.max(0.0).sqrt(),
        projection_sigma_px: projection_px2.max(0.0).sqrt(),
    })
}
