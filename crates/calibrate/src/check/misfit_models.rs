//! Fits the extended bundle under a cause, and weighs the gain against the penalty for the
//! parameters.
//!
//! Each [`Cause`] adds parameters to the lens and poses. Its probability follows from the gain in
//! fit over the plain bundle.

use nalgebra::{DMatrix, Point3, SMatrix, Vector2};

use super::{
    extended_bundle::{ExtendedProblem, ExtendedState, FEW, LOCAL, MANY},
    first_steps::{FirstStep, FirstSteps, Plain, half_board_m},
    hypotheses::{Cause, FEW_SHARED_EXTRAS, Family, LOCAL_EXTRAS},
};
use crate::solve::{
    bundle::{Bundle, BundleState, Observations},
    lens_model::{LensFreedom, tie_covariance},
    schur_lm::{Minimum, NormalEquations, ViewBlock, inverse, minimise_to},
    view_scatter::Scatter,
};
use boresight_geometry::{LENS_PARAMETERS, LensMatrix, LensParameter, frame::ImageSize};

/// Number of fits of a cause with a prior on per-view parameters; each fit takes their standard
/// deviation from the previous one.
const PRIOR_PASSES: usize = 4;
/// `δᵀ g` at which a fit ends: 0.03 standard deviations don't change odds of at least e⁵.
const NEGLIGIBLE_STEP: f64 = 1e-3;
/// Least promised gain of the first step of a fit, as a share of the penalty for the parameters.
const PROMISING: f64 = 0.8;
/// Least gain for per-view parameters with a prior, in standard deviations above the gain by
/// chance.
const PROMISING_SIGMAS: f64 = 4.0;

/// Best fit under a cause.
#[derive(Clone, Debug)]
pub(super) struct Explanation {
    pub(super) cause: Cause,
    /// Number of parameters added by the cause.
    pub(crate) parameters: usize,
    /// Twice the logarithm of the odds to the plain bundle: `n ln(cost₀/cost)`, corrected for
    /// correlation, less the cost of its parameters and [`Cause::against`]. The correction is a
    /// division by the overcounting of the corners ([`Scatter::overcount`]), or, with per-view
    /// parameters, a subtraction of the gain from correlated noise.
    pub(super) gain: f64,
    /// Sum of squared whitened residuals.
    pub(crate) cost: f64,
    pub(crate) state: ExtendedState,
    /// Covariance of the lens for corners with the stated error, parameters of the cause
    /// marginalised out.
    pub(crate) unit_covariance: LensMatrix,
    /// Covariance of the lens for corners with the stated error, with the parameters of the cause
    /// known.
    pub(super) known_unit_covariance: LensMatrix,
    /// Points of the board in metres and the shift of each seen corner in pixels, view by view;
    /// `None` unless the board is bent alike in all views.
    pub(crate) bent: Option<Bent>,
    /// Largest shift in pixels by the cause beyond the lens: of a corner by a smooth field, of a
    /// place in the picture by non-square pixels or squares. `None` for other causes.
    pub(super) largest_shift_px: Option<f64>,
    /// Distance in metres between the lowest and the highest corner of the board; zero unless it's
    /// bent. If it bends differently in each view, root mean square.
    pub(super) depth_m: f64,
}

impl Explanation {
    /// Variance of the corners as a multiple of the stated covariances, after a plain bundle with
    /// `freedom` parameters estimated from `n` coordinates.
    pub(super) fn noise_variance(&self, n: f64, freedom: usize) -> f64 {
        self.cost / (n - (freedom + self.parameters) as f64).max(1.0)
    }

    /// False if the largest shift by the cause is too small to matter, however certain.
    pub(super) fn is_visible(&self) -> bool {
        self.largest_shift_px.is_none_or(|shift_px| shift_px >= self.cause.row().least_px)
    }

