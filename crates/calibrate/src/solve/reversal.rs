//! Reversed tilts: a small or distant board tilted towards the camera looks nearly like one tilted
//! away.
//!
//! Under weak perspective both pictures are the same (Necker's reversal; Collins & Bartoli,
//! "Infinitesimal plane-based pose estimation", 2014). A bundle that starts with the wrong tilt of
//! a view keeps it, because the face-on board between the two has larger residuals. So each view's
//! reversed tilt is refined separately, and the better one kept.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point2, Point3, Rotation3, SVector, UnitQuaternion};

use super::{
    bundle::{BundleState, Observations},
    whitened::Whitened,
};
use boresight_geometry::{
    Camera, Corner, fit_pose,
    least_squares::{Limits, Linearised, Problem, minimise},
};

/// Least drop of a view's cost by a reversal, as a share and as a number: less is rounding or
/// chance.
const LEAST_SHARE: f64 = 1e-3;
const LEAST_GAIN: f64 = 1.0;
/// Limits deliberately short of the minimum: the bundle continues from there.
const LIMITS: Limits =
    Limits { rounds: 15, first_damping: 1e-3, negligible_step: 1e-4, cost_rounding: 1e-13 };

/// `state` with views reversed if the corners then fit better, with the lens held. `None` if there
/// are none.
///
/// Tries only views with a cost of at least `suspicious` times the median view's; 0 tries all.
pub(super) fn with_better_tilts(
    observations: &Observations,
    state: &BundleState,
    suspicious: f64,
) -> Option<BundleState> {
    let camera = &state.camera;
    let problem = |view: usize| OneView { camera, corners: observations.view(view) };
    let costs: Vec<f64> = state
        .cam_from_board
        .iter()
        .enumerate()
        .map(|(view, pose)| problem(view).cost(pose).unwrap_or(f64::INFINITY))
        .collect();
    let mut sorted = costs.clone();
    sorted.sort_by(f64::total_cmp);
    let least = suspicious * sorted.get(sorted.len() / 2)?;
    let centre = board_centre_m(observations);
    let better = |view: usize| {
        let pose = &state.cam_from_board[view];
        let found = (costs[view] >= least)
            .then(|| minimise(&problem(view), reversed(pose, &centre), LIMITS))
            .flatten();
        found
            .filter(|found| found.at.cost < costs[view] * (1.0 - LEAST_SHARE) - LEAST_GAIN)
            .map(|found| found.state)
    };
    let better = observations.by_view(|view| Some(better(view)))?;
    let pose = |(pose, better): (&Isometry3<f64>, &Option<_>)| better.unwrap_or(*pose);
    let cam_from_board = state.cam_from_board.iter().zip(&better).map(pose).collect();
    let changed = better.iter().any(Option::is_some);
    changed.then_some(BundleState { camera: *camera, cam_from_board })
}

/// Poses of one view under a known lens: the fitted one, and the refined reversed tilt. Empty
/// without a pose.
pub(crate) fn tilts(
    camera: &Camera,
    board_m: &[Point2<f64>],
    corners: &[Corner],
) -> Vec<Isometry3<f64>> {
    let Ok(fit) = fit_pose(camera, board_m, corners) else { return Vec::new() };
    let Ok(observations) = Observations::new(board_m, &[corners]) else { return Vec::new() };
    let other = reversed(&fit.cam_from_board, &board_centre_m(&observations));
    let problem = OneView { camera, corners: observations.view(0) };
    let other = minimise(&problem, other, LIMITS).map(|found| found.state);
    [Some(fit.cam_from_board), other].into_iter().flatten().collect()
}

fn board_centre_m(observations: &Observations) -> Point3<f64> {
    let board_m = observations.board_m();
    let sum =
        board_m.iter().fold(Point3::origin(), |sum, p| sum + nalgebra::vector![p.x, p.y, 0.0]);
    sum / board_m.len().max(1) as f64
}

