//! Motion of a held board within a frame, interpolated from the neighbouring frames.
//!
//! A hand sways slowly and trembles at 8 to 12 Hz, so its motion is a Gaussian process with a
//! spectrum known up to its size. The size follows from the prediction error of each frame;
//! velocity, acceleration and their errors follow from the frames before and after, at any frame
//! rate. Source: `docs/method.md`, section 3.8.

use std::collections::VecDeque;

use nalgebra::{Matrix2, Point2, SMatrix, SVector, Vector2};

use boresight_geometry::{Corner, frame::CaptureTime};

/// Number of frames to interpolate a motion.
const FRAMES: usize = 7;
/// Minimum number of frames before a frame of interest; with fewer, the first frames of a full
/// window gain nothing by later frames.
const ENOUGH_BEFORE: usize = 3;
/// Sway: decay rate, for a spectrum flat up to 0.4 Hz.
const SWAY_PER_SEC: f64 = 4.35;
/// Tremor: size as a share of the sway's, frequency and width.
const TREMOR: f64 = 0.1;
const TREMOR_RAD_PER_S: f64 = 63.0;
const TREMOR_WIDTH_RAD_PER_S: f64 = 7.5;
/// Intended motion, as a multiple of the sway: variances of place and of speed per second.
const INTENDED: (f64, f64) = (100.0, 1000.0);
/// Variance of a measured place, as a share of the sway's.
const MEASURED: f64 = 1e-5;
/// Averaging time for predicted frames.
const UNREST_SECS: f64 = 0.3;

/// Motion of a board in the picture: the velocity field of a plane moving and turning before a
/// camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity {
    /// Motion in a second.
    per_sec: Step,
    /// Change of the velocity per second, at the middle.
    px_per_s2: Vector2<f64>,
    /// Standard deviation of the velocity's error, per axis.
    unknown_px_per_s: f64,
}

impl Velocity {
    /// Velocity at a pixel, in pixels per second.
    pub fn at(&self, px: &Point2<f64>) -> Vector2<f64> {
        self.per_sec.at(px)
    }

    /// Displacement of the board at a pixel `secs` later.
    pub fn moved_px(&self, px: &Point2<f64>, secs: f64) -> Vector2<f64> {
        self.at(px) * secs + self.px_per_s2 * (0.5 * secs * secs)
    }

    /// Standard deviation of the velocity's error, per axis.
    pub(crate) fn unknown_px_per_s(&self) -> f64 {
        self.unknown_px_per_s
    }

    /// Root mean square speed of the corners: a board turning about its middle moves, too.
    pub fn speed_px_per_s(&self) -> f64 {
        self.per_sec.mean_square_px2().sqrt()
    }
}

/// The board in the newest frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandMotion {
    /// Frames with the step to each, the oldest first.
    frames: VecDeque<(CaptureTime, Step)>,
    /// Size of the sway, as a variance from predicted frames.
    sway_px2: Option<f64>,
}

/// A plane's motion by the pixel of the later frame, eight numbers: `px + by_px d + d (tip_per_px ·
/// d)` at `d` from the middle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Step {
    middle_px: Point2<f64>,
    px: Vector2<f64>,
    by_px: Matrix2<f64>,
    /// Tipping of the plane: gain of speed towards a nearing edge, per pixel of the way there.
    tip_per_px: Vector2<f64>,
    /// Mean square of the corners' places about the middle, px².
    spread_px2: Matrix2<f64>,
}

/// Times of frames, and the inverse covariance of their places.
struct Window {
    secs: [f64; FRAMES],
    count: usize,
    inverse: SMatrix<f64, FRAMES, FRAMES>,
}

impl HandMotion {
    /// Forgets all frames.
    pub fn clear(&mut self) {
        self.frames.clear();
    }

