//! Sums products lane by lane, in the widest vectors.

use boresight_geometry::least_squares::Linearised;
pub(super) use boresight_geometry::simd::{Loop, widest};
use nalgebra::{SMatrix, SVector};

/// Fixed number of accumulators, so that results don't depend on the vector width.
pub(super) const LANES: usize = 8;
/// Pixels processed together, so that the derivatives stay in the first-level cache.
pub(super) const CHUNK: usize = 16 * LANES;
pub(super) type Lanes = [f32; LANES];
/// Values of a chunk, in whole lines of the cache.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Row(pub(super) [Lanes; CHUNK / LANES]);

/// Adds the products of each of the `ones` and the `others`, of `count` pixels, lane by lane.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "iterators keep no sums in registers: 3 x the time")]
pub(super) fn add_products<const I: usize, const J: usize>(
    ones: &[Row; I],
    others: &[Row; J],
    count: usize,
    sums: &mut [[Lanes; J]; I],
) {
    let mut totals = *sums;
    for at in 0..(count / LANES).min(CHUNK / LANES) {
        for i in 0..I {
            for j in 0..J {
                for lane in 0..LANES {
                    totals[i][j][lane] += ones[i].0[at][lane] * others[j].0[at][lane];
                }
            }
        }
    }
    *sums = totals;
}

pub(super) fn total(lanes: Lanes) -> f64 {
    lanes.iter().fold(0.0, |total, lane| total + f64::from(*lane))
}

/// Normal matrix, gradient and cost from the sums of products of two of `N` derivatives and, last,
/// the residual.
#[inline(always)]
pub(super) fn linearised<const N: usize>(sum: impl Fn(usize, usize) -> f64) -> Linearised<N> {
    let mut normal_matrix =
        SMatrix::<f64, N, N>::from_fn(|i, j| if j > i { 0.0 } else { sum(i, j) });
    normal_matrix.fill_upper_triangle_with_lower_triangle();
    let gradient = SVector::from_fn(|i, _| sum(N, i));
    Linearised { normal_matrix, gradient, cost: sum(N, N), extra: () }
}

/// Checks of what a model's loop sums up.
#[cfg(test)]
pub(super) mod checks {
    use super::*;

    pub(crate) fn are_the_same_bits<const N: usize>(one: &Linearised<N>, other: &Linearised<N>) {
        assert_eq!(one.cost.to_bits(), other.cost.to_bits());
        assert_eq!(one.normal_matrix.map(f64::to_bits), other.normal_matrix.map(f64::to_bits));
        assert_eq!(one.gradient.map(f64::to_bits), other.gradient.map(f64::to_bits));
    }

    /// Compares the gradient at `at` with differences of the cost over `steps`, to the `share` of
    /// each.
    pub(crate) fn is_gradient_of_cost<const N: usize>(
        linearise: impl Fn(&SVector<f64, N>) -> Linearised<N>,
        at: &SVector<f64, N>,
        steps: [f64; N],
        share: impl Fn(usize) -> f64,
    ) {
        let analytic = linearise(at).gradient;
        for (i, step) in steps.into_iter().enumerate() {
            let cost = |sign: f64| {
                let mut moved = *at;
                moved[i] += sign * step;
                linearise(&moved).cost
            };
            // The gradient of the fit is −½ dcost/dparameter.
            let numeric = -(cost(1.0) - cost(-1.0)) / (4.0 * step);
            let size = analytic[i].abs().max(0.02 * analytic.amax());
            let off = (numeric - analytic[i]).abs();
            assert!(off < share(i) * size, "{i}: {numeric} {}", analytic[i]);
        }
    }
}
