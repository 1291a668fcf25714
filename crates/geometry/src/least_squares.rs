//! Levenberg–Marquardt for a fixed, small number of parameters.
//!
//! Minimises `F(x) = Σ rᵀ W r`, `r` observed minus predicted. With `J` the prediction's Jacobian,
//! `H = Jᵀ W J` and `g = Jᵀ W r`, each round solves `(H + λ diag H) δ = g` and keeps the step only
//! if `F` does not grow. `λ` falls after a kept step and rises after a rejected one, or where
//! `H + λ diag H` is not positive definite (Marquardt 1963; Nocedal & Wright, *Numerical
//! Optimization*, section 10.3).
//!
//! The end test is the same for every problem: `δᵀ g`, the squared length of the step in standard
//! deviations of the parameters. It has no unit, so that one limit fits pixels, radians and metres.
//!
//! `boresight_calibrate`'s `solve::schur_lm` has the same loop for problems with parameters per
//! view.

use nalgebra::{SMatrix, SVector};

/// λ after the first rejected step.
const LEAST_DAMPING: f64 = 1e-6;
/// λ below which steps don't change, and λ becomes zero.
const NEGLIGIBLE_DAMPING: f64 = 1e-10;
/// λ above which no step can lower the cost.
const MAX_DAMPING: f64 = 1e9;
/// Largest λ at the end: a step under more damping is short because of the damping, not because the
/// minimum is near.
const MAX_DAMPING_AT_END: f64 = 0.1;

/// Cost and normal equations of a [`Problem`] at a state.
#[derive(Clone, Debug)]
pub struct Linearised<const N: usize, Extra = ()> {
    /// `F`.
    pub cost: f64,
    /// `g`: half the steepest descent of `F`.
    pub gradient: SVector<f64, N>,
    /// `H`, the information about the parameters.
    pub normal_matrix: SMatrix<f64, N, N>,
    /// Further sums of the problem over the residuals.
    pub extra: Extra,
}

/// Weighted sum of squares of `N` parameters.
pub trait Problem<const N: usize> {
    /// Values of the parameters.
    type State;
    /// See [`Linearised::extra`].
    type Extra;

    /// Cost and normal equations at `state`. `None` where the model is undefined.
    fn linearise(&self, state: &Self::State) -> Option<Linearised<N, Self::Extra>>;

    /// `state` moved by `step`.
    fn moved(&self, state: &Self::State, step: &SVector<f64, N>) -> Self::State;

    /// Variance of a residual with weight 1: the unit of `δᵀ g`. 1 if residuals are weighted by
    /// their covariances.
    fn noise_variance(&self, _cost: f64) -> f64 {
        1.0
    }
}

/// Start and stop settings of [`minimise`].
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Most steps.
    pub rounds: usize,
    /// First `λ`; 0 for a start near the minimum.
    pub first_damping: f64,
    /// Negligible `δᵀ g` of the next step, in units of [`Problem::noise_variance`].
    pub negligible_step: f64,
    /// Relative rounding error of the cost: a step may seem to raise the cost by this much.
    pub cost_rounding: f64,
}

impl Limits {
    /// Limits for sums in double precision: to 1e-9 standard deviations.
    pub const EXACT: Self =
        Self { rounds: 50, first_damping: 0.0, negligible_step: 1e-18, cost_rounding: 1e-13 };
}

/// Final state of [`minimise`]. `at` always belongs to `state`.
#[derive(Clone, Debug)]
pub struct Minimum<State, const N: usize, Extra = ()> {
    /// Best state found.
    pub state: State,
    /// Cost and normal equations at the state.
    pub at: Linearised<N, Extra>,
    /// True if the next step is negligible.
    pub converged: bool,
}

/// Follows the cost downhill from `start`.
///
/// Never ends higher than it started, apart from [`Limits::cost_rounding`]; deterministic. `None`
/// if the model is undefined at `start`.
pub fn minimise<P: Problem<N>, const N: usize>(
    problem: &P,
    start: P::State,
    limits: Limits,
) -> Option<Minimum<P::State, N, P::Extra>> {
    let at = problem.linearise(&start)?;
    let mut minimum = Minimum { state: start, at, converged: false };
    let mut damping = limits.first_damping;
    for _ in 0..limits.rounds {
        let Minimum { state, at, .. } = &minimum;
        let next = damped_step(at, damping).and_then(|step| {
            let decrement = step.dot(&at.gradient) / problem.noise_variance(at.cost);
            let negligible = decrement <= limits.negligible_step && damping <= MAX_DAMPING_AT_END;
            if negligible {
                return Some(None);
            }
            let state = problem.moved(state, &step);
            let next = problem.linearise(&state)?;
            let lower = next.cost <= at.cost * (1.0 + limits.cost_rounding);
            lower.then_some(Some((state, next, decrement)))
        });
        match next {
            Some(None) => {
                minimum.converged = true;
                break;
            }
            Some(Some((state, next, decrement))) => {
                // The cost no longer falls measurably, and rounding keeps the steps from shrinking
                // further.
                let rounded = at.cost - next.cost <= limits.cost_rounding * at.cost;
                let stalled = rounded && decrement <= 1e3 * limits.negligible_step;
                minimum = Minimum { state, at: next, converged: stalled };
                if stalled {
                    break;
                }
                damping = if damping > NEGLIGIBLE_DAMPING { damping * 0.1 } else { 0.0 };
            }
            None if damping > MAX_DAMPING => break,
            None => damping = (damping * 10.0).max(LEAST_DAMPING),
        }
    }
    Some(minimum)
}

