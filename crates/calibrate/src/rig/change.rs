//! Whether a camera has moved against another since an earlier calibration of the rig.

use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::{Pair, RigCalibration, stated::shared_places};
use crate::{DriftVerdict, acceptance::TWO_SIDED_95};
use boresight_geometry::Camera;

/// Motion of a camera against another since an earlier calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairChange {
    /// The cameras.
    pub of: [usize; 2],
    /// Change of the second camera's place in the first one's frame: angle and distance.
    pub turn_rad: f64,
    /// See [`Self::turn_rad`]; in metres.
    pub shift_m: f64,
    /// Displacement in the second camera's picture of points in front of both, root mean square.
    pub displaced_px: f64,
    /// Where the true displacement lies: least and most, by 95 %.
    pub interval_px: [f64; 2],
    /// Displacement against a limit.
    pub verdict: DriftVerdict,
}

/// Change of `pair` of a new calibration since `earlier`, its motion with covariance, for a
/// displacement that matters from `limit_px` on. The new calibration holds the lenses to those of
/// the earlier one.
///
/// The change is `d`, a turn and a shift, with covariance `C` of both; `G` is the mean square of
/// displacements by `d`. The displacement is `√(dᵀGd)`, at least 1.96 standard deviations less along
/// `d`, at most `1.96 √tr(GC)` more. `None` if the pair has no uncertainty or no common places.
pub fn pair_change(
    new: &RigCalibration,
    pair: &Pair,
    (earlier, covariance): (&Isometry3<f64>, &Matrix6<f64>),
    limit_px: f64,
) -> Option<PairChange> {
    let sd = pair.sd.as_ref()?;
    let [a, b] = pair.of;
    let places = shared_places(new, pair.of);
    if places.is_empty() {
        return None;
    }
    let turn = (pair.second_from_first.rotation * earlier.rotation.inverse()).scaled_axis();
    let shift = pair.second_from_first.translation.vector - earlier.translation.vector;
    let change = Vector6::from_iterator(turn.iter().chain(shift.iter()).copied());
    let camera: &Camera = &new.rig.cameras[b];
    let mut gram = Matrix6::zeros();
    let mut count = 0.0;
    for place in &places {
        let in_first: Point3<f64> = new.rig.cam_from_rig[a] * place;
        if let Some(at) = camera.project_body_point(&pair.second_from_first, &in_first) {
            gram += at.jac_pose.transpose() * at.jac_pose;
            count += 1.0;
        }
    }
    gram /= count;
    let covariance = sd.motion + covariance;
    let displaced_px = change.dot(&(gram * change)).max(0.0).sqrt();
    let along = gram * change / displaced_px.max(f64::MIN_POSITIVE);
    let sd_px = along.dot(&(covariance * along)).max(0.0).sqrt();
    let noise_px = (gram * covariance).trace().max(0.0).sqrt();
    let interval_px =
        [(displaced_px - TWO_SIDED_95 * sd_px).max(0.0), displaced_px + TWO_SIDED_95 * noise_px];
    let verdict = match interval_px {
        [_, most] if most <= limit_px => DriftVerdict::Ok,
        [least, _] if least > limit_px => DriftVerdict::Recalibrate,
        _ => DriftVerdict::CannotTell,
    };
    Some(PairChange {
        of: pair.of,
        turn_rad: turn.norm(),
        shift_m: shift.norm(),
        displaced_px,
        interval_px,
        verdict,
    })
}

/// Camera that moved: the one in every pair that has changed, if all others have stayed. `None`
/// if none or several fit, as of two cameras.
pub fn moved_camera(changes: &[PairChange]) -> Option<usize> {
    let mut cameras: Vec<usize> = changes.iter().flat_map(|change| change.of).collect();
    cameras.sort_unstable();
    cameras.dedup();
    let is_it = |camera: &usize| {
        let (own, others): (Vec<&PairChange>, Vec<&PairChange>) =
            changes.iter().partition(|change| change.of.contains(camera));
        !others.is_empty()
            && own.iter().all(|change| change.verdict == DriftVerdict::Recalibrate)
            && others.iter().all(|change| change.verdict == DriftVerdict::Ok)
    };
    let mut fitting = cameras.into_iter().filter(is_it);
    fitting.next().filter(|_| fitting.next().is_none())
}
