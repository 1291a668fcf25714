//! Homographies seen through a common radial distortion: the independent check.
//!
//! ```text
//! p = DC + S g (1 + K1 |g|² + K2 |g|⁴),   g = H_i X,   S = 1000 px
//! ```
//! Each view keeps all eight freedoms of its homography; DC, K1, K2 are shared. Neither a common focal
//! length nor a distortion centre at the principal point is assumed. The undistorted views' principal
//! lines then meet in the principal point.

use nalgebra::{
    Matrix2, Matrix2x4, Matrix3, Matrix4, Point2, RowVector2, SMatrix, SVector, Vector2, Vector4,
};

use super::arrow::{Arrow, Minimum, Problem, Step, ViewBlock, inverse, minimise};
use super::bundle::Observations;
use crate::frame::ImageSize;
use crate::geometry::Distortion;

/// S above: makes g about 1 at the edge of the picture.
const SCALE_PX: f64 = 1000.0;

/// What is believed about the distortion centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortionCentrePrior {
    /// Most likely place.
    pub px: Point2<f64>,
    /// Standard deviation along each axis.
    pub sd_px: f64,
}

impl DistortionCentrePrior {
    /// Image centre ± 5 % of the width.
    pub fn of(image_size: ImageSize) -> Self {
        Self { px: image_size.centre_px(), sd_px: 0.05 * f64::from(image_size.width_px) }
    }
}

/// The fit, and what follows from its principal lines.
#[derive(Clone, Debug)]
pub struct FreeHomographies {
    /// DC.
    pub distortion_centre_px: Point2<f64>,
    /// K1, K2, for g in units of 1000 px.
    pub k: [f64; 2],
    /// Board (metres) → undistorted pixel, one per view.
    pub image_from_board: Vec<Matrix3<f64>>,
    /// Whitened sum of squared residuals, prior excluded.
    pub cost: f64,
    /// Coordinates seen less parameters.
    pub degrees_of_freedom: usize,
    /// Where the principal lines meet, weighted by their variances.
    pub pp_px: Point2<f64>,
    /// Covariance of `pp_px` for corners as noisy as their covariances claim.
    pub pp_unit_covariance_px2: Matrix2<f64>,
    /// Where the principal lines meet, all with the same weight.
    pub pp_unweighted_px: Point2<f64>,
    /// Each view's own focal length at `pp_px` and its variance for noise as claimed.
    pub focal: Vec<Option<(f64, f64)>>,
}

impl FreeHomographies {
    /// `√(cost / dof)`.
    pub fn noise_factor(&self) -> f64 {
        (self.cost / self.degrees_of_freedom as f64).sqrt()
    }
}

type Local = SVector<f64, 8>;

#[derive(Clone)]
struct FreeState {
    shared: Vector4<f64>,
    views: Vec<Local>,
}

struct FreeProblem<'a> {
    observations: &'a Observations,
    board_scale_m: f64,
    prior: DistortionCentrePrior,
}

