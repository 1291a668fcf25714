//! Earlier calibration of an untouched lens, used to hold a new calibration.
//!
//! A board that stays small can't fix the lens of an installed camera, but an earlier calibration
//! may. The two are combined by their covariances, as two measurements of the same lens. If they
//! contradict each other, the lens has changed, and the new calibration is used alone.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::solve::lens_model::LensModel;
use boresight_geometry::{Camera, LENS_PARAMETERS, LensKind, LensParameter};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;
type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Probability of agreement between two calibrations of the same lens.
const AGREEMENT: f64 = 0.999;
/// Least variance of a compared direction, as a share of the largest, over both covariances
/// together and with each parameter in units of the standard deviation. Below it, neither
/// calibration estimates the direction.
const UNESTIMATED: f64 = 1e-9;

/// Lens with covariance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredLens", into = "StoredLens")]
pub struct KnownLens {
    /// Kind of lens, which defines the coefficients.
    pub kind: LensKind,
    /// Lens parameters: see [`Camera::lens_parameters`].
    pub parameters: [f64; LENS_PARAMETERS],
    /// Covariance of the parameters.
    pub covariance: [[f64; LENS_PARAMETERS]; LENS_PARAMETERS],
}

/// [`KnownLens`] in a file: nine parameters if all others are zero, else all.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct StoredLens {
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    fisheye: bool,
    parameters: Vec<f64>,
    covariance: Vec<Vec<f64>>,
}

/// Parameters in a file, in order.
fn stored_parameters(is_brown: bool) -> impl Iterator<Item = LensParameter> {
    LensParameter::ALL.into_iter().filter(move |parameter| !is_brown || parameter.is_browns())
}

impl From<KnownLens> for StoredLens {
    fn from(lens: KnownLens) -> Self {
        let has = |i: usize| lens.parameters[i] != 0.0 || lens.covariance[i][i] != 0.0;
        let is_brown = LensParameter::ALL.iter().all(|of| of.is_browns() || !has(of.index()));
        let stored = || stored_parameters(is_brown).map(LensParameter::index);
        Self {
            fisheye: lens.kind.is_fisheye(),
            parameters: stored().map(|i| lens.parameters[i]).collect(),
            covariance: stored()
                .map(|i| stored().map(|j| lens.covariance[i][j]).collect())
                .collect(),
        }
    }
}

impl TryFrom<StoredLens> for KnownLens {
    type Error = &'static str;

    fn try_from(stored: StoredLens) -> Result<Self, Self::Error> {
        let count = stored.parameters.len();
        let is_square = stored.covariance.len() == count
            && stored.covariance.iter().all(|row| row.len() == count);
        let has = |is_brown| stored_parameters(is_brown).count() == count;
        let is_brown = has(true);
        if !(is_brown || has(false)) || !is_square {
            return Err("a known lens has 9 or 12 parameters, and a square covariance of them");
        }
        let place =
            |of: usize| stored_parameters(is_brown).position(|parameter| parameter.index() == of);
        let at = |row: &[f64], of: usize| place(of).map_or(0.0, |place| row[place]);
        Ok(Self {
            kind: LensKind::of_fisheye(stored.fisheye),
            parameters: std::array::from_fn(|i| at(&stored.parameters, i)),
            covariance: std::array::from_fn(|i| {
                let row = place(i).map(|place| &stored.covariance[place]);
                std::array::from_fn(|j| row.map_or(0.0, |row| at(row, j)))
            }),
        })
    }
}

/// Reason why a calibration can't be held to an earlier calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotHeld {
    /// The earlier lens is of another kind than the views call for.
    OtherKind {
        /// Kind of the earlier lens.
        earlier: LensKind,
        /// Kind of the new lens.
        now: LensKind,
    },
    /// A covariance isn't finite or isn't positive.
    NoCovariance,
    /// The focal length varies from view to view, so there's no lens to hold.
    FocalVaries,
}

/// Combination of two calibrations of the same lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Combined {
    /// Lens supported by both.
    pub camera: Camera,
    /// Covariance of the parameters.
    pub covariance: LensMatrix,
    /// `dᵀ (C₁ + C₂)⁻¹ d` of the difference, χ² if both measure the same lens.
    pub statistic: f64,
    /// 0.999 quantile of χ² for `statistic`.
    pub limit: f64,
}

impl KnownLens {
    /// Known lens with the parameters of `camera` and the given `covariance`.
    pub fn new(camera: &Camera, covariance: &LensMatrix) -> Self {
        Self {
            kind: camera.distortion.kind,
            parameters: camera.lens_parameters(),
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        }
    }

    /// Camera with the parameters.
    pub fn camera(&self) -> Camera {
        Camera::from_lens_parameters(self.kind, &self.parameters)
    }

    /// Covariance of the parameters.
    pub fn covariance(&self) -> LensMatrix {
        LensMatrix::from_fn(|i, j| self.covariance[i][j])
    }

    /// Combines the known lens with a newer calibration: `x = x₁ + K (x₂ − x₁)`,
    /// `K = C₁ (C₁ + C₂)⁻¹`, `C = C₁ − K C₁`.
    ///
    /// # Errors
    ///
    /// [`NotHeld`] if the lenses are of different kinds, or if a covariance isn't finite or isn't
    /// positive.
    pub(crate) fn combined_with(
        &self,
        camera: &Camera,
        covariance: &LensMatrix,
    ) -> Result<Combined, NotHeld> {
        let (earlier, now) = (self.kind, camera.distortion.kind);
        if earlier != now {
            return Err(NotHeld::OtherKind { earlier, now });
        }
        let (ours, theirs) = (self.covariance(), *covariance);
        let sum = ours + theirs;
        if !sum.iter().all(|value| value.is_finite()) {
            return Err(NotHeld::NoCovariance);
        }
        let to_unit =
            LensVector::from_fn(
                |i, _| if sum[(i, i)] > 0.0 { sum[(i, i)].sqrt().recip() } else { 0.0 },
            );
        let to_unit = LensMatrix::from_diagonal(&to_unit);
        let eigen = (to_unit * sum * to_unit).symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        if !(largest > 0.0) || eigen.eigenvalues.min() < -1e-6 * largest {
            return Err(NotHeld::NoCovariance);
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
        let distribution = ChiSquared::new(compared as f64).map_err(|_| NotHeld::NoCovariance)?;
        Ok(Combined {
            camera: camera.with_lens_parameters(&parameters),
            covariance: (combined + combined.transpose()) * 0.5,
            statistic: (difference.transpose() * inverse * difference).x,
            limit: distribution.inverse_cdf(AGREEMENT),
        })
    }
}

impl Combined {
    /// True if the two calibrations measure the same lens, within the uncertainty.
    pub fn agrees(&self) -> bool {
        self.statistic <= self.limit
    }

    /// Simplest model with all coefficients of the lens.
    pub(super) fn model(&self) -> LensModel {
        LensModel::simplest_with(&self.camera)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    fn diagonal(sd: [f64; LENS_PARAMETERS]) -> LensMatrix {
        LensMatrix::from_diagonal(&LensVector::from(sd.map(|sd| sd * sd)))
    }

    const SD: [f64; LENS_PARAMETERS] =
        [4.0, 4.0, 3.0, 3.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

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
        // Five parameters have a variance; the tables have the quantile for five.
        assert!((both.limit / 20.515 - 1.0).abs() < 1e-4, "{}", both.limit);
    }
}
