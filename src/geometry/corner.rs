use nalgebra::{Matrix2, Point2, Vector2};

/// A board corner as seen in the picture, with what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position, distorted pixels as the camera delivers them.
    pub px: Point2<f64>,
    /// Covariance of the position error, px². Positive definite.
    pub covariance_px2: Matrix2<f64>,
}

impl Corner {
    /// A corner with equal, independent error of `sigma_px` along both axes.
    pub fn isotropic(px: Point2<f64>, sigma_px: f64) -> Self {
        Self { px, covariance_px2: Matrix2::from_diagonal_element(sigma_px * sigma_px) }
    }

    /// Standard deviation of the position error, root mean square over directions.
    pub fn sigma_px(&self) -> f64 {
        (self.covariance_px2.trace() / 2.0).sqrt()
    }
}

/// Where the corners are on average; the origin if there are none.
pub fn mean_px(corners: &[Corner]) -> Point2<f64> {
    let sum = corners.iter().fold(Vector2::zeros(), |sum, corner| sum + corner.px.coords);
    Point2::from(sum / corners.len().max(1) as f64)
}
