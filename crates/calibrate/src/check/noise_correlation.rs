//! Widens the covariance of the lens if the errors of neighbouring corners correlate.
//!
//! Blur, shadows on the print, a board that isn't flat and compression shift neighbouring corners
//! together. The poses then absorb most of these errors, so the residuals stay small, while the
//! lens follows the rest: the residual noise understates the error of the lens. The errors of a
//! view are therefore modelled as
//!
//! ```text
//! cov(eᵢ, eⱼ) = s² ((1 − a) δᵢⱼ + a exp(−dᵢⱼ²/2ℓ²))        d: distance of two corners in the
//! picture
//! ```
//!
//! in units of the stated covariances. Each pair (a, ℓ) of a grid gets a weight by its restricted
//! likelihood (Patterson & Thompson 1971), which accounts for the absorption by the poses and the
//! lens. The estimate stays that of independent noise; its covariance becomes `I⁻¹ (Σ Aᵀ K A) I⁻¹`,
//! with `A` the Jacobian of a view by the lens, its pose eliminated, and `K` the average of the
//! models.

use nalgebra::{DMatrix, SMatrix, SVector};

use crate::causes::positive_part;
use crate::solve::{
    bundle::{Bundle, Observations},
    common_error::CommonError,
    gram::{Gram, Row},
    model_choice::{ModelChoice, ModelFit},
    schur_lm::inverse,
    whitened::Whitened,
};
use boresight_geometry::{
    LENS_PARAMETERS,
    simd::{Loop, widest},
};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;
type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Shares `a` of the smooth variance.
const SHARES: [f64; 7] = [0.1, 0.25, 0.5, 0.75, 0.95, 0.999, 0.999_99];
/// Correlation lengths `ℓ`, as multiples of the mean distance between neighbouring corners in the
/// picture.
const LENGTHS: [f64; 5] = [0.5, 0.8, 1.3, 2.2, 4.0];
/// Approximate number of corners per view: the cost is cubic in it. Larger boards are thinned.
const CORNERS: usize = 80;
/// Approximate number of views; more are sampled evenly.
const VIEWS: usize = 50;
/// Prior probability of independent noise.
const INDEPENDENT: f64 = 0.8;

/// Difference of −2 log likelihoods from which a model doesn't count: odds of e⁻¹².
const UNLIKELY: f64 = 24.0;

/// Parameters of the correlation: `a` and `ℓ`.
const PARAMETERS: f64 = 2.0;

/// Columns of a view's table: lens, pose, residual.
pub(super) const POSE: usize = LENS_PARAMETERS;
pub(super) const RESIDUAL: usize = LENS_PARAMETERS + 6;
pub(super) const TILES: usize = (RESIDUAL + 1).div_ceil(4);

/// Noise of the corners, averaged over the models.
#[derive(Clone, Debug)]
pub(crate) struct NoiseCorrelation {
    /// Gain in BIC of the likeliest model over independent noise.
    pub(crate) gain: f64,
    /// Likeliest model with correlation: its share of the variance, correlation length in pixels,
    /// and standard deviation as a multiple of the stated one.
    pub(super) share: f64,
    pub(super) length_px: f64,
    pub(super) noise_factor: f64,
    /// `Σ Aᵀ K A`, and `Σ Aᵀ A` for comparison.
    information: LensMatrix,
    independent: LensMatrix,
}

/// Thinned view under the lens of the bundle.
struct View {
    /// Rows, two per corner.
    rows: Vec<Row<TILES>>,
    /// Derivatives of the corners by the lens, with the pose eliminated: a row per corner for each
    /// coordinate.
    by_lens: [DMatrix<f64>; 2],
    distance_px: DMatrix<f64>,
    /// Mean distance of these corners from the nearest neighbours, thinned corners included.
    spacing_px: f64,
}

