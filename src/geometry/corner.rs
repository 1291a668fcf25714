use nalgebra::{Matrix2, Point2, Vector2};

/// A measured board corner, with the covariance of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position in distorted pixels, as the camera delivers them.
    pub px: Point2<f64>,
    /// Covariance of the position error, px². Positive definite.
    pub covariance_px2: Matrix2<f64>,
}

impl Corner {
    /// A corner with independent errors of standard deviation `sigma_px` along both axes.
    pub fn isotropic(px: Point2<f64>, sigma_px: f64) -> Self {
        Self { px, covariance_px2: Matrix2::from_diagonal_element(sigma_px * sigma_px) }
    }

    /// Standard deviation of the error along one axis, root mean square over directions.
    pub fn sigma_px(&self) -> f64 {
        (self.covariance_px2.trace() / 2.0).sqrt()
    }
}

/// Mean position of the corners, in pixels; the origin if there are none.
pub fn mean_px(corners: &[Corner]) -> Point2<f64> {
    let sum = corners.iter().fold(Vector2::zeros(), |sum, corner| sum + corner.px.coords);
    Point2::from(sum / corners.len().max(1) as f64)
}
