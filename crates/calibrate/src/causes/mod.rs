//! Causes of a misfit of the views to one lens and a flat board of squares. See `docs/method.md`,
//! section 2.11.
//!
//! One pass over the corners at the minimum of the bundle gives the products of all derivatives,
//! view by view ([`columns`]).
//!
//! - A cause that all views share is fitted in a bundle of its own if that pass promises a gain
//!   ([`explanations`]). Clear causes are corrected ([`correction`]); the others widen the
//!   covariance.
//! - A difference between views is named only if it predicts views outside its fit better than
//!   every rival does ([`judge`]). Without a clear winner, all such causes are named together. No
//!   further fit of the bundle is needed.

mod columns;
mod correction;
mod effects;
mod evidence;
mod explanations;
mod extended_bundle;
mod findings;
mod judge;
mod kinds;
mod model;
mod two_cameras;
mod witness;

use boresight_geometry::{Camera, LensMatrix, frame::SceneScale};
use columns::half_board_m;
use explanations::Explanations;
use judge::Verdicts;

use crate::{check::finding::Finding, solve::bundle::Bundle};

pub(crate) use columns::{Derivatives, OneColumn};
pub(crate) use correction::{Correction, with_square_pixels};
pub(crate) use explanations::positive_part;

/// What all views share beside the lens, and the correction of what is clear of it.
pub(crate) struct SharedCauses {
    explanations: Explanations,
    /// Correction to apply, if a cause is clear.
    pub(crate) correction: Option<Correction>,
}

impl SharedCauses {
    /// Causes at the minimum of `bundle`, the richest bundle, in addition to the `earlier`
    /// correction. `result` is the lens of the computed doubt.
    pub(crate) fn of(
        derivatives: &Derivatives<'_>,
        bundle: &Bundle,
        result: &Camera,
        noise_floor: f64,
        earlier: Option<&Correction>,
    ) -> Self {
        let explanations = Explanations::of(derivatives, bundle, result, noise_floor);
        let n = derivatives.observations.coordinate_count() as f64;
        let correction = Correction::of(&explanations, bundle, n, earlier);
        Self { explanations, correction }
    }

    /// Covariance of the lens from uncertainty about the true cause.
    pub(crate) fn doubt(&self) -> LensMatrix {
        self.explanations.doubt
    }

    /// Twice the logarithm of the odds of the likeliest cause; `None` if none is clear.
    pub(crate) fn gain(&self) -> Option<f64> {
        self.explanations.best().map(|best| best.gain)
    }
}

/// Causes that the views name, beside the corrected ones.
pub(crate) struct NamedCauses {
    pub(crate) findings: Vec<Finding>,
    /// Least named relative change of the focal length from the first view to the last. `None` if
    /// there are too few views.
    pub(crate) visible_drift: Option<f64>,
}

impl NamedCauses {
    /// Causes at the minimum of the bundle behind `derivatives`, with the scene of each view as a
    /// witness.
    pub(crate) fn of(
        derivatives: &Derivatives<'_>,
        noise_floor: f64,
        scene: &[Option<SceneScale>],
    ) -> Self {
        let verdicts = Verdicts::of(derivatives, noise_floor, scene);
        let half_width_px = 0.5 * f64::from(derivatives.image_size.width_px);
        let depth_m = half_board_m(derivatives.observations);
        let findings = findings::of_verdicts(&verdicts, depth_m, half_width_px);
        Self { findings, visible_drift: verdicts.visible_drift }
    }
}