/// Models the noise around the minimum of `bundle`, the richest bundle. `None` if a covariance is
/// singular.
pub(crate) fn noise_correlation(
    observations: &Observations,
    bundle: &Bundle,
) -> Option<NoiseCorrelation> {
    // In the view with the most corners.
    let most = (0..observations.view_count()).map(|view| observations.view(view).len()).max()?;
    let step = (most / CORNERS).max(1);
    let every = observations.view_count().div_ceil(VIEWS).max(1);
    let views: Vec<View> = (0..observations.view_count())
        .step_by(every)
        .map(|view| View::of(observations, bundle, view, step))
        .collect::<Option<_>>()?;
    let spacing_px = views.iter().map(|view| view.spacing_px).sum::<f64>() / views.len() as f64;
    let count: f64 = views.iter().map(|view| 2.0 * view.count() as f64).sum();
    let left = count - (bundle.freedom.count() + 6 * views.len()) as f64;
    if left < 1.0 || spacing_px.is_nan() || spacing_px <= 0.0 {
        return None;
    }
    let white: Vec<DMatrix<f64>> =
        views.iter().map(|view| DMatrix::identity(view.count(), view.count())).collect();
    let fit = |share: f64, smooth: &[DMatrix<f64>]| {
        restricted_likelihood(&views, smooth, share, bundle, left)
    };
    let (independent_cost, variance) = fit(0.0, &white)?;
    // A thinned corner represents `step` corners, a pair the square of that, and a view `every`
    // views.
    let (step, every) = (step as f64, every as f64);
    let independent = between(&views, &white) * (step * every);
    let prior = (1.0 - INDEPENDENT) / (SHARES.len() * LENGTHS.len()) as f64;
    // Independent noise first.
    let mut models = vec![(0.0, 0, independent_cost - 2.0 * libm::log(INDEPENDENT), variance)];
    let mut smooth: [Option<Vec<DMatrix<f64>>>; LENGTHS.len()] = Default::default();
    likely_models(|share, length| {
        let smooth_at = || views.iter().map(|v| v.smooth(LENGTHS[length] * spacing_px)).collect();
        let smooth = smooth[length].get_or_insert_with(smooth_at);
        let (cost, variance) = fit(SHARES[share], smooth)?;
        let cost = cost - 2.0 * libm::log(prior);
        models.push((SHARES[share], length, cost, variance));
        Some(cost)
    });
    let by_length = smooth.map(|smooth| {
        let pairs = between(&views, &smooth?) * every - independent / step;
        Some(pairs * (step * step) + independent)
    });
    let least = models.iter().map(|model| model.2).fold(f64::INFINITY, f64::min);
    let odds = |cost: f64| libm::exp(-0.5 * (cost - least));
    let total: f64 = models.iter().map(|model| odds(model.2)).sum();
    let mut information = LensMatrix::zeros();
    for &(share, length, cost, variance) in &models {
        let smooth = by_length[length].unwrap_or(independent);
        let of_model = independent * (1.0 - share) + smooth * share;
        information += of_model * (variance * odds(cost) / total);
    }
    let (share, length, cost, variance) =
        models.iter().skip(1).copied().min_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(NoiseCorrelation {
        gain: (independent_cost - (cost + 2.0 * libm::log(prior))) * (step * every)
            - PARAMETERS * libm::log(observations.coordinate_count() as f64),
        share,
        length_px: LENGTHS[length] * spacing_px,
        noise_factor: variance.sqrt(),
        information,
        independent,
    })
}

/// Calls `cost_of` with the indices of a share and a length for the models of the grid that count:
/// from the middle downhill, and on as far as a neighbour's cost is within [`UNLIKELY`] of the
/// least.
fn likely_models(mut cost_of: impl FnMut(usize, usize) -> Option<f64>) {
    let mut is_tried = [[false; LENGTHS.len()]; SHARES.len()];
    let mut open = vec![(f64::NEG_INFINITY, SHARES.len() / 2, LENGTHS.len() / 2)];
    let mut least = f64::INFINITY;
    let by_cost = |(_, a): &(usize, &(f64, usize, usize)),
                   (_, b): &(usize, &(f64, usize, usize))| {
        a.0.total_cmp(&b.0)
    };
    while let Some((next, _)) = open.iter().enumerate().min_by(by_cost) {
        let (cost, share, length) = open.swap_remove(next);
        if cost > least + UNLIKELY {
            return;
        }
        let near_share = |(other, _): &(usize, _)| share.abs_diff(*other) <= 1;
        let near_length = |(other, _): &(usize, _)| length.abs_diff(*other) <= 1;
        for (share, is_tried) in is_tried.iter_mut().enumerate().filter(near_share) {
            for (length, is_tried) in is_tried.iter_mut().enumerate().filter(near_length) {
                if std::mem::replace(is_tried, true) {
                    continue;
                }
                let cost = cost_of(share, length).unwrap_or(f64::INFINITY);
                least = least.min(cost);
                open.push((cost, share, length));
            }
        }
    }
}