/// Fits the model, starting from homographies of the corners as seen.
///
/// `None` with fewer than two views, where the fit fails, or where the lines do not meet.
pub fn fit(
    observations: &Observations,
    prior: DistortionCentrePrior,
    image_from_board_as_seen: &[Matrix3<f64>],
) -> Option<FreeHomographies> {
    if observations.view_count() < 2 || image_from_board_as_seen.len() != observations.view_count()
    {
        return None;
    }
    let largest = observations.board_m().iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let problem = FreeProblem { observations, board_scale_m: largest, prior };
    let board_from_unit = Matrix3::from_diagonal(&[largest, largest, 1.0].into());
    let g_from_image = Matrix3::new(
        1.0 / SCALE_PX,
        0.0,
        -prior.px.x / SCALE_PX,
        0.0,
        1.0 / SCALE_PX,
        -prior.px.y / SCALE_PX,
        0.0,
        0.0,
        1.0,
    );
    let views = image_from_board_as_seen
        .iter()
        .map(|h| {
            let h = g_from_image * h * board_from_unit;
            let h = h / h[(2, 2)];
            Local::from_iterator((0..8).map(|i| h[(i / 3, i % 3)]))
        })
        .collect();
    let start = FreeState { shared: Vector4::new(prior.px.x, prior.px.y, 0.0, 0.0), views };
    let minimum = minimise(&problem, start)?;
    let state = &minimum.state;
    let lines: Vec<Line> = state.views.iter().map(Line::of).collect::<Option<_>>()?;
    let (unweighted, _) = intersect(&lines, &vec![1.0; lines.len()])?;
    let mut at = unweighted;
    let spreads: Vec<_> = state
        .views
        .iter()
        .zip(&minimum.arrow.views)
        .map(|(view, block)| Some((LineJacobian::of(view)?, block.local_inverse(0.0)?)))
        .collect::<Option<_>>()?;
    for _ in 0..20 {
        let weights = weights(&spreads, &lines, &at);
        let (next, _) = intersect(&lines, &weights)?;
        let change = (next - at).norm();
        at = next;
        if change < 1e-13 {
            break;
        }
    }
    let weights = weights(&spreads, &lines, &at);
    let (_, normal_inverse) = intersect(&lines, &weights)?;
    let pp_unit_covariance_px2 =
        joint_covariance(&minimum, &spreads, &lines, &weights, &normal_inverse, &at)?;
    let distortion_centre_px = Point2::new(state.shared[0], state.shared[1]);
    let to_px = |g: Vector2<f64>| distortion_centre_px + g * SCALE_PX;
    let focal = spreads
        .iter()
        .zip(&lines)
        .map(|((jacobian, covariance), line)| line.focal_length(jacobian, covariance, &at))
        .collect();
    let (pp_px, pp_unweighted_px) = (to_px(at), to_px(unweighted));
    let parameters = 4 + 8 * observations.view_count();
    let image_from_board = state
        .views
        .iter()
        .map(|view| image_from_board(view, largest, &distortion_centre_px))
        .collect();
    let usable = pp_px.coords.iter().chain(pp_unit_covariance_px2.iter()).all(|x| x.is_finite());
    usable.then(|| FreeHomographies {
        distortion_centre_px,
        k: [state.shared[2], state.shared[3]],
        image_from_board,
        cost: minimum.cost - problem.prior_cost(&state.shared),
        degrees_of_freedom: observations.coordinate_count().saturating_sub(parameters).max(1),
        pp_px,
        pp_unit_covariance_px2,
        pp_unweighted_px,
        focal,
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

/// Principal line of a view, in g: `n·p = c`, and what gives the focal length.
struct Line {
    normal: Vector2<f64>,
    c: f64,
    v: f64,
    d: f64,
}

impl Line {
    /// `None` for a board parallel to the image.
    fn of(view: &Local) -> Option<Self> {
        let (a, b) = (view[6], view[7]);
        let rho2 = a * a + b * b;
        let vanishing = Vector2::new(a * view[0] + b * view[1], a * view[3] + b * view[4]) / rho2;
        let u = Vector2::new(a * view[1] - b * view[0], a * view[4] - b * view[3]);
        let length = u.norm();
        let normal = u / length;
        let tangent = Vector2::new(-normal.y, normal.x);
        let line = Self {
            normal,
            c: normal.dot(&vanishing),
            v: tangent.dot(&vanishing),
            d: length / rho2,
        };
        (line.c.is_finite() && line.v.is_finite() && line.d.is_finite()).then_some(line)
    }

    fn tangent(&self) -> Vector2<f64> {
        Vector2::new(-self.normal.y, self.normal.x)
    }

    /// Derivative of `c − n·P` over (φ, c).
    fn miss_by_line(&self, at: &Vector2<f64>) -> RowVector2<f64> {
        RowVector2::new(-self.tangent().dot(at), 1.0)
    }

    /// `f² = D² − (t·P − v)²` in px with its variance, P given.
    fn focal_length(
        &self,
        jacobian: &LineJacobian,
        covariance: &SMatrix<f64, 8, 8>,
        at: &Vector2<f64>,
    ) -> Option<(f64, f64)> {
        let delta = self.tangent().dot(at) - self.v;
        let f = (self.d * self.d - delta * delta).sqrt();
        if !(f.is_finite() && f > 0.0) {
            return None;
        }
        let by_line =
            SMatrix::<f64, 1, 4>::new(delta * self.normal.dot(at) / f, 0.0, delta / f, self.d / f);
        let by_view = by_line * jacobian.0;
        let variance = (by_view * covariance * by_view.transpose())[(0, 0)];
        Some((f * SCALE_PX, variance * SCALE_PX * SCALE_PX))
    }
}

/// d (φ, c, v, D) / d view.
struct LineJacobian(SMatrix<f64, 4, 8>);

impl LineJacobian {
    fn of(view: &Local) -> Option<Self> {
        let line = Line::of(view)?;
        let (a, b) = (view[6], view[7]);
        let rho2 = a * a + b * b;
        let (normal, tangent) = (line.normal, line.tangent());
        let vanishing = normal * line.c + tangent * line.v;
        let length = line.d * rho2;
        let mut jacobian = SMatrix::<f64, 4, 8>::zeros();
        for i in 0..8 {
            let mut d_vanishing = Vector2::zeros();
            let mut d_u = Vector2::zeros();
            let mut d_rho2 = 0.0;
            match i {
                0 | 3 => {
                    d_vanishing[i / 3] = a / rho2;
                    d_u[i / 3] = -b;
                }
                1 | 4 => {
                    d_vanishing[i / 3] = b / rho2;
                    d_u[i / 3] = a;
                }
                6 => {
                    d_vanishing = (Vector2::new(view[0], view[3]) - vanishing * 2.0 * a) / rho2;
                    d_u = Vector2::new(view[1], view[4]);
                    d_rho2 = 2.0 * a;
                }
                7 => {
                    d_vanishing = (Vector2::new(view[1], view[4]) - vanishing * 2.0 * b) / rho2;
                    d_u = -Vector2::new(view[0], view[3]);
                    d_rho2 = 2.0 * b;
                }
                _ => {}
            }
            let d_phi = tangent.dot(&d_u) / length;
            jacobian[(0, i)] = d_phi;
            jacobian[(1, i)] = normal.dot(&d_vanishing) + line.v * d_phi;
            jacobian[(2, i)] = tangent.dot(&d_vanishing) - line.c * d_phi;
            jacobian[(3, i)] = (normal.dot(&d_u) - line.d * d_rho2) / rho2;
        }
        jacobian.iter().all(|x| x.is_finite()).then_some(Self(jacobian))
    }

    /// d (c − n·P) / d view.
    fn miss(&self, line: &Line, at: &Vector2<f64>) -> SMatrix<f64, 1, 8> {
        line.miss_by_line(at) * self.0.fixed_rows::<2>(0)
    }
}

fn weights(
    spreads: &[(LineJacobian, SMatrix<f64, 8, 8>)],
    lines: &[Line],
    at: &Vector2<f64>,
) -> Vec<f64> {
    spreads
        .iter()
        .zip(lines)
        .map(|((jacobian, covariance), line)| {
            let by_view = jacobian.miss(line, at);
            1.0 / (by_view * covariance * by_view.transpose())[(0, 0)]
        })
        .collect()
}

/// Weighted intersection and the inverse of its normal matrix.
fn intersect(lines: &[Line], weights: &[f64]) -> Option<(Vector2<f64>, Matrix2<f64>)> {
    let mut normal_matrix = Matrix2::zeros();
    let mut right = Vector2::zeros();
    for (line, weight) in lines.iter().zip(weights) {
        normal_matrix += *weight * line.normal * line.normal.transpose();
        right += *weight * line.c * line.normal;
    }
    let inverse = inverse(&normal_matrix)?;
    Some((inverse * right, inverse))
}

/// Covariance of the intersection, px²: lines of different views are correlated through the shared lens.
fn joint_covariance(
    minimum: &Minimum<FreeState, 4, 8>,
    spreads: &[(LineJacobian, SMatrix<f64, 8, 8>)],
    lines: &[Line],
    weights: &[f64],
    normal_inverse: &Matrix2<f64>,
    at: &Vector2<f64>,
) -> Option<Matrix2<f64>> {
    let shared_covariance: Matrix4<f64> = inverse(&minimum.arrow.reduced()?)?;
    // dP = N⁻¹ Σ w n (dc − (t·P) dφ), and p = DC + S g.
    let mut by_shared = Matrix2x4::zeros();
    by_shared.fixed_view_mut::<2, 2>(0, 0).fill_with_identity();
    let mut own = Matrix2::zeros();
    for (((jacobian, covariance), line), (weight, block)) in
        spreads.iter().zip(lines).zip(weights.iter().zip(&minimum.arrow.views))
    {
        let by_view = normal_inverse * line.normal * jacobian.miss(line, at) * *weight * SCALE_PX;
        own += by_view * covariance * by_view.transpose();
        by_shared -= by_view * covariance * block.cross.transpose();
    }
    Some(own + by_shared * shared_covariance * by_shared.transpose())
}

impl FreeProblem<'_> {
    fn prior_cost(&self, shared: &Vector4<f64>) -> f64 {
        let miss = self.prior.px.coords - shared.fixed_rows::<2>(0);
        miss.norm_squared() / (self.prior.sd_px * self.prior.sd_px)
    }
}

impl Problem<4, 8> for FreeProblem<'_> {
    type State = FreeState;

    fn linearise(&self, state: &FreeState) -> Option<(f64, Arrow<4, 8>)> {
        let centre = Point2::new(state.shared[0], state.shared[1]);
        let lens = Distortion { k1: state.shared[2], k2: state.shared[3], ..Distortion::default() };
        let mut cost = 0.0;
        let mut views = Vec::with_capacity(state.views.len());
        for (index, h) in state.views.iter().enumerate() {
            let mut block = ViewBlock::zeros();
            for corner in self.observations.view(index) {
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
                cost += residual.norm_squared();
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
                block.add(&(corner.whitener * by_shared), &(corner.whitener * by_view), &residual);
            }
            views.push(block);
        }
        let mut arrow = Arrow::from_views(views);
        let information = 1.0 / (self.prior.sd_px * self.prior.sd_px);
        for i in 0..2 {
            arrow.shared[(i, i)] += information;
            arrow.gradient[i] += information * (self.prior.px[i] - state.shared[i]);
        }
        cost += self.prior_cost(&state.shared);
        cost.is_finite().then_some((cost, arrow))
    }

    fn moved(&self, state: &FreeState, step: &Step<4, 8>) -> FreeState {
        let views = state.views.iter().zip(&step.views).map(|(view, step)| view + step).collect();
        FreeState { shared: state.shared + step.shared, views }
    }
}