    /// Adds the newest frame, after a frame with the corners `before`; restarts if there's none or
    /// no step fits.
    pub fn push(&mut self, now: CaptureTime, before: Option<&[Corner]>, corners: &[Corner]) {
        let step = before.and_then(|before| Step::between(before, corners));
        let passed_secs = self.frames.back().map_or(0.0, |(then, _)| now.secs_since(*then));
        let Some(step) = step.filter(|_| passed_secs > 0.0) else {
            self.frames.clear();
            self.frames.push_back((now, Step::default()));
            return;
        };
        self.note_foreseen(now, passed_secs, &step);
        if self.frames.len() == FRAMES {
            self.frames.pop_front();
        }
        self.frames.push_back((now, step));
    }

    /// Motion of the board in the frame captured `at` the given time. `None` if the frame isn't
    /// kept, if too few are, or if its neighbours before are gone, so that it was known better
    /// before.
    pub fn velocity(&self, at: CaptureTime) -> Option<Velocity> {
        let index = self.frames.iter().position(|(time, _)| *time == at)?;
        if self.frames.len() < 2 || (self.frames.len() == FRAMES && index < ENOUGH_BEFORE) {
            return None;
        }
        let window = self.window(at)?;
        let variance = window.velocity_variance();
        Some(Velocity {
            unknown_px_per_s: (variance * self.sway_px2.unwrap_or(1.0)).sqrt(),
            ..self.interpolated(index, &window)
        })
    }

    /// Velocity with the error expected once as many frames follow as came before.
    pub fn velocity_foreseen(&self, at: CaptureTime) -> Option<Velocity> {
        let velocity = self.velocity(at)?;
        let step_secs = {
            let (newest, before) = (self.frames.back()?, self.frames.get(self.frames.len() - 2)?);
            newest.0.secs_since(before.0)
        };
        let around = (0..FRAMES).map(|i| (i as f64 - (FRAMES / 2) as f64) * step_secs);
        let variance = Window::of(around)?.velocity_variance();
        let unknown_px_per_s = (variance * self.sway_px2.unwrap_or(1.0)).sqrt();
        Some(Velocity {
            unknown_px_per_s: unknown_px_per_s.min(velocity.unknown_px_per_s),
            ..velocity
        })
    }

    /// Updates the size of the sway from the prediction error at the end of `step`.
    fn note_foreseen(&mut self, now: CaptureTime, passed_secs: f64, step: &Step) {
        if self.frames.len() < 3 {
            return;
        }
        let Some(window) = self.window(now) else { return };
        let newest = self.frames.len() - 1;
        let (foreseen, variance) = window.place(|index| self.step(newest, index, &step.middle_px));
        let off = step.plus(-1.0, &foreseen).mean_square_px2() / (2.0 * variance);
        let share = (passed_secs / UNREST_SECS).clamp(0.0, 1.0);
        let mean = self.sway_px2.get_or_insert(off);
        *mean += share * (off - *mean);
    }

    fn window(&self, now: CaptureTime) -> Option<Window> {
        Window::of(self.frames.iter().map(|(time, _)| time.secs_since(now)))
    }

    /// Step of the board between two frames, about a pixel.
    fn step(&self, from: usize, to: usize, middle_px: &Point2<f64>) -> Step {
        let (first, last, sign) = if to < from { (to, from, -1.0) } else { (from, to, 1.0) };
        let steps = self.frames.iter().skip(first + 1).take(last - first).map(|(_, step)| step);
        let none = Step { middle_px: *middle_px, ..Step::default() };
        steps.fold(none, |sum, step| sum.plus(sign, step))
    }

    fn interpolated(&self, index: usize, window: &Window) -> Velocity {
        // The first frame has no step.
        let step = self.frames.get(index.max(1)).map(|(_, step)| step);
        let none = step.map_or_else(Step::default, Step::at_rest);
        let middle_px = none.middle_px;
        let weights = window.weights(velocity_covariance);
        let bends = window.weights(acceleration_covariance);
        let (mut per_sec, mut px_per_s2) = (none, Vector2::zeros());
        for j in 0..window.count {
            let moved = self.step(index, j, &middle_px);
            per_sec = per_sec.plus(weights[j], &moved);
            px_per_s2 += moved.px * bends[j];
        }
        Velocity { per_sec, px_per_s2, unknown_px_per_s: 0.0 }
    }
}

