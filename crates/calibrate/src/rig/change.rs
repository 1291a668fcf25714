//! Whether a camera has moved against another since an earlier calibration of the rig.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3, SMatrix, Vector3, Vector6};

use super::{
    RigCalibration,
    bundle::{OF_CAMERA, inverse, part},
    stated::{lens_rows, shared_places},
};
use crate::{DriftVerdict, acceptance::TWO_SIDED_95};
use boresight_geometry::{LENS_PARAMETERS, Rig};

/// Earlier calibration of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownRig {
    /// Lenses and places.
    pub rig: Rig,
    /// Covariance, as [`RigCalibration::covariance`].
    pub covariance: DMatrix<f64>,
}

impl KnownRig {
    /// The same with `cameras` alone, in that order: their mutual places are known as before.
    #[must_use]
    pub fn only(&self, cameras: &[usize]) -> Self {
        let all = OF_CAMERA * self.rig.cameras.len();
        let of = |camera: &usize| OF_CAMERA * camera..OF_CAMERA * (camera + 1);
        let rows: Vec<usize> =
            cameras.iter().flat_map(of).chain(all..self.covariance.nrows()).collect();
        let rig = Rig {
            cameras: cameras.iter().map(|camera| self.rig.cameras[*camera]).collect(),
            cam_from_rig: cameras.iter().map(|camera| self.rig.cam_from_rig[*camera]).collect(),
        };
        Self { rig, covariance: part(&self.covariance, &rows) }
    }
}

/// Motion of a camera against another since an earlier calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairChange {
    /// The cameras.
    pub of: [usize; 2],
    /// Angle of the second camera's change in the first one's frame, in radians.
    pub turn_rad: f64,
    /// Distance of the same change, in metres.
    pub shift_m: f64,
    /// Displacement in the second camera's picture of points in front of both, root mean square.
    pub displaced_px: f64,
    /// Where the true displacement lies: least and most, by 95 %.
    pub interval_px: [f64; 2],
    /// Displacement against a limit.
    pub verdict: DriftVerdict,
}

/// Motion between two cameras, with its covariance `own`, that with their lenses `with_lenses`
/// (6 × 2 lenses), and that of the lenses alone.
struct Motion {
    second_from_first: Isometry3<f64>,
    lenses: DVector<f64>,
    own: DMatrix<f64>,
    with_lenses: DMatrix<f64>,
    of_lenses: DMatrix<f64>,
}

impl Motion {
    fn of(rig: &Rig, covariance: &DMatrix<f64>, of: [usize; 2]) -> Self {
        let places: Vec<usize> = of
            .iter()
            .flat_map(|camera| {
                let at = OF_CAMERA * camera + LENS_PARAMETERS;
                at..at + 6
            })
            .collect();
        let lens_of: Vec<usize> = of.iter().flat_map(|camera| lens_rows(*camera)).collect();
        let [first, second] = of.map(|camera| rig.cam_from_rig[camera]);
        let motion = second * first.inverse();
        let turn = *motion.rotation.to_rotation_matrix().matrix();
        let (t_1, mut jacobian) = (first.translation.vector, SMatrix::<f64, 6, 12>::zeros());
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-turn);
        jacobian.fixed_view_mut::<3, 3>(0, 6).copy_from(&SMatrix::identity());
        // t = t₂ − R t₁, and R turns with ω₂ and against ω₁.
        jacobian.fixed_view_mut::<3, 3>(3, 0).copy_from(&-(turn * t_1.cross_matrix()));
        jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&-turn);
        jacobian.fixed_view_mut::<3, 3>(3, 6).copy_from(&(turn * t_1).cross_matrix());
        jacobian.fixed_view_mut::<3, 3>(3, 9).copy_from(&SMatrix::identity());
        let jacobian = DMatrix::from_fn(6, 12, |i, j| jacobian[(i, j)]);
        let cross = DMatrix::from_fn(places.len(), lens_of.len(), |i, j| {
            covariance[(places[i], lens_of[j])]
        });
        let parameters = of.map(|camera| rig.cameras[camera].lens_parameters()).concat();
        Self {
            second_from_first: motion,
            lenses: DVector::from_vec(parameters),
            own: &jacobian * part(covariance, &places) * jacobian.transpose(),
            with_lenses: jacobian * cross,
            of_lenses: part(covariance, &lens_of),
        }
    }
}

