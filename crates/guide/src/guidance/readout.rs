//! Rolling shutter: the readout time of all rows, and the corners at a common instant.
//!
//! A corner in row `y` of a picture `h` rows high is seen `(y/h − ½) T` after the middle row, and
//! moves meanwhile at its speed `v`. To first order it's off by `q T` with `q = v (y/h − ½)`. Most
//! of the shear looks like another pose; the rest changes its sign with the motion, as no error of
//! lens or board does, so `T` is estimated from the residuals of poses of a moving board. A global
//! shutter has `T = 0`. Source: `docs/method.md`, section 3.8.

use nalgebra::{Point2, SMatrix, SVector};

use super::{hand_motion::Velocity, view::LensEstimate};
use boresight_geometry::{Corner, fit_pose};

/// Prior of the readout time: most sensors with a rolling shutter read their rows within 10 to 30
/// ms; some have a global one.
const USUAL_SECS: f64 = 0.015;
const USUAL_SD_SECS: f64 = 0.012;
/// Least standard deviation of a readout, absolute and as a share: some sensors pause after a
/// frame, and hands don't move evenly during the readout.
const LEAST_SD_SECS: f64 = 0.000_2;
const LEAST_SD: f64 = 0.1;
/// Number of residuals counted as a single independent one: those of neighbouring corners and
/// frames err alike.
const ALIKE: f64 = 8.0;
/// Speed, in picture widths per second, above which boards don't move evenly during the readout.
const FASTEST_WIDTHS_PER_SEC: f64 = 0.4;

/// Readout time of all rows of the sensor, as far as known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readout {
    /// Information, and information times seconds.
    sums: (f64, f64),
}

impl Default for Readout {
    fn default() -> Self {
        let information = USUAL_SD_SECS.powi(-2);
        Self { sums: (information, information * USUAL_SECS) }
    }
}

impl Readout {
    /// The readout time; not negative.
    pub fn secs(&self) -> f64 {
        (self.sums.1 / self.sums.0).max(0.0)
    }

    /// Standard deviation of the readout time.
    pub(crate) fn sd_secs(&self) -> f64 {
        self.sums.0.sqrt().recip().max(LEAST_SD_SECS + LEAST_SD * self.secs())
    }

    /// Updates the estimate from a frame's `corners` of a moving board with `points_m`, seen
    /// through a known lens.
    pub fn add(
        &mut self,
        corners: &[Corner],
        velocity: &Velocity,
        points_m: &[Point2<f64>],
        lens_estimate: &LensEstimate,
    ) {
        let size = lens_estimate.image_size;
        let (width_px, height_px) = (f64::from(size.width_px), f64::from(size.height_px));
        if velocity.speed_px_per_s() > FASTEST_WIDTHS_PER_SEC * width_px {
            return;
        }
        let camera = &lens_estimate.camera;
        let Ok(fit) = fit_pose(camera, points_m, corners) else { return };
        let (mut by_pose, mut pose_q) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        let (mut q_q, mut q_e, mut e_e, mut seen) = (0.0, 0.0, 0.0, 0.0);
        for (corner, point) in corners.iter().zip(points_m).filter(|(corner, _)| corner.is_seen()) {
            let Some(at) = camera.project_board_point(&fit.cam_from_board, point) else { return };
            let q = velocity.at(&corner.px) * (corner.px.y / height_px - 0.5);
            let off = corner.px - at.px;
            by_pose += at.jac_pose.transpose() * at.jac_pose;
            pose_q += at.jac_pose.transpose() * q;
            q_q += q.norm_squared();
            q_e += q.dot(&off);
            e_e += off.norm_squared();
            seen += 2.0;
        }
        let Some(by_pose) = by_pose.cholesky() else { return };
        let freedom = seen - 7.0;
        if freedom < 1.0 {
            return;
        }
        let left = (q_q - pose_q.dot(&by_pose.solve(&pose_q))).max(0.0);
        let (speed, unknown) = (velocity.speed_px_per_s(), velocity.unknown_px_per_s());
        if left <= 0.0 || speed <= unknown {
            return;
        }
        // The corners' noise, and the velocity's error.
        let noise_secs2 = (e_e / freedom).max(1e-4) / left;
        let variance_secs2 = noise_secs2 + (self.secs() * unknown / speed).powi(2);
        let information = 1.0 / (ALIKE * variance_secs2);
        self.sums.0 += information;
        self.sums.1 += information * q_e / left;
    }

    /// Corners of a board moving with `velocity`, at the time of the middle row in a picture
    /// `height_px` high, with their common error from inexact motion and readout.
    pub(crate) fn at_one_instant(
        &self,
        corners: &[Corner],
        velocity: Option<&Velocity>,
        height_px: f64,
    ) -> Vec<Corner> {
        let Some(velocity) = velocity else { return corners.to_vec() };
        let unknown_px = libm::hypot(
            velocity.speed_px_per_s() * self.sd_secs(),
            velocity.unknown_px_per_s() * self.secs(),
        );
        let moved = corners.iter().map(|corner| {
            let row = corner.px.y / height_px - 0.5;
            let px = corner.px - velocity.moved_px(&corner.px, row * self.secs());
            Corner { px, common_px: row * unknown_px, ..*corner }
        });
        moved.collect()
    }
}