    /// Logarithms of the views' focal lengths, relative to the lens's; empty unless the cause is a
    /// moving focus.
    pub(super) fn log_focal(&self) -> Vec<f64> {
        let local = &self.state.local;
        let along = |view| self.state.shared[0] * self.cause.times(view, local.len());
        match &self.cause {
            Cause::Focus => local.iter().map(|local| local[0]).collect(),
            cause if cause.row().family == Family::Focus => (0..local.len()).map(along).collect(),
            _ => Vec::new(),
        }
    }

    /// Relative sample standard deviation of the focal length over the views; zero unless the cause
    /// is a moving focus.
    pub(super) fn focal_relative_sd(&self) -> f64 {
        let logs = self.log_focal();
        let mean = logs.iter().sum::<f64>() / logs.len().max(1) as f64;
        let squares: f64 = logs.iter().map(|x| (x - mean).powi(2)).sum();
        (squares / (logs.len() as f64 - 1.0).max(1.0)).sqrt()
    }
}

/// A board that is bent alike in all views.
#[derive(Clone, Debug)]
pub(crate) struct Bent {
    /// Points in metres, in numbering order.
    pub(crate) board_m: Vec<Point3<f64>>,
    /// Shift of each seen corner by the bend in pixels, view by view.
    pub(crate) shift_px: Vec<Vec<Vector2<f64>>>,
}

/// Fits of the causes of a misfit.
pub(super) struct Explained {
    pub(super) explanations: Vec<Explanation>,
    /// Causes with an unconverged fit.
    pub(super) failed: Vec<Cause>,
    /// First step of a drifting focus.
    pub(super) drift: Option<FirstStep>,
}

/// Corners, with the minimum of the plain bundle before any explanation.
#[derive(Clone, Copy)]
pub(super) struct Unexplained<'a> {
    pub(super) observations: &'a Observations,
    pub(super) image_size: ImageSize,
    pub(super) start: &'a BundleState,
    pub(super) freedom: LensFreedom,
    /// Sum of squared whitened residuals of the plain bundle.
    pub(super) cost: f64,
    /// Least credible sum.
    pub(super) least_cost: f64,
    /// Gain in BIC of correlated noise over independent noise.
    pub(super) noise_gain: f64,
}

impl<'a> Unexplained<'a> {
    /// Misfit of `bundle`.
    pub(super) fn by(
        bundle: &'a Bundle,
        observations: &'a Observations,
        image_size: ImageSize,
        noise_floor: f64,
        noise_gain: f64,
    ) -> Self {
        let least_cost = observations.coordinate_count() as f64 * noise_floor * noise_floor;
        Self {
            observations,
            image_size,
            start: &bundle.state,
            freedom: bundle.freedom,
            cost: bundle.cost.max(least_cost),
            least_cost,
            noise_gain: noise_gain.max(0.0),
        }
    }

    /// First steps under each of `causes`, with promised gains.
    pub(super) fn first_steps(&self, causes: &[Cause]) -> FirstSteps {
        let plain = Plain {
            observations: self.observations,
            state: self.start,
            image_size: self.image_size,
            square_pixels: self.freedom.square_pixels,
            free: self.freed(),
            noise_variance: self.noise_variance(self.cost),
        };
        FirstSteps::of(&plain, causes)
    }

    /// Best fits under `causes`, in order, except where the first step promises less than most of
    /// the penalty for the parameters.
    pub(super) fn explain_all(&self, causes: Vec<Cause>) -> Explained {
        let steps = self.first_steps(&causes);
        let drift = causes.iter().position(|cause| *cause == Cause::FocusDrift);
        let drift = drift.and_then(|place| steps.of_one(place));
        let mut explained = Explained { explanations: Vec::new(), failed: Vec::new(), drift };
        for (place, cause) in causes.into_iter().enumerate() {
            if steps.left(place).is_some_and(|left| self.promises(&cause, left)) {
                match self.explain(&cause) {
                    Some(explanation) => explained.explanations.push(explanation),
                    None => explained.failed.push(cause),
                }
            }
        }
        explained
    }

