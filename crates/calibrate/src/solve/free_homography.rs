//! Homographies seen through a common radial distortion: the independent check.
//!
//! ```text
//! p = DC + S g (1 + K1 |g|² + K2 |g|⁴),   g = H_i X,   S = 1000 px
//! ```
//! Each view has the eight degrees of freedom of a homography; DC, K1, K2 are shared. The model
//! assumes neither a common focal length nor a distortion centre at the principal point. The
//! principal lines of the undistorted views intersect in the principal point. See `docs/method.md`,
//! section 2.

use nalgebra::{Matrix2, Matrix2x4, Matrix3, Matrix4, Point2, SMatrix, Vector2, Vector4};

use super::{
    bundle::Observations,
    free_covariance::{Local, pp_covariance},
    gram::{Gram, Row},
    schur_lm::{
        LEAST_NOISE_VARIANCE, Limits, NormalEquations, Problem, Step, ViewBlock, inverse, minimise,
    },
};
use boresight_geometry::{
    Corner, Distortion, Homography, OutlierLine, PrincipalLine, consistent_lines, frame::ImageSize,
    intersect_weighted, mean_px,
};

/// `S`, so that g is about 1 at the edge of the picture.
const SCALE_PX: f64 = 1000.0;

/// Prior on the distortion centre: a normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortionCentrePrior {
    /// Mean, in pixels.
    pub px: Point2<f64>,
    /// Standard deviation along each axis, in pixels.
    pub sd_px: f64,
}

impl DistortionCentrePrior {
    /// Mean at the image centre, standard deviation 5 % of the width.
    pub fn of(image_size: ImageSize) -> Self {
        Self { px: image_size.centre_px(), sd_px: 0.05 * f64::from(image_size.width_px) }
    }

    /// Prior in a picture with rows scaled so that pixels of that ratio of height to width become
    /// square.
    pub(crate) fn with_square_pixels(self, pixel_aspect: f64) -> Self {
        Self { px: Point2::new(self.px.x, self.px.y / pixel_aspect), ..self }
    }
}

/// Fitted homographies and distortion, with the intersection of the principal lines.
#[derive(Clone, Debug)]
pub struct FreeHomographies {
    /// Distortion centre DC, in pixels.
    pub distortion_centre_px: Point2<f64>,
    /// K1, K2, for g in units of 1000 px.
    pub k: [f64; 2],
    /// Board (metres) → undistorted pixels, a homography per view.
    pub image_from_board: Vec<Matrix3<f64>>,
    /// Sum of squared whitened residuals, without the prior.
    pub cost: f64,
    /// Measured coordinates minus parameters; at least 1.
    pub degrees_of_freedom: usize,
    /// Intersection of the principal lines, weighted by inverse variances, in pixels.
    pub pp_px: Point2<f64>,
    /// Covariance of `pp_px`, px², for corners with the stated error.
    pub pp_unit_covariance_px2: Matrix2<f64>,
    /// Covariance of `(DC, K1, K2)` for corners with the stated error.
    pub shared_unit_covariance: Matrix4<f64>,
    /// Principal lines of the undistorted corners, for the stated error; `None` for frontal views.
    pub lines: Vec<Option<PrincipalLine>>,
    /// Lines that miss the intersection of the others by more than the variances of line and
    /// distortion explain, with the indices of the views.
    pub outliers: Vec<OutlierLine>,
}

impl FreeHomographies {
    /// σ₀ of this fit, see [`Bundle::noise_factor`](crate::Bundle::noise_factor).
    pub fn noise_factor(&self) -> f64 {
        (self.cost / self.degrees_of_freedom as f64).sqrt()
    }

