//! Motion of the board up to a frame.
//!
//! The board moves as a whole: its motion is a homography between two frames' corners, less the
//! part explained by noise. Motion is judged over the last frame interval and over a tenth of a
//! second; the faster counts, so neither a tremor with a period of a tenth of a second nor a slow
//! sway hides. So a board at rest is still at 2 and at 240 frames per second, at any noise of
//! single corners.
//!
//! In a damaged frame with a board, some corners moved although the others didn't. Such a frame is
//! no candidate for the view to take; nor is the one after it.

use std::collections::VecDeque;

use nalgebra::{Point2, SMatrix};

use super::hand_motion::{HandMotion, Velocity};
use boresight_geometry::{Corner, Homography, frame::CaptureTime};

/// Harmless deviation of a corner from the common motion …
const HARMLESS_STRAY_PX: f64 = 0.05;
/// … and the harmless multiple of all corners' median. Of 54 corners with independent errors, one
/// strays 5 medians in one frame of a million.
const STRAY_MEDIANS: f64 = 5.0;
/// Least time to judge motion over, with frames at close intervals.
const LONG_ENOUGH_SECS: f64 = 0.1;
/// Age beyond which an earlier frame says nothing about motion since then: slower than a frame per
/// second.
pub(super) const TOO_LONG_SECS: f64 = 1.05;

/// Speed limit of a calm hand, in picture widths per second. Shown to a person; limits nothing.
pub const HOLD_WIDTHS_PER_SEC: f64 = 0.03;

/// Longest step to measure noise from.
const LONGEST_NOISE_STEP_PX: f64 = 0.25;

/// Corners of the newest frames with a board, as far back as motion is judged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionWindow {
    /// Frames, the oldest first.
    frames: VecDeque<(CaptureTime, Vec<Corner>)>,
    hand: HandMotion,
}

/// Motion of the board up to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Root mean square speed of the corners, less the part explained by noise: over the last frame
    /// interval or over a tenth of a second, the larger of the two.
    pub speed_px_per_s: f64,
    /// True if all corners moved together, as of a rigid board, since the frame before.
    pub is_rigid: bool,
    /// Residual of the corners' steps since the frame before, without the common motion.
    pub scatter: Scatter,
}

/// Squared residuals of corners from the board's common motion between frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// Sum over corners and axes.
    pub sum_px2: f64,
    /// Degrees of freedom: two a corner, less the eight of a homography.
    pub freedom: f64,
}

impl Scatter {
    /// Adds the scatter between another two frames. Equal frames are copies, and add nothing.
    pub fn add(&mut self, other: Self) {
        if other.sum_px2 <= 0.0 {
            return;
        }
        self.sum_px2 += other.sum_px2;
        self.freedom += other.freedom;
    }

    /// Standard deviation per axis of a corner in a frame. Both ends of a step have it, so a step
    /// has twice its variance. `None` with fewer than `least` degrees of freedom.
    pub(crate) fn corner_sigma_px(&self, least: f64) -> Option<f64> {
        (self.freedom >= least.max(1.0)).then(|| (0.5 * self.sum_px2 / self.freedom).sqrt())
    }
}

impl MotionWindow {
    /// Forgets all frames: the next frame can't be compared with them.
    pub fn clear(&mut self) {
        self.frames.clear();
        self.hand.clear();
    }

    /// Adds the corners of the newest frame.
    pub fn push(&mut self, captured_at: CaptureTime, corners: &[Corner]) {
        // Timestamps that don't increase come from a restarted clock.
        if self.frames.back().is_some_and(|(last, _)| captured_at <= *last) {
            self.clear();
        }
        self.hand.push(captured_at, self.frames.back().map(|(_, last)| last.as_slice()), corners);
        // One old enough frame is needed; older ones are not.
        let is_old = |frame: &(CaptureTime, _)| captured_at.secs_since(frame.0) >= LONG_ENOUGH_SECS;
        let mut reused = Vec::new();
        while self.frames.get(1).is_some_and(is_old) {
            reused = self.frames.pop_front().map_or(reused, |(_, corners)| corners);
        }
        reused.clear();
        reused.extend_from_slice(corners);
        self.frames.push_back((captured_at, reused));
    }

    /// See [`HandMotion::velocity`].
    pub fn velocity(&self, at: CaptureTime) -> Option<Velocity> {
        self.hand.velocity(at)
    }

    /// See [`HandMotion::velocity_foreseen`].
    pub fn velocity_foreseen(&self, at: CaptureTime) -> Option<Velocity> {
        self.hand.velocity_foreseen(at)
    }

    /// The second newest frame.
    pub(crate) fn before_newest(&self) -> Option<(CaptureTime, &[Corner])> {
        let (time, corners) = self.frames.get(self.frames.len().checked_sub(2)?)?;
        Some((*time, corners))
    }

