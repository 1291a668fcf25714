//! Rolling shutter: the readout time of all rows, and the corners at a common instant.
//!
//! A corner in row `y` of a picture `h` rows high is seen `(y/h − ½) T` after the middle row, and
//! moves meanwhile at its speed `v`. To first order it's off by `q T` with `q = v (y/h − ½)`. Most
//! of the shear looks like another pose, or another lens within the lens's uncertainty; the rest
//! changes its sign with the motion, as no error of the board does, so `T` is estimated from the
//! residuals of a moving board. A global shutter has `T = 0`. Source: `docs/method.md`, section
//! 3.8.

use nalgebra::{Point2, SMatrix, SVector};

use super::{gain::UNSTATED_PX, hand_motion::Velocity, view::LensEstimate};
use boresight_geometry::{Corner, LENS_PARAMETERS, LensMatrix, fit_pose};

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

/// Parameters that explain residuals: of the pose, and of the lens's error.
const OTHERS: usize = 6 + LENS_PARAMETERS;

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

    /// Root mean square of the possible readout times: a time that seems short may be longer.
    fn rms_secs(&self) -> f64 {
        libm::hypot(self.secs(), self.sd_secs())
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
        let lens_error = lens_estimate.covariance.map_or_else(LensMatrix::zeros, root);
        let mut normal = SMatrix::<f64, OTHERS, OTHERS>::zeros();
        let (mut others_q, mut others_e) = (SVector::<f64, OTHERS>::zeros(), SVector::zeros());
        let (mut q_q, mut q_e, mut e_e, mut seen, mut noise_px2) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (corner, point) in corners.iter().zip(points_m).filter(|(corner, _)| corner.is_seen()) {
            let Some(at) = camera.project_board_point(&fit.cam_from_board, point) else { return };
            let q = velocity.at(&corner.px) * (corner.px.y / height_px - 0.5);
            let off = corner.px - at.px;
            let mut jac = SMatrix::<f64, 2, OTHERS>::zeros();
            jac.fixed_columns_mut::<6>(0).copy_from(&at.jac_pose);
            jac.fixed_columns_mut::<LENS_PARAMETERS>(6).copy_from(&(at.jac_lens * lens_error));
            normal += jac.transpose() * jac;
            others_q += jac.transpose() * q;
            others_e += jac.transpose() * off;
            q_q += q.norm_squared();
            q_e += q.dot(&off);
            e_e += off.norm_squared();
            noise_px2 += corner.covariance_px2.trace();
            seen += 2.0;
        }
        let freedom = seen - 7.0;
        if freedom < 1.0 {
            return;
        }
        // The lens's error is known to be about 1 in its own units.
        for index in 6..OTHERS {
            normal[(index, index)] += noise_px2 / seen + UNSTATED_PX * UNSTATED_PX;
        }
        let Some(normal) = normal.cholesky() else { return };
        let by_q = normal.solve(&others_q);
        let left = q_q - others_q.dot(&by_q);
        let stray_px2 = e_e - others_e.dot(&normal.solve(&others_e));
        let (speed, unknown) = (velocity.speed_px_per_s(), velocity.unknown_px_per_s());
        if left <= 0.0 || speed <= unknown {
            return;
        }
        // The corners' noise, and the velocity's error.
        let noise_secs2 = (stray_px2 / freedom).max(1e-4) / left;
        let variance_secs2 = noise_secs2 + (self.rms_secs() * unknown / speed).powi(2);
        let information = 1.0 / (ALIKE * variance_secs2);
        self.sums.0 += information;
        self.sums.1 += information * (q_e - others_e.dot(&by_q)) / left;
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
            velocity.unknown_px_per_s() * self.rms_secs(),
        );
        let moved = corners.iter().map(|corner| {
            let row = corner.px.y / height_px - 0.5;
            let px = corner.px - velocity.moved_px(&corner.px, row * self.secs());
            Corner { px, common_px: row * unknown_px, ..*corner }
        });
        moved.collect()
    }
}

/// Matrix `A` with `A Aᵀ` the `covariance`: an error in units of its standard deviations.
fn root(covariance: LensMatrix) -> LensMatrix {
    let eigen = covariance.symmetric_eigen();
    let sd = eigen.eigenvalues.map(|variance| variance.max(0.0).sqrt());
    eigen.eigenvectors * LensMatrix::from_diagonal(&sd)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;
    use crate::guidance::hand_motion::HandMotion;
    use boresight_geometry::{
        Camera, LensParameter,
        boards::Board,
        frame::{CaptureTime, ImageSize},
    };

    const READOUT_SECS: f64 = 0.015;

    /// Readout learned from a board that is `turned` and drifts one way, seen through a lens with
    /// an error of f within its uncertainty.
    fn learned(turned: [f64; 2], f_error: f64) -> Readout {
        let image_size = ImageSize { width_px: 480, height_px: 360 };
        let board = Board::new(9, 6, 0.025).expect("valid");
        let points_m = board.corners_in_board_m();
        let truth = Camera::pinhole(380.0, image_size.centre_px());
        let mut lens_estimate = LensEstimate::guess(image_size);
        lens_estimate.camera = Camera::pinhole((1.0 + f_error) * 380.0, image_size.centre_px());
        let mut covariance = LensMatrix::zeros();
        let [x, y] = [LensParameter::Fx, LensParameter::Fy].map(LensParameter::index);
        for place in [(x, x), (x, y), (y, x), (y, y)] {
            covariance[place] = (0.02 * 380.0_f64).powi(2);
        }
        lens_estimate.covariance = Some(covariance);
        let pose = |secs: f64| {
            let at_m = Vector3::new(0.07 * (secs - 0.6), 0.07 * (secs - 0.6), 0.4);
            Isometry3::new(at_m, Vector3::new(turned[0], turned[1], 0.0))
        };
        let see = |secs: f64, point: &Point2<f64>| {
            let at = |secs| truth.px_from_board(&pose(secs), point).expect("in front");
            let row = at(secs).y / 360.0 - 0.5;
            Corner::isotropic(at(secs + row * READOUT_SECS), 0.03)
        };
        let (mut readout, mut hand) = (Readout::default(), HandMotion::default());
        let mut before: Option<(CaptureTime, Vec<Corner>)> = None;
        for frame in 1..36_u32 {
            let secs = f64::from(frame) / 30.0;
            let now = CaptureTime { nanos: u64::from(frame) * 33_333_333 };
            let corners: Vec<Corner> = points_m.iter().map(|point| see(secs, point)).collect();
            hand.push(now, before.as_ref().map(|(_, corners)| corners.as_slice()), &corners);
            if let Some((then, corners)) = &before
                && let Some(velocity) = hand.velocity(*then)
            {
                readout.add(corners, &velocity, &points_m, &lens_estimate);
            }
            before = Some((now, corners));
        }
        readout
    }

    #[test]
    fn an_error_of_the_lens_is_no_readout() {
        for (turned, f_error) in [([0.6, 0.0], 0.02), ([0.0, 0.6], -0.02), ([0.45, 0.45], 0.0)] {
            let readout = learned(turned, f_error);
            let (secs, sd_secs) = (readout.secs(), readout.sd_secs());
            assert!(sd_secs < 0.5 * USUAL_SD_SECS, "{f_error}: nothing learned, ±{sd_secs} s");
            let off = (secs - READOUT_SECS).abs() / sd_secs;
            assert!(off < 2.0, "f off by {f_error}: {secs} ± {sd_secs} s");
        }
    }
}
