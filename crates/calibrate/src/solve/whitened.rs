//! Corners in units of the stated error.

use nalgebra::{Matrix2, Point2};

use boresight_geometry::Corner;

/// Corner with the square root of the information matrix.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whitened {
    /// Index of the corner on the board.
    pub(crate) place: usize,
    pub(crate) board_m: Point2<f64>,
    pub(crate) px: Point2<f64>,
    /// `L⁻¹`, 1/px.
    pub(crate) whitener: Matrix2<f64>,
    /// See [`Corner::common_px`].
    pub(crate) common_px: f64,
}

/// Whitened corner; `None` if the corner isn't finite, or its covariance isn't positive definite.
pub(crate) fn whiten(place: usize, corner: &Corner, board_m: &Point2<f64>) -> Option<Whitened> {
    let c = &corner.covariance_px2;
    let l11 = c[(0, 0)].sqrt();
    let l21 = c[(1, 0)] / l11;
    let l22 = (c[(1, 1)] - l21 * l21).sqrt();
    let whitener = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
    let px = corner.px;
    let usable = whitener.iter().chain(px.coords.iter()).all(|x| x.is_finite())
        && corner.common_px.is_finite()
        && l11 > 0.0
        && l22 > 0.0;
    usable.then_some(Whitened {
        place,
        board_m: *board_m,
        px,
        whitener,
        common_px: corner.common_px,
    })
}
