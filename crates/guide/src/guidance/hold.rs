//! Hold: the time for which a view worth taking is held still, and the choice of its frame.

use super::{hand_motion::Velocity, independence::Role, view::View};
use boresight_geometry::{Corner, frame::CaptureTime};

/// Largest displacement of corners from the best frame's, as a share of the picture's width: farther is another pose.
const SAME_POSE_WIDTHS: f64 = 0.025;
/// A frame takes the best one's place if it tells this many times as much: the frames of a board at rest tell alike.
const MORE: f64 = 1.05;
/// Pace at which a hold fades, as a share of the pace at which it grows.
const FADING: f64 = 0.5;
/// Longest time that a frame counts for, even after a longer gap.
const LONGEST_STEP_SECS: f64 = 0.5;

/// A view that is held. Its progress grows with every good frame and fades with every other one, so that a
/// moment's unrest costs a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// The frame to take as things stand.
    pub best: HeldFrame,
    /// Time for which the frames have been good, less what has faded.
    held_secs: f64,
    /// Time at which the newest frame was judged.
    judged_at: CaptureTime,
}

/// A frame of a hold.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldFrame {
    /// The frame's measurement.
    pub view: View,
    /// Its corners as seen, sheared by a rolling shutter if the board moves.
    pub seen: Vec<Corner>,
    /// How the board moves in it.
    pub velocity: Option<Velocity>,
    /// What the view is for.
    pub role: Role,
    /// File name of its picture, or empty.
    pub name: String,
    /// True if the corners moved rigidly since the frame before.
    pub is_rigid: bool,
    /// What it tells: see [`Knowledge::gain_by_the_end`](super::Knowledge::gain_by_the_end).
    pub gain: f64,
}

impl Hold {
    /// Starts with `first`, which is taken if no better frame follows.
    pub fn start(first: HeldFrame) -> Self {
        let judged_at = first.view.captured_at;
        Self { best: first, held_secs: 0.0, judged_at }
    }

    /// Adds a frame of the hold: of those that moved rigidly, one that tells clearly more becomes the best one.
    pub fn add(&mut self, frame: HeldFrame) {
        self.held_secs += self.step_secs(frame.view.captured_at);
        if frame.is_rigid && (!self.best.is_rigid || frame.gain > MORE * self.best.gain) {
            self.best = frame;
        }
    }

    /// Notes a frame that isn't good. Returns whether anything of the hold is left.
    pub(crate) fn fade(&mut self, now: CaptureTime) -> bool {
        self.held_secs -= FADING * self.step_secs(now);
        self.held_secs > 0.0
    }

    fn step_secs(&mut self, now: CaptureTime) -> f64 {
        let secs = now.secs_since(self.judged_at).clamp(0.0, LONGEST_STEP_SECS);
        self.judged_at = now;
        secs
    }

    /// True if the hold has lasted for `wanted_secs` and has a frame to take. The frame after that shows how the board moved.
    pub(crate) fn is_complete(&self, wanted_secs: f64) -> bool {
        let is_followed = self.best.view.captured_at < self.judged_at;
        self.best.is_rigid && is_followed && self.progress(wanted_secs) >= 1.0
    }

    /// True if `corners` show the pose of the best frame, in a picture of that width.
    pub fn covers(&self, corners: &[Corner], width_px: f64) -> bool {
        let best = &self.best.view.corners;
        let far = |(best, now): (&Corner, &Corner)| {
            let are_seen = best.is_seen() && now.is_seen();
            are_seen && (now.px - best.px).norm() > SAME_POSE_WIDTHS * width_px
        };
        best.len() == corners.len() && !best.iter().zip(corners).any(far)
    }

    /// Share of the hold that has passed, 0 to 1.
    pub fn progress(&self, wanted_secs: f64) -> f64 {
        if wanted_secs > 0.0 { (self.held_secs / wanted_secs).clamp(0.0, 1.0) } else { 1.0 }
    }
}
