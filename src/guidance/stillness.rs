//! Is the board held still, and which frame of the hold is the sharpest?
//!
//! Motion is the step of the fastest corner over one frame interval, as long as noise is small against the
//! speed that counts as still. Where it isn't, because frames come fast or corners are uncertain, motion is that
//! of the board as a whole: a homography between two frames' corners, less what their covariances explain of
//! it, with the earlier frame as far back as needed, up to a tenth of a second. So a board at rest is still at 2
//! and at 240 frames per second.
//!
//! A damaged frame that still shows a board has corners that moved although the others didn't. Such a frame is
//! no candidate for the view to take; nor is the one after it.

use std::collections::VecDeque;

use nalgebra::{Point2, SMatrix};

use super::{independence::Role, params::GuidanceParams, refusal::Refusal, view::View};
use crate::{
    frame::{CaptureTime, FrameKind},
    geometry::{Corner, Homography},
};

/// A corner may stray from the common motion by this much in any case …
const HARMLESS_STRAY_PX: f64 = 0.05;
/// … and by this many medians of all corners' strays. Of 54 corners with independent errors, one strays 5
/// medians in one frame of a million.
const STRAY_MEDIANS: f64 = 5.0;
/// Time after which noise no longer matters: a comparison doesn't reach farther back to find less of it.
const LONG_ENOUGH_SECS: f64 = 0.1;
/// Noise that looks slower than this share of the fastest accepted speed is harmless.
const NOISE_SHARE: f64 = 0.2;
/// An earlier frame says nothing about motion since then if it is older: slower than one frame per second.
const TOO_LONG_SECS: f64 = 1.05;
/// Share of the picture's width that corners may drift during a hold.
const DRIFT_WIDTHS: f64 = 0.012;

/// Corners of the newest frames with a board, as far back as motion is judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionWindow {
    /// Oldest first.
    frames: VecDeque<(CaptureTime, Vec<Corner>)>,
}

/// How the board moved up to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Speed of the fastest corner.
    pub speed_px_per_s: f64,
    /// Whether all corners moved as those of one board since the frame before: see [`moved_rigidly`].
    pub is_rigid: bool,
}

impl MotionWindow {
    /// Forgets all frames: what comes next can't be compared with them.
    pub fn clear(&mut self) {
        self.frames.clear();
    }

    /// Adds the corners of the newest frame.
    pub fn push(&mut self, captured_at: CaptureTime, corners: &[Corner]) {
        // Times that don't grow are of another clock.
        if self.frames.back().is_some_and(|(last, _)| captured_at <= *last) {
            self.frames.clear();
        }
        // One frame that is old enough is needed; older ones are not.
        let is_old = |frame: &(CaptureTime, _)| captured_at.secs_since(frame.0) >= LONG_ENOUGH_SECS;
        let mut reused = Vec::new();
        while self.frames.get(1).is_some_and(is_old) {
            reused = self.frames.pop_front().map_or(reused, |(_, corners)| corners);
        }
        reused.clear();
        reused.extend_from_slice(corners);
        self.frames.push_back((captured_at, reused));
    }

    /// How the board moved up to a frame that has not been added yet. `limit_px_per_s` is the speed that noise
    /// must not be mistaken for.
    ///
    /// `None` without an earlier frame, if it is too long ago, or if the corners are another board's.
    pub fn motion(
        &self,
        now: CaptureTime,
        corners: &[Corner],
        limit_px_per_s: f64,
    ) -> Option<Motion> {
        let (then, before) = self.frames.back()?;
        let secs = now.secs_since(*then);
        if !(secs > 0.0 && secs < TOO_LONG_SECS) {
            return None;
        }
        if before.len() != corners.len() {
            return None;
        }
        let harmless_px_per_s = NOISE_SHARE * limit_px_per_s;
        let step = CommonStep::between(before, corners);
        let is_rigid = step.is_some_and(|step| step.is_rigid);
        if corner_noise_px(before, corners) <= harmless_px_per_s * secs {
            let speed_px_per_s = largest_step_px(before, corners) / secs;
            return Some(Motion { speed_px_per_s, is_rigid });
        }
        let enough_secs = (step?.noise_px / harmless_px_per_s).clamp(0.0, LONG_ENOUGH_SECS);
        let usable =
            self.frames.iter().rev().take_while(|(then, _)| now.secs_since(*then) < TOO_LONG_SECS);
        let long = usable.clone().find(|(then, _)| now.secs_since(*then) >= enough_secs);
        let (then, before) = long.or(usable.last())?;
        let fastest_px = CommonStep::between(before, corners)?.fastest_px;
        Some(Motion { speed_px_per_s: fastest_px / now.secs_since(*then), is_rigid })
    }
}

