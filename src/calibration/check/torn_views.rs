//! Finds views whose picture is put together from two: the rows below a tear show the board at another moment.
//!
//! A driver that fills a buffer while it is read gives such pictures, at full length and without an error. If the board
//! moved, the corners below the tear are shifted; a pose absorbs most of that, so the tear is looked for in what no pose
//! explains.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use crate::calibration::solve::{
    bundle::{BundleState, Observations},
    schur_lm::inverse,
};

/// Corners wanted on each side of a tear: fewer are explained by a few wrong corners.
const LEAST_CORNERS: usize = 6;
/// Reduction of a view's cost that makes it suspect, in multiples of its typical squared residual: three parameters
/// gain 40 by chance once in 10⁸ views. The fit of all views decides.
const SUSPECT_GAIN: f64 = 40.0;
/// Suspects gain at least this share of the first one's gain: what the lens makes of a torn view shows in the others.
const LEAST_SHARE: f64 = 0.1;

/// For each view, the row in pixels at which it is probably torn. `None` if no view is suspect.
pub(super) fn suspects(
    observations: &Observations,
    state: &BundleState,
) -> Option<Vec<Option<f64>>> {
    let tears: Vec<Option<Tear>> = (0..observations.view_count())
        .map(|view| likeliest_tear(observations, state, view))
        .collect();
    let mut squares: Vec<f64> = tears.iter().flatten().map(|tear| tear.left_square).collect();
    squares.sort_by(f64::total_cmp);
    let typical_square = *squares.get(squares.len() / 2)?;
    let most = tears.iter().flatten().map(|tear| tear.gain).fold(0.0, f64::max);
    let least = (SUSPECT_GAIN * typical_square).max(LEAST_SHARE * most);
    let rows = tears.iter().map(|tear| Some(tear.as_ref().filter(|t| t.gain > least)?.row_px));
    let rows: Vec<Option<f64>> = rows.collect();
    rows.iter().any(Option::is_some).then_some(rows)
}

struct Tear {
    row_px: f64,
    /// Reduction of the view's cost by a shift of the corners below, its pose free.
    gain: f64,
    /// Mean squared whitened residual that is left.
    left_square: f64,
}

/// The row at which a shift of all corners below it reduces the cost of `view` most, under the lens of `state`.
fn likeliest_tear(observations: &Observations, state: &BundleState, view: usize) -> Option<Tear> {
    let pose = &state.cam_from_board[view];
    let mut corners: Vec<_> = observations.view(view).iter().collect();
    corners.sort_by(|a, b| b.px.y.total_cmp(&a.px.y));
    let mut local = SMatrix::<f64, 6, 6>::zeros();
    let mut gradient = SVector::<f64, 6>::zeros();
    let mut cost = 0.0;
    // Sums over the corners below, by their number.
    let mut below = Vec::with_capacity(corners.len());
    let mut cross = SMatrix::<f64, 2, 6>::zeros();
    let mut information = Matrix2::zeros();
    let mut pull = Vector2::zeros();
    for corner in &corners {
        let predicted = state.camera.project_board_point(pose, &corner.board_m)?;
        let residual = corner.whitener * (corner.px - predicted.px);
        let by_pose = corner.whitener * predicted.jac_pose;
        local += by_pose.transpose() * by_pose;
        gradient += by_pose.transpose() * residual;
        cost += residual.norm_squared();
        let by_shift = corner.whitener.transpose();
        cross += by_shift * by_pose;
        information += by_shift * corner.whitener;
        pull += by_shift * residual;
        below.push((cross, information, pull));
    }
    let settled = inverse(&local)?;
    let mut best: Option<(f64, usize)> = None;
    let last = corners.len().saturating_sub(LEAST_CORNERS);
    for count in LEAST_CORNERS..=last {
        let (cross, information, pull) = below[count - 1];
        let of_pose = cross * settled;
        let alone = information - of_pose * cross.transpose();
        let pull = pull - of_pose * gradient;
        let Some(covariance) = alone.try_inverse() else { continue };
        let gain = pull.dot(&(covariance * pull));
        if gain.is_finite() && best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, count));
        }
    }
    let (gain, count) = best?;
    let row_px = 0.5 * (corners[count - 1].px.y + corners[count].px.y);
    let left = (cost - gradient.dot(&(settled * gradient)) - gain).max(0.0);
    Some(Tear { row_px, gain, left_square: left / (2 * corners.len()) as f64 })
}
