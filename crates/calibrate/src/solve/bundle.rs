//! Bundle adjustment: fits the lens and all board poses to the corners by least squares.
//!
//! Minimises `Σ |L⁻¹ (measured − predicted)|²`, with `L Lᵀ` the covariance of each corner, by
//! Levenberg–Marquardt with a Schur complement over the views. Efficient (reaches the Cramér–Rao
//! bound) if the lens model is right.

use std::ops::Range;

use nalgebra::{Isometry3, Point2, SMatrix, SVector, Vector2, Vector3};

use super::{
    common_error::CommonError,
    gram::{Gram, Row},
    lens_model::{LensFreedom, LensPrior, tie_covariance, tie_focal_lengths},
    schur_lm::{
        LEAST_NOISE_VARIANCE, Limits, NormalEquations, Problem, Step, ViewBlock, inverse, minimise,
    },
    whitened::{Whitened, whiten},
};
use boresight_geometry::{BROWN_PARAMETERS, Camera, Corner, LENS_PARAMETERS, LensMatrix, parallel};

type LensVector = SVector<f64, LENS_PARAMETERS>;

/// Approximate number of coordinates per task of a thread: 16 views of 54 corners.
const COORDINATES_AT_ONCE: usize = 1728;
/// Number of coordinates from which threads save more time than the start takes: 200 views of 54
/// corners.
const COORDINATES_WORTH_THREADS: usize = 20_000;

/// Corners of all views with board points, prepared for adjustment.
#[derive(Clone, Debug)]
pub struct Observations {
    board_m: Vec<Point2<f64>>,
    views: Vec<Vec<Whitened>>,
    /// Common error of each view.
    common: Vec<Option<CommonError>>,
    /// Number of threads for the adjustment.
    threads: usize,
}

/// Reason why corners can't be adjusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidCorners {
    /// A view doesn't have exactly one corner per board corner.
    Count {
        /// Index of the view, from 0.
        view: usize,
        /// Number of corners in the view.
        got: usize,
        /// Number of corners on the board.
        want: usize,
    },
    /// A corner isn't finite, or its covariance isn't positive definite.
    Value {
        /// Index of the view, from 0.
        view: usize,
        /// Index of the corner in the board's numbering, from 0.
        corner: usize,
    },
}

impl Observations {
    /// Checks and prepares the corners (distorted pixels) of all views, each in the order of
    /// `board_m` (metres). Unseen corners are left out.
    ///
    /// # Errors
    ///
    /// [`InvalidCorners`] names the first unusable view or corner.
    pub fn new(board_m: &[Point2<f64>], views: &[&[Corner]]) -> Result<Self, InvalidCorners> {
        let mut whitened = Vec::with_capacity(views.len());
        for (view, corners) in views.iter().enumerate() {
            let (got, want) = (corners.len(), board_m.len());
            if got != want {
                return Err(InvalidCorners::Count { view, got, want });
            }
            let seen = corners.iter().zip(board_m).enumerate().filter(|(_, (c, _))| c.is_seen());
            let prepared = seen.map(|(place, (corner, board_m))| {
                whiten(place, corner, board_m).ok_or(InvalidCorners::Value { view, corner: place })
            });
            whitened.push(prepared.collect::<Result<_, _>>()?);
        }
        let common = whitened.iter().map(CommonError::of).collect();
        Ok(Self { board_m: board_m.to_vec(), views: whitened, common, threads: 1 })
    }

    /// Adjusts many corners with up to `threads` threads. Doesn't affect the result.
    #[must_use]
    pub(crate) fn with_threads(self, threads: usize) -> Self {
        Self { threads, ..self }
    }

    /// Corners of some views only.
    pub(crate) fn only(&self, kept: &[usize]) -> Self {
        let views = kept.iter().map(|view| self.views[*view].clone()).collect();
        let common = kept.iter().map(|view| self.common[*view].clone()).collect();
        Self { board_m: self.board_m.clone(), views, common, threads: self.threads }
    }

