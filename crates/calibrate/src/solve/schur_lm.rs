//! Levenberg–Marquardt for parameters shared by all views and parameters of single views.
//!
//! The normal matrix has the shape of an arrow, so the parameters of the views are eliminated by a
//! Schur complement (Triggs et al., "Bundle adjustment – a modern synthesis", 2000, section 6). The
//! loop and its end test are the same as in `geometry::least_squares`, whose problems have no
//! views.

use nalgebra::{SMatrix, SVector};

/// Squared length, in standard deviations, of a negligible step after the last: 1e-2 of one.
const HIDDEN_STEP: f64 = 1e-4;
/// Least noise variance, as a multiple of the stated one: of exact corners. A prior weighed against
/// it stays effective.
pub(super) const LEAST_NOISE_VARIANCE: f64 = 1e-6;
/// Largest damping at the end: a step under more is short because of the damping.
const MAX_DAMPING_AT_END: f64 = 0.1;
/// Least share of the promised fall of the cost, `δᵀ g`, after which steps may be longer.
const PROMISED: f64 = 0.75;

/// Normal equations `H δ = g` of `S` shared parameters and `L` parameters per view.
///
/// ```text
/// H = | U    W₁  W₂ … |     Schur complement  U − Σ Wᵢ Vᵢ⁻¹ Wᵢᵀ: the information about the shared
///     | W₁ᵀ  V₁       |     parameters once every view has settled.
///     | W₂ᵀ      V₂   |
/// ```
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations<const S: usize, const L: usize> {
    /// `U`, priors included.
    pub(crate) shared: SMatrix<f64, S, S>,
    /// Shared part of `g`.
    pub(crate) gradient: SVector<f64, S>,
    /// Blocks of the views, in order.
    pub(crate) views: Vec<ViewBlock<S, L>>,
}

/// Contribution of a view to [`NormalEquations`].
#[derive(Clone, Debug)]
pub(crate) struct ViewBlock<const S: usize, const L: usize> {
    /// Contribution to `U`.
    pub(crate) shared: SMatrix<f64, S, S>,
    /// Contribution to the shared part of `g`.
    pub(super) shared_gradient: SVector<f64, S>,
    /// `W`.
    pub(crate) cross: SMatrix<f64, S, L>,
    /// `V`.
    pub(crate) local: SMatrix<f64, L, L>,
    /// Local part of `g`.
    pub(crate) gradient: SVector<f64, L>,
}

/// Solution `δ` of [`NormalEquations`].
pub(crate) struct Step<const S: usize, const L: usize> {
    pub(crate) shared: SVector<f64, S>,
    pub(crate) views: Vec<SVector<f64, L>>,
    /// `δᵀ g`: squared length of the step in standard deviations.
    pub(crate) decrement: f64,
}

impl<const S: usize, const L: usize> ViewBlock<S, L> {
    /// `V⁻¹`, with the diagonal of `V` multiplied by `1 + damping`. `None` if singular.
    pub(crate) fn local_inverse(&self, damping: f64) -> Option<SMatrix<f64, L, L>> {
        let mut local = self.local;
        for i in 0..L {
            local[(i, i)] *= 1.0 + damping;
        }
        inverse(&local)
    }

    /// Information and gradient of this view for the shared parameters, local parameters
    /// marginalised out.
    pub(crate) fn reduced(&self) -> Option<(SMatrix<f64, S, S>, SVector<f64, S>)> {
        let gain = self.cross * self.local_inverse(0.0)?;
        Some((
            self.shared - gain * self.cross.transpose(),
            self.shared_gradient - gain * self.gradient,
        ))
    }
}

/// Equations of a step downhill.
pub(crate) trait Equations {
    /// Solution.
    type Step;
    /// Step with diagonals multiplied by `1 + damping`. `None` if the matrix isn't positive
    /// definite.
    fn solve(&self, damping: f64) -> Option<Self::Step>;
    /// `δᵀ g`: squared length of a step in standard deviations.
    fn decrement(step: &Self::Step) -> f64;
}

