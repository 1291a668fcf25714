//! Examines the residuals for noise and causes of a misfit, and adds the doubt to the covariance of
//! the lens.

use nalgebra::SMatrix;

use super::{
    check::{
        correction::Correction,
        heavy_tails::TailWeights,
        misfit_diagnosis::{Causes, causes},
        next_radial::next_radial_doubt,
        noise_correlation::{NoiseCorrelation, noise_correlation},
        print_errors::{PrintErrors, print_errors},
    },
    inputs::{Inputs, VIEWS_WITHOUT_PRIOR},
    solve::{bundle::Bundle, model_choice::ModelChoice, view_scatter::averaged},
};
use boresight_geometry::LENS_PARAMETERS;

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Advised number of distinct views.
const VIEWS_ADVISED: usize = 8;

/// Findings in the residuals of the richest lens model.
pub(super) struct Examined {
    pub(super) correlation: Option<NoiseCorrelation>,
    print_errors: Option<PrintErrors>,
    pub(super) causes: Causes,
    /// Ratio of the information claimed by the corners to the actual information about the lens, at
    /// least 1.
    overcount: f64,
}

impl Examined {
    pub(super) fn of(inputs: &Inputs<'_>, choice: &ModelChoice) -> Self {
        let noise_floor = inputs.noise_floor;
        let enough = inputs.distinct >= VIEWS_WITHOUT_PRIOR;
        let Some(richest) = choice.bundles.last().filter(|_| enough) else {
            return Self {
                correlation: None,
                print_errors: None,
                causes: Causes::none(),
                overcount: 1.0,
            };
        };
        let correlation = noise_correlation(&inputs.observations, richest);
        let scatter = richest.scatter(richest.noise_factor().max(noise_floor));
        let overcount = scatter.map_or(1.0, |scatter| scatter.overcount(inputs.distinct));
        let noise_gain = correlation.as_ref().map_or(0.0, |found| found.gain);
        let (size, result) = (inputs.image_size, &choice.fit().camera);
        let causes = causes(&inputs.observations, richest, result, size, noise_floor, noise_gain);
        let print_errors = print_errors(&inputs.observations, richest);
        Self { correlation, print_errors, causes, overcount }
    }

    /// Correction to apply, if the cause is clear.
    pub(super) fn correction(
        &self,
        inputs: &Inputs<'_>,
        choice: &ModelChoice,
    ) -> Option<Correction> {
        let n = inputs.observations.coordinate_count() as f64;
        let richest = choice.bundles.last()?;
        Correction::of(&self.causes, richest, n, inputs.image_size, inputs.correction)
    }

    /// Covariance of the chosen lens from the errors of the corners, with model uncertainty. `None`
    /// if it isn't finite.
    ///
    /// A model of the noise gives the effect of corner errors on the lens; the views give their
    /// scatter about it ([`Bundle::covariance_by_views`]), regardless of the noise. Both are
    /// [`averaged`]. Nearly alike views have alike errors and count once.
    pub(super) fn sampling_covariance(
        &self,
        inputs: &Inputs<'_>,
        choice: &ModelChoice,
    ) -> Option<LensMatrix> {
        let of_tails = inputs.tails.as_ref().map_or(1.0, TailWeights::variance_factor);
        let distinct = inputs.distinct.max(1) as f64;
        let of_alike = (inputs.views.len().min(VIEWS_ADVISED) as f64 / distinct).max(1.0);
        let averaged_over = |covariance: fn(&Bundle, f64) -> Option<LensMatrix>| {
            choice.averaged_covariance(inputs.noise_floor, self.overcount, covariance)
        };
        let plain = averaged_over(Bundle::covariance)? * (of_tails * of_alike);
        let correlated =
            self.correlation.as_ref().map(|found| found.doubt(choice, inputs.noise_floor));
        let of_model = plain + correlated.unwrap_or_default();
        let of_views = averaged_over(Bundle::covariance_by_views)?;
        Some(averaged(of_model, of_views, inputs.distinct))
    }

    /// Covariance to add to the sampling covariance: doubt about the cause of a misfit, radial
    /// terms beyond the models, the remaining doubt about a corrected cause, and errors of the
    /// print, shared by all views.
    pub(super) fn doubt(&self, inputs: &Inputs<'_>, choice: &ModelChoice) -> LensMatrix {
        let (lens, freedom) = (&choice.fit().camera, &choice.bundle().freedom);
        let allowed_for = inputs
            .correction
            .map(|correction| correction.doubt((lens, freedom), inputs.image_size));
        let of_print = self.print_errors.as_ref().map(|found| found.doubt(choice));
        [self.next_radial_doubt(inputs, choice), allowed_for, of_print]
            .into_iter()
            .flatten()
            .fold(self.causes.doubt, |sum, doubt| sum + doubt)
    }

    /// Doubt from the radial term beyond the richest lens model. `None` if that model isn't
    /// allowed: a person who names a simpler one knows the lens.
    fn next_radial_doubt(&self, inputs: &Inputs<'_>, choice: &ModelChoice) -> Option<LensMatrix> {
        let richest = choice.bundles.last()?;
        if Some(&choice.richest_allowed) != inputs.family.models().last() {
            return None;
        }
        let chosen = (choice.fit().model, choice.fit().camera.distortion.k1);
        let (size, noise_floor) = (inputs.image_size, inputs.noise_floor);
        next_radial_doubt(&inputs.observations, richest, chosen, size, noise_floor, self.overcount)
    }
}
