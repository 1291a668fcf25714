//! Fits the bundle under each cause that all views share, and compares their odds.

use nalgebra::{DMatrix, SMatrix, SVector, SymmetricEigen, Vector2};

use super::{
    columns::{Derivatives, half_board_m},
    extended_bundle::{EXTRAS, ExtendedProblem, ExtendedState, SHARED},
    kinds::Kind,
    model::{Fit, Shared},
};
use crate::solve::{
    bundle::Bundle,
    lens_model::tie_covariance,
    odds::CLEAR,
    schur_lm::{Limits, Minimum, NormalEquations, ViewBlock, inverse, minimise},
    view_scatter::Scatter,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix, LensParameter, frame::ImageSize};

/// Least gain promised by one pass, as a share of the penalty for the parameters.
const PROMISING: f64 = 0.8;
/// Least reported shift by pixels or squares that aren't square, anywhere in the picture: the error
/// of a good detector's corner, in pixels.
const LEAST_PX: f64 = 0.1;

/// Best fit under a cause.
#[derive(Clone, Debug)]
pub(super) struct Explanation {
    pub(super) kind: Kind,
    /// Twice the logarithm of the odds to the plain bundle: `n ln(cost₀/cost)`, divided by the
    /// overcount of the corners ([`Scatter::overcount`]), less the penalty for its parameters and
    /// the prior odds.
    pub(super) gain: f64,
    /// Sum of squared whitened residuals.
    cost: f64,
    pub(super) state: ExtendedState,
    /// Covariance of the lens for corners with the stated error, parameters of the cause
    /// marginalised out.
    unit_covariance: LensMatrix,
    /// The same, with the parameters of the cause known.
    known_unit_covariance: LensMatrix,
    /// Shift of each seen corner in pixels, view by view; empty unless the board is bent.
    pub(super) shift_px: Vec<Vec<Vector2<f64>>>,
    /// Heights of the board's points in metres; zeros unless the board is bent.
    pub(super) rise_m: Vec<f64>,
    /// Largest shift in pixels of a place in the picture; `None` unless by pixels or squares.
    largest_shift_px: Option<f64>,
}

impl Explanation {
    /// Variance of the corners as a multiple of the stated covariances.
    fn noise_variance(&self, n: f64, freedom: usize) -> f64 {
        self.cost / (n - (freedom + self.kind.columns().len()) as f64).max(1.0)
    }

    /// False if the largest shift is too small to matter, however certain.
    pub(super) fn is_visible(&self) -> bool {
        self.largest_shift_px.is_none_or(|shift_px| shift_px >= LEAST_PX)
    }

    /// Covariance of the lens from the parameters of the cause.
    pub(super) fn of_parameters(&self, n: f64, freedom: usize) -> LensMatrix {
        let of_parameters = self.unit_covariance - self.known_unit_covariance;
        positive_part(&(of_parameters * self.noise_variance(n, freedom)))
    }

    fn lens_off(&self, from: &Camera) -> SVector<f64, LENS_PARAMETERS> {
        let (lens, there) = (self.state.bundle.camera.lens_parameters(), from.lens_parameters());
        SVector::from_fn(|i, _| lens[i] - there[i])
    }
}

/// Explanations, most probable first.
#[derive(Clone, Debug)]
pub(super) struct Explanations {
    pub(super) all: Vec<Explanation>,
    /// Covariance of the lens from uncertainty about the true explanation.
    pub(super) doubt: LensMatrix,
}

impl Explanations {
    /// Fits every cause that one pass promises a gain of, starting from the minimum of `bundle`,
    /// the richest plain bundle. `result` is the lens of the computed doubt.
    pub(super) fn of(
        derivatives: &Derivatives<'_>,
        bundle: &Bundle,
        result: &Camera,
        noise_floor: f64,
    ) -> Self {
        let search = Search::of(derivatives, bundle, noise_floor);
        let kinds = Kind::FITTED
            .into_iter()
            .filter(|kind| *kind != Kind::PixelAspect || bundle.freedom.square_pixels);
        let mut all: Vec<Explanation> = kinds
            .filter(|kind| search.promises(*kind))
            .filter_map(|kind| search.fit(kind))
            .collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let n = derivatives.observations.coordinate_count() as f64;
        let doubt = doubt(&all, bundle, result, n);
        Self { all, doubt }
    }