    /// Calls `of` for each view, in order.
    pub(crate) fn by_view<T: Send>(
        &self,
        of: impl Fn(usize) -> Option<T> + Sync,
    ) -> Option<Vec<T>> {
        self.by_chunk(|views| views.map(&of).collect::<Option<Vec<T>>>()).into_iter().try_fold(
            Vec::with_capacity(self.views.len()),
            |mut all, some| {
                all.append(&mut some?);
                Some(all)
            },
        )
    }

    /// Calls `of` for each few consecutive views, in order. The division doesn't depend on the
    /// number of threads.
    pub(crate) fn by_chunk<T: Send>(&self, of: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
        let (coordinates, count) = (self.coordinate_count().max(1), self.views.len());
        let threads = if coordinates >= COORDINATES_WORTH_THREADS { self.threads } else { 1 };
        let chunk = (COORDINATES_AT_ONCE * count / coordinates).max(1);
        parallel::map(threads, count.div_ceil(chunk), |number| {
            of(number * chunk..count.min((number + 1) * chunk))
        })
    }

    /// Number of measured coordinates: two per corner.
    pub(crate) fn coordinate_count(&self) -> usize {
        2 * self.views.iter().map(Vec::len).sum::<usize>()
    }

    /// Variance of the corners as a multiple of the stated one, from a sum of squares.
    pub(crate) fn noise_variance(&self, cost: f64) -> f64 {
        cost / self.coordinate_count() as f64
    }

    /// Mean square added to a whitened coordinate by an error of `px` along each axis.
    pub(crate) fn whitened_square(&self, px: f64) -> f64 {
        let squares = self.views.iter().flatten().map(|corner| corner.whitener.norm_squared());
        px * px * squares.sum::<f64>() / self.coordinate_count() as f64
    }

    /// Number of views.
    pub fn view_count(&self) -> usize {
        self.views.len()
    }

    /// Board points in metres, in corner order.
    pub(crate) fn board_m(&self) -> &[Point2<f64>] {
        &self.board_m
    }

    /// Seen corners of a view, in corner order.
    pub(crate) fn view(&self, index: usize) -> &[Whitened] {
        &self.views[index]
    }

    /// Common error of the corners of a view; `None` if there is none.
    pub(crate) fn common(&self, view: usize) -> Option<&CommonError> {
        self.common[view].as_ref()
    }

    /// Root mean square residual of each view per coordinate, in pixels.
    pub fn residual_rms_px(&self, camera: &Camera, poses: &[Isometry3<f64>]) -> Vec<f64> {
        poses
            .iter()
            .enumerate()
            .map(|(view, pose)| self.view_residual_rms_px(view, camera, pose))
            .collect()
    }

    /// Root mean square residual of a view per coordinate, in pixels. Corners behind the camera are
    /// left out.
    pub(crate) fn view_residual_rms_px(
        &self,
        view: usize,
        camera: &Camera,
        pose: &Isometry3<f64>,
    ) -> f64 {
        let corners = &self.views[view];
        let sum: f64 = corners
            .iter()
            .filter_map(|corner| {
                let predicted = camera.project_board_point(pose, &corner.board_m)?.px;
                Some((corner.px - predicted).norm_squared())
            })
            .sum();
        (sum / (2 * corners.len()).max(1) as f64).sqrt()
    }

    /// Sum of squared whitened residuals. `None` if a corner is behind the camera.
    pub fn cost(&self, camera: &Camera, poses: &[Isometry3<f64>]) -> Option<f64> {
        self.cost_of(|view, corner| {
            Some(camera.project_board_point(&poses[view], &corner.board_m)?.px)
        })
    }

    /// Sum of squared whitened residuals of the corners from the `predicted` pixels, less the part
    /// explained by common errors. `None` if a corner has no predicted pixel.
    pub(crate) fn cost_of(
        &self,
        predicted: impl Fn(usize, &Whitened) -> Option<Point2<f64>>,
    ) -> Option<f64> {
        let of_view = |view| self.view_cost_of(view, |corner| predicted(view, corner));
        let cost = (0..self.views.len()).map(of_view).sum::<Option<f64>>()?;
        cost.is_finite().then_some(cost)
    }