/// Change between two cameras of a new calibration since `earlier`, for a displacement that matters
/// from `limit_px` on. The new calibration starts from the earlier lenses with their covariance.
///
/// An error of the lenses moves both estimates alike: with `A` the earlier motion's regression on
/// its lenses `θ`, the change is `d = m − m₀ − A (θ − θ₀)`, with covariance
/// `C = C_mm − C_mθ Aᵀ − A C_θm + A C_θθ Aᵀ` of the new and `C_mm − A C_θm` of the earlier
/// calibration. `G` is the mean square of displacements by `d`. The displacement is `√(dᵀGd)`, at
/// least 1.96 standard deviations less along `d`, at most `1.96 √tr(GC)` more. `None` without
/// uncertainty or common places.
pub fn pair_change(
    new: &RigCalibration,
    earlier: &KnownRig,
    of: [usize; 2],
    limit_px: f64,
) -> Option<PairChange> {
    let now = Motion::of(&new.rig, new.covariance.as_ref()?, of);
    let was = Motion::of(&earlier.rig, &earlier.covariance, of);
    let known: Vec<usize> =
        (0..was.lenses.len()).filter(|row| was.of_lenses[(*row, *row)] > 0.0).collect();
    let regression =
        was.with_lenses.select_columns(&known) * inverse(&part(&was.of_lenses, &known))?;
    let (learned, with_lenses) =
        ((now.lenses - &was.lenses).select_rows(&known), now.with_lenses.select_columns(&known));
    let covariance =
        &now.own - &with_lenses * regression.transpose() - &regression * with_lenses.transpose()
            + &regression * part(&now.of_lenses, &known) * regression.transpose()
            + &was.own
            - &regression * was.with_lenses.select_columns(&known).transpose();
    let covariance = Matrix6::from_fn(|i, j| covariance[(i, j)]);
    let turn =
        (now.second_from_first.rotation * was.second_from_first.rotation.inverse()).scaled_axis();
    let shift = now.second_from_first.translation.vector - was.second_from_first.translation.vector;
    let explained = regression * learned;
    let change =
        Vector6::from_fn(|i, _| (if i < 3 { turn[i] } else { shift[i - 3] }) - explained[i]);
    let places = shared_places(new, of);
    let [a, b] = of;
    let (mut gram, mut count) = (Matrix6::zeros(), 0.0);
    for place in &places {
        let in_first: Point3<f64> = new.rig.cam_from_rig[a] * place;
        let seen = new.rig.cameras[b].project_body_point(&now.second_from_first, &in_first);
        if let Some(at) = seen {
            gram += at.jac_pose.transpose() * at.jac_pose;
            count += 1.0;
        }
    }
    if count == 0.0 {
        return None;
    }
    gram /= count;
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
    let [turn, shift]: [Vector3<f64>; 2] =
        [change.fixed_rows::<3>(0).into(), change.fixed_rows::<3>(3).into()];
    Some(PairChange {
        of,
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

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use boresight_geometry::Camera;

    /// Derivatives of the motion against differences.
    #[test]
    fn a_small_step_of_a_place_moves_the_motion_as_stated() {
        let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
        let rig = Rig {
            cameras: vec![camera; 2],
            cam_from_rig: vec![
                Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, -0.1, 0.4)),
                Isometry3::new(Vector3::new(-0.3, 0.1, 0.2), Vector3::new(-0.3, 0.5, 0.1)),
            ],
        };
        let was = rig.cam_from_cam(1, 0);
        for index in 0..12 {
            let (camera, number) = (index / 6, index % 6);
            let mut step = [Vector3::zeros(), Vector3::zeros()];
            step[number / 3][number % 3] = 1e-6;
            let mut moved = rig.clone();
            let place = &mut moved.cam_from_rig[camera];
            *place = Camera::moved(place, &step[0], &step[1]);
            let now = moved.cam_from_cam(1, 0);
            let turn = (now.rotation * was.rotation.inverse()).scaled_axis() / 1e-6;
            let shift = (now.translation.vector - was.translation.vector) / 1e-6;
            let mut covariance = DMatrix::zeros(2 * OF_CAMERA, 2 * OF_CAMERA);
            let row = OF_CAMERA * camera + LENS_PARAMETERS + number;
            covariance[(row, row)] = 1.0;
            let own = Motion::of(&rig, &covariance, [0, 1]).own;
            let by = Vector6::from_fn(|i, _| if i < 3 { turn[i] } else { shift[i - 3] });
            let wanted = by * by.transpose();
            assert!((&own - wanted).amax() < 1e-4, "{index}: {own} {wanted}");
        }
    }
}
