//! Independence: judges if a view's principal line adds anything to the accepted ones.

use std::f64::consts::PI;

use super::{
    params::{GuidanceParams, width_scale},
    refusal::Refusal,
    slots::direction_difference_rad,
    view::{LensEstimate, View},
};

/// Role of a view among the accepted ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", tag = "role")]
pub enum Role {
    /// The view's principal line is linearly independent of all accepted ones.
    NewDirection,
    /// The view is the opposed partner, 180° apart, of an accepted view that had none.
    Partner {
        /// Index of that view among the accepted ones.
        of: usize,
    },
    /// The person forced it; no limit was checked.
    Forced,
}

/// Views after which a principal line can be tested against the others. Source: `docs/method.md`, section 3.6.
const CONSISTENCY_FROM_VIEWS: usize = 5;
/// Standard deviations beyond which a line contradicts the others. Source: `docs/method.md`, section 3.6.
const CONSISTENCY_SIGMAS: f64 = 3.5;
/// Distance from the principal point, in a picture 1280 pixels wide, below which a line contradicts nothing, even with
/// a tiny standard deviation. Chosen for the error of a lens model that is too simple: 2.2 px with eight views in
/// reflected pairs. Source: `docs/method.md`, section 3.9.
const LENS_MODEL_FLOOR_PX: f64 = 2.0;
/// Ratio of standard deviations below which a line counts as much better known than another.
const MUCH_BETTER: f64 = 0.5;

/// The role of `view` among the `accepted` ones. Source: `docs/method.md`, sections 3.2, 3.3 and 3.6.
///
/// Two principal lines are independent if and only if their angle ψ satisfies `ψ ≥ independent_rad` and
/// `ψ > independent_sigmas · √(sd φ₁² + sd φ₂²)`. A view is useful if and only if its line is independent of
/// every accepted one, or it is the opposed partner of an accepted view that has none. A line that is known
/// much better than an accepted one doesn't count as covered by it: a small or hardly tilted board must not
/// block its direction for good.
///
/// # Errors
///
/// The [`Refusal`] with what was measured and what is wanted.
pub fn role_of(
    view: &View,
    accepted: &[View],
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Result<Role, Refusal> {
    consistent(view, accepted, lens_estimate)?;
    let mut nearest_rad = f64::INFINITY;
    let mut partner_refusal = None;
    for (index, other) in accepted.iter().enumerate() {
        let opposed_rad =
            direction_difference_rad(view.tilt_azimuth_rad(), other.tilt_azimuth_rad() + PI).abs();
        if opposed_rad <= params.partner_slot_rad && partner_of(index, accepted).is_none() {
            match reflected(view, other, lens_estimate, params) {
                Ok(()) => return Ok(Role::Partner { of: index }),
                Err(refusal) => partner_refusal = Some(refusal),
            }
        }
        let sigma_rad = view.line.sigma_phi_rad().hypot(other.line.sigma_phi_rad());
        let angle_rad = view.line.angle_to(&other.line);
        let is_parallel = angle_rad < params.independent_rad
            || angle_rad <= params.independent_sigmas * sigma_rad;
        if is_parallel && !is_much_better(view, other, lens_estimate) {
            nearest_rad = nearest_rad.min(angle_rad);
        }
    }
    if let Some(refusal) = partner_refusal {
        return Err(refusal);
    }
    if nearest_rad.is_finite() {
        return Err(Refusal::AlreadyCovered { nearest_rad, wanted_rad: params.independent_rad });
    }
    Ok(Role::NewDirection)
}

/// Index of the opposed partner of the accepted view at `index`; either of the two may have been taken first. `None`
/// without one, or without a view at `index`. Settled at acceptance: a better lens estimate doesn't undo it.
pub fn partner_of(index: usize, accepted: &[View]) -> Option<usize> {
    let view = accepted.get(index)?;
    accepted.iter().position(|other| {
        view.partner_frame == Some(other.frame_id) || other.partner_frame == Some(view.frame_id)
    })
}

fn reflected(
    view: &View,
    of: &View,
    lens_estimate: &LensEstimate,
    params: &GuidanceParams,
) -> Result<(), Refusal> {
    let offset_px = reflection_offset_px(view, of, lens_estimate);
    let wanted_px = partner_limit_px(lens_estimate, params);
    if offset_px <= wanted_px { Ok(()) } else { Err(Refusal::PartnerOff { offset_px, wanted_px }) }
}

/// Distance of `view`'s centre from the point reflection of `of`'s centre about the principal point.
fn reflection_offset_px(view: &View, of: &View, lens_estimate: &LensEstimate) -> f64 {
    let wanted = lens_estimate.camera.pp_px.coords * 2.0 - of.board_px.coords;
    (view.board_px.coords - wanted).norm()
}

fn partner_limit_px(lens_estimate: &LensEstimate, params: &GuidanceParams) -> f64 {
    // The tolerance is never below the uncertainty of the reflection, whose centre is uncertain.
    let known_px = match lens_estimate.covariance {
        Some(_) => lens_estimate.pp_covariance_px2().trace().max(0.0).sqrt(),
        None => 0.0,
    };
    params.partner_offset_px.max(1.0 / lens_estimate.line_bias_per_px()).max(2.0 * known_px)
}

/// True if the line of `view` passes the principal point with less than half the uncertainty of the line of `other`: it
/// then carries at least four times the information.
pub(super) fn is_much_better(view: &View, other: &View, lens_estimate: &LensEstimate) -> bool {
    let pp = lens_estimate.camera.pp_px;
    view.line.variance_of_distance(&pp)
        < MUCH_BETTER * MUCH_BETTER * other.line.variance_of_distance(&pp)
}

/// Refuses a line with `|z| > 3.5` once there are five views, where
/// `z = (n·P − c) / √(var + nᵀ C_P n + (a_res n·(m − P))²)`. Source: `docs/method.md`, section 3.6.
fn consistent(view: &View, accepted: &[View], lens_estimate: &LensEstimate) -> Result<(), Refusal> {
    if accepted.len() < CONSISTENCY_FROM_VIEWS || lens_estimate.covariance.is_none() {
        return Ok(());
    }
    let pp = lens_estimate.camera.pp_px;
    let normal = view.line.normal();
    let pull_px = lens_estimate.line_bias_per_px() * normal.dot(&(view.mean_px - pp));
    let variance = view.line.variance_of_distance(&pp)
        + (normal.transpose() * lens_estimate.pp_covariance_px2() * normal).x
        + pull_px * pull_px;
    let distance_px = view.line.distance_px(&pp).abs();
    let sigmas = distance_px / variance.max(1e-12).sqrt();
    let floor_px = LENS_MODEL_FLOOR_PX * width_scale(lens_estimate.image_size);
    if sigmas > CONSISTENCY_SIGMAS && distance_px > floor_px {
        return Err(Refusal::Inconsistent { sigmas, wanted: CONSISTENCY_SIGMAS });
    }
    Ok(())
}