    /// True if a first step with the cost `left` promises to gain most of the cost of the
    /// parameters of `cause`.
    fn promises(&self, cause: &Cause, left: f64) -> bool {
        let n = self.observations.coordinate_count() as f64;
        let parameters = cause.parameters(self.observations.view_count()) as f64;
        let promised = n * libm::log(self.cost / left.max(self.least_cost));
        let wanted = match cause.local_sd() {
            Some(_) => parameters + PROMISING_SIGMAS * (2.0 * parameters).sqrt(),
            None => PROMISING * parameters * libm::log(n),
        };
        promised >= wanted + PROMISING * cause.against(self.observations.view_count())
    }

    /// Minimises the reprojection error under `cause`, starting from the minimum of the plain
    /// bundle. `None` if the fit doesn't converge.
    fn explain(&self, cause: &Cause) -> Option<Explanation> {
        if cause.shared_extras() > FEW_SHARED_EXTRAS {
            self.fit::<MANY>(cause)
        } else {
            self.fit::<FEW>(cause)
        }
    }

    /// Gain of two cameras in the view with the largest gain; zero for other causes. Any fault of a
    /// single view looks like another camera, so only the gain shared with other views counts.
    fn of_oddest(&self, problem: &ExtendedProblem<'_>, state: &ExtendedState) -> Option<f64> {
        let Cause::Mixed(_) = problem.cause else { return Some(0.0) };
        let plain = ExtendedState::plain(self.start);
        let gain = |view| Some(problem.view_cost(&plain, view)? - problem.view_cost(state, view)?);
        (0..state.local.len()).try_fold(0.0, |most: f64, view| Some(most.max(gain(view)?)))
    }

    /// Variance of the corners as a multiple of the stated covariances, if `cost` remains.
    fn noise_variance(&self, cost: f64) -> f64 {
        let n = self.observations.coordinate_count() as f64;
        let left = n - (6 * self.observations.view_count() + LENS_PARAMETERS) as f64;
        cost.max(self.least_cost) / left.max(1.0)
    }

    /// Free lens parameters beside a cause: all of the model, and all of Brown's model even if few
    /// views determine fewer. A cause is found only if the corners distinguish it from the lens.
    fn freed(&self) -> [bool; LENS_PARAMETERS] {
        let all = self.start.camera.distortion.kind.keeps_lines();
        LensParameter::ALL.map(|of| self.freedom.free[of.index()] || (all && of.is_browns()))
    }

    fn problem<'b>(&'b self, cause: &'b Cause) -> ExtendedProblem<'b> {
        ExtendedProblem {
            observations: self.observations,
            cause,
            image_size: self.image_size,
            half_board_m: half_board_m(self.observations),
            square_pixels: self.freedom.square_pixels && *cause != Cause::PixelAspect,
            free: self.freed(),
            local_sd: cause.local_sd().map_or(1.0, |(first, _)| first),
            noise_variance: self.noise_variance(self.cost),
        }
    }

