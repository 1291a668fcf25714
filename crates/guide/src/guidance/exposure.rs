//! Exposure time, estimated where the driver doesn't report it.
//!
//! A board that moves by `m` px during the exposure `T` at speed `v` smears its edges: `m = vT` adds `m²/12` to the
//! variance of the blur across the motion, `m²/24` on average over the two families of edges. So
//! `24·blur² = 24·blur₀² + T²v²`, and `T²` is the slope of `24·blur²` over `v²`. What the lens alone blurs, `blur₀`,
//! changes with distance; the slope is therefore taken from differences between frames a fifth of a second apart.

use std::collections::VecDeque;

use super::motion::Motion;
use boresight_geometry::frame::CaptureTime;

/// Exposure assumed before anything has been seen to move: usual in a room's light.
const USUAL_SECS: f64 = 0.012;
/// Bounds of estimates: exposures of cameras in light in which a board can be found.
const SHORTEST_SECS: f64 = 0.001;
const LONGEST_SECS: f64 = 0.035;
/// Weight of `USUAL_SECS`, as a sum of squared differences of squared speeds: one step to 150 px/s outweighs it.
const USUAL_WEIGHT: f64 = 5e8;
/// Time between compared frames: the distance hardly changes in it, the speed does.
const APART_SECS: f64 = 0.2;
/// Time between frames beyond which they may show different poses.
const TOO_FAR_APART_SECS: f64 = 0.5;
/// Ratio of smear to blur above which edges no longer follow the model.
const MAX_SMEAR_TO_BLUR: f64 = 12.0;
/// Share that each frame forgets, because exposure follows the light.
const FORGOTTEN: f64 = 0.002;

/// Estimate of the exposure time from speed and blur.
#[derive(Clone, Debug, PartialEq)]
pub struct ExposureEstimate {
    /// Time, squared speed in px²/s² and `24·blur²` of the newest frames, oldest first.
    frames: VecDeque<(CaptureTime, f64, f64)>,
    /// Speed and blur of the newest frame; its speed is complete once the next frame has come.
    newest: Option<(CaptureTime, f64, f64)>,
    /// `Σ Δ(v²)²` and `Σ Δ(v²)·Δ(24·blur²)`.
    sums: (f64, f64),
}

impl Default for ExposureEstimate {
    fn default() -> Self {
        let sums = (USUAL_WEIGHT, USUAL_WEIGHT * USUAL_SECS * USUAL_SECS);
        Self { frames: VecDeque::new(), newest: None, sums }
    }
}

impl ExposureEstimate {
    /// Adds a frame; `motion` is the board's motion up to it, if known.
    pub fn add(&mut self, captured_at: CaptureTime, motion: Option<&Motion>, blur_px: f64) {
        let Some(motion) = motion else {
            self.newest = None;
            return;
        };
        let speed = motion.raw_speed_px_per_s;
        // The exposure lies in the middle between the step to a frame and the step from it.
        let complete = self.newest.replace((captured_at, speed, 24.0 * blur_px * blur_px));
        let Some((time, speed_before, blur)) = complete else { return };
        let speed_squared = (0.5 * (speed_before + speed)).powi(2);
        let outdated = |frame: &(CaptureTime, f64, f64)| time.secs_since(frame.0) > APART_SECS;
        let mut earlier = None;
        while self.frames.front().is_some_and(outdated) {
            earlier = self.frames.pop_front();
        }
        if let Some((then, speed_squared_then, blur_then)) = earlier
            && time.secs_since(then) < TOO_FAR_APART_SECS
            && speed_squared.max(speed_squared_then) * self.secs().powi(2)
                < MAX_SMEAR_TO_BLUR * blur.max(blur_then)
        {
            let (x, y) = (speed_squared - speed_squared_then, blur - blur_then);
            let (xx, xy) = self.sums;
            let kept = 1.0 - FORGOTTEN;
            self.sums = (kept * xx + x * x, kept * xy + x * y);
        }
        self.frames.push_back((time, speed_squared, blur));
    }

    /// The exposure time in seconds. A usual one until something has been seen to move.
    pub fn secs(&self) -> f64 {
        let (xx, xy) = self.sums;
        (xy / xx).max(0.0).sqrt().clamp(SHORTEST_SECS, LONGEST_SECS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guidance::motion::Scatter;

    /// Half a minute of a board that speeds up and slows down once a second, at `rate_hz`.
    fn estimate(exposure_secs: f64, top_px_per_s: f64, rate_hz: f64) -> f64 {
        let mut estimate = ExposureEstimate::default();
        for number in 0..(30.0 * rate_hz) as u64 {
            let secs = number as f64 / rate_hz;
            let speed = |secs: f64| top_px_per_s * (std::f64::consts::PI * secs).sin().abs();
            let smear_px2 = (exposure_secs * speed(secs)).powi(2);
            // The lens alone blurs by 0.7 px, and by more as the board comes nearer.
            let blur_px = (0.49 + 0.01 * secs.sin() + smear_px2 / 24.0).sqrt();
            let raw_speed_px_per_s = speed(secs - 0.5 / rate_hz);
            let motion = Motion {
                since_secs: 1.0 / rate_hz,
                speed_px_per_s: raw_speed_px_per_s,
                raw_speed_px_per_s,
                is_rigid: true,
                scatter: Scatter::default(),
            };
            let time = CaptureTime { nanos: (secs * 1e9) as u64 };
            estimate.add(time, Some(&motion), blur_px);
        }
        estimate.secs()
    }

    #[test]
    fn the_exposure_follows_from_speed_and_blur() {
        for rate_hz in [10.0, 30.0, 120.0] {
            for exposure_secs in [0.004, 0.008, 0.016, 0.030] {
                let estimated_secs = estimate(exposure_secs, 250.0, rate_hz);
                let ratio = estimated_secs / exposure_secs;
                assert!((0.85..1.15).contains(&ratio), "{rate_hz} Hz, {exposure_secs} s: {ratio}");
            }
        }
    }

    #[test]
    fn without_motion_the_exposure_is_a_usual_one() {
        assert_eq!(ExposureEstimate::default().secs(), USUAL_SECS);
        let resting = estimate(0.020, 10.0, 30.0);
        assert!((0.008..0.016).contains(&resting), "{resting}");
    }
}