    /// [`Self::cost_of`] for a single view.
    pub(crate) fn view_cost_of(
        &self,
        view: usize,
        predicted: impl Fn(&Whitened) -> Option<Point2<f64>>,
    ) -> Option<f64> {
        let common = self.common(view);
        let (mut cost, mut residuals) = (0.0, Vec::<Vector2<f64>>::new());
        for corner in &self.views[view] {
            let residual = corner.whitener * (corner.px - predicted(corner)?);
            cost += residual.norm_squared();
            residuals.extend(common.map(|_| residual));
        }
        Some(cost - common.map_or(0.0, |common| common.explained(&residuals)))
    }
}

/// Lens and poses of all views.
#[derive(Clone, Debug, PartialEq)]
pub struct BundleState {
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Rigid motion from board to camera for each view, in metres.
    pub cam_from_board: Vec<Isometry3<f64>>,
}

/// Result of [`adjust`].
#[derive(Clone, Debug)]
pub struct Bundle {
    /// Lens and poses at the minimum.
    pub state: BundleState,
    /// Estimated lens parameters.
    pub freedom: LensFreedom,
    /// Sum of squared whitened residuals, without priors.
    pub cost: f64,
    /// Measured coordinates minus estimated parameters; at least 1.
    pub degrees_of_freedom: usize,
    /// True if the next step is below 1e-7 standard deviations, or below 1e-2 after the last step.
    pub converged: bool,
    /// Information of the corners about the free lens parameters, poses marginalised out.
    information: LensMatrix,
    prior_information: LensVector,
    /// Contribution of each view to `information` and to the gradient.
    view_information: Vec<(LensMatrix, LensVector)>,
}

struct BundleProblem<'a> {
    observations: &'a Observations,
    freedom: &'a LensFreedom,
    prior: Option<&'a LensPrior>,
    /// Variance of the corners as a multiple of the stated covariances.
    noise_variance: f64,
}

/// Minimises the reprojection error from `start`, one pose per view.
///
/// A prior is weighed against the actual noise of the corners rather than the stated one, so a
/// prior calls for a second pass.
///
/// `None` without views, if `start` puts a corner behind the camera, or if corners and prior leave
/// a lens parameter undetermined.
pub fn adjust(
    observations: &Observations,
    freedom: &LensFreedom,
    prior: Option<&LensPrior>,
    start: BundleState,
) -> Option<Bundle> {
    adjust_from(observations, freedom, prior, start, Limits::GUESS)
}

/// [`adjust`] within other limits.
pub(super) fn adjust_from(
    observations: &Observations,
    freedom: &LensFreedom,
    prior: Option<&LensPrior>,
    start: BundleState,
    limits: Limits,
) -> Option<Bundle> {
    if observations.view_count() == 0 || start.cam_from_board.len() != observations.view_count() {
        return None;
    }
    // Brown's model takes matrices of half the size.
    if freedom.parameters().into_iter().any(|parameter| !parameter.is_browns()) {
        adjust_sized::<LENS_PARAMETERS>(observations, freedom, prior, start, limits)
    } else {
        adjust_sized::<BROWN_PARAMETERS>(observations, freedom, prior, start, limits)
    }
}