    /// Motion of the board up to a frame not yet added.
    ///
    /// `None` without an earlier frame, if it is too long ago, if the corners are another board's,
    /// or if no homography maps the one frame's to the other's.
    pub fn motion(&self, now: CaptureTime, corners: &[Corner]) -> Option<Motion> {
        let (then, before) = self.frames.back()?;
        let since_secs = now.secs_since(*then);
        if !(since_secs > 0.0 && since_secs < TOO_LONG_SECS) {
            return None;
        }
        let step = CommonStep::between(before, corners)?;
        let mut speed_px_per_s = step.common_px / since_secs;
        let old_enough = |(then, _): &&(CaptureTime, _)| now.secs_since(*then) >= LONG_ENOUGH_SECS;
        let recent = |(then, _): &&(CaptureTime, _)| now.secs_since(*then) < TOO_LONG_SECS;
        let long = self.frames.iter().rev().take_while(recent).find(old_enough);
        if let Some((long_ago, at_that_time)) = long
            && long_ago != then
        {
            let long_step = CommonStep::between(at_that_time, corners)?;
            let speed = long_step.common_px / now.secs_since(*long_ago);
            speed_px_per_s = speed_px_per_s.max(speed);
        }
        Some(Motion { speed_px_per_s, is_rigid: step.is_rigid, scatter: step.scatter })
    }
}

/// The common motion of a board's corners between two frames.
#[derive(Clone, Copy)]
struct CommonStep {
    /// Root mean square step of the corners, less the part explained by noise.
    common_px: f64,
    is_rigid: bool,
    scatter: Scatter,
}

impl CommonStep {
    /// Fits the common step; `None` if no homography maps the corners of either frame to the
    /// other's.
    fn between(before: &[Corner], after: &[Corner]) -> Option<Self> {
        if before.len() != after.len() {
            return None;
        }
        let in_both = || {
            before.iter().zip(after).filter(|(before, after)| before.is_seen() && after.is_seen())
        };
        let from: Vec<_> = in_both().map(|(before, _)| before.px).collect();
        // Both ends of a corner's step are uncertain.
        let to: Vec<Corner> = in_both()
            .map(|(before, after)| {
                Corner::new(after.px, before.covariance_px2 + after.covariance_px2)
            })
            .collect();
        let motion = Homography::fit(&from, &to).ok()?;
        let (mut sum_px2, mut stray_px2, mut claimed_px2) = (0.0, 0.0, 0.0);
        for (from, to) in from.iter().zip(&to) {
            let moved = motion.map(from)?;
            sum_px2 += (moved - from).norm_squared();
            stray_px2 += (to.px - moved).norm_squared();
            claimed_px2 += to.covariance_px2.trace();
        }
        let freedom = (2.0 * from.len() as f64 - 8.0).max(0.0);
        // Under distortion, a longer step is more than a homography.
        let is_short = sum_px2 <= LONGEST_NOISE_STEP_PX.powi(2) * from.len() as f64;
        let scatter =
            if is_short { Scatter { sum_px2: stray_px2, freedom } } else { Scatter::default() };
        // A camera may be noisier than the covariances of its corners.
        let expected_px2 = claimed_px2 * freedom / (2.0 * from.len() as f64);
        let excess = if expected_px2 > 0.0 { (stray_px2 / expected_px2).max(1.0) } else { 1.0 };
        let mut noise_px2 = 0.0;
        for from in &from {
            noise_px2 += excess * variance_px2(&motion, from)?;
        }
        let count = from.len() as f64;
        Some(Self {
            common_px: ((sum_px2 - noise_px2) / count).max(0.0).sqrt(),
            is_rigid: moved_rigidly(&motion, &from, &to),
            scatter,
        })
    }
}

/// Trace of the covariance of the image of the point `from` under `motion`; `None` on the vanishing
/// line.
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

fn moved_rigidly(motion: &Homography, from: &[Point2<f64>], after: &[Corner]) -> bool {
    let stray_px = |(from, after): (_, &Corner)| {
        motion.map(from).map_or(f64::INFINITY, |moved| (after.px - moved).norm())
    };
    let mut strays_px: Vec<f64> = from.iter().zip(after).map(stray_px).collect();
    strays_px.sort_by(f64::total_cmp);
    let (median_px, worst_px) = (strays_px[strays_px.len() / 2], strays_px[strays_px.len() - 1]);
    worst_px <= HARMLESS_STRAY_PX.max(STRAY_MEDIANS * median_px)
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    fn is_rigid(before: &[Corner], after: &[Corner]) -> bool {
        CommonStep::between(before, after).is_some_and(|step| step.is_rigid)
    }

    /// Corners of a tipped board after a move by `px`, each off by up to `noise_px`.
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
            assert!(is_rigid(&before, &after), "noise {noise_px} px");
            after[23].px.x += off_px;
            assert!(!is_rigid(&before, &after), "noise {noise_px} px, off {off_px} px");
        }
    }

    #[test]
    fn corners_without_a_motion_did_not_move_together() {
        let board = corners(0.0, 0.0);
        assert!(!is_rigid(&board, &board[..53]));
        assert!(!is_rigid(&board[..3], &board[..3]));
        assert!(!is_rigid(&[], &[]));
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
        let motion = window.motion(at(12), &corners(6.0, -0.03)).expect("frames to compare");
        // 30 px/s across and 9 px/s up, foreshortened.
        assert!((27.0..32.0).contains(&motion.speed_px_per_s), "{motion:?}");
        assert!(motion.is_rigid);
        assert_eq!(window.motion(at(100), &corners(6.0, 0.0)), None, "too long ago");
        assert_eq!(window.motion(at(11), &corners(6.0, 0.0)), None, "not later");
        assert_eq!(window.motion(at(12), &corners(6.0, 0.0)[..53]), None, "another board");
    }
}
