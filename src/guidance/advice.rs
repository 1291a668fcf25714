//! The one thing the person should do now.

use serde::Serialize;

use super::{GuidanceParams, Hold, Refusal, Target, View, direction_difference_rad};

/// What to do next. Structured: `text` turns it into words.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "do")]
pub enum Advice {
    /// Bring the whole board into the picture.
    ShowBoard,
    /// Make the board recede towards another direction.
    TipTowards {
        /// Direction in which it recedes now; `None` if it faces the camera.
        slot_rad: Option<f64>,
        /// Direction in which it should recede.
        wanted_rad: f64,
    },
    /// Change how far it is tipped.
    Tilt {
        /// Tilt now.
        tilt_rad: f64,
        /// Tilt wanted.
        wanted_rad: f64,
        /// Direction in which it recedes.
        slot_rad: f64,
    },
    /// Change the distance.
    Distance {
        /// Share of the picture that it spans now.
        fill: f64,
        /// Share wanted.
        wanted: f64,
    },
    /// Shift the board in the picture.
    Shift {
        /// How far right.
        right_px: f64,
        /// How far down.
        down_px: f64,
    },
    /// Stop moving.
    HoldStill {
        /// Speed now.
        speed_px_per_s: f64,
        /// Fastest accepted.
        wanted_px_per_s: f64,
    },
    /// Keep still until it is taken.
    Holding {
        /// Share of the hold that has passed.
        progress: f64,
    },
    /// Mend what the refusal says.
    Mend {
        /// What is wrong.
        refusal: Refusal,
    },
    /// Nothing: the session is complete.
    Finished,
}

/// The advice for a view that was refused for `refusal`, on the way to `target`.
pub fn advise(
    view: Option<&View>,
    refusal: Option<&Refusal>,
    hold: Option<&Hold>,
    target: Option<&Target>,
    params: &GuidanceParams,
) -> Advice {
    let Some(target) = target else { return Advice::Finished };
    match (refusal, hold) {
        (Some(Refusal::NotFound), _) => return Advice::ShowBoard,
        (Some(&Refusal::Holding { progress }), Some(_)) => return Advice::Holding { progress },
        (Some(&Refusal::Moving { speed_px_per_s, wanted_px_per_s }), _) => {
            return Advice::HoldStill { speed_px_per_s, wanted_px_per_s };
        }
        (
            Some(
                &refusal @ (Refusal::Blurred { .. }
                | Refusal::AtTheEdge { .. }
                | Refusal::CameraNotReady),
            ),
            _,
        ) => {
            return Advice::Mend { refusal };
        }
        _ => {}
    }
    let Some(view) = view else {
        return Advice::TipTowards { slot_rad: None, wanted_rad: target.slot_rad };
    };
    let tilt_rad = view.tilt_rad.unwrap_or(0.0);
    let turn_rad = direction_difference_rad(target.slot_rad, view.slot_rad());
    let shift_px = middle_px(&target.ghost_px) - view.mean_px;
    let fill_ratio = span_px(&target.ghost_px)
        / span_px(&view.corners.iter().map(|corner| corner.px).collect::<Vec<_>>());
    if tilt_rad < 0.4 * params.min_tilt_rad {
        Advice::TipTowards { slot_rad: None, wanted_rad: target.slot_rad }
    } else if turn_rad.abs() > params.max_slot_error_rad {
        Advice::TipTowards { slot_rad: Some(view.slot_rad()), wanted_rad: target.slot_rad }
    } else if tilt_rad < params.min_tilt_rad || tilt_rad > params.max_tilt_rad {
        Advice::Tilt { tilt_rad, wanted_rad: target.tilt_rad, slot_rad: target.slot_rad }
    } else if !(0.8..1.3).contains(&fill_ratio) {
        Advice::Distance { fill: view.fill, wanted: (view.fill * fill_ratio).min(1.0) }
    } else if shift_px.norm() > params.partner_offset_px {
        Advice::Shift { right_px: shift_px.x, down_px: shift_px.y }
    } else if let Some(&refusal) = refusal {
        Advice::Mend { refusal }
    } else {
        Advice::TipTowards { slot_rad: Some(view.slot_rad()), wanted_rad: target.slot_rad }
    }
}

fn middle_px(points: &[nalgebra::Point2<f64>]) -> nalgebra::Point2<f64> {
    let sum = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords);
    nalgebra::Point2::from(sum / points.len().max(1) as f64)
}

/// Root mean square distance of the points from their middle.
fn span_px(points: &[nalgebra::Point2<f64>]) -> f64 {
    let middle = middle_px(points);
    let sum: f64 = points.iter().map(|p| (p - middle).norm_squared()).sum();
    (sum / points.len().max(1) as f64).sqrt().max(1e-9)
}
