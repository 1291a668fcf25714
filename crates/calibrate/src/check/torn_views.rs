//! Finds views composed of two pictures: the rows below a tear show the board at another moment.
//!
//! A driver that fills a buffer during a read gives such pictures, at full length and without an
//! error. If the board moved, the corners below the tear are shifted; a pose absorbs most of that,
//! so the search uses the residuals with a free pose. A board that moved during the exposure is
//! smeared, not torn: its corners are shifted, too, but smoothly.

use nalgebra::{DMatrix, DVector, Matrix2, Point2, SMatrix, SVector, Vector2};

use crate::solve::{
    bundle::{BundleState, Observations},
    schur_lm::inverse,
};

/// Least corners on each side of a tear: a few wrong corners would explain fewer.
const LEAST_CORNERS: usize = 6;
/// Reduction of the cost of a suspect view, in multiples of the typical squared residual: three
/// parameters gain 40 by chance once in 10⁸ views. The fit of all views decides.
const SUSPECT_GAIN: f64 = 40.0;
/// Least gain of a suspect, as a share of the largest gain: a torn view distorts the lens, and
/// thereby the other views.
const LEAST_SHARE: f64 = 0.1;
/// Least ratio of the cost after a tear along a column to the cost after a tear along a row. 200
/// rendered smears have 1.5 at most, small tears 1.9 at least.
const BETTER_THAN_ACROSS: f64 = 1.7;
/// Least ratio of the cost after smooth shifts to the cost after two rigid halves. The same smears
/// have 1.2 at most, rendered tears with a turn 4.8 at least.
const BETTER_THAN_SMOOTH: f64 = 2.0;
/// Singular value, for slopes of unit length, below which parameters have the same effect.
const LEAST_SINGULAR: f64 = 1e-6;

/// Row in pixels at which each view is probably torn. `None` if no view is suspect.
pub(super) fn suspects(
    observations: &Observations,
    state: &BundleState,
) -> Option<Vec<Option<f64>>> {
    let views: Vec<Option<FreeView>> = (0..observations.view_count())
        .map(|view| FreeView::of(observations, state, view))
        .collect();
    let tears: Vec<Option<Tear>> =
        views.iter().map(|view| view.as_ref()?.likeliest_tear(|px| px.y)).collect();
    let mut squares: Vec<f64> = tears.iter().flatten().map(|tear| tear.left_square).collect();
    squares.sort_by(f64::total_cmp);
    let typical_square = *squares.get(squares.len() / 2)?;
    let most = tears.iter().flatten().map(|tear| tear.gain).fold(0.0, f64::max);
    let least = (SUSPECT_GAIN * typical_square).max(LEAST_SHARE * most);
    let rows: Vec<Option<f64>> = views
        .iter()
        .zip(&tears)
        .map(|(view, tear)| {
            let tear = tear.as_ref().filter(|tear| tear.gain > least)?;
            view.as_ref()?.is_torn(tear).then_some(tear.at_px)
        })
        .collect();
    rows.iter().any(Option::is_some).then_some(rows)
}

struct Tear {
    /// Place of the tear along the search axis.
    at_px: f64,
    /// Reduction of the view's cost by a shift of the corners beyond the tear, with a free pose.
    gain: f64,
    /// Mean squared remaining whitened residual.
    left_square: f64,
}

/// Residual and derivatives of a corner, under changes of the view.
struct Pull {
    px: Point2<f64>,
    whitener: Matrix2<f64>,
    by_pose: SMatrix<f64, 2, 6>,
    residual: Vector2<f64>,
}

/// View under the lens of a state, with a free pose.
struct FreeView {
    pulls: Vec<Pull>,
    /// Inverse of the pose's information.
    settled: SMatrix<f64, 6, 6>,
    gradient: SVector<f64, 6>,
    cost: f64,
}

impl FreeView {
    fn of(observations: &Observations, state: &BundleState, view: usize) -> Option<Self> {
        let pose = &state.cam_from_board[view];
        let mut pulls = Vec::with_capacity(observations.view(view).len());
        let mut local = SMatrix::<f64, 6, 6>::zeros();
        let mut gradient = SVector::<f64, 6>::zeros();
        let mut cost = 0.0;
        for corner in observations.view(view) {
            let predicted = state.camera.project_board_point(pose, &corner.board_m)?;
            let residual = corner.whitener * (corner.px - predicted.px);
            let by_pose = corner.whitener * predicted.jac_pose;
            local += by_pose.transpose() * by_pose;
            gradient += by_pose.transpose() * residual;
            cost += residual.norm_squared();
            pulls.push(Pull { px: corner.px, whitener: corner.whitener, by_pose, residual });
        }
        Some(Self { pulls, settled: inverse(&local)?, gradient, cost })
    }

