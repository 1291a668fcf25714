//! An earlier calibration of a lens that nobody has touched since: a new one is held to it.
//!
//! A board that stays small can't fix the lens of an installed camera, but an earlier calibration may know it. The two are
//! combined by their covariances, as two measurements of the same lens. If they contradict each other, the lens has
//! changed, and the new calibration stands alone.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::solve::lens_model::LensModel;
use crate::geometry::{Camera, LENS_PARAMETERS};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;
type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Probability with which two calibrations of the same lens agree.
const AGREEMENT: f64 = 0.999;
/// Directions in which the two covariances together are below this share of the largest, each parameter in units of its
/// own standard deviation, aren't compared: neither calibration estimates them.
const UNESTIMATED: f64 = 1e-9;

/// A lens and what is known about it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownLens {
    /// Lens parameters: see [`Camera::lens_parameters`].
    pub parameters: [f64; LENS_PARAMETERS],
    /// Their covariance.
    pub covariance: [[f64; LENS_PARAMETERS]; LENS_PARAMETERS],
}

/// What two calibrations of the same lens say together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined {
    /// The lens that both support.
    pub camera: Camera,
    /// Covariance of its parameters.
    pub covariance: LensMatrix,
    /// `dᵀ (C₁ + C₂)⁻¹ d` of their difference, χ² if both measure the same lens.
    pub statistic: f64,
    /// Its 0.999 quantile.
    pub limit: f64,
}

impl KnownLens {
    /// The lens `camera` with the `covariance` of its parameters.
    pub fn new(camera: &Camera, covariance: &LensMatrix) -> Self {
        Self {
            parameters: camera.lens_parameters(),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        }
    }

    /// The lens.
    pub fn camera(&self) -> Camera {
        Camera::from_lens_parameters(&self.parameters)
    }

    /// Covariance of its parameters.
    pub fn covariance(&self) -> LensMatrix {
        LensMatrix::from_fn(|i, j| self.covariance[i][j])
    }

    /// Combines it with a newer calibration: `x = x₁ + K (x₂ − x₁)`, `K = C₁ (C₁ + C₂)⁻¹`, `C = C₁ − K C₁`. `None` if
    /// a covariance isn't finite or isn't positive.
    pub fn combined_with(&self, camera: &Camera, covariance: &LensMatrix) -> Option<Combined> {
        let (ours, theirs) = (self.covariance(), *covariance);
        let sum = ours + theirs;
        if !sum.iter().all(|value| value.is_finite()) {
            return None;
        }
        let to_unit =
            LensVector::from_fn(
                |i, _| if sum[(i, i)] > 0.0 { sum[(i, i)].sqrt().recip() } else { 0.0 },
            );
        let to_unit = LensMatrix::from_diagonal(&to_unit);
        let eigen = (to_unit * sum * to_unit).symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        if !(largest > 0.0) || eigen.eigenvalues.min() < -1e-6 * largest {
            return None;
        }
        let is_compared = |value: f64| value > UNESTIMATED * largest;
        let compared = eigen.eigenvalues.iter().filter(|value| is_compared(**value)).count();
        let inverted =
            eigen.eigenvalues.map(|value| if is_compared(value) { value.recip() } else { 0.0 });
        let directions = to_unit * eigen.eigenvectors;
        let inverse = directions * LensMatrix::from_diagonal(&inverted) * directions.transpose();
        let newer = camera.lens_parameters();
        let difference = LensVector::from_fn(|i, _| newer[i] - self.parameters[i]);
        let gain = ours * inverse;
        let shift = gain * difference;
        let parameters = std::array::from_fn(|i| self.parameters[i] + shift[i]);
        let combined = ours - gain * ours;
        Some(Combined {
            camera: Camera::from_lens_parameters(&parameters),
            covariance: (combined + combined.transpose()) * 0.5,
            statistic: (difference.transpose() * inverse * difference).x,
            limit: ChiSquared::new(compared as f64).ok()?.inverse_cdf(AGREEMENT),
        })
    }
}

impl Combined {
    /// Whether the two calibrations measure the same lens, as far as they can tell.
    pub fn agrees(&self) -> bool {
        self.statistic <= self.limit
    }

    /// The simplest model with all coefficients of the lens.
    pub(super) fn model(&self) -> LensModel {
        let parameters = self.camera.lens_parameters();
        let last = (4..LENS_PARAMETERS).rev().find(|i| parameters[*i] != 0.0);
        let coefficients = last.map_or(0, |last| last - 3);
        let holds = |model: &LensModel| model.coefficients() >= coefficients;
        LensModel::ALL.into_iter().find(holds).unwrap_or(LensModel::K1K2P1P2K3)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    fn diagonal(sd: [f64; LENS_PARAMETERS]) -> LensMatrix {
        LensMatrix::from_diagonal(&LensVector::from(sd.map(|sd| sd * sd)))
    }

    const SD: [f64; LENS_PARAMETERS] = [4.0, 4.0, 3.0, 3.0, 0.01, 0.0, 0.0, 0.0, 0.0];

    #[test]
    fn two_equal_measurements_meet_in_the_middle_with_half_the_variance() {
        let one = Camera::pinhole(1000.0, Point2::new(640.0, 360.0));
        let two = Camera::pinhole(1004.0, Point2::new(642.0, 360.0));
        let both = KnownLens::new(&one, &diagonal(SD)).combined_with(&two, &diagonal(SD));
        let both = both.expect("positive");
        assert!((both.camera.f_px.x - 1002.0).abs() < 1e-9 && both.agrees());
        assert!((both.camera.pp_px.x - 641.0).abs() < 1e-9);
        assert!((both.covariance - diagonal(SD) * 0.5).amax() < 1e-9);
    }

    #[test]
    fn what_one_knows_exactly_stands() {
        let one = Camera::pinhole(1000.0, Point2::new(640.0, 360.0));
        let two = Camera::pinhole(1010.0, Point2::new(650.0, 360.0));
        let wide = diagonal(SD.map(|sd| 1000.0 * sd));
        let both =
            KnownLens::new(&one, &diagonal(SD)).combined_with(&two, &wide).expect("positive");
        assert!((both.camera.f_px.x - 1000.0).abs() < 1e-3 && both.agrees());
    }

    #[test]
    fn a_lens_that_has_changed_contradicts() {
        let one = Camera::pinhole(1000.0, Point2::new(640.0, 360.0));
        let two = Camera::pinhole(1040.0, Point2::new(640.0, 360.0));
        let both = KnownLens::new(&one, &diagonal(SD)).combined_with(&two, &diagonal(SD));
        let both = both.expect("positive");
        assert!(!both.agrees());
        // Five parameters have a variance: the quantile of the tables.
        assert!((both.limit / 20.515 - 1.0).abs() < 1e-4, "{}", both.limit);
    }
}