    /// Most probable explanation with a reportable effect, with sufficient odds.
    pub(super) fn best(&self) -> Option<&Explanation> {
        self.all.iter().find(|it| it.is_visible()).filter(|best| best.gain > CLEAR)
    }

    /// True if no explanation of another family is nearly as good as [`Self::best`].
    fn is_clear(&self) -> bool {
        let Some(best) = self.best() else { return false };
        let family = best.kind.row().family;
        let is_rival = |it: &&Explanation| {
            it.is_visible() && it.kind.row().family != family && it.gain > best.gain - CLEAR
        };
        !self.all.iter().any(|it| is_rival(&it))
    }

    /// Explanation to correct: pixels or squares that clearly aren't square, or a bent board if
    /// that's the clear winner. `is_done` is true for causes already corrected.
    pub(super) fn correctable(&self, is_done: impl Fn(Kind) -> bool) -> Option<&Explanation> {
        let best = self.best().map(|best| best.kind);
        let may_be = |it: &&Explanation| match it.kind {
            Kind::BoardBent => best == Some(it.kind) && self.is_clear(),
            Kind::PixelAspect | Kind::BoardStretched => true,
            _ => false,
        };
        let can_be = |it: &&Explanation| it.gain > CLEAR && it.is_visible() && !is_done(it.kind);
        let likeliest = self.all.iter().filter(can_be).find(may_be)?;
        // Prefer pixels to squares unless the views tell them apart: the board then keeps its
        // stated size for every use with this lens.
        let is_as_good =
            |it: &&Explanation| it.kind == Kind::PixelAspect && it.gain > likeliest.gain - CLEAR;
        let is_stretched = likeliest.kind == Kind::BoardStretched;
        let pixels = || self.all.iter().filter(can_be).find(is_as_good);
        is_stretched.then(pixels).flatten().or(Some(likeliest))
    }

    /// Covariance of the lens under `best`, from alternatives of the same family.
    pub(super) fn doubt_beside(&self, best: &Explanation) -> LensMatrix {
        let odds = |it: &Explanation| libm::exp(0.5 * (it.gain - best.gain)).min(1.0);
        let family = best.kind.row().family;
        let alike = || self.all.iter().filter(|it| it.kind.row().family == family);
        let total: f64 = alike().map(odds).sum();
        let spread = |it: &Explanation| {
            let off = it.lens_off(&best.state.bundle.camera);
            off * off.transpose() * (odds(it) / total)
        };
        alike().map(spread).sum()
    }
}

/// Corners, with the minimum of the plain bundle.
struct Search<'a> {
    derivatives: &'a Derivatives<'a>,
    bundle: &'a Bundle,
    n: f64,
    cost: f64,
    /// Least credible sum of squared whitened residuals.
    least_cost: f64,
}

impl<'a> Search<'a> {
    fn of(derivatives: &'a Derivatives<'a>, bundle: &'a Bundle, noise_floor: f64) -> Self {
        let n = derivatives.observations.coordinate_count() as f64;
        let least_cost = n * noise_floor * noise_floor;
        Self { derivatives, bundle, n, cost: bundle.cost.max(least_cost), least_cost }
    }

    /// True if one pass promises most of the penalty for the parameters of `kind`.
    fn promises(&self, kind: Kind) -> bool {
        let columns = kind.columns();
        let shared = Shared { columns, sd: vec![f64::INFINITY; columns.len()], course: None };
        let fit = Fit::of(&self.derivatives.of_views, &self.derivatives.lens, &[shared]);
        fit.is_some_and(|fit| {
            let left = (self.cost - fit.gain()).max(self.least_cost);
            let promised = self.n * libm::log(self.cost / left);
            let penalty = columns.len() as f64 * libm::log(self.n) + kind.row().against;
            promised >= PROMISING * penalty
        })
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        let views = self.derivatives.observations.view_count();
        let left = self.n - (6 * views + LENS_PARAMETERS) as f64;
        cost.max(self.least_cost) / left.max(1.0)
    }