/// Damped step `δ`. `None` if the damped matrix is not positive definite.
fn damped_step<const N: usize, Extra>(
    at: &Linearised<N, Extra>,
    damping: f64,
) -> Option<SVector<f64, N>> {
    let mut damped = at.normal_matrix;
    if damping > 0.0 {
        // A parameter without any information gets some, or no damping would make the matrix
        // definite.
        let least = f64::EPSILON * at.normal_matrix.diagonal().amax();
        for i in 0..N {
            damped[(i, i)] += damping * at.normal_matrix[(i, i)].max(least);
        }
    }
    let step = damped.cholesky()?.solve(&at.gradient);
    step.iter().all(|value| value.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};

    use super::*;

    /// Rosenbrock's valley as residuals `10 (y − x²)` and `1 − x`; minimum 0 at (1, 1).
    struct Valley;

    impl Problem<2> for Valley {
        type State = Vector2<f64>;
        type Extra = ();

        fn linearise(&self, at: &Vector2<f64>) -> Option<Linearised<2>> {
            let residual = -Vector2::new(10.0 * (at.y - at.x * at.x), 1.0 - at.x);
            let jacobian = Matrix2::new(-20.0 * at.x, 10.0, -1.0, 0.0);
            let cost = residual.norm_squared();
            cost.is_finite().then(|| Linearised {
                cost,
                gradient: jacobian.transpose() * residual,
                normal_matrix: jacobian.transpose() * jacobian,
                extra: (),
            })
        }

        fn moved(&self, at: &Vector2<f64>, step: &Vector2<f64>) -> Vector2<f64> {
            at + step
        }
    }

    /// Residuals `1 − x` and `2 − x y`: at `x = 0`, `y` is undetermined.
    struct Product;

    impl Problem<2> for Product {
        type State = Vector2<f64>;
        type Extra = ();

        fn linearise(&self, at: &Vector2<f64>) -> Option<Linearised<2>> {
            let residual = Vector2::new(1.0 - at.x, 2.0 - at.x * at.y);
            let jacobian = Matrix2::new(1.0, 0.0, at.y, at.x);
            Some(Linearised {
                cost: residual.norm_squared(),
                gradient: jacobian.transpose() * residual,
                normal_matrix: jacobian.transpose() * jacobian,
                extra: (),
            })
        }

        fn moved(&self, at: &Vector2<f64>, step: &Vector2<f64>) -> Vector2<f64> {
            at + step
        }
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let start = Vector2::new(-1.2, 1.0);
        let minimum = minimise(&Valley, start, Limits::EXACT).expect("finite");
        assert!(minimum.converged);
        assert!((minimum.state - Vector2::new(1.0, 1.0)).norm() < 1e-8, "{}", minimum.state);
    }

    #[test]
    fn a_singular_start_is_left_by_damping() {
        let start = Vector2::new(0.0, 0.5);
        let at = Product.linearise(&start).expect("defined");
        assert_eq!(damped_step(&at, 0.0), None, "the test needs a singular matrix");
        let minimum = minimise(&Product, start, Limits::EXACT).expect("finite");
        assert!(minimum.converged);
        assert!((minimum.state - Vector2::new(1.0, 2.0)).norm() < 1e-8, "{}", minimum.state);
    }

    #[test]
    fn cost_and_matrix_belong_to_the_state_wherever_it_ends() {
        let start = Vector2::new(-1.2, 1.0);
        let first = Valley.linearise(&start).expect("finite").cost;
        for rounds in 0..30 {
            for negligible_step in [1e-18, 1e-3, 1.0] {
                let limits = Limits { rounds, negligible_step, ..Limits::EXACT };
                let minimum = minimise(&Valley, start, limits).expect("finite");
                let again = Valley.linearise(&minimum.state).expect("finite");
                assert_eq!(minimum.at.cost.to_bits(), again.cost.to_bits());
                assert_eq!(minimum.at.normal_matrix, again.normal_matrix);
                assert_eq!(minimum.at.gradient, again.gradient);
                assert!(minimum.at.cost <= first);
            }
        }
    }

    #[test]
    fn an_undefined_start_has_no_minimum() {
        assert!(minimise(&Valley, Vector2::new(f64::NAN, 0.0), Limits::EXACT).is_none());
    }
}
