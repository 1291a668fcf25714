//! Movement of the board between poses.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::{TechnicianParams, time::after};
use boresight_geometry::frame::CaptureTime;

/// Top speed of a minimum-jerk movement relative to the mean speed.
const TOP_SPEED: f64 = 15.0 / 8.0;
/// Minimum duration of a corrective movement.
const CORRECTION_SECS: f64 = 0.3;
/// Time in which a held board sinks by about two thirds of the total.
const SINKING_SECS: f64 = 5.0;

/// Reach to a pose: a minimum-jerk movement with an overshoot, two corrections (superposed
/// submovements: Flash and Henis, 1991), and then a slow sinking.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    from: Isometry3<f64>,
    to: Isometry3<f64>,
    start: CaptureTime,
    first_secs: f64,
    /// Overshoot of the first movement beyond the target, relative to the distance.
    overshoot: f64,
    correction_secs: f64,
    sink_m: f64,
}

impl Reach {
    /// Reach without movement except sinking.
    pub(super) fn rest(pose: Isometry3<f64>, start: CaptureTime, sink_m: f64) -> Self {
        Self {
            from: pose,
            to: pose,
            start,
            first_secs: 0.0,
            overshoot: 0.0,
            correction_secs: 0.0,
            sink_m,
        }
    }

    /// Reach as fast as the person's speeds allow, but not in less than 0.1 s.
    pub(super) fn new(
        from: Isometry3<f64>,
        to: Isometry3<f64>,
        start: CaptureTime,
        params: &TechnicianParams,
        overshoot: f64,
        sink_m: f64,
    ) -> Self {
        let way_m = (to.translation.vector - from.translation.vector).norm();
        let turn_rad = from.rotation.angle_to(&to.rotation);
        let secs = (TOP_SPEED * way_m / params.max_speed_m_per_s)
            .max(TOP_SPEED * turn_rad / params.max_turn_rad_per_s)
            .max(0.1);
        let (first_secs, correction_secs) = if overshoot > 0.0 {
            let back = overshoot * (1.0 + overshoot);
            ((1.0 + overshoot) * secs, CORRECTION_SECS.max(back * secs))
        } else {
            (secs, 0.0)
        };
        Self { from, to, start, first_secs, overshoot, correction_secs, sink_m }
    }

    /// End of the reach, before the sinking.
    pub(super) fn to(&self) -> &Isometry3<f64> {
        &self.to
    }

    /// Time of the board's arrival.
    pub(super) fn arrival(&self) -> CaptureTime {
        after(self.start, self.first_secs + 2.0 * self.correction_secs)
    }

    pub(super) fn pose_at(&self, time: CaptureTime) -> Isometry3<f64> {
        let elapsed_secs = time.secs_since(self.start);
        let held_secs = elapsed_secs - self.first_secs - 2.0 * self.correction_secs;
        if held_secs >= 0.0 {
            let sunk_m = self.sink_m * -libm::expm1(-held_secs / SINKING_SECS);
            let mut sunk = self.to;
            sunk.translation.vector.y += sunk_m;
            return sunk;
        }
        let share = self.share_at(elapsed_secs);
        let turn = (self.to.rotation * self.from.rotation.inverse()).scaled_axis();
        Isometry3::from_parts(
            self.from.translation.vector.lerp(&self.to.translation.vector, share).into(),
            UnitQuaternion::from_scaled_axis(share * turn) * self.from.rotation,
        )
    }

    /// Share of the distance covered.
    fn share_at(&self, elapsed_secs: f64) -> f64 {
        let first = minimum_jerk(elapsed_secs / self.first_secs);
        let beyond = self.overshoot;
        if beyond == 0.0 {
            return first;
        }
        let after_first = (elapsed_secs - self.first_secs) / self.correction_secs;
        (1.0 + beyond) * first - (beyond + beyond * beyond) * minimum_jerk(after_first)
            + beyond * beyond * minimum_jerk(after_first - 1.0)
    }
}

/// `s³ (10 - 15 s + 6 s²)`, the profile of hand movements (Flash and Hogan, 1985).
fn minimum_jerk(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s.powi(3) * (10.0 + s * (6.0 * s - 15.0))
}

/// `pose` tipped so that its normal leans by `gain` of the way towards receding by `tilt_rad` in
/// the picture direction `azimuth_rad`; its roll is kept. The board must face the camera.
pub(super) fn tipped(
    pose: &Isometry3<f64>,
    azimuth_rad: f64,
    tilt_rad: f64,
    gain: f64,
) -> Isometry3<f64> {
    let normal = pose.rotation * Vector3::z();
    let across = Vector3::z().cross(&normal);
    let now = across
        .try_normalize(1e-12)
        .map_or_else(Vector3::zeros, |axis| axis * libm::atan2(across.norm(), normal.z));
    let wanted = Vector3::new(libm::sin(azimuth_rad), -libm::cos(azimuth_rad), 0.0) * tilt_rad;
    let next = now + gain * (wanted - now);
    Isometry3::from_parts(
        pose.translation,
        UnitQuaternion::from_scaled_axis(next)
            * UnitQuaternion::from_scaled_axis(now).inverse()
            * pose.rotation,
    )
}
