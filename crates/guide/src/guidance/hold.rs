//! Hold: the time of holding an acceptable view still, and the choice of its frame.

use super::{hand_motion::Velocity, independence::Role, view::View};
use boresight_geometry::{Corner, frame::CaptureTime};

/// Largest displacement of corners from the best frame's, as a share of the picture's width, within
/// a pose.
const SAME_POSE_WIDTHS: f64 = 0.025;
/// Gain relative to the best frame's, above which a frame replaces the best: frames of a board at
/// rest are alike.
const MORE: f64 = 1.05;
/// Pace at which a hold fades, as a share of the pace at which it grows.
const FADING: f64 = 0.5;
/// Longest time credited to a frame, even after a longer gap.
pub(crate) const LONGEST_STEP_SECS: f64 = 0.5;

/// A held view. Progress grows with every good frame and fades with every other one, so a moment's
/// unrest costs a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// Frame to be taken so far.
    pub best: HeldFrame,
    /// Time of good frames, less the faded time.
    held_secs: f64,
    /// Time of the newest judged frame.
    judged_at: CaptureTime,
}

/// A frame of a hold.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldFrame {
    /// The frame's measurement.
    pub view: View,
    /// Corners as seen, sheared by a rolling shutter if the board moves.
    pub seen: Vec<Corner>,
    /// Motion of the board within the frame.
    pub velocity: Option<Velocity>,
    /// Role of the view.
    pub role: Role,
    /// File name of the picture, or empty.
    pub name: String,
    /// True if the corners moved rigidly since the frame before.
    pub is_rigid: bool,
    /// Gain of the view: see [`Knowledge::gain_by_the_end`](super::Knowledge::gain_by_the_end).
    pub gain: f64,
}

impl Hold {
    /// Starts with `first`, the frame taken unless a better frame follows.
    pub fn start(first: HeldFrame) -> Self {
        let judged_at = first.view.captured_at;
        Self { best: first, held_secs: 0.0, judged_at }
    }

    /// Adds a frame of the hold. Of the frames moved rigidly, one with clearly more gain becomes
    /// the best.
    pub fn add(&mut self, frame: HeldFrame) {
        self.held_secs += self.step_secs(frame.view.captured_at);
        if frame.is_rigid && (!self.best.is_rigid || frame.gain > MORE * self.best.gain) {
            self.best = frame;
        }
    }

    /// Notes a frame outside the hold. Returns true if anything of the hold is left.
    pub(crate) fn fade(&mut self, now: CaptureTime) -> bool {
        self.held_secs -= FADING * self.step_secs(now);
        self.held_secs > 0.0
    }

    fn step_secs(&mut self, now: CaptureTime) -> f64 {
        let secs = now.secs_since(self.judged_at).clamp(0.0, LONGEST_STEP_SECS);
        self.judged_at = now;
        secs
    }

    /// True if the hold has lasted for `wanted_secs` and has a frame to take. The next frame shows
    /// how the board moved.
    pub(crate) fn is_complete(&self, wanted_secs: f64) -> bool {
        let is_followed = self.best.view.captured_at < self.judged_at;
        self.best.is_rigid && is_followed && self.progress(wanted_secs) >= 1.0
    }

    /// True if `corners` show the pose of the best frame, in a picture `width_px` wide.
    pub fn covers(&self, corners: &[Corner], width_px: f64) -> bool {
        let best = &self.best.view.corners;
        let far = |(best, now): (&Corner, &Corner)| {
            let are_seen = best.is_seen() && now.is_seen();
            are_seen && (now.px - best.px).norm() > SAME_POSE_WIDTHS * width_px
        };
        best.len() == corners.len() && !best.iter().zip(corners).any(far)
    }

    /// Share of the hold passed, 0 to 1.
    pub fn progress(&self, wanted_secs: f64) -> f64 {
        if wanted_secs > 0.0 { (self.held_secs / wanted_secs).clamp(0.0, 1.0) } else { 1.0 }
    }
}
