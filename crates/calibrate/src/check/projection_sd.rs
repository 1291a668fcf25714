//! Projects the covariance of the lens to pixels: the standard deviation of the image of a ray,
//! over the picture.

use nalgebra::{Matrix3, Point2, SMatrix};

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::solve::schur_lm::inverse;
use boresight_geometry::{
    Camera, LENS_PARAMETERS, RayProjection, cell_centres_px, frame::ImageSize,
};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Derivatives of the image by the lens parameters, compensated for rotation of the camera, on a
/// grid of pixels.
///
/// `M = J − R R_c⁺ J_c`, with `J` = d px / d lens of fixed rays, `R` = d px / d rotation of the
/// camera, and `c` the points over which the rotation is the best ([`Self::turned_over`]). It's
/// compensated because the orientation of the camera isn't part of a calibration (as in mrcal's
/// projection uncertainty).
#[derive(Clone, Debug)]
pub struct ProjectionJacobian {
    /// Grid points inside the field of the lens model, in pixels.
    pub px: Vec<Point2<f64>>,
    /// Two rows of `M` per grid point; columns in the order of [`LENS_PARAMETERS`].
    pub jac_lens: Vec<SMatrix<f64, 2, LENS_PARAMETERS>>,
    /// Number of grid points beyond the fold of the lens model, which have no ray. Points outside
    /// the round picture of a fisheye lens aren't counted.
    pub unmapped: usize,
    /// Two rows of `R` per grid point.
    jac_rotation: Vec<SMatrix<f64, 2, 3>>,
    /// Rotation in radians that compensates for each lens parameter.
    explained: SMatrix<f64, 3, LENS_PARAMETERS>,
}

/// Standard deviation of projection at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSd {
    /// Grid point in the picture, in pixels.
    pub px: Point2<f64>,
    /// Root mean square over directions, in pixels.
    pub sd_px: f64,
}

/// Rotation-compensated standard deviation of projection over the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectionSd {
    /// Mean over the grid, in pixels.
    pub mean_px: f64,
    /// Maximum over the grid, in pixels.
    pub max_px: f64,
    /// 95 % quantile, over repeated calibrations, of the root mean square error of projection over
    /// the grid, in pixels. In a [`Calibration`](crate::Calibration), it is compensated by the best
    /// rotation over the whole picture, all else by the best over the covered part.
    pub bound_px: f64,
    /// Values of the mapped grid points, row by row.
    pub grid: Vec<GridSd>,
    /// Number of grid points beyond the fold of the lens model, excluded from all figures.
    pub unmapped: usize,
}

/// Part of the picture with sufficiently certain projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidArea {
    /// Error bound of the area's points, each with 95 % probability, in pixels: root mean square
    /// over directions.
    pub goal_px: f64,
    /// Share of the picture, 0 to 1.
    pub share: f64,
    /// 95 % quantile of the root mean square error over the area, in pixels; `None` if it's empty.
    pub bound_px: Option<f64>,
}

/// `M` of `camera` at all [`cell_centres_px`] of the picture.
///
/// `None` if too few of them lie inside the field of the lens model to determine a rotation.
pub fn projection_jacobian(camera: &Camera, image_size: ImageSize) -> Option<ProjectionJacobian> {
    let mut jacobian = ProjectionJacobian {
        px: Vec::new(),
        jac_lens: Vec::new(),
        unmapped: 0,
        jac_rotation: Vec::new(),
        explained: SMatrix::zeros(),
    };
    for px in cell_centres_px(image_size) {
        let Some(at) = camera.ray_from_px(&px).and_then(|ray| camera.project_ray(&ray)) else {
            jacobian.unmapped += usize::from(!camera.is_outside_field(&px));
            continue;
        };
        jacobian.jac_rotation.push(at.jac_rotation);
        jacobian.px.push(px);
        jacobian.jac_lens.push(at.jac_lens);
    }
    jacobian.turned_over(|_| true)
}

