//! Comparison of two calibrations of a camera by the stated covariances: the statistic of a check,
//! without its views.

use nalgebra::{Matrix3, Vector3};

use super::{
    lens_change::{F_AND_PP_LIMIT, Told, f_and_pp_shift},
    shift::{DriftVerdict, Shift, relevant_shift_px},
    solve::schur_lm::inverse,
};
use boresight_geometry::frame::ImageSize;

/// Focal length and principal point with covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatedLens {
    /// Focal length and principal point x, y in pixels.
    pub f_pp_px: Vector3<f64>,
    /// Covariance of `f_pp_px`, px².
    pub covariance_px2: Matrix3<f64>,
}

impl StatedLens {
    /// Weighted mean of calibrations of a lens. If their scatter exceeds their stated uncertainty,
    /// the mean's covariance is inflated accordingly. `None` without any, or if a covariance isn't
    /// positive definite.
    pub fn mean(lenses: &[Self]) -> Option<Self> {
        let informations: Vec<Matrix3<f64>> =
            lenses.iter().map(|lens| inverse(&lens.covariance_px2)).collect::<Option<_>>()?;
        if let [only] = lenses {
            return Some(*only);
        }
        let covariance_px2 = inverse(&informations.iter().sum())?;
        let weighted = lenses.iter().zip(&informations).map(|(lens, w)| w * lens.f_pp_px);
        let f_pp_px = covariance_px2 * weighted.sum::<Vector3<f64>>();
        let scatter: f64 = lenses
            .iter()
            .zip(&informations)
            .map(|(lens, w)| {
                let off_px = lens.f_pp_px - f_pp_px;
                (off_px.transpose() * w * off_px).x
            })
            .sum();
        let freedom = 3.0 * (lenses.len() - 1) as f64;
        let excess = (scatter / freedom).max(1.0);
        Some(Self { f_pp_px, covariance_px2: covariance_px2 * excess })
    }
}

/// Difference between two calibrations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensDifference {
    /// Verdict on the size of the change.
    pub verdict: DriftVerdict,
    /// True if the change exceeds chance.
    pub is_significant: bool,
    /// New less old focal length and principal point, in pixels.
    pub change_px: Vector3<f64>,
    /// Standard deviations of the change.
    pub sd_px: Vector3<f64>,
    /// `dᵀS⁻¹d` of the change d with covariance S, the sum of both: χ² with 3 degrees of freedom if
    /// nothing changed.
    pub statistic: f64,
    /// Largest displacement of the image of a ray over the picture.
    pub shift: Shift,
}

impl LensDifference {
    /// Compares two calibrations of pictures of `image_size`; `None` if a covariance isn't positive
    /// definite or a number isn't finite. The limits are the same as in
    /// [`drift`](super::drift::drift), but the covariance is taken as exact.
    pub fn of(old: &StatedLens, new: &StatedLens, image_size: ImageSize) -> Option<Self> {
        let covariance = old.covariance_px2 + new.covariance_px2;
        let change_px = new.f_pp_px - old.f_pp_px;
        let information = inverse(&covariance)?;
        let statistic = (change_px.transpose() * information * change_px).x;
        let told = Told::EXACTLY;
        let shift = f_and_pp_shift(&old.f_pp_px, (&change_px, &covariance), image_size, &told)?;
        let is_significant = statistic > told.limit(3, F_AND_PP_LIMIT)?;
        (statistic.is_finite() && shift.most_px.is_finite()).then_some(Self {
            verdict: shift.verdict(is_significant, relevant_shift_px(image_size)),
            is_significant,
            change_px,
            sd_px: covariance.diagonal().map(f64::sqrt),
            statistic,
            shift,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    fn lens(f_px: f64, x: f64, y: f64, sd_px: f64) -> StatedLens {
        let covariance_px2 = Matrix3::identity() * sd_px * sd_px;
        StatedLens { f_pp_px: Vector3::new(f_px, x, y), covariance_px2 }
    }

    #[test]
    fn a_change_counts_against_the_uncertainty_of_both() {
        let old = lens(1000.0, 640.0, 360.0, 0.3);
        let found = LensDifference::of(&old, &lens(1000.5, 640.0, 360.0, 0.4), SIZE);
        let found = found.expect("compared");
        assert!((found.statistic - 1.0).abs() < 1e-9);
        // Neither seen, nor small for certain.
        assert_eq!((found.is_significant, found.verdict), (false, DriftVerdict::CannotTell));
        // Far beyond chance, and 6 px at the picture's edge.
        let far = LensDifference::of(&old, &lens(1010.0, 640.0, 360.0, 0.4), SIZE);
        assert_eq!(far.expect("compared").verdict, DriftVerdict::Recalibrate);
        // Beyond chance, but too small to matter.
        let sharp = lens(1000.0, 640.0, 360.0, 0.01);
        let small = LensDifference::of(&sharp, &lens(1000.1, 640.0, 360.0, 0.01), SIZE);
        let small = small.expect("compared");
        assert_eq!((small.is_significant, small.verdict), (true, DriftVerdict::Ok));
    }

    #[test]
    fn a_mean_knows_more_unless_its_parts_disagree() {
        let alike = [lens(1000.0, 640.0, 360.0, 0.4), lens(1000.3, 640.0, 360.0, 0.2)];
        let mean = StatedLens::mean(&alike).expect("a mean");
        // The better lens counts four times as much.
        assert!((mean.f_pp_px.x - 1000.24).abs() < 1e-9);
        assert!((mean.covariance_px2[(0, 0)] - 0.032).abs() < 1e-9);
        let apart = [lens(1000.0, 640.0, 360.0, 0.4), lens(1006.0, 640.0, 360.0, 0.4)];
        let mean = StatedLens::mean(&apart).expect("a mean");
        // Their χ² is 112.5; 3 is expected.
        assert!((mean.covariance_px2[(0, 0)] - 0.08 * 37.5).abs() < 1e-9);
        assert_eq!(StatedLens::mean(&alike[..1]), Some(alike[0]));
        assert!(StatedLens::mean(&[]).is_none());
        assert!(StatedLens::mean(&[alike[0], lens(f64::NAN, 640.0, 360.0, f64::NAN)]).is_none());
    }

    #[test]
    fn what_states_nonsense_is_not_compared() {
        let old = lens(1000.0, 640.0, 360.0, 0.0);
        assert!(LensDifference::of(&old, &old, SIZE).is_none());
        let nan = lens(f64::NAN, 640.0, 360.0, 1.0);
        assert!(LensDifference::of(&nan, &old, SIZE).is_none());
    }
}
