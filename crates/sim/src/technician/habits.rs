//! Habits difficult for a guide: not looking, walking away.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{CueKind, TechnicianParams, time::after};
use crate::scene::Scene;
use boresight_geometry::{
    Camera,
    frame::{CaptureTime, ImageSize},
};

/// Range of times between changes of the pose by a person who doesn't look, in seconds.
const WANDERS_SECS: std::ops::Range<f64> = 1.5..3.0;
/// Range of start times of walking away, in seconds.
const LEAVES_AT_SECS: std::ops::Range<f64> = 3.0..12.0;
/// Largest tilt of a board shown at random, in radians.
const WANDERING_TILT_RAD: f64 = 0.7;
/// Range of the grid's width, relative to the picture's.
const WANDERING_WIDTHS: std::ops::Range<f64> = 0.3..0.7;
/// Largest distance of the grid's middle from the picture's, relative to the picture's width and
/// height.
const WANDERING_OFFSET: (f64, f64) = (0.12, 0.08);

/// Pending acts by habit.
#[derive(Clone, Debug)]
pub(super) struct Habits {
    rng: ChaCha8Rng,
    params: TechnicianParams,
    camera: Camera,
    image_size: ImageSize,
    /// Width of the board's grid of corners.
    grid_m: f64,
    /// Time of the next change of pose.
    wander: Option<CaptureTime>,
    /// Begin and end of the walk, until over.
    walk: Option<(CaptureTime, CaptureTime)>,
    is_away: bool,
}

/// Act by habit.
#[derive(Clone, Copy, Debug)]
pub(super) enum Act {
    /// Walks away until the given time.
    Leave(CaptureTime),
    /// Returns, and follows the guidance.
    Return,
    /// Shows the board at the given pose.
    Show(Isometry3<f64>),
}

impl Habits {
    pub(super) fn new(mut rng: ChaCha8Rng, scene: &Scene) -> Self {
        let params = scene.technician;
        let start = CaptureTime { nanos: 0 };
        let wander = after(start, rng.random_range(WANDERS_SECS));
        let leave = after(start, rng.random_range(LEAVES_AT_SECS));
        Self {
            rng,
            params,
            camera: scene.camera,
            image_size: scene.image_size,
            grid_m: 2.0 * scene.board.reach_m()[0],
            wander: params.wanders.then_some(wander),
            walk: (params.leaves_for_secs > 0.0)
                .then(|| (leave, after(leave, params.leaves_for_secs))),
            is_away: false,
        }
    }

    /// Time of the next act by habit.
    pub(super) fn due(&self) -> Option<CaptureTime> {
        match self.walk {
            Some((_, end)) if self.is_away => Some(end),
            Some((start, _)) => Some(self.wander.map_or(start, |wander| wander.min(start))),
            None => self.wander,
        }
    }

    /// True from leaving to coming back.
    pub(super) fn is_away(&self) -> bool {
        self.is_away
    }

    /// Ends all habits.
    pub(super) fn end(&mut self) {
        (self.wander, self.walk, self.is_away) = (None, None, false);
    }

    /// True for an unseen or ignored cue.
    pub(super) fn ignore(&self, cue: &CueKind) -> bool {
        match cue {
            CueKind::Show { .. } => self.params.wanders || self.params.hears_only,
            CueKind::Sentence { .. } => self.params.wanders,
            CueKind::Taken | CueKind::Finished => false,
        }
    }

    /// Act due at `now`.
    pub(super) fn act(&mut self, now: CaptureTime) -> Act {
        match self.walk {
            Some((_, end)) if self.is_away => {
                (self.walk, self.is_away) = (None, false);
                self.wander = self.wander.map(|_| end);
                Act::Return
            }
            Some((start, end)) if start <= now => {
                self.is_away = true;
                Act::Leave(end)
            }
            _ => {
                self.wander = Some(after(now, self.rng.random_range(WANDERS_SECS)));
                Act::Show(self.pose_that_comes_to_mind())
            }
        }
    }

    fn pose_that_comes_to_mind(&mut self) -> Isometry3<f64> {
        let rng = &mut self.rng;
        let size_px =
            Vector2::new(f64::from(self.image_size.width_px), f64::from(self.image_size.height_px));
        let grid_px = rng.random_range(WANDERING_WIDTHS) * size_px.x;
        let depth_m = self.camera.f_px.x * self.grid_m / grid_px.max(1.0);
        let (most_x, most_y) = WANDERING_OFFSET;
        let off_px = Vector2::new(
            rng.random_range(-most_x..most_x) * size_px.x,
            rng.random_range(-most_y..most_y) * size_px.y,
        );
        let middle_px = self.image_size.centre_px() + off_px - self.camera.pp_px;
        let ray = middle_px.component_div(&self.camera.f_px);
        let (sin, cos) = libm::sincos(rng.random_range(0.0..std::f64::consts::TAU));
        let tilt_rad = rng.random_range(0.0..WANDERING_TILT_RAD);
        Isometry3::from_parts(
            Translation3::new(ray.x * depth_m, ray.y * depth_m, depth_m),
            UnitQuaternion::from_scaled_axis(tilt_rad * Vector3::new(sin, -cos, 0.0)),
        )
    }
}