impl ProjectionJacobian {
    /// Derivatives compensated by the best rotation over the grid points selected by `is_inside`. A
    /// bound over a part of the picture takes the rotation over that part: the lens elsewhere
    /// doesn't rotate the camera.
    ///
    /// `None` if too few points are selected to determine a rotation.
    pub fn turned_over(&self, is_inside: impl Fn(&Point2<f64>) -> bool) -> Option<Self> {
        let mut turned = self.clone();
        let mut turn_information = Matrix3::zeros();
        let mut turn_by_lens = SMatrix::<f64, 3, LENS_PARAMETERS>::zeros();
        let all = self.px.iter().zip(&self.jac_rotation).zip(&self.jac_lens);
        for ((_, turn), lens) in all.filter(|((px, _), _)| is_inside(px)) {
            turn_information += turn.transpose() * turn;
            turn_by_lens += turn.transpose() * lens;
        }
        let explained = inverse(&turn_information)? * turn_by_lens;
        for (turn, lens) in turned.jac_rotation.iter().zip(&mut turned.jac_lens) {
            *lens -= turn * explained;
        }
        turned.explained += explained;
        Some(turned)
    }

    /// `M` of the same `camera` at the image of any ray, compensated by the rotation of the grid.
    pub fn at(&self, ray: &RayProjection) -> SMatrix<f64, 2, LENS_PARAMETERS> {
        ray.jac_lens - ray.jac_rotation * self.explained
    }

    /// Standard deviation of projection for the lens covariance `C`: `√(tr(M C Mᵀ)/2)` at each grid
    /// point.
    pub fn sd(&self, covariance: &LensMatrix) -> ProjectionSd {
        let grid: Vec<GridSd> = self
            .px
            .iter()
            .zip(&self.jac_lens)
            .map(|(px, jac_lens)| {
                let variance = (jac_lens * covariance * jac_lens.transpose()).trace() / 2.0;
                GridSd { px: *px, sd_px: variance.max(0.0).sqrt() }
            })
            .collect();
        let sum: f64 = grid.iter().map(|point| point.sd_px).sum();
        ProjectionSd {
            mean_px: sum / grid.len().max(1) as f64,
            bound_px: self.bound_px(covariance),
            max_px: grid.iter().map(|point| point.sd_px).fold(0.0, f64::max),
            grid,
            unmapped: self.unmapped,
        }
    }

    /// 95 % bound of the root mean square error over the grid, in pixels. The mean square error is
    /// distributed as `Σ λᵢ χ²₁`, with λ the eigenvalues of `W C` and `W` the mean of `MᵀM/2`. Its
    /// quantile is taken from the gamma distribution with the same mean and variance (Satterthwaite
    /// 1946).
    pub(crate) fn bound_px(&self, covariance: &LensMatrix) -> f64 {
        Self::quantile_px(&self.weight(), covariance)
    }

    /// 95 % bound of the error over the grid points selected by `is_inside`. `None` if there are
    /// none.
    pub(crate) fn bound_px_inside(
        &self,
        covariance: &LensMatrix,
        is_inside: impl Fn(&Point2<f64>) -> bool,
    ) -> Option<f64> {
        let inside = self.px.iter().zip(&self.jac_lens).filter(|(px, _)| is_inside(px));
        let (mut weight, mut count) = (LensMatrix::zeros(), 0);
        for (_, jac_lens) in inside {
            weight += jac_lens.transpose() * jac_lens;
            count += 1;
        }
        (count > 0).then(|| Self::quantile_px(&(weight / f64::from(count)), covariance))
    }

    /// Area of the grid points with a 95 % error bound of at most `goal_px`.
    pub fn valid_area(&self, covariance: &LensMatrix, goal_px: f64) -> ValidArea {
        let (mut weight, mut count) = (LensMatrix::zeros(), 0);
        for jac_lens in &self.jac_lens {
            let here = jac_lens.transpose() * jac_lens;
            if Self::quantile_px(&here, covariance) <= goal_px {
                weight += here;
                count += 1;
            }
        }
        let of = self.jac_lens.len() + self.unmapped;
        let bound_px =
            (count > 0).then(|| Self::quantile_px(&(weight / f64::from(count)), covariance));
        ValidArea { goal_px, share: f64::from(count) / of.max(1) as f64, bound_px }
    }