impl NoiseCorrelation {
    /// Covariance to add to the chosen lens's, averaged over the models as in
    /// [`ModelChoice::averaged_covariance`]. Never negative: correlation doesn't make a result more
    /// certain.
    pub(crate) fn doubt(&self, choice: &ModelChoice, noise_floor: f64) -> LensMatrix {
        averaged_doubt(choice, |fit| {
            let variance = fit.noise_factor.max(noise_floor).powi(2);
            self.information - self.independent * variance
        })
    }
}

/// Covariance of the chosen lens from the information `more` of each model beyond independent
/// noise, averaged over the models as in [`ModelChoice::averaged_covariance`]. Never negative.
pub(super) fn averaged_doubt(
    choice: &ModelChoice,
    more: impl Fn(&ModelFit) -> LensMatrix,
) -> LensMatrix {
    let (mut sum, mut total) = (LensMatrix::zeros(), 0.0);
    for (fit, bundle) in choice.fits.iter().zip(&choice.bundles).skip(choice.chosen) {
        let Some(unit) = bundle.covariance(1.0) else { continue };
        sum += positive_part(&(unit * more(fit) * unit)) * fit.weight;
        total += fit.weight;
    }
    if total > 0.0 { sum / total } else { sum }
}

impl View {
    /// Samples every `step`-th corner of a view. The other corners are dropped: pairs of all
    /// corners of a large board would take gigabytes.
    fn of(observations: &Observations, bundle: &Bundle, view: usize, step: usize) -> Option<Self> {
        let all = observations.view(view);
        let first = view % step;
        let corners: Vec<_> = all.iter().skip(first).step_by(step).collect();
        let mut rows = rows(&corners, bundle, view)?;
        if let Some(common) = CommonError::of(corners.iter().copied()) {
            common.take_out(&mut rows);
        }
        let (_, block) = Gram::of(&rows).split::<LENS_PARAMETERS, 6>();
        let absorbed = block.local_inverse(0.0)? * block.cross.transpose();
        let by_lens = [0, 1].map(|axis| {
            DMatrix::from_fn(corners.len(), LENS_PARAMETERS, |corner, column| {
                let row = &rows[2 * corner + axis];
                let of_pose = (0..6).map(|i| row.at(POSE + i) * absorbed[(i, column)]);
                row.at(column) - of_pose.sum::<f64>()
            })
        });
        let count = corners.len();
        let distance_px =
            DMatrix::from_fn(count, count, |i, j| (corners[i].px - corners[j].px).norm());
        let nearest = |i: usize| {
            let others = all.iter().enumerate().filter(|(j, _)| *j != first + i * step);
            others.map(|(_, other)| (corners[i].px - other.px).norm()).fold(f64::INFINITY, f64::min)
        };
        let spacing_px = (0..count).map(nearest).sum::<f64>() / count.max(1) as f64;
        Some(Self { rows, by_lens, distance_px, spacing_px })
    }

    fn count(&self) -> usize {
        self.distance_px.nrows()
    }

    fn smooth(&self, length_px: f64) -> DMatrix<f64> {
        self.distance_px.map(|d| libm::exp(-0.5 * (d / length_px).powi(2)))
    }

    /// Rows multiplied by the inverse of the lower triangular `factor` of the corners' covariance.
    fn whitened(&self, factor: &DMatrix<f64>) -> Vec<Row<TILES>> {
        let mut rows = self.rows.clone();
        widest(Whitening(&mut rows, factor));
        rows
    }
}

/// Replaces the lower triangle of a covariance with its Cholesky factor; false if it isn't positive
/// definite.
struct Factoring<'a>(&'a mut DMatrix<f64>);

impl Loop for Factoring<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let count = self.0.nrows();
        let mut right = self.0.as_mut_slice();
        for j in 0..count {
            let (column, after) = std::mem::take(&mut right).split_at_mut(count);
            let root = column[j].sqrt();
            if root.is_nan() || root == 0.0 {
                return false;
            }
            column[j..].iter_mut().for_each(|value| *value /= root);
            for (k, other) in (j + 1..count).zip(after.chunks_exact_mut(count)) {
                let by = column[k];
                other[k..].iter_mut().zip(&column[k..]).for_each(|(value, of)| *value -= by * of);
            }
            right = after;
        }
        true
    }
}

struct Whitening<'a>(&'a mut [Row<TILES>], &'a DMatrix<f64>);