    /// Fit in the camera's picture, from a fit in a picture with square pixels, made from pixels of
    /// that ratio of height to width. The principal lines and the covariance of the distortion
    /// remain in the latter.
    pub(crate) fn with_pixel_aspect(mut self, pixel_aspect: f64) -> Self {
        let stretch = Matrix2::new(1.0, 0.0, 0.0, pixel_aspect);
        self.pp_px.y *= pixel_aspect;
        self.distortion_centre_px.y *= pixel_aspect;
        self.pp_unit_covariance_px2 = stretch * self.pp_unit_covariance_px2 * stretch;
        let image_from_square = Matrix3::from_diagonal(&[1.0, pixel_aspect, 1.0].into());
        self.image_from_board.iter_mut().for_each(|h| *h = image_from_square * *h);
        self
    }

    /// Fit of some views expanded to all `count`: `numbers` are the indices of the fitted views.
    /// The others have no line.
    pub(crate) fn with_views(mut self, numbers: &[usize], count: usize) -> Self {
        let mut lines = vec![None; count];
        for (line, number) in self.lines.drain(..).zip(numbers) {
            lines[*number] = line;
        }
        self.lines = lines;
        self.outliers.iter_mut().for_each(|outlier| outlier.index = numbers[outlier.index]);
        self
    }

    /// `S`, the unit of `g`, in pixels.
    pub(crate) fn unit_px(&self) -> f64 {
        SCALE_PX
    }
}

/// Distortion centre and coefficients, and the homography of each view.
#[derive(Clone, Debug)]
struct FreeState {
    shared: Vector4<f64>,
    views: Vec<Local>,
}

fn lens(state: &FreeState) -> Distortion {
    Distortion { k1: state.shared[2], k2: state.shared[3], ..Distortion::default() }
}

/// First fit of the model: enough for residuals, and a start.
#[derive(Clone, Debug)]
pub(crate) struct RoughHomographies {
    state: FreeState,
    board_scale_m: f64,
}

impl RoughHomographies {
    /// Fit to 0.03 standard deviations from the homographies of the distorted corners, for each
    /// view. `None` with fewer than two views, or if the fit fails.
    pub(crate) fn of(
        observations: &Observations,
        prior: DistortionCentrePrior,
        image_from_board_as_seen: &[Matrix3<f64>],
    ) -> Option<Self> {
        let views = observations.view_count();
        if views < 2 || image_from_board_as_seen.len() != views {
            return None;
        }
        let board_scale_m =
            observations.board_m().iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
        let unit_from_board = Matrix3::from_diagonal(&[board_scale_m, board_scale_m, 1.0].into());
        let (s, middle_px) = (1.0 / SCALE_PX, prior.px);
        let g_from_image =
            Matrix3::new(s, 0.0, -s * middle_px.x, 0.0, s, -s * middle_px.y, 0.0, 0.0, 1.0);
        let views = image_from_board_as_seen
            .iter()
            .map(|h| {
                let h = g_from_image * h * unit_from_board;
                let h = h / h[(2, 2)];
                Local::from_iterator((0..8).map(|i| h[(i / 3, i % 3)]))
            })
            .collect();
        let state = FreeState { shared: Vector4::new(middle_px.x, middle_px.y, 0.0, 0.0), views };
        let mut found = Self { state, board_scale_m };
        // Without distortion the corners look noisier than they are, which weighs the prior too
        // much.
        for _ in 0..2 {
            let problem = FreeProblem::at(&found, observations, prior)?;
            found.state = minimise(&problem, found.state, Limits::TRIAL)?.state;
        }
        Some(found)
    }

    /// Residual, px, and stated covariance, px², of every corner, view by view.
    pub(crate) fn residuals_px(
        &self,
        observations: &Observations,
    ) -> Vec<(Vector2<f64>, Matrix2<f64>)> {
        let lens = lens(&self.state);
        let centre = Point2::from(self.state.shared.xy());
        let of_view = |(view, local): (usize, &Local)| {
            let h = image_from_board(local, self.board_scale_m, &centre);
            observations.view(view).iter().filter_map(move |corner| {
                let undistorted_px = Point2::from_homogeneous(h * corner.board_m.to_homogeneous())?;
                let g = Point2::from((undistorted_px - centre) / SCALE_PX);
                let predicted = centre + lens.apply(&g).coords * SCALE_PX;
                let information = corner.whitener.transpose() * corner.whitener;
                Some((corner.px - predicted, information.try_inverse()?))
            })
        };
        self.state.views.iter().enumerate().flat_map(of_view).collect()
    }
}

