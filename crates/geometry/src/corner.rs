use std::borrow::Cow;

use nalgebra::{Matrix2, Point2, Vector2};

/// Measured board corner with the covariance of the error, or the expected place of an unseen
/// corner.
///
/// The corners of a view fill the whole board, in its order. A corner covered or outside of the
/// picture is [`unseen`](Self::unseen): fits leave it out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position in distorted pixels, as delivered by the camera. For an unseen corner, the expected
    /// position; NaN if there is none.
    pub px: Point2<f64>,
    /// Covariance of the position error, px². Positive definite; infinite for an unseen corner.
    pub covariance_px2: Matrix2<f64>,
    /// Standard deviation, per axis, of an additional error common to all corners of a view in
    /// proportion to this number, as by a rolling shutter and a moving board. It changes its sign
    /// at the middle row; 0 without such an error.
    pub common_px: f64,
}

/// Rounding steps of a position, per pixel: a hundredth of the smallest error of a detector.
const STEPS_PER_PX: f64 = 1e5;
/// Number of digits of a rounded covariance.
const COVARIANCE_DIGITS: i32 = 4;
/// Largest relative change of a covariance's determinant by rounding.
const DETERMINANT_CHANGE: f64 = 0.02;

impl Corner {
    /// Corner with the given covariance, and no common error.
    pub fn new(px: Point2<f64>, covariance_px2: Matrix2<f64>) -> Self {
        Self { px, covariance_px2, common_px: 0.0 }
    }

    /// Corner with independent errors of standard deviation `sigma_px` along both axes.
    ///
    /// ```
    /// # use boresight_geometry::Corner;
    /// # use nalgebra::Point2;
    /// let corner = Corner::isotropic(Point2::new(310.2, 95.7), 0.05);
    /// assert!(corner.is_seen());
    /// assert!((corner.sigma_px() - 0.05).abs() < 1e-12);
    /// ```
    pub fn isotropic(px: Point2<f64>, sigma_px: f64) -> Self {
        Self::new(px, Matrix2::from_diagonal_element(sigma_px * sigma_px))
    }

    /// Unseen corner, expected at `px`, which may lie outside of the picture.
    ///
    /// ```
    /// # use boresight_geometry::{Corner, seen_count};
    /// # use nalgebra::Point2;
    /// let seen = Corner::isotropic(Point2::new(310.2, 95.7), 0.05);
    /// let corners = [seen, Corner::unseen(Point2::new(350.0, 95.7))];
    /// assert_eq!(seen_count(&corners), 1);
    /// ```
    pub fn unseen(px: Point2<f64>) -> Self {
        Self::new(px, Matrix2::from_diagonal_element(f64::INFINITY))
    }

    /// True if the corner was measured.
    pub fn is_seen(&self) -> bool {
        self.covariance_px2[(0, 0)] != f64::INFINITY
    }

    /// Standard deviation of the error along an axis, root mean square over directions.
    pub fn sigma_px(&self) -> f64 {
        (self.covariance_px2.trace() / 2.0).sqrt()
    }

    /// Corner in a picture with rows scaled by `factor`.
    #[doc(hidden)]
    pub fn with_rows_scaled(&self, factor: f64) -> Self {
        let px = Point2::new(self.px.x, self.px.y * factor);
        if !self.is_seen() {
            return Self::unseen(px);
        }
        let scale = Matrix2::new(1.0, 0.0, 0.0, factor);
        Self { px, covariance_px2: scale * self.covariance_px2 * scale, ..*self }
    }

    /// Corner rounded to few decimal digits, far below the error, for short recordings: positions
    /// to 10⁻⁵ px, covariances to four digits of the larger variance. A covariance so narrow that
    /// rounding would change its determinant by more than 2 % is unchanged.
    #[doc(hidden)]
    pub fn in_few_digits(&self) -> Self {
        let covariance = self.covariance_px2;
        // If the covariance is no number, the magnitude doesn't matter: nothing is rounded then.
        let magnitude = libm::log10(covariance.diagonal().max()).floor().clamp(-20.0, 20.0) as i32;
        let digits = COVARIANCE_DIGITS - 1 - magnitude;
        let rounded = covariance.map(|value| to_steps(value, 10_f64.powi(digits.clamp(0, 22))));
        let change = rounded.determinant() / covariance.determinant();
        let is_same = (change - 1.0).abs() <= DETERMINANT_CHANGE;
        Self {
            px: self.px.map(|value| to_steps(value, STEPS_PER_PX)),
            covariance_px2: if is_same { rounded } else { covariance },
            common_px: self.common_px,
        }
    }
}