    /// Free lens parameters beside a cause: all of the model, and all of Brown's model even if few
    /// views determine fewer. A cause is found only if the corners distinguish it from the lens.
    fn freed(&self) -> [bool; LENS_PARAMETERS] {
        let all = self.bundle.state.camera.distortion.kind.keeps_lines();
        let free = &self.bundle.freedom.free;
        LensParameter::ALL.map(|of| free[of.index()] || (all && of.is_browns()))
    }

    /// Minimises the reprojection error under `kind`, starting from the plain bundle. `None` if the
    /// fit doesn't converge.
    fn fit(&self, kind: Kind) -> Option<Explanation> {
        let observations = self.derivatives.observations;
        let square_pixels = self.bundle.freedom.square_pixels && kind != Kind::PixelAspect;
        let half_board_m = half_board_m(observations);
        let free = self.freed();
        let problem = ExtendedProblem { observations, kind, half_board_m, square_pixels, free };
        let start = ExtendedState { bundle: self.bundle.state.clone(), extras: [0.0; EXTRAS] };
        let minimum: Minimum<_, NormalEquations<SHARED, 6>> =
            minimise(&problem, start, Limits::TRIAL)?;
        if !minimum.converged {
            return None;
        }
        let state = minimum.state;
        let cost = problem.cost(&state)?;
        let variance = self.noise_variance(cost);
        let views = observations.view_count();
        let overcount = scatter(&problem, &minimum.normal, variance)?.overcount(views);
        let information = minimum.normal.reduced()?;
        let covariance = inverse(&information)?;
        let told = self.n * libm::log(self.cost / cost.max(self.least_cost)) / overcount;
        let at = (state.bundle.camera.f_px.x, variance * overcount);
        let occam =
            occam(kind, &shared_information(kind, &covariance, at)?, &self.derivatives.image_size);
        let mut known = information;
        for index in LENS_PARAMETERS..SHARED {
            known.row_mut(index).fill(0.0);
            known.column_mut(index).fill(0.0);
            known[(index, index)] = 1.0;
        }
        let is_bent = kind == Kind::BoardBent;
        let board_m = observations.board_m().iter();
        let size = self.derivatives.image_size;
        Some(Explanation {
            kind,
            gain: told - occam - kind.row().against,
            cost,
            unit_covariance: lens_covariance(&problem, &covariance),
            known_unit_covariance: lens_covariance(&problem, &inverse(&known)?),
            shift_px: if is_bent { problem.shifts_px(&state)? } else { Vec::new() },
            rise_m: board_m.map(|p| problem.on_board(&state.extras, p).z).collect(),
            largest_shift_px: match kind {
                Kind::PixelAspect => {
                    let f_px = state.bundle.camera.f_px;
                    Some(stretch_px(f_px.y / f_px.x, size))
                }
                Kind::BoardStretched => Some(stretch_px(1.0 + state.extras[0], size)),
                _ => None,
            },
            state,
        })
    }
}

/// Evidence cost of the parameters of a cause, as twice a logarithm: `ln |1 + T² A|` with their
/// information `A` and prior sizes `T` (the Occam factor, MacKay 1992).
fn occam(kind: Kind, information: &DMatrix<f64>, image_size: &ImageSize) -> f64 {
    let sd = kind.sd(*image_size);
    let scaled = DMatrix::from_fn(sd.len(), sd.len(), |i, j| information[(i, j)] * sd[i] * sd[j]);
    let eigenvalues = SymmetricEigen::new(scaled).eigenvalues;
    eigenvalues.iter().map(|it| libm::log1p(it.max(0.0))).sum()
}