    fn quantile_px(weight: &LensMatrix, covariance: &LensMatrix) -> f64 {
        let product = weight * covariance / 2.0;
        let (mean, variance) = (product.trace(), 2.0 * (product * product).trace());
        let freedom = 2.0 * mean * mean / variance;
        ChiSquared::new(freedom).map_or(mean.max(0.0).sqrt(), |chi2| {
            (variance / (2.0 * mean) * chi2.inverse_cdf(0.95)).max(0.0).sqrt()
        })
    }

    /// Mean of `MᵀM` over the grid points, so that the mean of `tr(M C Mᵀ) = tr(MᵀM C)` takes one
    /// product.
    pub fn weight(&self) -> LensMatrix {
        let mut weight = LensMatrix::zeros();
        for jac_lens in &self.jac_lens {
            weight += jac_lens.transpose() * jac_lens;
        }
        weight / self.jac_lens.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use boresight_geometry::{GRID_COLUMNS, GRID_ROWS, LensParameter};

    const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    #[test]
    fn a_turned_camera_is_no_error() {
        // Without distortion, moving the PP by a pixel is a rotation to first order near the
        // centre, so nearly all of it is compensated; a change of f is not.
        let camera = Camera::pinhole(6000.0, SIZE.centre_px());
        let jacobian = projection_jacobian(&camera, SIZE).expect("covers the picture");
        let mut covariance = LensMatrix::zeros();
        covariance[(2, 2)] = 1.0;
        assert!(jacobian.sd(&covariance).max_px < 0.02);
        let mut covariance = LensMatrix::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).fill(1.0);
        assert!(jacobian.sd(&covariance).max_px > 0.05);
        let weighted = (jacobian.weight() * covariance).trace() / 2.0;
        let mean_square =
            jacobian.sd(&covariance).grid.iter().map(|p| p.sd_px.powi(2)).sum::<f64>()
                / f64::from(GRID_COLUMNS * GRID_ROWS);
        assert!((weighted - mean_square).abs() < 1e-12);
    }

    #[test]
    fn what_the_lens_does_elsewhere_doesnt_turn_the_camera() {
        let camera = Camera::pinhole(500.0, SIZE.centre_px());
        let whole = projection_jacobian(&camera, SIZE).expect("covers the picture");
        let is_inside = |px: &Point2<f64>| (px - SIZE.centre_px()).norm() < 250.0;
        let inside = whole.turned_over(is_inside).expect("covers the middle");
        // Decentring grows with the square of the radius: the dark corners rotate the camera more
        // than the middle.
        let mut covariance = LensMatrix::zeros();
        covariance[(LensParameter::P2.index(), LensParameter::P2.index())] = 1e-6;
        let bound_px = |by: &ProjectionJacobian| by.bound_px_inside(&covariance, is_inside);
        let (of_whole, of_inside) = (bound_px(&whole), bound_px(&inside));
        assert!(of_inside < of_whole.map(|px| 0.5 * px), "{of_inside:?} {of_whole:?}");
        assert!(inside.bound_px(&covariance) > whole.bound_px(&covariance));
        assert!(whole.turned_over(|_| false).is_none());
    }

    #[test]
    fn compensation_is_the_best_turn() {
        let camera = Camera::pinhole(900.0, SIZE.centre_px());
        let jacobian = projection_jacobian(&camera, SIZE).expect("covers the picture");
        let step = 1e-4;
        let mut covariance = LensMatrix::zeros();
        covariance[(2, 2)] = step * step;
        let predicted = jacobian.sd(&covariance);
        // The same value by moving a camera and searching for the best rotation.
        let mut moved = camera;
        moved.pp_px.x += step;
        let miss = |turn: f64| {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, turn, 0.0));
            jacobian
                .px
                .iter()
                .filter_map(|px| {
                    let normalized = camera.normalized_from_px(px)?;
                    let ray = rotation * Point2::new(normalized.x, normalized.y).to_homogeneous();
                    Some((moved.project(&ray.into())? - px).norm_squared())
                })
                .sum::<f64>()
        };
        let best = (-2000..2000).map(|i| miss(f64::from(i) * 1e-10)).fold(f64::INFINITY, f64::min);
        let expected: f64 = predicted.grid.iter().map(|p| 2.0 * p.sd_px.powi(2)).sum();
        assert!((best / expected - 1.0).abs() < 1e-3, "{best} {expected}");
    }
}