/// [`adjust`] for the first `S` lens parameters.
fn adjust_sized<const S: usize>(
    observations: &Observations,
    freedom: &LensFreedom,
    prior: Option<&LensPrior>,
    start: BundleState,
    limits: Limits,
) -> Option<Bundle> {
    let parameters = freedom.count() + 6 * observations.view_count();
    let degrees_of_freedom = observations.coordinate_count().saturating_sub(parameters).max(1);
    let mut problem = BundleProblem { observations, freedom, prior, noise_variance: 1.0 };
    let mut minimum = minimise::<_, NormalEquations<S, 6>>(&problem, start, limits)?;
    if prior.is_some() {
        let BundleState { camera, cam_from_board } = &minimum.state;
        let cost = observations.cost(camera, cam_from_board)?;
        problem.noise_variance = (cost / degrees_of_freedom as f64).max(LEAST_NOISE_VARIANCE);
        minimum = minimise::<_, NormalEquations<S, 6>>(&problem, minimum.state, Limits::NEAR)?;
    }
    let mut prior_information = LensVector::zeros();
    if let Some(prior) = prior {
        for i in (0..LENS_PARAMETERS).filter(|i| freedom.free[*i]) {
            prior_information[i] = prior.information[i];
        }
    }
    let reduced = minimum.normal.reduced()?;
    inverse(&reduced)?;
    let mut information =
        widened(&reduced) - LensMatrix::from_diagonal(&prior_information) * problem.noise_variance;
    for i in (0..LENS_PARAMETERS).filter(|i| !freedom.free[*i]) {
        information[(i, i)] = 0.0;
    }
    let of_view = |view: &ViewBlock<S, 6>| {
        let (information, gradient) = view.reduced()?;
        let mut all = LensVector::zeros();
        all.rows_mut(0, S).copy_from(&gradient);
        Some((widened(&information), all))
    };
    let view_information = minimum.normal.views.iter().map(of_view).collect::<Option<Vec<_>>>()?;
    let state = minimum.state;
    Some(Bundle {
        cost: observations.cost(&state.camera, &state.cam_from_board)?,
        state,
        freedom: *freedom,
        degrees_of_freedom,
        converged: minimum.converged,
        information,
        prior_information,
        view_information,
    })
}

/// Widens an information matrix about the first `S` lens parameters to all lens parameters.
fn widened<const S: usize>(information: &SMatrix<f64, S, S>) -> LensMatrix {
    let mut all = LensMatrix::zeros();
    all.view_mut((0, 0), (S, S)).copy_from(information);
    all
}

impl Bundle {
    /// A-posteriori standard deviation of unit weight, σ₀ = `√(cost / dof)`: the actual error of
    /// the corners as a multiple of the stated one. 1 if the covariances of the corners are right.
    ///
    /// Every `noise_factor` in this module has this meaning.
    pub fn noise_factor(&self) -> f64 {
        (self.cost / self.degrees_of_freedom as f64).sqrt()
    }

    /// Covariance of the lens parameters, in the order of [`LENS_PARAMETERS`], for corners with
    /// `noise_factor` times the stated error. Zero for fixed parameters; with square pixels `fy`
    /// equals `fx`. `None` if singular.
    pub fn covariance(&self, noise_factor: f64) -> Option<LensMatrix> {
        self.covariance_of(&self.information, noise_factor)
    }

    /// Change and covariance of the lens parameters when a view is left out, to first order.
    ///
    /// One Gauss–Newton step from the full minimum: `δ = (I − Iᵢ)⁻¹ (−gᵢ)`.
    pub(crate) fn without_view(
        &self,
        view: usize,
        noise_factor: f64,
    ) -> Option<(LensVector, LensMatrix)> {
        let (information, gradient) = self.view_information.get(view)?;
        let covariance = self.covariance_of(&(self.information - information), noise_factor)?;
        let mut shift = covariance * gradient / -(noise_factor * noise_factor);
        if self.freedom.square_pixels {
            tie_focal_lengths(shift.as_mut_slice());
        }
        Some((shift, covariance))
    }

    /// Contribution of each view to [`Self::information`] and to the gradient.
    pub(crate) fn view_information(&self) -> &[(LensMatrix, LensVector)] {
        &self.view_information
    }

    /// Information of the prior on each lens parameter; zero for none.
    pub(super) fn prior_information(&self) -> &LensVector {
        &self.prior_information
    }

    /// Information about the free lens parameters for corners with the stated error, poses
    /// marginalised out.
    pub fn information(&self) -> &LensMatrix {
        &self.information
    }