fn to_steps(value: f64, steps_per_unit: f64) -> f64 {
    (value * steps_per_unit).round() / steps_per_unit
}

/// Mean position of the seen corners, in pixels; the origin if there are none.
///
/// ```
/// # use boresight_geometry::{Corner, mean_px};
/// # use nalgebra::Point2;
/// let at = |x| Corner::isotropic(Point2::new(x, 5.0), 0.1);
/// let corners = [at(1.0), at(3.0), Corner::unseen(Point2::new(100.0, 0.0))];
/// assert_eq!(mean_px(&corners), Point2::new(2.0, 5.0));
/// ```
pub fn mean_px(corners: &[Corner]) -> Point2<f64> {
    let seen = || corners.iter().filter(|corner| corner.is_seen());
    let sum = seen().fold(Vector2::zeros(), |sum, corner| sum + corner.px.coords);
    Point2::from(sum / seen().count().max(1) as f64)
}

/// Number of seen corners.
pub fn seen_count(corners: &[Corner]) -> usize {
    corners.iter().filter(|corner| corner.is_seen()).count()
}

/// Seen corners with board points; the same slices if all are seen.
pub(super) fn seen<'a>(
    board_points_m: &'a [Point2<f64>],
    corners: &'a [Corner],
) -> (Cow<'a, [Point2<f64>]>, Cow<'a, [Corner]>) {
    if corners.iter().all(Corner::is_seen) || board_points_m.len() != corners.len() {
        return (Cow::Borrowed(board_points_m), Cow::Borrowed(corners));
    }
    let both = board_points_m.iter().zip(corners).filter(|(_, corner)| corner.is_seen());
    let (points, corners): (Vec<_>, Vec<_>) = both.unzip();
    (
        Cow::Owned(points.into_iter().copied().collect()),
        Cow::Owned(corners.into_iter().copied().collect()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_digits_change_less_than_the_error() {
        let corner = Corner::new(
            Point2::new(143.898_795_128_915_14, 0.000_012_345),
            Matrix2::new(3.694_550_935e-5, 6.308_55e-7, 6.308_55e-7, 3.721_856e-5),
        );
        let short = corner.in_few_digits();
        assert_eq!(short.px, Point2::new(143.8988, 0.00001));
        assert_eq!(short.covariance_px2, Matrix2::new(3.695e-5, 6.3e-7, 6.3e-7, 3.722e-5));
        assert_eq!(short.in_few_digits(), short);
        assert_eq!(serde_json::to_string(&short.px.x).expect("a number"), "143.8988");
    }

    #[test]
    fn an_unseen_corner_stays_unseen() {
        let unseen = Corner::unseen(Point2::new(-3.5, 7.0));
        assert!(!unseen.is_seen());
        assert_eq!(unseen.in_few_digits(), unseen);
        let scaled = unseen.with_rows_scaled(1.5);
        assert!(!scaled.is_seen() && scaled.px == Point2::new(-3.5, 10.5));
        let seen = Corner::isotropic(Point2::new(1.0, 2.0), 0.1);
        assert_eq!(mean_px(&[unseen, seen]), seen.px);
        assert_eq!(seen_count(&[unseen, seen]), 1);
    }

    #[test]
    fn few_digits_never_make_a_covariance_singular() {
        for narrow in [1e-3, 1e-6, 1e-9, 1e-12] {
            let (sin, cos) = 0.4_f64.sin_cos();
            let turn = Matrix2::new(cos, -sin, sin, cos);
            let along = Matrix2::from_diagonal(&Vector2::new(0.37, 0.37 * narrow));
            let covariance_px2 = turn * along * turn.transpose();
            let short = Corner::new(Point2::origin(), covariance_px2).in_few_digits();
            let change = short.covariance_px2.determinant() / covariance_px2.determinant();
            assert!((0.98..=1.02).contains(&change), "{narrow}: {change}");
        }
        let none = Corner::new(Point2::origin(), Matrix2::zeros());
        assert_eq!(none.in_few_digits(), none);
    }
}
