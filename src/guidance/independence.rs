//! Does a view's principal line add anything to those accepted?

use std::f64::consts::PI;

use super::{
    GuidanceParams, LensEstimate, Plan, Refusal, SLOTS_DEG, View, direction_difference_rad,
};

/// What a view is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case", tag = "role")]
pub enum Role {
    /// Its principal line is linearly independent of all accepted ones.
    NewDirection,
    /// It is the 180°-opposed partner of an accepted view that had none.
    Partner {
        /// Index of that view among the accepted ones.
        of: usize,
    },
    /// The person insisted.
    Forced,
}

/// Views after which a principal line can be tested against the others, METHOD section 3.6.
const CONSISTENCY_FROM_VIEWS: usize = 5;
const CONSISTENCY_SIGMAS: f64 = 3.5;

/// The role of `view` among the `accepted` ones, METHOD sections 3.2, 3.3 and 3.6.
///
/// Two principal lines are independent iff their angle ψ satisfies `ψ ≥ independent_rad` and
/// `ψ > independent_sigmas · √(sd φ₁² + sd φ₂²)`. A view is useful iff its line is independent of
/// every accepted one, or it is the opposed partner of an accepted view that has none.
///
/// # Errors
///
/// The [`Refusal`] that says what is missing.
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
        let opposed_rad = direction_difference_rad(view.slot_rad(), other.slot_rad() + PI).abs();
        if opposed_rad <= params.partner_slot_rad && partner_of(index, accepted).is_none() {
            match reflected(view, other, lens_estimate, params) {
                Ok(()) => return Ok(Role::Partner { of: index }),
                Err(refusal) => partner_refusal = Some(refusal),
            }
        }
        let sigma_rad = view.line.sigma_phi_rad().hypot(other.line.sigma_phi_rad());
        let angle_rad = view.line.angle_to(&other.line);
        if angle_rad < params.independent_rad || angle_rad <= params.independent_sigmas * sigma_rad
        {
            nearest_rad = nearest_rad.min(angle_rad);
        }
    }
    if let Some(refusal) = partner_refusal {
        return Err(refusal);
    }
    if nearest_rad.is_finite() {
        return Err(Refusal::AlreadyCovered { nearest_rad, wanted_rad: params.independent_rad });
    }
    on_a_slot(view, accepted.len(), params)?;
    Ok(Role::NewDirection)
}

/// The accepted view that was taken as the opposed partner of the one at `index`, or whose partner that
/// one was taken as. Settled at acceptance: later, better knowledge of the camera does not undo it.
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
    let wanted = lens_estimate.camera.pp_px.coords * 2.0 - of.mean_px.coords;
    (view.mean_px.coords - wanted).norm()
}

fn partner_limit_px(lens_estimate: &LensEstimate, params: &GuidanceParams) -> f64 {
    // A reflection about an uncertain point cannot be asked for more exactly than that point is known.
    let known_px = match lens_estimate.covariance {
        Some(_) => lens_estimate.pp_covariance_px2().trace().max(0.0).sqrt(),
        None => 0.0,
    };
    params.partner_offset_px.max(1.0 / lens_estimate.line_bias_per_px()).max(2.0 * known_px)
}

/// In a plan of slots, a new direction must be one of the slots' while slots are open.
fn on_a_slot(view: &View, accepted: usize, params: &GuidanceParams) -> Result<(), Refusal> {
    let slots = match params.plan {
        Plan::Quick => 4,
        Plan::Full => 8,
        Plan::Adaptive if accepted < 4 => 8,
        Plan::Adaptive => return Ok(()),
    };
    let error_rad = SLOTS_DEG[..slots.min(SLOTS_DEG.len())]
        .iter()
        .map(|slot| direction_difference_rad(view.slot_rad(), slot.to_radians()).abs())
        .fold(f64::INFINITY, f64::min);
    if error_rad <= params.max_slot_error_rad {
        Ok(())
    } else {
        Err(Refusal::BetweenSlots { error_rad, wanted_rad: params.max_slot_error_rad })
    }
}

/// `z = (n·P − c) / √(var + nᵀ C_P n + (a_res n·(m − P))²)`, rejected beyond 3.5, once five views are in.
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
    let sigmas = view.line.distance_px(&pp).abs() / variance.max(1e-12).sqrt();
    // A corner error floor of the lens model itself; a tenth of a pixel is never an inconsistency.
    if sigmas > CONSISTENCY_SIGMAS && view.line.distance_px(&pp).abs() > 2.0 {
        return Err(Refusal::Inconsistent { sigmas, wanted: CONSISTENCY_SIGMAS });
    }
    Ok(())
}