    fn covariance_of(&self, information: &LensMatrix, noise_factor: f64) -> Option<LensMatrix> {
        let mut full = information / (noise_factor * noise_factor)
            + LensMatrix::from_diagonal(&self.prior_information);
        for i in (0..LENS_PARAMETERS).filter(|i| !self.freedom.free[*i]) {
            full[(i, i)] = 1.0;
        }
        let mut covariance = inverse(&full)?;
        for i in (0..LENS_PARAMETERS).filter(|i| !self.freedom.free[*i]) {
            covariance.row_mut(i).fill(0.0);
            covariance.column_mut(i).fill(0.0);
        }
        if self.freedom.square_pixels {
            tie_covariance(&mut covariance);
        }
        Some(covariance)
    }
}

impl BundleProblem<'_> {
    /// Cost and normal equations of a view of `S + 6` parameters, at most `4 T − 1`.
    fn block<const S: usize, const T: usize>(
        &self,
        view: usize,
        state: &BundleState,
    ) -> Option<(f64, ViewBlock<S, 6>)> {
        let pose = &state.cam_from_board[view];
        let corners = &self.observations.views[view];
        let mut rows: Vec<Row<T>> = Vec::with_capacity(2 * corners.len());
        for corner in corners {
            let predicted = state.camera.project_board_point(pose, &corner.board_m)?;
            let mut jac_lens = predicted.jac_lens;
            self.freedom.restrict(&mut jac_lens);
            let by_lens = corner.whitener * jac_lens.fixed_columns::<S>(0);
            let by_pose = corner.whitener * predicted.jac_pose;
            let residual = corner.whitener * (corner.px - predicted.px);
            for axis in 0..2 {
                let mut row = Row::zeros();
                (0..S).for_each(|i| row.set(i, by_lens[(axis, i)]));
                (0..6).for_each(|i| row.set(S + i, by_pose[(axis, i)]));
                row.set(S + 6, residual[axis]);
                rows.push(row);
            }
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        Some(Gram::of(&rows).split())
    }
}

impl<const S: usize> Problem<NormalEquations<S, 6>> for BundleProblem<'_> {
    type State = BundleState;

    fn linearise(&self, state: &BundleState) -> Option<(f64, NormalEquations<S, 6>)> {
        if state.camera.f_px.min() <= 1.0 {
            return None;
        }
        let views = self.observations.by_view(|view| match S {
            BROWN_PARAMETERS => self.block::<S, 4>(view, state),
            _ => self.block::<S, 5>(view, state),
        })?;
        let (mut normal, mut cost) = NormalEquations::from_views(views);
        let parameters = state.camera.lens_parameters();
        for (i, value) in parameters.iter().enumerate().take(S) {
            if !self.freedom.free[i] {
                // Keeps the matrix invertible; the step remains zero.
                normal.shared[(i, i)] = 1.0;
            } else if let Some(prior) = self.prior {
                let miss = prior.mean[i] - value;
                let information = prior.information[i] * self.noise_variance;
                normal.shared[(i, i)] += information;
                normal.gradient[i] += information * miss;
                cost += information * miss * miss;
            }
        }
        cost.is_finite().then_some((cost, normal))
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        self.observations.noise_variance(cost)
    }

    fn moved(&self, state: &BundleState, step: &Step<S, 6>) -> BundleState {
        let mut parameters = state.camera.lens_parameters();
        for (parameter, change) in parameters.iter_mut().zip(step.shared.iter()) {
            *parameter += change;
        }
        if self.freedom.square_pixels {
            tie_focal_lengths(&mut parameters);
        }
        let cam_from_board = state
            .cam_from_board
            .iter()
            .zip(&step.views)
            .map(|(pose, step)| {
                let turn_rad: Vector3<f64> = step.fixed_rows::<3>(0).into();
                let shift_m: Vector3<f64> = step.fixed_rows::<3>(3).into();
                Camera::moved(pose, &turn_rad, &shift_m)
            })
            .collect();
        BundleState { camera: state.camera.with_lens_parameters(&parameters), cam_from_board }
    }
}