/// The common motion of a board's corners between two frames.
#[derive(Clone, Copy)]
struct CommonStep {
    /// How far the fastest corner moved, less what noise explains.
    fastest_px: f64,
    /// Largest standard deviation of a corner's motion.
    noise_px: f64,
    /// See [`moved_rigidly`].
    is_rigid: bool,
}

impl CommonStep {
    /// `None` if no homography maps the corners of one frame to those of the other.
    fn between(before: &[Corner], after: &[Corner]) -> Option<Self> {
        if before.len() != after.len() {
            return None;
        }
        let from: Vec<_> = before.iter().map(|corner| corner.px).collect();
        // Both ends of a corner's step are uncertain.
        let to: Vec<Corner> = before
            .iter()
            .zip(after)
            .map(|(before, after)| Corner {
                px: after.px,
                covariance_px2: before.covariance_px2 + after.covariance_px2,
            })
            .collect();
        let motion = Homography::fit(&from, &to).ok()?;
        let (mut farthest_px2, mut noise_px2) = (0.0_f64, 0.0_f64);
        for from in &from {
            let step_px2 = (motion.map(from)? - from).norm_squared();
            let variance_px2 = variance_px2(&motion, from)?;
            farthest_px2 = farthest_px2.max(step_px2 - variance_px2);
            noise_px2 = noise_px2.max(variance_px2);
        }
        let is_rigid = strays_little(&motion, &from, after);
        Some(Self { fastest_px: farthest_px2.sqrt(), noise_px: noise_px2.sqrt(), is_rigid })
    }
}

/// Whether the corners moved as those of one board between two frames: by a homography, with errors like each
/// other's. `false` if no homography fits or the frames have different numbers of corners.
pub fn moved_rigidly(before: &[Corner], after: &[Corner]) -> bool {
    CommonStep::between(before, after).is_some_and(|step| step.is_rigid)
}

/// Trace of the covariance of where `motion` maps the point `from`; `None` on its vanishing line.
fn variance_px2(motion: &Homography, from: &Point2<f64>) -> Option<f64> {
    let to = motion.map(from)?;
    let scale = (motion.image_from_board().row(2) * from.to_homogeneous()).x;
    let (x, y) = (from.x / scale, from.y / scale);
    let by_entries = SMatrix::<f64, 2, 9>::from_row_slice(&[
        x,
        y,
        1.0 / scale,
        0.0,
        0.0,
        0.0,
        -to.x * x,
        -to.x * y,
        -to.x / scale,
        0.0,
        0.0,
        0.0,
        x,
        y,
        1.0 / scale,
        -to.y * x,
        -to.y * y,
        -to.y / scale,
    ]);
    Some((by_entries * motion.covariance() * by_entries.transpose()).trace().max(0.0))
}

fn strays_little(motion: &Homography, from: &[Point2<f64>], after: &[Corner]) -> bool {
    let stray_px = |(from, after): (_, &Corner)| {
        motion.map(from).map_or(f64::INFINITY, |moved| (after.px - moved).norm())
    };
    let mut strays_px: Vec<f64> = from.iter().zip(after).map(stray_px).collect();
    strays_px.sort_by(f64::total_cmp);
    let (median_px, worst_px) = (strays_px[strays_px.len() / 2], strays_px[strays_px.len() - 1]);
    worst_px <= HARMLESS_STRAY_PX.max(STRAY_MEDIANS * median_px)
}

/// Speed of a corner that counts as still, in a picture of that width.
pub fn still_limit_px_per_s(width_px: f64, params: &GuidanceParams) -> f64 {
    params.still_widths_per_sec * width_px
}

/// Whether the board stands still, from its [`MotionWindow::motion`]. A [`FrameKind::Photograph`] is still by
/// definition.
///
/// # Errors
///
/// [`Refusal::Moving`] with the fastest corner's speed, `None` without an earlier frame to compare with.
pub fn still(
    kind: FrameKind,
    motion: Option<&Motion>,
    width_px: f64,
    params: &GuidanceParams,
) -> Result<(), Refusal> {
    let wanted_px_per_s = still_limit_px_per_s(width_px, params);
    let speed_px_per_s = motion.map(|motion| motion.speed_px_per_s);
    let is_still = kind == FrameKind::Photograph
        || speed_px_per_s.is_some_and(|speed_px_per_s| speed_px_per_s <= wanted_px_per_s);
    if is_still { Ok(()) } else { Err(Refusal::Moving { speed_px_per_s, wanted_px_per_s }) }
}

