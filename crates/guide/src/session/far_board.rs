use super::seen::Seen;
use crate::guidance::{GuidanceParams, LensEstimate, Reach, View, reach};
use boresight_geometry::boards::Board;

/// Limits of a board small in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FarBoard {
    /// Requested span: the larger of the shares of the picture's width and height.
    pub span_fraction: f64,
    /// Expected precision after eight views.
    pub reach: Reach,
    /// Expected precision with a board of twice the size, at least as good as `reach`; `None` if it
    /// doesn't fit into the picture.
    pub twice_the_size: Option<Reach>,
}

impl FarBoard {
    /// Computes the limits; `None` if the board fits nowhere.
    pub(super) fn of(
        accepted: &[View],
        board: &Board,
        lens_estimate: &LensEstimate,
        seen: &Seen,
        limits: &GuidanceParams,
    ) -> Option<Self> {
        let (noise_px, span_fraction) = (seen.noise_px(), limits.target_span_fraction);
        let reach = |limits| reach(accepted, board, lens_estimate, noise_px, limits);
        let twice =
            GuidanceParams { target_span_fraction: (2.0 * span_fraction).min(1.0), ..*limits };
        let now = reach(limits)?;
        let twice_the_size = reach(&twice).map(|twice| twice.or(now));
        Some(Self { span_fraction, reach: now, twice_the_size })
    }
}