impl<const S: usize, const L: usize> NormalEquations<S, L> {
    /// Sums up the views, each given with a cost; the second value is the total cost.
    pub(crate) fn from_views(views: Vec<(f64, ViewBlock<S, L>)>) -> (Self, f64) {
        let mut shared = SMatrix::zeros();
        let mut gradient = SVector::zeros();
        let mut cost = 0.0;
        for (of_view, view) in &views {
            shared += view.shared;
            gradient += view.shared_gradient;
            cost += of_view;
        }
        let views = views.into_iter().map(|(_, view)| view).collect();
        (Self { shared, gradient, views }, cost)
    }

    /// Information about the shared parameters, priors included, local parameters marginalised out.
    pub(crate) fn reduced(&self) -> Option<SMatrix<f64, S, S>> {
        let mut reduced = self.shared;
        for view in &self.views {
            let gain = view.cross * view.local_inverse(0.0)?;
            reduced -= gain * view.cross.transpose();
        }
        Some(reduced)
    }
}

impl<const S: usize, const L: usize> Equations for NormalEquations<S, L> {
    type Step = Step<S, L>;

    fn solve(&self, damping: f64) -> Option<Self::Step> {
        let mut reduced = self.shared;
        for i in 0..S {
            reduced[(i, i)] *= 1.0 + damping;
        }
        let mut gradient = self.gradient;
        let mut inverses = Vec::with_capacity(self.views.len());
        for view in &self.views {
            let inverse = view.local_inverse(damping)?;
            let gain = view.cross * inverse;
            reduced -= gain * view.cross.transpose();
            gradient -= gain * view.gradient;
            inverses.push(inverse);
        }
        let shared = inverse(&reduced)? * gradient;
        let mut decrement = shared.dot(&self.gradient);
        let views = self
            .views
            .iter()
            .zip(&inverses)
            .map(|(view, inverse)| {
                let step = inverse * (view.gradient - view.cross.transpose() * shared);
                decrement += step.dot(&view.gradient);
                step
            })
            .collect();
        decrement.is_finite().then_some(Step { shared, views, decrement })
    }

    fn decrement(step: &Self::Step) -> f64 {
        step.decrement
    }
}

/// Inverse of a symmetric positive definite matrix, computed after scaling to a unit diagonal.
/// `None` if a pivot shows the matrix to be singular.
pub(crate) fn inverse<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let mut scale = SVector::<f64, N>::zeros();
    for i in 0..N {
        let diagonal = matrix[(i, i)];
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            return None;
        }
        scale[i] = 1.0 / diagonal.sqrt();
    }
    let rescaled = |matrix: &SMatrix<f64, N, N>| {
        SMatrix::<f64, N, N>::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j])
    };
    let unscaled = solve_spd(&rescaled(matrix))?;
    let inverse = rescaled(&unscaled);
    inverse.iter().all(|x| x.is_finite()).then_some(inverse)
}

/// Inverse by Cholesky factors. `None` if a pivot is below the rounding error: `nalgebra`'s
/// decomposition only refuses pivots that aren't positive.
fn solve_spd<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let mut lower = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        let mut pivot = matrix[(j, j)];
        for k in 0..j {
            pivot -= lower[(j, k)] * lower[(j, k)];
        }
        if pivot <= 1e-14 || !pivot.is_finite() {
            return None;
        }
        let root = pivot.sqrt();
        lower[(j, j)] = root;
        for i in j + 1..N {
            let mut value = matrix[(i, j)];
            for k in 0..j {
                value -= lower[(i, k)] * lower[(j, k)];
            }
            lower[(i, j)] = value / root;
        }
    }
    // Columns of L⁻¹, then L⁻ᵀ L⁻¹.
    let mut inverse_lower = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        inverse_lower[(j, j)] = 1.0 / lower[(j, j)];
        for i in j + 1..N {
            let mut sum = 0.0;
            for k in j..i {
                sum += lower[(i, k)] * inverse_lower[(k, j)];
            }
            inverse_lower[(i, j)] = -sum / lower[(i, i)];
        }
    }
    Some(inverse_lower.transpose() * inverse_lower)
}