    /// Place along an axis of the picture beyond which a shift of all corners reduces the cost
    /// most.
    fn likeliest_tear(&self, along: impl Fn(&Point2<f64>) -> f64) -> Option<Tear> {
        let mut pulls: Vec<&Pull> = self.pulls.iter().collect();
        pulls.sort_by(|a, b| along(&b.px).total_cmp(&along(&a.px)));
        let mut best: Option<(f64, usize)> = None;
        // Sums over the corners beyond.
        let mut cross = SMatrix::<f64, 2, 6>::zeros();
        let mut information = Matrix2::zeros();
        let mut pull = Vector2::zeros();
        let last = pulls.len().saturating_sub(LEAST_CORNERS);
        for (count, corner) in (1..=last).zip(&pulls) {
            let by_shift = corner.whitener.transpose();
            cross += by_shift * corner.by_pose;
            information += by_shift * corner.whitener;
            pull += by_shift * corner.residual;
            if count < LEAST_CORNERS {
                continue;
            }
            let of_pose = cross * self.settled;
            let alone = information - of_pose * cross.transpose();
            let pull = pull - of_pose * self.gradient;
            let Some(covariance) = alone.try_inverse() else { continue };
            let gain = pull.dot(&(covariance * pull));
            if gain.is_finite() && best.is_none_or(|(most, _)| gain > most) {
                best = Some((gain, count));
            }
        }
        let (gain, count) = best?;
        let at_px = 0.5 * (along(&pulls[count - 1].px) + along(&pulls[count].px));
        let left = self.cost - self.gradient.dot(&(self.settled * self.gradient)) - gain;
        Some(Tear { at_px, gain, left_square: left.max(0.0) / (2 * pulls.len()) as f64 })
    }

    /// True if the view is torn, not smeared. A smear moves corners smoothly and independently of
    /// rows. A tear along a row therefore fits a torn view far better than a tear along a column,
    /// or two rigid halves fit far better than any smooth shift.
    fn is_torn(&self, tear: &Tear) -> bool {
        let across = self.likeliest_tear(|px| px.x).map_or(0.0, |across| across.left_square);
        across > BETTER_THAN_ACROSS * tear.left_square
            || self.left_if_smooth() > BETTER_THAN_SMOOTH * self.left_if_halves(tear.at_px)
    }

    /// Mean squared whitened residual if the rows on either side have separate poses.
    fn left_if_halves(&self, row_px: f64) -> f64 {
        self.left_square::<12>(|pull| {
            let from = if pull.px.y > row_px { 6 } else { 0 };
            let mut both = SMatrix::<f64, 2, 12>::zeros();
            both.fixed_view_mut::<2, 6>(0, from).copy_from(&pull.by_pose);
            both
        })
    }

    /// Mean squared whitened residual after smooth shifts of the corners over the board.
    fn left_if_smooth(&self) -> f64 {
        let count = self.pulls.len().max(1) as f64;
        let sum = self.pulls.iter().fold(Vector2::zeros(), |sum, pull| sum + pull.px.coords);
        let off = |pull: &Pull| pull.px.coords - sum / count;
        let reach = self.pulls.iter().map(|pull| off(pull).amax()).fold(1.0, f64::max);
        self.left_square::<16>(|pull| {
            let at = off(pull) / reach;
            let mut by_all = SMatrix::<f64, 2, 16>::zeros();
            by_all.fixed_view_mut::<2, 6>(0, 0).copy_from(&pull.by_pose);
            let shapes = [at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y];
            for (shape, value) in shapes.into_iter().enumerate() {
                by_all.fixed_view_mut::<2, 2>(0, 6 + 2 * shape).copy_from(&(pull.whitener * value));
            }
            by_all
        })
    }

    /// Mean squared whitened residual at the best values of `N` parameters.
    fn left_square<const N: usize>(&self, by: impl Fn(&Pull) -> SMatrix<f64, 2, N>) -> f64 {
        let rows = 2 * self.pulls.len();
        let mut slopes = DMatrix::zeros(rows, N);
        let mut residuals = DVector::zeros(rows);
        for (row, pull) in (0..rows).step_by(2).zip(&self.pulls) {
            slopes.fixed_view_mut::<2, N>(row, 0).copy_from(&by(pull));
            residuals.fixed_rows_mut::<2>(row).copy_from(&pull.residual);
        }
        // Normalize each column, so that columns with the same effect show in the singular values.
        for mut column in slopes.column_iter_mut() {
            let length = column.norm();
            column /= length.max(f64::MIN_POSITIVE);
        }
        let split = slopes.svd(true, false);
        let Some(directions) = split.u else { return f64::NAN };
        let free = directions.column_iter().zip(split.singular_values.iter());
        for (direction, _) in free.filter(|(_, value)| **value > LEAST_SINGULAR) {
            let along = direction.dot(&residuals);
            residuals.axpy(-along, &direction, 1.0);
        }
        residuals.norm_squared() / rows as f64
    }
}