struct FreeProblem<'a> {
    observations: &'a Observations,
    board_scale_m: f64,
    prior: DistortionCentrePrior,
}

/// Fits the model, starting from the homographies of the distorted corners, for each view.
///
/// `None` with fewer than two views, if the fit fails, or if the lines don't intersect.
pub fn fit(
    observations: &Observations,
    prior: DistortionCentrePrior,
    image_from_board_as_seen: &[Matrix3<f64>],
) -> Option<FreeHomographies> {
    let rough = RoughHomographies::of(observations, prior, image_from_board_as_seen)?;
    fit_near(observations, prior, &rough)
}

/// [`fit`] from a first fit of the same corners, perhaps with other covariances.
pub(crate) fn fit_near(
    observations: &Observations,
    prior: DistortionCentrePrior,
    near: &RoughHomographies,
) -> Option<FreeHomographies> {
    let problem = FreeProblem::at(near, observations, prior)?;
    let minimum = minimise(&problem, near.state.clone(), Limits::NEAR)?;
    let degrees_of_freedom = problem.degrees_of_freedom();
    let cost = (minimum.cost - problem.prior_cost(&minimum.state.shared)).max(0.0);
    let noise_variance = cost / degrees_of_freedom as f64;
    let state = &minimum.state;
    let distortion_centre_px = Point2::new(state.shared[0], state.shared[1]);
    let lines = (0..observations.view_count())
        .map(|view| problem.line(view, state))
        .collect::<Option<Vec<_>>>()?;
    let usable: Vec<PrincipalLine> = lines.iter().flatten().cloned().collect();
    let pp_px = intersect_weighted(&usable).ok()?.px;
    let pp_in_g = (pp_px - distortion_centre_px) / SCALE_PX;
    let views: Vec<(&Local, &ViewBlock<4, 8>)> = state
        .views
        .iter()
        .zip(&minimum.normal.views)
        .zip(&lines)
        .filter_map(|(view, line)| line.is_some().then_some(view))
        .collect();
    let shared_covariance = inverse(&minimum.normal.reduced()?)?;
    let pp_unit_covariance_px2 = pp_covariance(&views, &shared_covariance, &pp_in_g, SCALE_PX)?;
    let image_from_board = state
        .views
        .iter()
        .map(|view| image_from_board(view, near.board_scale_m, &distortion_centre_px))
        .collect();
    let usable = pp_px.coords.iter().chain(pp_unit_covariance_px2.iter()).all(|x| x.is_finite());
    usable.then(|| FreeHomographies {
        distortion_centre_px,
        k: [state.shared[2], state.shared[3]],
        image_from_board,
        cost,
        degrees_of_freedom,
        pp_px,
        pp_unit_covariance_px2,
        outliers: problem.outliers(&lines, state, &shared_covariance, noise_variance),
        shared_unit_covariance: shared_covariance,
        lines,
    })
}

fn image_from_board(view: &Local, board_scale_m: f64, centre_px: &Point2<f64>) -> Matrix3<f64> {
    let h =
        Matrix3::new(view[0], view[1], view[2], view[3], view[4], view[5], view[6], view[7], 1.0);
    let image_from_g =
        Matrix3::new(SCALE_PX, 0.0, centre_px.x, 0.0, SCALE_PX, centre_px.y, 0.0, 0.0, 1.0);
    let unit_from_board =
        Matrix3::from_diagonal(&[1.0 / board_scale_m, 1.0 / board_scale_m, 1.0].into());
    image_from_g * h * unit_from_board
}