impl Loop for Whitening<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(rows, factor) = self;
        for corner in 0..rows.len() / 2 {
            let column = factor.column(corner);
            let (done, left) = rows.split_at_mut(2 * corner + 2);
            let pair = &mut done[2 * corner..];
            pair.iter_mut().for_each(|row| row.scale(column[corner].recip()));
            for (other, by) in left.chunks_exact_mut(2).zip(column.iter().skip(corner + 1)) {
                other.iter_mut().zip(&*pair).for_each(|(row, of)| row.add_scaled(of, -by));
            }
        }
    }
}

/// Whitened derivatives by the lens and the pose of a view, and residuals: two rows per corner.
pub(super) fn rows(corners: &[&Whitened], bundle: &Bundle, view: usize) -> Option<Vec<Row<TILES>>> {
    let (camera, pose) = (&bundle.state.camera, bundle.state.cam_from_board.get(view)?);
    let mut rows = Vec::with_capacity(2 * corners.len());
    for corner in corners {
        let predicted = camera.project_board_point(pose, &corner.board_m)?;
        let residual = corner.whitener * (corner.px - predicted.px);
        let mut by_lens = predicted.jac_lens;
        bundle.freedom.restrict(&mut by_lens);
        let (by_lens, by_pose) = (corner.whitener * by_lens, corner.whitener * predicted.jac_pose);
        for axis in 0..2 {
            let mut row = Row::zeros();
            (0..LENS_PARAMETERS).for_each(|column| row.set(column, by_lens[(axis, column)]));
            (0..6).for_each(|column| row.set(POSE + column, by_pose[(axis, column)]));
            row.set(RESIDUAL, residual[axis]);
            rows.push(row);
        }
    }
    Some(rows)
}

/// `Σ Aᵀ C A` over the views, with `C` the correlations in `smooth`.
fn between(views: &[View], smooth: &[DMatrix<f64>]) -> LensMatrix {
    let mut sum = LensMatrix::zeros();
    for (view, smooth) in views.iter().zip(smooth) {
        for by_lens in &view.by_lens {
            let product = by_lens.transpose() * (smooth * by_lens);
            sum += LensMatrix::from_column_slice(product.as_slice());
        }
    }
    sum
}

/// −2 log restricted likelihood up to a constant, and the most likely `s²`.
fn restricted_likelihood(
    views: &[View],
    smooth: &[DMatrix<f64>],
    share: f64,
    bundle: &Bundle,
    left: f64,
) -> Option<(f64, f64)> {
    let (mut log_determinants, mut squares) = (0.0, 0.0);
    let (mut of_lens, mut pull) = (LensMatrix::zeros(), LensVector::zeros());
    for (view, smooth) in views.iter().zip(smooth) {
        let mut covariance = smooth * share;
        for i in 0..view.count() {
            covariance[(i, i)] += 1.0 - share;
        }
        if !widest(Factoring(&mut covariance)) {
            return None;
        }
        let factor = &covariance;
        log_determinants += 4.0 * (0..view.count()).map(|i| libm::log(factor[(i, i)])).sum::<f64>();
        let (cost, block) = Gram::of(&view.whitened(factor)).split::<LENS_PARAMETERS, 6>();
        let (information, gradient) = block.reduced()?;
        log_determinants += log_determinant(&block.local)?;
        squares += cost - block.gradient.dot(&(block.local_inverse(0.0)? * block.gradient));
        of_lens += information;
        pull += gradient;
    }
    for i in (0..LENS_PARAMETERS).filter(|i| !bundle.freedom.free[*i]) {
        of_lens[(i, i)] = 1.0;
    }
    log_determinants += log_determinant(&of_lens)?;
    squares -= pull.dot(&(inverse(&of_lens)? * pull));
    let variance = squares / left;
    let cost = left * libm::log(variance) + log_determinants;
    cost.is_finite().then_some((cost, variance))
}

/// Logarithm of the determinant of a positive definite matrix. Scaled first, as parameters differ
/// by orders of magnitude.
fn log_determinant<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Option<f64> {
    let scale = SVector::<f64, N>::from_fn(|i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt());
    let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| matrix[(i, j)] / (scale[i] * scale[j]));
    let factor = DMatrix::from_column_slice(N, N, scaled.as_slice()).cholesky()?;
    let factor = factor.l_dirty();
    let of_scaled: f64 = (0..N).map(|i| libm::log(factor[(i, i)])).sum();
    let of_scale: f64 = scale.iter().map(|s| libm::log(*s)).sum();
    Some(2.0 * (of_scaled + of_scale))
}
