//! Path of the board over time: the rows of a picture request times in any order, but a person
//! moves only forward.

use std::collections::VecDeque;

use nalgebra::{Isometry3, UnitQuaternion};

use super::hands::Hands;
use boresight_geometry::frame::CaptureTime;

/// Time between two stored poses. A tremor of 12 Hz and 0.35 mm differs by 1 µm from linear
/// interpolation.
const STEP_SECS: f64 = 0.002;

/// Poses at even times, from a step before the first requested time to a step after the last.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    start_secs: f64,
    poses: VecDeque<Isometry3<f64>>,
}

impl Track {
    /// Follows the board in `hands` from `from_secs` to `to_secs`, and forgets earlier poses.
    /// Neither may decrease from call to call.
    pub(super) fn follow(&mut self, hands: &Hands, from_secs: f64, to_secs: f64) {
        if self.poses.is_empty() || self.end_secs() < from_secs - STEP_SECS {
            self.poses.clear();
            self.start_secs = from_secs - STEP_SECS;
        }
        while self.poses.len() < 2 || self.end_secs() < to_secs {
            let next_secs = self.start_secs + self.poses.len() as f64 * STEP_SECS;
            let nanos = (next_secs.max(0.0) * 1e9).round() as u64;
            self.poses.push_back(hands.pose_at(CaptureTime { nanos }));
        }
        while self.poses.len() > 2 && self.start_secs + STEP_SECS < from_secs {
            self.poses.pop_front();
            self.start_secs += STEP_SECS;
        }
    }

    /// Pose of the board at `secs`, interpolated; the nearest stored pose outside.
    pub(super) fn pose_at(&self, secs: f64) -> Isometry3<f64> {
        let steps = ((secs - self.start_secs) / STEP_SECS).max(0.0);
        let before = (steps as usize).min(self.poses.len().saturating_sub(2));
        let (Some(a), Some(b)) = (self.poses.get(before), self.poses.get(before + 1)) else {
            return self.poses.front().copied().unwrap_or_default();
        };
        let share = (steps - before as f64).min(1.0);
        let turn = (b.rotation * a.rotation.inverse()).scaled_axis();
        Isometry3::from_parts(
            a.translation.vector.lerp(&b.translation.vector, share).into(),
            UnitQuaternion::from_scaled_axis(share * turn) * a.rotation,
        )
    }

    /// Time of the last pose.
    fn end_secs(&self) -> f64 {
        self.start_secs + (self.poses.len() as f64 - 1.0) * STEP_SECS
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, technician::Person};

    #[test]
    fn a_track_runs_where_the_board_goes() {
        let scene = Scene { technician: Person::Shaky.params(), ..Scene::default_720p(3) };
        let hands = || Hands::before(&[(scene.clone(), Isometry3::identity())]).remove(0);
        let (followed, alone) = (hands(), hands());
        let mut track = Track::default();
        let mut farthest_m = 0.0_f64;
        for frame in 1..60 {
            // Pictures of 20 ms, 33 ms apart, then a long gap.
            let middle = f64::from(frame) / 30.0 + if frame > 40 { 10.0 } else { 0.0 };
            track.follow(&followed, middle - 0.01, middle + 0.01);
            for part in 0..=8 {
                let secs = middle - 0.01 + 0.0025 * f64::from(part);
                let pose = alone.pose_at(CaptureTime { nanos: (secs * 1e9).round() as u64 });
                let off = track.pose_at(secs).translation.vector - pose.translation.vector;
                farthest_m = farthest_m.max(off.norm());
            }
            assert!(track.poses.len() < 30, "{} poses are kept", track.poses.len());
        }
        assert!(farthest_m > 0.0 && farthest_m < 2e-6, "{farthest_m}");
    }
}
