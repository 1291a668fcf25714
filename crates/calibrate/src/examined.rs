//! Examines the residuals for noise and causes of a misfit, and adds the doubt to the covariance of
//! the lens.

use nalgebra::SMatrix;

use super::{
    causes::{Derivatives, NamedCauses, SharedCauses},
    check::{
        heavy_tails::TailWeights,
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

/// Noise and causes of a misfit in the residuals of the richest lens model.
pub(super) struct Examined {
    pub(super) correlation: Option<NoiseCorrelation>,
    print_errors: Option<PrintErrors>,
    pub(super) causes: Option<NamedCauses>,
    /// Doubt from causes that all views share, and from the radial term beyond the models.
    of_shared: LensMatrix,
    /// Ratio of the information claimed by the corners to the actual information about the lens, at
    /// least 1.
    overcount: f64,
}

/// Causes that all views share, at the minimum of the richest lens model. `None` for few views.
pub(super) fn shared_causes<'a>(
    inputs: &'a Inputs<'_>,
    choice: &'a ModelChoice,
) -> Option<(Derivatives<'a>, SharedCauses)> {
    let enough = inputs.distinct >= VIEWS_WITHOUT_PRIOR;
    let richest = choice.bundles.last().filter(|_| enough)?;
    let derivatives = Derivatives::of(&inputs.observations, richest, inputs.image_size)?;
    let (lens, floor, earlier) = (&choice.fit().camera, inputs.noise_floor, inputs.correction);
    let causes = SharedCauses::of(&derivatives, richest, lens, floor, earlier);
    Some((derivatives, causes))
}

impl Examined {
    pub(super) fn of(
        inputs: &Inputs<'_>,
        choice: &ModelChoice,
        shared: Option<(Derivatives<'_>, SharedCauses)>,
    ) -> Self {
        let noise_floor = inputs.noise_floor;
        let enough = inputs.distinct >= VIEWS_WITHOUT_PRIOR;
        let richest = choice.bundles.last().filter(|_| enough);
        let scatter = richest.and_then(|it| it.scatter(it.noise_factor().max(noise_floor)));
        let overcount = scatter.map_or(1.0, |scatter| scatter.overcount(inputs.distinct));
        let of_shared = shared.as_ref().map_or_else(LensMatrix::zeros, |(derivatives, causes)| {
            let of_next = next_radial(inputs, choice, derivatives, overcount);
            causes.doubt() + of_next.unwrap_or_default()
        });
        Self {
            correlation: richest.and_then(|it| noise_correlation(&inputs.observations, it)),
            print_errors: richest.and_then(|it| print_errors(&inputs.observations, it)),
            causes: shared.map(|(derivatives, _)| {
                NamedCauses::of(&derivatives, noise_floor, &inputs.params.scene)
            }),
            of_shared,
            overcount,
        }
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

    /// Covariance to add to the sampling covariance, from what all views share: causes, corrected
    /// or not, radial terms beyond the models, and errors of the print.
    pub(super) fn doubt(&self, inputs: &Inputs<'_>, choice: &ModelChoice) -> LensMatrix {
        let of_corrected = inputs.correction.map(|correction| correction.doubt);
        let of_print = self.print_errors.as_ref().map(|found| found.doubt(choice));
        [of_corrected, of_print]
            .into_iter()
            .flatten()
            .fold(self.of_shared, |sum, doubt| sum + doubt)
    }
}

/// Doubt from the radial term beyond the richest lens model. `None` if that model isn't allowed: a
/// person who names a simpler one knows the lens.
fn next_radial(
    inputs: &Inputs<'_>,
    choice: &ModelChoice,
    derivatives: &Derivatives<'_>,
    overcount: f64,
) -> Option<LensMatrix> {
    let richest = choice.bundles.last()?;
    if Some(&choice.richest_allowed) != inputs.family.models().last() {
        return None;
    }
    let chosen = (choice.fit().model, choice.fit().camera.distortion.k1);
    let (size, noise_floor) = (inputs.image_size, inputs.noise_floor);
    next_radial_doubt(derivatives, richest, chosen, size, noise_floor, overcount)
}
