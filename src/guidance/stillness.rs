//! Is the board held still, and which frame of the hold is the sharpest?

use super::{GuidanceParams, Refusal, View};
use crate::{
    frame::{CaptureTime, FrameKind},
    geometry::Corner,
    guidance::Role,
};

/// A view that would be taken, being held. The sharpest frame of the hold is the one that is taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// When the hold began.
    pub since: CaptureTime,
    /// What the view is for.
    pub role: Role,
    /// Sharpest view so far.
    pub best: View,
    /// Corners at the start: drift counts as motion even if it is slow.
    anchor: Vec<Corner>,
}

impl Hold {
    /// Starts with `view`.
    pub fn start(view: View, role: Role) -> Self {
        Self { since: view.captured_at, role, anchor: view.corners.clone(), best: view }
    }

    /// Adds a frame of the hold.
    pub fn add(&mut self, view: View, role: Role) {
        if view.blur_px < self.best.blur_px {
            self.best = view;
            self.role = role;
        }
    }

    /// Whether `corners` are still where the hold began, within what a still hand does.
    pub fn covers(&self, corners: &[Corner], width_px: f64) -> bool {
        largest_step_px(&self.anchor, corners) <= 0.012 * width_px
    }

    /// Share of the hold that has passed at `now`, 0 to 1.
    pub fn progress(&self, now: CaptureTime, params: &GuidanceParams) -> f64 {
        (now.secs_since(self.since) / params.hold_secs).clamp(0.0, 1.0)
    }
}

/// Distance of the corner that moved farthest.
fn largest_step_px(before: &[Corner], after: &[Corner]) -> f64 {
    before
        .iter()
        .zip(after)
        .map(|(before, after)| (after.px - before.px).norm())
        .fold(0.0, f64::max)
}

/// Speed of the fastest corner between two frames. `None` without an earlier frame, or if it is too long
/// ago to say anything about motion in between.
pub fn speed_px_per_s(
    before: Option<(CaptureTime, &[Corner])>,
    now: (CaptureTime, &[Corner]),
) -> Option<f64> {
    let (then, corners) = before?;
    let secs = now.0.secs_since(then);
    (secs > 0.0 && secs < 0.5).then(|| largest_step_px(corners, now.1) / secs)
}

/// Whether the board stands still between two frames.
///
/// # Errors
///
/// [`Refusal::Moving`] with the fastest corner's speed; infinite if there is no earlier frame to
/// compare with. A [`FrameKind::Photograph`] is still by itself.
pub fn still(
    kind: FrameKind,
    before: Option<(CaptureTime, &[Corner])>,
    now: (CaptureTime, &[Corner]),
    width_px: f64,
    params: &GuidanceParams,
) -> Result<(), Refusal> {
    if kind == FrameKind::Photograph {
        return Ok(());
    }
    let wanted_px_per_s = params.still_widths_per_sec * width_px;
    let speed_px_per_s = speed_px_per_s(before, now).unwrap_or(f64::MAX);
    if speed_px_per_s <= wanted_px_per_s {
        Ok(())
    } else {
        Err(Refusal::Moving { speed_px_per_s, wanted_px_per_s })
    }
}
