//! Displacement of the picture by a change of a lens: an interval, and the verdict on it against a
//! limit. `docs/method.md`, section 4.

use nalgebra::{Matrix2, Vector2};

use boresight_geometry::frame::ImageSize;

/// Displacement of a ray, as a fraction of the picture's width, below which a change doesn't
/// matter: 1 px at 1280.
const RELEVANT_SHIFT_FRACTION: f64 = 0.0008;
/// Confidence of the interval at each place.
pub(super) const CONFIDENCE: f64 = 0.95;

/// Displacement above which a change matters unless a person says otherwise, in pixels.
pub(super) fn relevant_shift_px(image_size: ImageSize) -> f64 {
    RELEVANT_SHIFT_FRACTION * f64::from(image_size.width_px)
}

/// Verdict of a drift check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriftVerdict {
    /// Any change is surely too small to matter, and one that matters would have been detected.
    Ok,
    /// A change that matters is neither certain nor excluded.
    CannotTell,
    /// A significant change, surely large enough to matter.
    Recalibrate,
}

impl DriftVerdict {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::CannotTell => "cannot-tell",
            Self::Recalibrate => "recalibrate",
        }
    }
}

/// Largest displacement of the image of a ray over the picture, by a change of the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// Measured displacement, in pixels.
    pub px: f64,
    /// Lower bound of the displacement at a confidence of 95 %, in pixels.
    pub least_px: f64,
    /// Upper bound of the displacement at a confidence of 95 %, in pixels.
    pub most_px: f64,
    /// Displacement above which every change is detected with a probability of 95 %, in pixels.
    pub visible_px: f64,
}

impl Shift {
    /// Shift at `places`, each with its displacement and covariance. The bounds are `bound` squared
    /// standard deviations away, and `seen` of them are detected.
    pub(super) fn over(
        places: impl Iterator<Item = (Vector2<f64>, Matrix2<f64>)>,
        (bound, seen): (f64, f64),
    ) -> Self {
        let none = Self { px: 0.0, least_px: 0.0, most_px: 0.0, visible_px: 0.0 };
        places.fold(none, |shift, (moved_px, covariance)| {
            let px = moved_px.norm();
            let along = moved_px.try_normalize(0.0).unwrap_or_default();
            let variance = (along.transpose() * covariance * along).x;
            let largest = covariance.symmetric_eigenvalues().max().max(0.0);
            shift.or(&Self {
                px,
                least_px: px - (bound * variance).sqrt(),
                most_px: px + (bound * largest).sqrt(),
                visible_px: (seen * largest).sqrt(),
            })
        })
    }

    /// Larger of two shifts, number by number.
    pub(super) fn or(&self, other: &Self) -> Self {
        Self {
            px: self.px.max(other.px),
            least_px: self.least_px.max(other.least_px),
            most_px: self.most_px.max(other.most_px),
            visible_px: self.visible_px.max(other.visible_px),
        }
    }

    /// Verdict, if displacements above `matters_px` matter.
    pub(super) fn verdict(&self, is_significant: bool, matters_px: f64) -> DriftVerdict {
        if is_significant && self.least_px > matters_px {
            DriftVerdict::Recalibrate
        } else if self.most_px <= matters_px && self.visible_px <= matters_px {
            DriftVerdict::Ok
        } else {
            DriftVerdict::CannotTell
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Displacement of 2 px along x at one place; the bounds are two standard deviations away, and
    /// what is four away is detected.
    fn shift(sd_px: f64) -> Shift {
        let covariance = Matrix2::identity() * sd_px * sd_px;
        Shift::over([(Vector2::new(2.0, 0.0), covariance)].into_iter(), (4.0, 16.0))
    }

    #[test]
    fn what_is_not_surely_within_or_beyond_is_open() {
        let sharp = shift(0.1);
        assert_eq!((sharp.px, sharp.least_px, sharp.most_px), (2.0, 1.8, 2.2));
        assert_eq!(sharp.verdict(true, 1.0), DriftVerdict::Recalibrate);
        assert_eq!(sharp.verdict(true, 2.1), DriftVerdict::CannotTell);
        assert_eq!(sharp.verdict(true, 2.3), DriftVerdict::Ok);
        // Not beyond chance.
        assert_eq!(sharp.verdict(false, 1.0), DriftVerdict::CannotTell);
    }

    #[test]
    fn what_could_not_be_seen_is_not_fine() {
        let blunt = shift(1.0);
        assert_eq!((blunt.least_px, blunt.most_px, blunt.visible_px), (0.0, 4.0, 4.0));
        assert_eq!(blunt.verdict(false, 3.9), DriftVerdict::CannotTell);
        assert_eq!(blunt.verdict(false, 4.0), DriftVerdict::Ok);
    }

    #[test]
    fn numbers_that_are_none_are_not_fine() {
        let none = Shift::over([(Vector2::zeros(), Matrix2::zeros())].into_iter(), (4.0, 16.0));
        let broken = Shift { most_px: f64::NAN, ..none };
        assert_eq!(broken.verdict(false, 1.0), DriftVerdict::CannotTell);
    }
}