impl<'a> FreeProblem<'a> {
    /// Problem with the prior weighed against the noise of the corners at `start`.
    fn at(
        start: &RoughHomographies,
        observations: &'a Observations,
        prior: DistortionCentrePrior,
    ) -> Option<Self> {
        let mut problem = Self { observations, board_scale_m: start.board_scale_m, prior };
        let (cost, _) = problem.linearise(&start.state)?;
        let cost = cost - problem.prior_cost(&start.state.shared);
        let variance = cost / problem.degrees_of_freedom() as f64;
        problem.prior.sd_px /= variance.max(LEAST_NOISE_VARIANCE).sqrt();
        Some(problem)
    }

    /// Measured coordinates minus parameters; at least 1.
    fn degrees_of_freedom(&self) -> usize {
        let parameters = 4 + 8 * self.observations.view_count();
        self.observations.coordinate_count().saturating_sub(parameters).max(1)
    }

    /// Principal line of the undistorted corners of a view. `Some(None)` for a view without one,
    /// `None` if a corner lies beyond the fold of the lens model.
    fn line(&self, view: usize, state: &FreeState) -> Option<Option<PrincipalLine>> {
        let centre = Point2::new(state.shared[0], state.shared[1]);
        let lens = lens(state);
        let corners: Vec<Corner> = self
            .observations
            .view(view)
            .iter()
            .map(|corner| {
                let g = lens.invert(&Point2::from((corner.px - centre) / SCALE_PX))?;
                let px = centre + g.coords * SCALE_PX;
                let information = corner.whitener.transpose() * corner.whitener;
                Some(Corner::new(px, information.try_inverse()?))
            })
            .collect::<Option<_>>()?;
        let board_m: Vec<Point2<f64>> =
            self.observations.view(view).iter().map(|corner| corner.board_m).collect();
        let near = image_from_board(&state.views[view], self.board_scale_m, &centre);
        let homography = Homography::fit_near(&board_m, &corners, &near).ok()?;
        Some(PrincipalLine::of(&homography, self.prior.px, mean_px(&corners)).ok())
    }

    /// Outliers among `lines` that miss the intersection of the others, with the indices of the
    /// views.
    ///
    /// A wrong distortion moves the lines of boards far from its centre, so each distance has that
    /// variance, too: `J C Jᵀ` with the covariance `C` of `(DC, K1, K2)`.
    fn outliers(
        &self,
        lines: &[Option<PrincipalLine>],
        state: &FreeState,
        shared_unit_covariance: &Matrix4<f64>,
        noise_variance: f64,
    ) -> Vec<OutlierLine> {
        let there: Vec<usize> = (0..lines.len()).filter(|view| lines[*view].is_some()).collect();
        let usable: Vec<PrincipalLine> = lines.iter().flatten().cloned().collect();
        let Ok(consistent) = consistent_lines(&usable) else { return Vec::new() };
        if consistent.outliers.is_empty() {
            return Vec::new();
        }
        let is_outlier =
            |view: usize| consistent.outliers.iter().any(|outlier| there[outlier.index] == view);
        let distances_px = |state: &FreeState| -> Option<Vec<f64>> {
            let line = |view: &usize| self.line(*view, state).flatten();
            let good: Vec<PrincipalLine> =
                there.iter().filter(|view| !is_outlier(**view)).filter_map(line).collect();
            let pp_px = intersect_weighted(&good).ok()?.px;
            let outliers = consistent.outliers.iter().map(|outlier| &there[outlier.index]);
            outliers.map(|view| Some(line(view)?.distance_px(&pp_px))).collect()
        };
        let slopes = || -> Option<Vec<Vec<f64>>> {
            let here = distances_px(state)?;
            let slope = |i: usize| -> Option<Vec<f64>> {
                let step = 1e-3 * shared_unit_covariance[(i, i)].sqrt();
                let mut moved = state.clone();
                moved.shared[i] += step;
                let there = distances_px(&moved)?;
                Some(there.iter().zip(&here).map(|(there, here)| (there - here) / step).collect())
            };
            (0..4).map(slope).collect()
        };
        let slopes = slopes();
        consistent
            .outliers
            .iter()
            .enumerate()
            .filter_map(|(place, outlier)| {
                let outlier = OutlierLine { index: there[outlier.index], ..*outlier };
                let Some(slopes) = &slopes else { return Some(outlier) };
                let slope = Vector4::from_fn(|i, _| slopes[i][place]);
                let of_lens = (slope.transpose() * shared_unit_covariance * slope).x;
                let line = lines[outlier.index].as_ref()?;
                let own = line.variance_of_distance(&consistent.pp.px);
                // A few lines hardly determine their own spread; the residuals of all corners do.
                let noisier = (noise_variance / consistent.variance_scale).max(1.0);
                outlier.with_variance(noisier * (1.0 + of_lens / own))
            })
            .collect()
    }