    fn fit<const S: usize>(&self, cause: &Cause) -> Option<Explanation> {
        let views = self.observations.view_count();
        let n = self.observations.coordinate_count() as f64;
        let mut problem = self.problem(cause);
        let start = ExtendedState::plain(self.start);
        let parameters = cause.parameters(views);
        let mut minimum: Minimum<_, S, LOCAL> = minimise_to(&problem, start, NEGLIGIBLE_STEP)?;
        if let Some((_, least)) = cause.local_sd() {
            // A prior wider than the actual scatter would leave f and the principal point
            // undetermined.
            for _ in 1..PRIOR_PASSES {
                problem.local_sd = minimum.state.local_rms(cause.local_extras()).max(least);
                problem.noise_variance = self.noise_variance(problem.cost(&minimum.state)?);
                minimum = minimise_to(&problem, minimum.state, NEGLIGIBLE_STEP)?;
            }
        }
        if !minimum.converged {
            return None;
        }
        let state = minimum.state;
        let cost = problem.cost(&state)?;
        let information = minimum.normal.reduced()?;
        // Per-view parameters don't make views agree with each other.
        let overcount = match cause.local_extras() {
            0 => scatter(&problem, &minimum.normal, self.noise_variance(cost))?.overcount(views),
            _ => 1.0,
        };
        let plain_cost = self.cost - self.of_oddest(&problem, &state)?;
        let by_corners = |cost: f64| n * libm::log(plain_cost / cost.max(self.least_cost));
        // Correlated noise explains residuals, too; for shared causes, overcounting already
        // includes it.
        let told = |cost: f64| match cause.local_extras() {
            0 => by_corners(cost) / overcount,
            _ => by_corners(cost) - self.noise_gain,
        };
        let covariance = inverse(&information)?;
        let unit_covariance = lens_covariance(&problem, &covariance);
        let gain = match cause.local_sd() {
            Some(_) => {
                let prior_information = problem.noise_variance / problem.local_sd.powi(2);
                let occam: f64 = minimum
                    .normal
                    .views
                    .iter()
                    .map(|view| evidence_cost(view, cause.local_extras(), prior_information))
                    .sum();
                told(minimum.cost) - occam - libm::log(n)
            }
            None if cause.is_free() => told(cost) - parameters as f64 * libm::log(n),
            None => {
                let f_px = state.bundle.camera.f_px.x;
                let at = (f_px, self.noise_variance(cost) * overcount);
                told(cost) - cause.occam(&shared_information(&problem, &covariance, at)?)
            }
        };
        let mut known = information;
        for index in LENS_PARAMETERS..S {
            known.row_mut(index).fill(0.0);
            known.column_mut(index).fill(0.0);
            known[(index, index)] = 1.0;
        }
        let known_unit_covariance = lens_covariance(&problem, &inverse(&known)?);
        let depth_m = depth_m(&problem, &state);
        let shifts_px = || problem.shifts_px(&state);
        let bent = match cause {
            Cause::BoardBent => {
                let flat_m = self.observations.board_m().iter();
                let on_board = |p| problem.on_board(&state.shared, &[0.0; LOCAL_EXTRAS], p);
                Some(Bent { board_m: flat_m.map(on_board).collect(), shift_px: shifts_px()? })
            }
            _ => None,
        };
        let largest_shift_px = match cause {
            Cause::SmoothField => {
                Some(shifts_px()?.iter().flatten().map(Vector2::norm).fold(0.0, f64::max))
            }
            Cause::PixelAspect => {
                let f_px = state.bundle.camera.f_px;
                Some(stretch_px(f_px.y / f_px.x, self.image_size))
            }
            Cause::BoardStretched => Some(stretch_px(1.0 + state.shared[0], self.image_size)),
            _ => None,
        };
        Some(Explanation {
            bent,
            largest_shift_px,
            depth_m,
            parameters,
            gain: gain - cause.against(views),
            cost,
            state,
            unit_covariance,
            known_unit_covariance,
            cause: cause.clone(),
        })
    }
}

/// Information about the shared parameters of a cause, with the lens's marginalised, for corners
/// with `variance`. `None` if undetermined.
fn shared_information<const S: usize>(
    problem: &ExtendedProblem<'_>,
    covariance: &SMatrix<f64, S, S>,
    (f_px, variance): (f64, f64),
) -> Option<DMatrix<f64>> {
    if *problem.cause == Cause::PixelAspect {
        let [fx, fy] = LensParameter::F.map(LensParameter::index);
        let unit_px2 = covariance[(fx, fx)] + covariance[(fy, fy)] - 2.0 * covariance[(fx, fy)];
        return Some(DMatrix::from_element(1, 1, f_px * f_px / (unit_px2 * variance)));
    }
    let count = problem.cause.shared_extras();
    let unit = covariance.view((LENS_PARAMETERS, LENS_PARAMETERS), (count, count)).into_owned();
    Some(unit.cholesky()?.inverse() / variance)
}

