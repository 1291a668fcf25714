//! Doubt about the lens from the first radial term beyond the richest model: r⁸, or θ¹⁰ of a
//! fisheye lens.
//!
//! Inside the boards' area, the corners limit that term; outside, only its prior does. Its effect
//! on the picture is fitted by the lens parameters, so that their covariance includes it.

use nalgebra::{Matrix4, SMatrix, SVector, Vector2, Vector4};

use super::projection_sd::projection_jacobian;
use crate::{
    causes::{Derivatives, OneColumn},
    solve::{bundle::Bundle, lens_model::LensModel, schur_lm::inverse},
};
use boresight_geometry::{LENS_PARAMETERS, LensMatrix, LensParameter, frame::ImageSize};

/// Multiples of `LensFamily::next_radial_sd`, with the prior probability of each: most lenses are
/// good, some are not.
const SCALES: [(f64, f64); 3] = [(0.03, 0.6), (0.1, 0.3), (0.3, 0.1)];
/// Largest shift of a ray at the edge of the picture by the term at that standard deviation, as a
/// share of the radius. Where the series hardly converges, the prior of Brown's family overstates
/// the shift.
const LARGEST_SHARE: f64 = 0.3;
/// Parameters changed by a radial term, fy with fx: f, k1, k2, k3.
const RADIAL: [LensParameter; 4] =
    [LensParameter::Fx, LensParameter::K1, LensParameter::K2, LensParameter::K3];

/// Covariance of the lens of `bundle`, the richest bundle, with its `derivatives`, from the term
/// r⁸;
/// `model` and `k1` belong to the chosen lens. The information of the corners is divided by
/// `overcount`, 1 for independent errors. `None` if the corners leave the term undetermined or the
/// lens covers too little of the picture.
pub(crate) fn next_radial_doubt(
    derivatives: &Derivatives<'_>,
    bundle: &Bundle,
    (model, k1): (LensModel, f64),
    image_size: ImageSize,
    noise_floor: f64,
    overcount: f64,
) -> Option<LensMatrix> {
    let OneColumn { value, unit_variance, lens_by_value } = derivatives.next_radial()?;
    let variance = unit_variance * bundle.noise_factor().max(noise_floor).powi(2) * overcount;
    // Average over the widths of the prior, weighted by the evidence for each.
    let camera = &bundle.state.camera;
    let jacobian = projection_jacobian(camera, image_size)?;
    let rays = jacobian.px.iter().filter_map(|px| camera.flat_from_px(px));
    let edge = rays.map(|ray| ray.coords.norm()).fold(0.0, f64::max);
    let power = camera.distortion.kind.next_radial_power();
    let at_edge = edge.powi(2 * power);
    let sd = model.family().next_radial_sd(k1, at_edge);
    let sd = sd.min(LARGEST_SHARE / at_edge);
    let (mut spread, mut total) = (0.0, 0.0);
    for (scale, probability) in SCALES {
        let prior = (scale * sd).powi(2);
        let sum = prior + variance;
        let left = prior * variance / sum;
        let mean = value * prior / sum;
        let likely = probability * libm::exp(-0.5 * value * value / sum) / sum.sqrt();
        spread += (left + mean * mean) * likely;
        total += likely;
    }
    if !(total > 0.0) {
        return None;
    }
    let (mut squares, mut pull) = (Matrix4::zeros(), Vector4::zeros());
    for (px, jac_lens) in jacobian.px.iter().zip(&jacobian.jac_lens) {
        let flat = camera.flat_from_px(px)?.coords;
        let shift: Vector2<f64> =
            (flat * flat.norm_squared().powi(power)).component_mul(&camera.f_px);
        let by = SMatrix::<f64, 2, 4>::from_fn(|row, i| match RADIAL[i] {
            fx @ LensParameter::Fx => {
                jac_lens[(row, fx.index())] + jac_lens[(row, LensParameter::Fy.index())]
            }
            parameter => jac_lens[(row, parameter.index())],
        });
        squares += by.transpose() * by;
        pull += by.transpose() * shift;
    }
    let alike = inverse(&squares)? * pull;
    let mut moved: SVector<f64, LENS_PARAMETERS> = -lens_by_value;
    for (value, parameter) in alike.iter().zip(RADIAL) {
        moved[parameter.index()] -= value;
    }
    moved[LensParameter::Fy.index()] -= alike[0];
    let doubt = moved * moved.transpose() * (spread / total);
    doubt.iter().all(|x| x.is_finite()).then_some(doubt)
}