/// Information about the parameters of a cause, with the lens's marginalised, for corners with
/// `variance`. `None` if undetermined.
fn shared_information(
    kind: Kind,
    covariance: &SMatrix<f64, SHARED, SHARED>,
    (f_px, variance): (f64, f64),
) -> Option<DMatrix<f64>> {
    if kind == Kind::PixelAspect {
        let [fx, fy] = LensParameter::F.map(LensParameter::index);
        let unit_px2 = covariance[(fx, fx)] + covariance[(fy, fy)] - 2.0 * covariance[(fx, fy)];
        return Some(DMatrix::from_element(1, 1, f_px * f_px / (unit_px2 * variance)));
    }
    let count = kind.extras();
    let unit = covariance.view((LENS_PARAMETERS, LENS_PARAMETERS), (count, count)).into_owned();
    Some(unit.cholesky()?.inverse() / variance)
}

/// Pulls of the views at the free shared parameters.
fn scatter(
    problem: &ExtendedProblem<'_>,
    normal: &NormalEquations<SHARED, 6>,
    noise_variance: f64,
) -> Option<Scatter> {
    let free: Vec<usize> = (0..SHARED).filter(|index| problem.is_free(*index)).collect();
    let of_view = |view: &ViewBlock<SHARED, 6>| {
        let (information, gradient) = view.reduced()?;
        let information = information.select_rows(&free).select_columns(&free) / noise_variance;
        Some((information, gradient.select_rows(&free) / noise_variance))
    };
    let views: Vec<_> = normal.views.iter().map(of_view).collect::<Option<_>>()?;
    Scatter::of(&views, &DMatrix::zeros(free.len(), free.len()))
}

/// Lens block of a covariance, with zeros for fixed parameters and `fy` as `fx` if pixels are
/// square.
fn lens_covariance(
    problem: &ExtendedProblem<'_>,
    covariance: &SMatrix<f64, SHARED, SHARED>,
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

/// Covariance from averaging over the explanations: `Σ w (s² C + d dᵀ − s₀² C₀)`, with weights in
/// proportion to the odds `e^(gain/2)`; the plain bundle's is 1. What differs from view to view is
/// part of the views' scatter.
fn doubt(explanations: &[Explanation], bundle: &Bundle, result: &Camera, n: f64) -> LensMatrix {
    let mut doubt = LensMatrix::zeros();
    let most = explanations.iter().map(|it| it.gain).fold(0.0, f64::max);
    let odds = |gain: f64| libm::exp(0.5 * (gain - most));
    let total = odds(0.0) + explanations.iter().map(|it| odds(it.gain)).sum::<f64>();
    let Some(plain) = bundle.covariance(bundle.noise_factor()) else { return doubt };
    let freedom = bundle.freedom.count() + 6 * bundle.state.cam_from_board.len();
    for explanation in explanations {
        let off = explanation.lens_off(result);
        let variance = explanation.noise_variance(n, freedom);
        let more = explanation.unit_covariance * variance + off * off.transpose() - plain;
        // Positive parts only: an explanation must not reduce the uncertainty of the result.
        doubt += positive_part(&more) * (odds(explanation.gain) / total);
    }
    doubt
}

/// Positive part of a symmetric matrix, by eigenvalues after scaling to a unit diagonal.
pub(crate) fn positive_part(matrix: &LensMatrix) -> LensMatrix {
    let scale = SVector::<f64, LENS_PARAMETERS>::from_fn(|i, _| {
        let size = matrix[(i, i)].abs().sqrt();
        if size > 0.0 { size } else { 1.0 }
    });
    let scaled = LensMatrix::from_fn(|i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let mut eigen = SymmetricEigen::new(scaled);
    eigen.eigenvalues.iter_mut().for_each(|value| *value = value.max(0.0));
    let positive = eigen.recompose();
    LensMatrix::from_fn(|i, j| positive[(i, j)] * scale[i] * scale[j])
}
