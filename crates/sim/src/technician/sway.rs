//! Involuntary motion of a held board.
//!
//! Each of the six degrees of freedom is a sum of sines of incommensurate frequencies, so the pose
//! at a time is a function of the time alone.
//!
//! **Sway.** The spectral density is flat up to 0.4 Hz and falls with the third power of the
//! frequency, up to 6 Hz. Measured on public videos of a hand-held board or camera with
//! `tests/bench/hand_motion.py` (pose of the board in every picture; windows of 1 or 2 s without
//! their linear trend, the quieter half of them), the slope of the log density between 1.5 and 6 Hz
//! is, over the six axes: −1.2 to −3.7 (live-pose, calibration2.mp4, board in hand, up to 4 Hz),
//! −1.7 to −3.7 (BoofCV, movie.mjpeg, board in hand), −1.5 to −6.9 (SJ-1011/Camera_Calibration,
//! camera in hand), −3.7 to −5.6 (Visual_Impact_Gauge, camera in hand).
//!
//! **Tremor.** Physiological tremor is at 8–12 Hz (Elble and Koller, *Tremor*, 1990). The spectrum
//! rises or stays level within 7–13 Hz in SJ-1011/Camera_Calibration and Visual_Impact_Gauge, where
//! the band holds 0.03–0.07 mm rms along the axes across the line of sight. In BoofCV's video the
//! band holds 0.2–0.4 mm and 0.04–0.05° without a rise: an upper limit, for a moving hand.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector6};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{Support, TechnicianParams};
use boresight_geometry::{Camera, frame::CaptureTime};

/// Corner frequency of the sway: flat density below, falling with the third power above.
const SWAY_CORNER_HZ: f64 = 0.4;
/// Band of the sway, and number of sines.
const SWAY_BAND_HZ: (f64, f64) = (0.05, 6.0);
const SWAY_SINES: usize = 20;
/// Band of the tremor, and number of sines.
const TREMOR_BAND_HZ: (f64, f64) = (8.0, 12.0);
const TREMOR_SINES: usize = 5;

/// Movement in all six degrees of freedom: radians about, then metres along the camera's axes.
#[derive(Clone, Debug)]
pub(super) struct Sway {
    shakes: Vec<Shake>,
}

/// Band of the spectrum.
#[derive(Clone, Debug)]
struct Shake {
    amplitude: Vector6<f64>,
    sines: Vec<Sine>,
}

/// Sine for each degree of freedom.
#[derive(Clone, Copy, Debug)]
struct Sine {
    weight: f64,
    rad_per_s: Vector6<f64>,
    phase_rad: Vector6<f64>,
}

impl Sway {
    pub(super) fn new(rng: &mut ChaCha8Rng, params: &TechnicianParams) -> Self {
        let tremor = six(params.tremor_rad, params.tremor_m);
        let shakes = match params.support {
            Support::Tripod => vec![Shake::of_tripod(rng, tremor)],
            Support::Hands => vec![
                Shake::sway(rng, six(params.sway_rad, params.sway_m)),
                Shake::tremor(rng, tremor),
            ],
        };
        Self { shakes }
    }

    /// `pose` at `time`, with the movement enlarged by `gain`.
    pub(super) fn applied(
        &self,
        pose: &Isometry3<f64>,
        time: CaptureTime,
        gain: f64,
    ) -> Isometry3<f64> {
        let secs = time.nanos as f64 * 1e-9;
        let moved: Vector6<f64> = self.shakes.iter().map(|shake| shake.at(secs)).sum();
        let moved = gain * moved;
        Camera::moved(
            pose,
            &moved.fixed_rows::<3>(0).into_owned(),
            &moved.fixed_rows::<3>(3).into_owned(),
        )
    }
}

impl Shake {
    /// Two sines per axis; `amplitude` is their largest sum.
    fn of_tripod(rng: &mut ChaCha8Rng, amplitude: Vector6<f64>) -> Self {
        let rad_per_s = [draw(rng, 0.3, 0.9), draw(rng, 1.2, 3.0)];
        let phase_rad = [draw(rng, 0.0, 1.0), draw(rng, 0.0, 1.0)];
        let sine =
            |i: usize, weight| Sine { weight, rad_per_s: rad_per_s[i], phase_rad: phase_rad[i] };
        Self { amplitude, sines: vec![sine(0, 0.7), sine(1, 0.3)] }
    }

    fn sway(rng: &mut ChaCha8Rng, rms: Vector6<f64>) -> Self {
        let (low, high) = SWAY_BAND_HZ;
        let edge_hz = |i: usize| low * libm::pow(high / low, i as f64 / SWAY_SINES as f64);
        let bands = (0..SWAY_SINES).map(|i| {
            let (from_hz, to_hz) = (edge_hz(i), edge_hz(i + 1));
            let falling = (SWAY_CORNER_HZ / (from_hz * to_hz).sqrt()).min(1.0).powi(3);
            (from_hz, to_hz, falling * (to_hz - from_hz))
        });
        Self::of_bands(rng, rms, bands)
    }

    fn tremor(rng: &mut ChaCha8Rng, rms: Vector6<f64>) -> Self {
        let (low, high) = TREMOR_BAND_HZ;
        let edge_hz = |i: usize| low + (high - low) * i as f64 / TREMOR_SINES as f64;
        let bands = (0..TREMOR_SINES).map(|i| (edge_hz(i), edge_hz(i + 1), 1.0));
        Self::of_bands(rng, rms, bands)
    }

    /// Sine at a random frequency within each band `(from_hz, to_hz, power)`; powers are relative.
    fn of_bands(
        rng: &mut ChaCha8Rng,
        rms: Vector6<f64>,
        bands: impl Iterator<Item = (f64, f64, f64)> + Clone,
    ) -> Self {
        let power: f64 = bands.clone().map(|(_, _, power)| power).sum();
        let sines = bands
            .map(|(from_hz, to_hz, share)| Sine {
                // The mean square of a sine is half its squared amplitude.
                weight: (2.0 * share / power).sqrt(),
                rad_per_s: draw(rng, from_hz, to_hz),
                phase_rad: draw(rng, 0.0, 1.0),
            })
            .collect();
        Self { amplitude: rms, sines }
    }

    fn at(&self, secs: f64) -> Vector6<f64> {
        Vector6::from_fn(|i, _| {
            let swing =
                |sine: &Sine| sine.weight * libm::sin(sine.rad_per_s[i] * secs + sine.phase_rad[i]);
            self.amplitude[i] * self.sines.iter().map(swing).sum::<f64>()
        })
    }
}

/// Six random numbers of turns from `low` to `high`, in radians.
fn draw(rng: &mut ChaCha8Rng, low: f64, high: f64) -> Vector6<f64> {
    Vector6::from_fn(|_, _| TAU * rng.random_range(low..high))
}

fn six(rad: f64, m: f64) -> Vector6<f64> {
    Vector6::new(rad, rad, rad, m, m, m)
}