    fn prior_cost(&self, shared: &Vector4<f64>) -> f64 {
        let miss = self.prior.px.coords - shared.fixed_rows::<2>(0);
        miss.norm_squared() / (self.prior.sd_px * self.prior.sd_px)
    }
}

impl Problem<NormalEquations<4, 8>> for FreeProblem<'_> {
    type State = FreeState;

    fn linearise(&self, state: &FreeState) -> Option<(f64, NormalEquations<4, 8>)> {
        let centre = Point2::new(state.shared[0], state.shared[1]);
        let lens = lens(state);
        let views = self.observations.by_view(|index| {
            let h = &state.views[index];
            let corners = self.observations.view(index);
            let mut rows: Vec<Row<4>> = Vec::with_capacity(2 * corners.len());
            for corner in corners {
                let (x, y) =
                    (corner.board_m.x / self.board_scale_m, corner.board_m.y / self.board_scale_m);
                let w = h[6] * x + h[7] * y + 1.0;
                if w <= 1e-9 {
                    return None;
                }
                let g =
                    Point2::new((h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w);
                let r2 = g.coords.norm_squared();
                let predicted = centre + lens.apply(&g).coords * SCALE_PX;
                let residual = corner.whitener * (corner.px - predicted);
                let (by_k1, by_k2) = (g.coords * r2 * SCALE_PX, g.coords * r2 * r2 * SCALE_PX);
                let by_shared =
                    Matrix2x4::new(1.0, 0.0, by_k1.x, by_k2.x, 0.0, 1.0, by_k1.y, by_k2.y);
                let (dx, dy, d1) = (x / w, y / w, 1.0 / w);
                let g_by_view = SMatrix::<f64, 2, 8>::from_row_slice(&[
                    dx,
                    dy,
                    d1,
                    0.0,
                    0.0,
                    0.0,
                    -g.x * dx,
                    -g.x * dy,
                    0.0,
                    0.0,
                    0.0,
                    dx,
                    dy,
                    d1,
                    -g.y * dx,
                    -g.y * dy,
                ]);
                let by_view = lens.derivative(&g) * g_by_view * SCALE_PX;
                let (by_shared, by_view) = (corner.whitener * by_shared, corner.whitener * by_view);
                for axis in 0..2 {
                    let mut row = Row::zeros();
                    (0..4).for_each(|i| row.set(i, by_shared[(axis, i)]));
                    (0..8).for_each(|i| row.set(4 + i, by_view[(axis, i)]));
                    row.set(12, residual[axis]);
                    rows.push(row);
                }
            }
            if let Some(common) = self.observations.common(index) {
                common.take_out(&mut rows);
            }
            Some(Gram::of(&rows).split())
        })?;
        let (mut normal, mut cost) = NormalEquations::from_views(views);
        let information = 1.0 / (self.prior.sd_px * self.prior.sd_px);
        for i in 0..2 {
            normal.shared[(i, i)] += information;
            normal.gradient[i] += information * (self.prior.px[i] - state.shared[i]);
        }
        cost += self.prior_cost(&state.shared);
        cost.is_finite().then_some((cost, normal))
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        self.observations.noise_variance(cost)
    }

    fn moved(&self, state: &FreeState, step: &Step<4, 8>) -> FreeState {
        let views = state.views.iter().zip(&step.views).map(|(view, step)| view + step).collect();
        FreeState { shared: state.shared + step.shared, views }
    }
}