/// Pose with the same image under weak perspective: the board reflected in the plane through
/// `centre_m` (board coordinates) across the line of sight, and its normal turned over to face the
/// camera again.
fn reversed(cam_from_board: &Isometry3<f64>, centre_m: &Point3<f64>) -> Isometry3<f64> {
    let centre = cam_from_board * centre_m;
    let sight = centre.coords.normalize();
    let mirror = Matrix3::identity() - 2.0 * sight * sight.transpose();
    let turn = cam_from_board.rotation.to_rotation_matrix();
    let matrix =
        mirror * turn.matrix() * Matrix3::from_diagonal(&nalgebra::vector![1.0, 1.0, -1.0]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    let shift = centre.coords - rotation * centre_m.coords;
    Isometry3::from_parts(shift.into(), rotation)
}

/// Corners of a view under a fixed lens.
struct OneView<'a> {
    camera: &'a Camera,
    corners: &'a [Whitened],
}

impl OneView<'_> {
    fn cost(&self, pose: &Isometry3<f64>) -> Option<f64> {
        self.corners.iter().try_fold(0.0, |cost, corner| {
            let predicted = self.camera.project_board_point(pose, &corner.board_m)?.px;
            Some(cost + (corner.whitener * (corner.px - predicted)).norm_squared())
        })
    }
}

impl Problem<6> for OneView<'_> {
    /// Pose from board to camera.
    type State = Isometry3<f64>;
    type Extra = ();

    fn linearise(&self, pose: &Isometry3<f64>) -> Option<Linearised<6>> {
        let (gradient, normal_matrix) = (SVector::zeros(), Matrix6::zeros());
        let mut linear = Linearised { cost: 0.0, gradient, normal_matrix, extra: () };
        for corner in self.corners {
            let predicted = self.camera.project_board_point(pose, &corner.board_m)?;
            let residual = corner.whitener * (corner.px - predicted.px);
            let jacobian = corner.whitener * predicted.jac_pose;
            linear.cost += residual.norm_squared();
            linear.gradient += jacobian.transpose() * residual;
            linear.normal_matrix += jacobian.transpose() * jacobian;
        }
        linear.cost.is_finite().then_some(linear)
    }

    fn moved(&self, pose: &Isometry3<f64>, step: &SVector<f64, 6>) -> Isometry3<f64> {
        let turn_rad = step.fixed_rows::<3>(0).into_owned();
        Camera::moved(pose, &turn_rad, &step.fixed_rows::<3>(3).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use boresight_geometry::boards::Board;

    #[test]
    fn a_reversed_view_comes_back() {
        let board = Board::new(9, 6, 0.025).expect("a board");
        let board_m = board.corners_in_board_m();
        let camera = Camera::pinhole(2500.0, Point2::new(650.0, 350.0));
        let tilts = [Vector3::new(0.5, 0.1, 0.0), Vector3::new(-0.3, 0.4, 0.2)];
        let truth = tilts.map(|turn| Isometry3::new(Vector3::new(0.05, -0.02, 1.5), turn));
        let views: Vec<Vec<Corner>> = truth
            .iter()
            .map(|pose| {
                let px = |p| camera.px_from_board(pose, p).expect("in front");
                board_m.iter().map(|p| Corner::isotropic(px(p), 0.05)).collect()
            })
            .collect();
        let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
        let observations = Observations::new(&board_m, &slices).expect("corners");
        let centre = board_centre_m(&observations);
        // Two reversals restore the pose, and the centre stays in place.
        let twice = reversed(&reversed(&truth[0], &centre), &centre);
        assert!((twice.to_homogeneous() - truth[0].to_homogeneous()).norm() < 1e-12);
        let off = reversed(&truth[0], &centre) * centre - truth[0] * centre;
        assert!(off.norm() < 1e-12);
        let mut state = BundleState { camera, cam_from_board: truth.to_vec() };
        assert_eq!(with_better_tilts(&observations, &state, 0.0), None);
        state.cam_from_board[1] = reversed(&truth[1], &centre);
        let corrected = with_better_tilts(&observations, &state, 0.0).expect("one is reversed");
        let off = corrected.cam_from_board[1].rotation.angle_to(&truth[1].rotation);
        assert!(off < 1e-3, "{off}");
        assert_eq!(corrected.cam_from_board[0], truth[0]);
    }
}