/// Pulls of the views at the free shared parameters.
fn scatter<const S: usize>(
    problem: &ExtendedProblem<'_>,
    normal: &NormalEquations<S, LOCAL>,
    noise_variance: f64,
) -> Option<Scatter> {
    let free: Vec<usize> = (0..S).filter(|index| problem.is_free(*index)).collect();
    let part =
        |all: &SMatrix<f64, S, S>| all.select_rows(&free).select_columns(&free) / noise_variance;
    let of_view = |view: &ViewBlock<S, LOCAL>| {
        let (information, gradient) = view.reduced()?;
        Some((part(&information), gradient.select_rows(&free) / noise_variance))
    };
    let views: Vec<_> = normal.views.iter().map(of_view).collect::<Option<_>>()?;
    let shared: SMatrix<f64, S, S> = normal.views.iter().map(|view| view.shared).sum();
    Scatter::of(&views, &part(&(normal.shared - shared)))
}

/// `ln |I + A/p|`: the penalty for the `count` parameters of a view with the information `p` from
/// their prior and `A` from the corners, with the pose eliminated (the Occam factor of Bayesian
/// model comparison, MacKay 1992).
fn evidence_cost<const S: usize>(
    view: &ViewBlock<S, LOCAL>,
    count: usize,
    prior_information: f64,
) -> f64 {
    let of_pose = view.local.fixed_view::<6, 6>(0, 0).into_owned();
    let Some(settled) = inverse(&of_pose) else { return f64::INFINITY };
    let cross = view.local.fixed_view::<LOCAL_EXTRAS, 6>(6, 0).into_owned();
    let own = view.local.fixed_view::<LOCAL_EXTRAS, LOCAL_EXTRAS>(6, 6).into_owned();
    let left = own - cross * settled * cross.transpose();
    // The block's information includes the prior.
    let scaled = DMatrix::from_fn(count, count, |i, j| left[(i, j)] / prior_information);
    scaled.cholesky().map_or(f64::INFINITY, |factors| factors.ln_determinant().max(0.0))
}

/// Lens block of a covariance, with zeros for fixed parameters and `fy` as `fx` if pixels are
/// square.
fn lens_covariance<const S: usize>(
    problem: &ExtendedProblem<'_>,
    covariance: &SMatrix<f64, S, S>,
) -> LensMatrix {
    let mut lens = LensMatrix::from_fn(|i, j| covariance[(i, j)]);
    for index in (0..LENS_PARAMETERS).filter(|index| !problem.is_free(*index)) {
        lens.row_mut(index).fill(0.0);
        lens.column_mut(index).fill(0.0);
    }
    if problem.square_pixels {
        tie_covariance(&mut lens);
    }
    lens
}

/// Largest shift in pixels in a picture stretched in height by `aspect`, beside the best scale with
/// the original aspect. A corner shifts by `a` of half the width and `b` of half the height, with
/// `b − a = ln aspect` and the least length.
fn stretch_px(aspect: f64, image_size: ImageSize) -> f64 {
    let half_px =
        [image_size.width_px, image_size.height_px].map(|side_px| 0.5 * f64::from(side_px));
    libm::log(aspect).abs() * half_px[0] * half_px[1] / libm::hypot(half_px[0], half_px[1])
}

fn depth_m(problem: &ExtendedProblem<'_>, state: &ExtendedState) -> f64 {
    let depth_m = |local: &[f64; LOCAL_EXTRAS]| {
        let board_m = problem.observations.board_m();
        let rises = board_m.iter().map(|p| problem.on_board(&state.shared, local, p).z);
        rises.clone().fold(f64::NEG_INFINITY, f64::max) - rises.fold(f64::INFINITY, f64::min)
    };
    let squares: f64 = state.local.iter().map(|local| depth_m(local).powi(2)).sum();
    (squares / state.local.len().max(1) as f64).sqrt()
}