/// Sum of squares over views.
pub(crate) trait Problem<N: Equations> {
    /// Values of all parameters.
    type State: Clone;
    /// Cost and normal equations at `state`. `None` where the model is undefined.
    fn linearise(&self, state: &Self::State) -> Option<(f64, N)>;
    /// `state` moved by `step`.
    fn moved(&self, state: &Self::State, step: &N::Step) -> Self::State;
    /// Variance of a residual of weight 1.
    fn noise_variance(&self, _cost: f64) -> f64 {
        1.0
    }
}

/// Final state of [`minimise`]. `cost` and `normal` belong to `state`, or to one a negligible step
/// away.
pub(crate) struct Minimum<State, N> {
    pub(crate) state: State,
    pub(crate) cost: f64,
    pub(crate) normal: N,
    pub(crate) converged: bool,
}

/// Start and end of a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    first_damping: f64,
    /// Largest `δᵀ g` of a negligible step: its squared length in standard deviations.
    negligible_step: f64,
}

impl Limits {
    /// From a rough guess, damped at first, to 1e-7 standard deviations. Large residuals make each
    /// step a third of the last, so that another digit would take two passes over the corners.
    pub(crate) const GUESS: Self = Self { first_damping: 1e-4, negligible_step: 1e-14 };
    /// From the minimum of nearly the same problem: damping would only shorten steps in directions
    /// hardly determined by the corners.
    pub(crate) const NEAR: Self = Self { first_damping: 1e-8, ..Self::GUESS };
    /// From a rough guess to 0.001 standard deviations.
    pub(crate) const ROUGH: Self = Self { negligible_step: 1e-6, ..Self::GUESS };
    /// To 0.03 standard deviations, which don't change odds of e⁵.
    pub(crate) const TRIAL: Self = Self { negligible_step: 1e-3, ..Self::GUESS };
}

/// Follows the cost downhill from `start`, in at most 100 steps. Never ends higher than it started;
/// deterministic.
///
/// Converged means a negligible next step, or one below 1e-2 standard deviations after the last of
/// the steps. `None` if the model is undefined at `start`.
pub(crate) fn minimise<P: Problem<N>, N: Equations>(
    problem: &P,
    start: P::State,
    limits: Limits,
) -> Option<Minimum<P::State, N>> {
    let (cost, normal) = problem.linearise(&start)?;
    let mut at = Minimum { state: start, cost, normal, converged: false };
    let mut damping = limits.first_damping;
    for _ in 0..100 {
        let step = at.normal.solve(damping);
        let decrement = step.as_ref().map_or(f64::INFINITY, N::decrement);
        let variance = problem.noise_variance(at.cost).max(LEAST_NOISE_VARIANCE);
        if decrement <= limits.negligible_step * variance {
            if let Some(step) = step.filter(|_| damping <= MAX_DAMPING_AT_END) {
                at.state = problem.moved(&at.state, &step);
                at.cost = (at.cost - decrement).max(0.0);
                at.converged = true;
            }
            break;
        }
        let lower = step.and_then(|step| {
            let state = problem.moved(&at.state, &step);
            let (cost, normal) = problem.linearise(&state)?;
            let converged = false;
            (cost <= at.cost * (1.0 + 1e-13)).then_some(Minimum { state, cost, normal, converged })
        });
        if let Some(lower) = lower {
            let is_as_promised = at.cost - lower.cost > PROMISED * decrement;
            at = lower;
            if is_as_promised {
                damping = if damping > 1e-10 { damping * 0.1 } else { 0.0 };
            }
        } else if damping > 1e9 {
            break;
        } else {
            damping = (damping * 10.0).max(1e-8);
        }
    }
    // Rounding hides the end of a valley hardly determined by the corners.
    let is_hidden = |step: N::Step| N::decrement(&step) <= HIDDEN_STEP;
    at.converged = at.converged || at.normal.solve(0.0).is_some_and(is_hidden);
    Some(at)
}
