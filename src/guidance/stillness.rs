//! Is the board held still, and which frame of the hold is the sharpest?
//!
//! A frame that was damaged on its way and still shows a board has corners that are somewhere else than a
//! moment before, while the others are not. Such a frame is no candidate; nor is the one after it.

use super::{GuidanceParams, Refusal, View};
use crate::{
    frame::{CaptureTime, FrameKind},
    geometry::{Corner, Homography},
    guidance::Role,
};

/// A corner may stray from the motion of the others by this much in any case, and by this many times as much
/// as half of them do. Of 54 with independent errors one strays 5 medians in one frame of a million.
const HARMLESS_STRAY_PX: f64 = 0.05;
const STRAY_MEDIANS: f64 = 5.0;

/// A view that would be taken, being held. The sharpest frame of the hold is the one that is taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// When the hold began.
    pub since: CaptureTime,
    /// What the view is for.
    pub role: Role,
    /// Sharpest view so far, of those whose corners moved together.
    pub best: View,
    /// Whether that is one: until there is any, it is the first.
    together: bool,
    /// Corners at the start: drift counts as motion even if it is slow.
    anchor: Vec<Corner>,
}

impl Hold {
    /// Starts with `view`; `together` as [`moved_rigidly`] has it.
    pub fn start(view: View, role: Role, together: bool) -> Self {
        let anchor = view.corners.clone();
        Self { since: view.captured_at, role, anchor, best: view, together }
    }

    /// Adds a frame of the hold.
    pub fn add(&mut self, view: View, role: Role, together: bool) {
        if together && (!self.together || view.blur_px < self.best.blur_px) {
            self.best = view;
            self.role = role;
            self.together = true;
        }
    }

    /// Whether the hold has lasted and has a view to take.
    pub fn complete(&self, now: CaptureTime, params: &GuidanceParams) -> bool {
        self.together && self.progress(now, params) >= 1.0
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

/// Whether the corners moved as those of one board between two frames: by a homography, and errors like each
/// other's. `false` if they have none.
pub fn moved_rigidly(before: &[Corner], after: &[Corner]) -> bool {
    let from: Vec<_> = before.iter().map(|corner| corner.px).collect();
    let Ok(motion) = Homography::fit(&from, after) else { return false };
    let stray_px = |(from, after): (_, &Corner)| {
        motion.map(from).map_or(f64::INFINITY, |moved| (after.px - moved).norm())
    };
    let mut strays_px: Vec<f64> = from.iter().zip(after).map(stray_px).collect();
    strays_px.sort_by(f64::total_cmp);
    let (median_px, worst_px) = (strays_px[strays_px.len() / 2], strays_px[strays_px.len() - 1]);
    worst_px <= HARMLESS_STRAY_PX.max(STRAY_MEDIANS * median_px)
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

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    /// Corners of a tipped board that has moved by `px`, each off by up to `noise_px`.
    fn corners(px: f64, noise_px: f64) -> Vec<Corner> {
        let corner = |number: usize| {
            let (x, y) = ((number % 9) as f64, (number / 9) as f64);
            let depth = 1.0 + (0.04 + 1e-4 * px) * x;
            let noise = |seed: usize| noise_px * ((number * seed % 23) as f64 / 11.0 - 1.0);
            let at = Point2::new(
                100.0 + px + 50.0 * x / depth + noise(7),
                90.0 - 0.3 * px + 50.0 * y / depth + noise(13),
            );
            Corner::isotropic(at, 0.05)
        };
        (0..54).map(corner).collect()
    }

    #[test]
    fn one_corner_that_strays_is_told_from_motion_and_noise() {
        for (noise_px, off_px) in [(0.0, 0.1), (0.02, 0.3), (0.1, 1.0)] {
            let before = corners(0.0, 0.0);
            let mut after = corners(1.5, noise_px);
            assert!(moved_rigidly(&before, &after), "noise {noise_px} px");
            after[23].px.x += off_px;
            assert!(!moved_rigidly(&before, &after), "noise {noise_px} px, off {off_px} px");
        }
    }

    #[test]
    fn corners_without_a_motion_did_not_move_together() {
        let board = corners(0.0, 0.0);
        assert!(!moved_rigidly(&board, &board[..53]));
        assert!(!moved_rigidly(&board[..3], &board[..3]));
        assert!(!moved_rigidly(&[], &[]));
    }
}