/// A view worth taking, held still. The sharpest frame of the hold is the one taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// When the hold began.
    pub since: CaptureTime,
    /// The frame to take as things stand.
    pub best: HeldFrame,
    /// Corners at the start: drift counts as motion even if it is slow.
    anchor: Vec<Corner>,
}

/// One frame of a hold.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldFrame {
    /// What it measures.
    pub view: View,
    /// What the view is for.
    pub role: Role,
    /// File name of its picture, or empty.
    pub name: String,
    /// Whether its corners moved rigidly since the frame before.
    pub is_rigid: bool,
}

impl Hold {
    /// Starts with `first`, which is taken if no better frame follows.
    pub fn start(first: HeldFrame) -> Self {
        let anchor = first.view.corners.clone();
        Self { since: first.view.captured_at, best: first, anchor }
    }

    /// Adds a frame of the hold: the sharpest of those that moved rigidly becomes the best one.
    pub fn add(&mut self, frame: HeldFrame) {
        let is_sharper = frame.view.blur_px < self.best.view.blur_px;
        if frame.is_rigid && (!self.best.is_rigid || is_sharper) {
            self.best = frame;
        }
    }

    /// Whether the hold has lasted and has a frame to take.
    pub fn complete(&self, now: CaptureTime, params: &GuidanceParams) -> bool {
        self.best.is_rigid && self.progress(now, params) >= 1.0
    }

    /// Whether `corners` are still where the hold began, in a picture of that width.
    pub fn covers(&self, corners: &[Corner], width_px: f64) -> bool {
        largest_step_px(&self.anchor, corners) <= DRIFT_WIDTHS * width_px
    }

    /// Share of the hold that has passed at `now`, 0 to 1.
    pub fn progress(&self, now: CaptureTime, params: &GuidanceParams) -> f64 {
        (now.secs_since(self.since) / params.hold_secs).clamp(0.0, 1.0)
    }
}

/// Largest standard deviation of a corner's step between two frames.
fn corner_noise_px(before: &[Corner], after: &[Corner]) -> f64 {
    before
        .iter()
        .zip(after)
        .map(|(before, after)| (before.covariance_px2 + after.covariance_px2).trace())
        .fold(0.0, f64::max)
        .sqrt()
}

/// Distance of the corner that moved farthest.
fn largest_step_px(before: &[Corner], after: &[Corner]) -> f64 {
    before
        .iter()
        .zip(after)
        .map(|(before, after)| (after.px - before.px).norm())
        .fold(0.0, f64::max)
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

    #[test]
    fn the_window_keeps_as_many_frames_as_motion_needs() {
        for (rate_hz, most) in [(1, 1), (30, 5), (240, 26)] {
            let mut window = MotionWindow::default();
            for number in 0..1000 {
                let captured_at = CaptureTime { nanos: 1_000_000_000 * number / rate_hz };
                window.push(captured_at, &corners(0.0, 0.0));
            }
            let (first, last) = (window.frames[0].0, window.frames[window.frames.len() - 1].0);
            assert!(window.frames.len() <= most + 1, "{} frames", window.frames.len());
            assert!(last.secs_since(first) >= LONG_ENOUGH_SECS, "{rate_hz} Hz");
        }
    }

    #[test]
    fn the_speed_is_that_of_the_motion_and_not_of_the_noise() {
        let mut window = MotionWindow::default();
        let at = |number: u64| CaptureTime { nanos: 1_000_000_000 * number / 60 };
        for number in 0..12 {
            window.push(at(number), &corners(0.5 * number as f64, 0.03));
        }
        let motion = window.motion(at(12), &corners(6.0, -0.03), 12.8).expect("frames to compare");
        // 30 px/s across and 9 px/s up; the far end follows more slowly.
        assert!((30.0..34.0).contains(&motion.speed_px_per_s), "{motion:?}");
        assert!(motion.is_rigid);
        assert_eq!(window.motion(at(100), &corners(6.0, 0.0), 12.8), None, "too long ago");
        assert_eq!(window.motion(at(11), &corners(6.0, 0.0), 12.8), None, "not later");
        assert_eq!(window.motion(at(12), &corners(6.0, 0.0)[..53], 12.8), None, "another board");
    }
}