impl Step {
    /// Step fitted to the corners seen at both ends. `None` with fewer than six, or all in a row.
    fn between(before: &[Corner], after: &[Corner]) -> Option<Self> {
        let both = || {
            let pairs = before.iter().zip(after);
            pairs.filter(|(before, after)| before.is_seen() && after.is_seen())
        };
        let count = both().count();
        if count < 6 || before.len() != after.len() {
            return None;
        }
        let sum: Vector2<f64> = both().map(|(_, after)| after.px.coords).sum();
        let middle_px = Point2::from(sum / count as f64);
        let spread_px2 = both()
            .map(|(_, after)| after.px - middle_px)
            .map(|off| off * off.transpose() / count as f64)
            .sum::<Matrix2<f64>>();
        // In units of the board's size, so that the eight numbers are of equal order.
        let size_px = spread_px2.trace().sqrt().max(f64::MIN_POSITIVE);
        let (mut normal, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
        for (before, after) in both() {
            let off = (after.px - middle_px) / size_px;
            let (x, y) = (off.x, off.y);
            let rows = SMatrix::<f64, 2, 8>::from_rows(&[
                [1.0, 0.0, x, y, 0.0, 0.0, x * x, x * y].into(),
                [0.0, 1.0, 0.0, 0.0, x, y, x * y, y * y].into(),
            ]);
            normal += rows.transpose() * rows;
            right += rows.transpose() * (after.px - before.px);
        }
        let fit = normal.cholesky()?.solve(&right);
        Some(Self {
            middle_px,
            px: Vector2::new(fit[0], fit[1]),
            by_px: Matrix2::new(fit[2], fit[3], fit[4], fit[5]) / size_px,
            tip_per_px: Vector2::new(fit[6], fit[7]) / (size_px * size_px),
            spread_px2,
        })
    }

    /// Zero step of the same corners.
    fn at_rest(&self) -> Self {
        Self { middle_px: self.middle_px, spread_px2: self.spread_px2, ..Self::default() }
    }

    fn at(&self, px: &Point2<f64>) -> Vector2<f64> {
        let off = px - self.middle_px;
        self.px + self.by_px * off + off * self.tip_per_px.dot(&off)
    }

    /// Mean square over the corners, without the part of tipping.
    fn mean_square_px2(&self) -> f64 {
        self.px.norm_squared() + (self.by_px * self.spread_px2 * self.by_px.transpose()).trace()
    }

    /// Sum with `times` another step, about the middle of `self`.
    fn plus(self, times: f64, other: &Self) -> Self {
        let off = self.middle_px - other.middle_px;
        let tip = other.tip_per_px;
        let by_px =
            other.by_px + off * tip.transpose() + Matrix2::from_diagonal_element(tip.dot(&off));
        Self {
            px: self.px + other.at(&self.middle_px) * times,
            by_px: self.by_px + by_px * times,
            tip_per_px: self.tip_per_px + tip * times,
            ..self
        }
    }
}

impl Window {
    /// Window of frames at the given times from the frame of interest, at most [`FRAMES`].
    fn of(secs: impl Iterator<Item = f64>) -> Option<Self> {
        let mut window = Self { secs: [0.0; FRAMES], count: 0, inverse: SMatrix::identity() };
        for (slot, secs) in window.secs.iter_mut().zip(secs) {
            *slot = secs;
            window.count += 1;
        }
        let (count, secs) = (window.count, &window.secs);
        let covariance = SMatrix::<f64, FRAMES, FRAMES>::from_fn(|i, j| {
            let measured = if i == j { MEASURED } else { 0.0 };
            match i < count && j < count {
                true => place_covariance(secs[i], secs[j]) + measured,
                false => f64::from(u8::from(i == j)),
            }
        });
        window.inverse = covariance.cholesky()?.inverse();
        Some(window)
    }

