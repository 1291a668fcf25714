//! Is a view good enough to be used at all?

use serde::Serialize;

use super::{GuidanceParams, View};

/// Why a view is not taken. Carries what was measured and what is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "why")]
pub enum Refusal {
    /// There is no board, or not a whole one.
    NotFound,
    /// The board faces the camera, so it has no principal line.
    NoLine,
    /// The board is not tilted enough.
    TooFlat {
        /// Tilt of this view.
        tilt_rad: f64,
        /// Least tilt.
        wanted_rad: f64,
    },
    /// The board is tilted too far.
    TooSteep {
        /// Tilt of this view.
        tilt_rad: f64,
        /// Largest tilt.
        wanted_rad: f64,
    },
    /// The principal line's direction is too uncertain.
    Unclear {
        /// Standard deviation of the direction.
        sigma_rad: f64,
        /// Largest accepted.
        wanted_rad: f64,
    },
    /// The board is too small in the picture.
    TooFar {
        /// Share of the picture that it spans.
        fill: f64,
        /// Least share.
        wanted: f64,
    },
    /// A corner is too close to the picture's edge.
    AtTheEdge {
        /// Distance from the edge.
        margin_px: f64,
        /// Least distance.
        wanted_px: f64,
    },
    /// The edges are blurred.
    Blurred {
        /// Width of the blur.
        blur_px: f64,
        /// Widest accepted.
        wanted_px: f64,
    },
    /// A view with almost this principal line is there already, and this is not its missing partner.
    AlreadyCovered {
        /// Angle to the nearest accepted principal line.
        nearest_rad: f64,
        /// Least angle.
        wanted_rad: f64,
    },
    /// The opposed partner of a view, but not at the reflected place.
    PartnerOff {
        /// Distance of the board's centre from the reflected one.
        offset_px: f64,
        /// Largest accepted.
        wanted_px: f64,
    },
    /// Between two slots, while the plan asks for slots.
    BetweenSlots {
        /// Angle to the nearest open slot.
        error_rad: f64,
        /// Largest accepted.
        wanted_rad: f64,
    },
    /// The principal line contradicts the views accepted so far.
    Inconsistent {
        /// Distance of the line from the principal point, in standard deviations.
        sigmas: f64,
        /// Largest accepted.
        wanted: f64,
    },
    /// The board moves.
    Moving {
        /// Speed of the fastest corner.
        speed_px_per_s: f64,
        /// Fastest accepted.
        wanted_px_per_s: f64,
    },
    /// Good, and being held: taken when the hold is complete.
    Holding {
        /// Share of the hold that has passed, 0 to 1.
        progress: f64,
    },
    /// The picture has another size than the session's.
    OtherSize {
        /// Width and height of this picture.
        size_px: (u32, u32),
        /// Width and height of the session's pictures.
        wanted_px: (u32, u32),
    },
    /// The camera is lost, frozen, or its focus or zoom has moved.
    CameraNotReady,
    /// The session is paused or complete.
    NotCollecting,
}

/// Checks the conditions that do not depend on the other views, METHOD section 3.1.
///
/// # Errors
///
/// The first [`Refusal`] that applies, in the order in which a person would mend it.
pub fn gate(view: &View, params: &GuidanceParams) -> Result<(), Refusal> {
    if view.margin_px < params.margin_px {
        return Err(Refusal::AtTheEdge { margin_px: view.margin_px, wanted_px: params.margin_px });
    }
    if view.fill < params.min_fill {
        return Err(Refusal::TooFar { fill: view.fill, wanted: params.min_fill });
    }
    let tilt_rad = view.tilt_rad.unwrap_or(0.0);
    if tilt_rad < params.min_tilt_rad {
        return Err(Refusal::TooFlat { tilt_rad, wanted_rad: params.min_tilt_rad });
    }
    if tilt_rad > params.max_tilt_rad {
        return Err(Refusal::TooSteep { tilt_rad, wanted_rad: params.max_tilt_rad });
    }
    let sigma_rad = view.line.sigma_phi_rad();
    if sigma_rad > params.max_sigma_phi_rad {
        return Err(Refusal::Unclear { sigma_rad, wanted_rad: params.max_sigma_phi_rad });
    }
    if view.blur_px > params.max_blur_px {
        return Err(Refusal::Blurred { blur_px: view.blur_px, wanted_px: params.max_blur_px });
    }
    Ok(())
}
