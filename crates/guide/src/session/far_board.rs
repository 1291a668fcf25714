use super::seen::Seen;
use crate::guidance::{GuidanceParams, LensEstimate, Reach, reach};
use boresight_geometry::board::Checkerboard;

/// Limits of a board that stays small in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarBoard {
    /// Larger of the shares of the picture's width and height that it is asked to span.
    pub span_fraction: f64,
    /// Expected precision after eight views.
    pub reach: Reach,
    /// Expected precision with a board of twice the size in the same places; `None` if it doesn't fit into the picture.
    pub twice_the_size: Option<Reach>,
}

impl FarBoard {
    /// `None` if the board fits nowhere.
    pub(super) fn of(
        board: &Checkerboard,
        lens_estimate: &LensEstimate,
        seen: &Seen,
        limits: &GuidanceParams,
    ) -> Option<Self> {
        let (noise_px, span_fraction) = (seen.noise_px(), limits.target_span_fraction);
        let twice =
            GuidanceParams { target_span_fraction: (2.0 * span_fraction).min(1.0), ..*limits };
        Some(Self {
            span_fraction,
            reach: reach(board, lens_estimate, noise_px, limits)?,
            twice_the_size: reach(board, lens_estimate, noise_px, &twice),
        })
    }
}