    /// Weights of the places for a quantity at time 0 with the given covariance with a place at
    /// another time.
    fn weights(&self, covariance: impl Fn(f64) -> f64) -> SVector<f64, FRAMES> {
        self.inverse * self.with(covariance)
    }

    fn with(&self, covariance: impl Fn(f64) -> f64) -> SVector<f64, FRAMES> {
        SVector::from_fn(|i, _| if i < self.count { covariance(self.secs[i]) } else { 0.0 })
    }

    /// Place of the board at time 0, and its variance for a sway of size 1.
    fn place(&self, places: impl Fn(usize) -> Step) -> (Step, f64) {
        let with = self.with(|secs| place_covariance(0.0, secs));
        let weights = self.inverse * with;
        let none = Step { middle_px: places(0).middle_px, ..Step::default() };
        let mean = (0..self.count).fold(none, |sum, j| sum.plus(weights[j], &places(j)));
        let variance = place_covariance(0.0, 0.0) + MEASURED - with.dot(&weights);
        (mean, variance.max(MEASURED))
    }

    /// Variance of the velocity at time 0, per axis, for a sway of size 1.
    fn velocity_variance(&self) -> f64 {
        let with = self.with(velocity_covariance);
        let prior = SWAY_PER_SEC.powi(2)
            + TREMOR * TREMOR * (TREMOR_RAD_PER_S.powi(2) + TREMOR_WIDTH_RAD_PER_S.powi(2))
            + INTENDED.1;
        (prior - with.dot(&(self.inverse * with))).max(0.0)
    }
}

/// Covariance of the places at two times.
fn place_covariance(one_secs: f64, other_secs: f64) -> f64 {
    let apart = (one_secs - other_secs).abs();
    let sway = (1.0 + SWAY_PER_SEC * apart) * libm::exp(-SWAY_PER_SEC * apart);
    let tremor = TREMOR * TREMOR * envelope(apart) * libm::cos(TREMOR_RAD_PER_S * apart);
    sway + tremor + INTENDED.0 + INTENDED.1 * one_secs * other_secs
}

/// Covariance of the velocity at time 0 and the place at another.
fn velocity_covariance(secs: f64) -> f64 {
    let sway = SWAY_PER_SEC.powi(2) * secs * libm::exp(-SWAY_PER_SEC * secs.abs());
    let (sin, cos) = libm::sincos(TREMOR_RAD_PER_S * secs);
    let width2 = TREMOR_WIDTH_RAD_PER_S.powi(2);
    let tremor = TREMOR * TREMOR * envelope(secs) * (width2 * secs * cos + TREMOR_RAD_PER_S * sin);
    sway + tremor + INTENDED.1 * secs
}

/// Covariance of the acceleration at time 0 and the place at another.
fn acceleration_covariance(secs: f64) -> f64 {
    let apart = SWAY_PER_SEC * secs.abs();
    let sway = SWAY_PER_SEC.powi(2) * (apart - 1.0) * libm::exp(-apart);
    let (sin, cos) = libm::sincos(TREMOR_RAD_PER_S * secs);
    let width2 = TREMOR_WIDTH_RAD_PER_S.powi(2);
    let bend = (width2 * secs).powi(2) - width2 - TREMOR_RAD_PER_S.powi(2);
    let tremor = bend * cos + 2.0 * width2 * secs * TREMOR_RAD_PER_S * sin;
    sway + TREMOR * TREMOR * envelope(secs) * tremor
}

fn envelope(secs: f64) -> f64 {
    libm::exp(-0.5 * (TREMOR_WIDTH_RAD_PER_S * secs).powi(2))
}
