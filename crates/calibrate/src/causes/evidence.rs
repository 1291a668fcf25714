//! Evidence counted by views.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Size of parameters, with the scatter when each view is left out.
#[derive(Clone, Debug)]
pub(super) struct Size {
    /// Covariance by the jackknife over the views.
    pub(super) covariance: DMatrix<f64>,
    /// Standard deviations by which the size stands out, as for a normal distribution.
    pub(super) sigmas: f64,
}

/// Size `value` of parameters from `left_out`, their values without each view in turn:
/// `C = (N−1)/N Σ (γ₋ᵥ − γ)(γ₋ᵥ − γ)ᵀ`, and `γᵀ C⁻¹ γ (N−k−1)/(k(N−1))` by the F distribution
/// (Hotelling 1931; Efron 1982). `tries` is the number of equally simple alternatives of which the
/// best is taken.
pub(super) fn size(value: &DVector<f64>, left_out: &[DVector<f64>], tries: f64) -> Option<Size> {
    let (k, n) = (value.len() as f64, left_out.len() as f64);
    let mut covariance = DMatrix::zeros(value.len(), value.len());
    for without in left_out {
        let off = without - value;
        covariance += &off * off.transpose() * ((n - 1.0) / n);
    }
    for i in 0..value.len() {
        covariance[(i, i)] += covariance[(i, i)] * 1e-6 + f64::MIN_POSITIVE;
    }
    let freedom = (n - k - 1.0).max(2.0);
    let pull = covariance.clone().cholesky()?.solve(value);
    let statistic = value.dot(&pull) / k * freedom / (n - 1.0);
    let chance = FisherSnedecor::new(k, freedom).ok()?.sf(statistic.max(0.0));
    Some(Size { covariance, sigmas: sigmas_of(chance * tries) })
}

/// Size of one parameter, in standard deviations by the jackknife over `views` views, that stands
/// out by `sigmas` with a probability of 95 %, as the best of `tries`. `None` for too few views.
pub(super) fn visible(views: usize, sigmas: f64, tries: f64) -> Option<f64> {
    const POWER: f64 = 0.95;
    let freedom = views.checked_sub(2).filter(|freedom| *freedom > 0)? as f64;
    let chance = 2.0 * Normal::standard().sf(sigmas) / tries;
    let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
    let limit = student.inverse_cdf(1.0 - 0.5 * chance) + student.inverse_cdf(POWER);
    Some(limit * ((views - 1) as f64 / freedom).sqrt())
}

/// Standard deviations of a two-sided test of a normal distribution with the same chance.
fn sigmas_of(chance: f64) -> f64 {
    const LEAST: f64 = 1e-300;
    -Normal::standard().inverse_cdf(chance.clamp(LEAST, 1.0) / 2.0)
}

/// Distance between the least and the largest of `values`.
pub(super) fn range(values: &[f64]) -> f64 {
    let values = values.iter().copied();
    values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
}

/// Gains of the views in twice the log likelihood, summed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gain {
    pub(super) sum: f64,
    /// Standard deviations by which the sum stands out if each view's sign were chance.
    pub(super) sigmas: f64,
}

impl Gain {
    /// Sum of `gains`, with its evidence when the signs of the views are flipped at random:
    /// `z² = 2 sup_λ [λ Σg − Σ ln cosh λg]` (Chernoff 1952).
    pub(super) fn of(gains: &[f64]) -> Self {
        const STEPS: i32 = 40;
        let sum: f64 = gains.iter().sum();
        let largest = gains.iter().copied().map(f64::abs).fold(1e-12, f64::max);
        if sum <= 0.0 {
            return Self { sum, sigmas: 0.0 };
        }
        let ln_cosh = |x: f64| x + libm::log1p(libm::exp(-2.0 * x)) - std::f64::consts::LN_2;
        let at = |step: i32| {
            let rate = libm::pow(10.0, f64::from(step) * 5.0 / f64::from(STEPS) - 2.0) / largest;
            rate * sum - gains.iter().map(|gain| ln_cosh((rate * gain).abs())).sum::<f64>()
        };
        let best = (0..STEPS).map(at).fold(0.0, f64::max);
        Self { sum, sigmas: (2.0 * best).sqrt() }
    }

    /// Gain of the first over the second, view by view.
    pub(super) fn between(first: &[f64], second: &[f64]) -> Self {
        let lead: Vec<f64> =
            first.iter().zip(second).map(|(first, second)| first - second).collect();
        Self::of(&lead)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_view_of_many_is_no_evidence() {
        let mut gains = [0.0; 20];
        gains[3] = 500.0;
        assert!(Gain::of(&gains).sigmas < 1.5);
        let all = Gain::of(&[5.0; 20]);
        assert!(all.sigmas > 5.0 && all.sum == 100.0);
    }

    #[test]
    fn size_stands_out_by_its_scatter() {
        let value = DVector::from_element(1, 1.0);
        let without = |by: f64| -> Vec<_> {
            let off = |i: i32| DVector::from_element(1, 1.0 + by * f64::from(i % 3 - 1));
            (0..15).map(off).collect()
        };
        // 15 views: Σ off² = 10 by², times 14/15.
        let found = size(&value, &without(0.1), 1.0).expect("a size");
        assert!((found.covariance[(0, 0)] - 0.0933).abs() < 1e-3);
        assert!((2.5..3.0).contains(&found.sigmas), "{}", found.sigmas);
        let tried = size(&value, &without(0.1), 5.0).expect("a size");
        assert!(tried.sigmas < found.sigmas);
    }
}
