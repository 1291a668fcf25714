//! Cameras of known truth, each with the fitted lens model.

use nalgebra::{Isometry3, Point2, Vector2};
use rand::RngExt;

use crate::{
    params::Params,
    setup::{board, chance},
};
use boresight_calibrate::LensModel;
use boresight_geometry::{Camera, Corner, Distortion, boards::Board, fit_pose, frame::ImageSize};

pub(super) const IMAGE_SIZE: ImageSize = ImageSize { width_px: 1920, height_px: 1080 };
/// Focal length of every camera, at the principal point.
pub(super) const F_PX: f64 = 1400.0;
/// Parameter of the field-of-view lens, radians.
const FIELD_OF_VIEW_RAD: f64 = 0.9;
/// Largest distance of the principal point from the picture's centre.
const PP_OFF_PX: f64 = 60.0;

/// True lens of the pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TrueLens {
    /// Lens of the fitted family.
    Brown(Camera),
    /// Lens of a different model family. A ray at the distance `r` from the axis appears at `f
    /// atan(2 r tan(w/2)) / (2 tan(w/2))`, so `f` is its focal length at the principal point.
    /// Source: Devernay & Faugeras, "Straight lines have to be straight", 2001, section 2.2.
    FieldOfView {
        /// Focal length and principal point; without distortion.
        pinhole: Camera,
        /// Parameter `w`.
        w_rad: f64,
    },
}

impl TrueLens {
    /// Camera, without distortion if the lens is from a different model family.
    pub fn camera(&self) -> &Camera {
        match self {
            Self::Brown(camera) | Self::FieldOfView { pinhole: camera, .. } => camera,
        }
    }

    /// Pixel of a point of the board. `None` behind the camera.
    pub fn px_from_board(
        &self,
        cam_from_board: &Isometry3<f64>,
        point_m: &Point2<f64>,
    ) -> Option<Point2<f64>> {
        match self {
            Self::Brown(camera) => camera.px_from_board(cam_from_board, point_m),
            Self::FieldOfView { pinhole, w_rad } => {
                let ideal = pinhole.px_from_board(cam_from_board, point_m)?;
                let off = (ideal - pinhole.pp_px).component_div(&pinhole.f_px);
                let (r, scale) = (off.norm(), 2.0 * (0.5 * w_rad).tan());
                let shrunk = if r < 1e-9 { 1.0 } else { (scale * r).atan() / (scale * r) };
                Some(pinhole.pp_px + (off * shrunk).component_mul(&pinhole.f_px))
            }
        }
    }

    /// Ray `(X/Z, Y/Z)` of a pixel. `None` outside the field of the lens.
    pub fn normalized_from_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        match self {
            Self::Brown(camera) => camera.normalized_from_px(px),
            Self::FieldOfView { pinhole, w_rad } => {
                let off = (px - pinhole.pp_px).component_div(&pinhole.f_px);
                let (r, scale) = (off.norm(), 2.0 * (0.5 * w_rad).tan());
                if scale * r >= 0.99 * std::f64::consts::FRAC_PI_2 {
                    return None;
                }
                let stretched = if r < 1e-9 { 1.0 } else { (scale * r).tan() / (scale * r) };
                Some(Point2::from(off * stretched))
            }
        }
    }

    /// Pose with the board's corners nearest to `ghost_px`. `None` if no pose comes near.
    pub fn pose_showing(&self, board: &Board, ghost_px: &[Point2<f64>]) -> Option<Isometry3<f64>> {
        let camera = self.camera();
        let corners: Option<Vec<Corner>> = ghost_px
            .iter()
            .map(|px| match self {
                Self::Brown(_) => Some(Corner::isotropic(*px, 1.0)),
                Self::FieldOfView { .. } => {
                    let ray = self.normalized_from_px(px)?;
                    Some(Corner::isotropic(camera.px_from_normalized(&ray), 1.0))
                }
            })
            .collect();
        Some(fit_pose(camera, &board.corners_in_board_m(), &corners?).ok()?.cam_from_board)
    }
}

/// Camera of known truth, and the fitted model.
#[derive(Clone, Debug)]
pub struct Course {
    /// True lens of the camera.
    pub lens: TrueLens,
    /// Lens model fitted after each view.
    pub model: LensModel,
    /// Board held up.
    pub board: Board,
}

impl Course {
    /// Codes of the courses: the right model, and two lenses beyond the model.
    pub const CODES: [&'static str; 3] = ["right", "k3", "fov"];

    /// Names of the courses in words, beside the codes.
    pub const WORDS: [&'static str; 3] = [
        "k1, k2; fitted with k1, k2",
        "k1, k2, k3; fitted with k1",
        "field-of-view lens; fitted with k1, k2",
    ];

    /// Camera of run `index` with the lens `CODES[course]`: the principal point is up to 60 px off
    /// the picture's centre, the same for every strategy, lens and hand.
    pub fn random(course: usize, params: &Params, index: u64) -> Self {
        let mut rng = chance(params.seed, 1_000_000 + index);
        let (angle, off_px): (f64, f64) =
            (rng.random_range(0.0..std::f64::consts::TAU), rng.random_range(0.0..PP_OFF_PX));
        let pp_px = IMAGE_SIZE.centre_px() + Vector2::new(angle.cos(), angle.sin()) * off_px;
        let pinhole = Camera::pinhole(F_PX, pp_px);
        let brown = |distortion| TrueLens::Brown(Camera { distortion, ..pinhole });
        let (lens, model) = match course {
            0 => (brown(mild_distortion()), LensModel::K1K2),
            1 => {
                let strong = Distortion { k1: -0.2, k2: 0.08, k3: -0.03, ..Distortion::default() };
                (brown(strong), LensModel::K1)
            }
            _ => (TrueLens::FieldOfView { pinhole, w_rad: FIELD_OF_VIEW_RAD }, LensModel::K1K2),
        };
        Self { lens, model, board: board_held() }
    }
}

/// Distortion of the right lens.
pub(super) fn mild_distortion() -> Distortion {
    Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() }
}

/// Board held up: 9×6 corners of 40 mm.
pub(super) fn board_held() -> Board {
    board([9, 6], 0.04)
}

/// Target standard deviation of the principal point: 1 px, more for long lenses, for which no
/// number of views determines the principal point to a pixel.
pub(super) fn wanted_pp_sd_px() -> f64 {
    (F_PX / f64::from(IMAGE_SIZE.width_px)).powi(2).max(1.0)
}

/// Target mean standard deviation of projection.
pub(super) const WANTED_PROJECTION_SD_PX: f64 = 0.3;

/// Minimum distance of a detectable corner from the picture's edge, 20 px in a picture 1080 px
/// high: the same for every strategy.
pub(super) fn seen_margin_px() -> f64 {
    20.0 / 1080.0 * f64::from(IMAGE_SIZE.height_px)
}

/// Minimum distance of a planned corner from the picture's edge, 45 px in a picture 1080 px high:
/// leaves room for the errors of a hand.
pub(super) fn planned_margin_px() -> f64 {
    45.0 / 1080.0 * f64::from(IMAGE_SIZE.height_px)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_pose_is_found_again_from_what_it_shows() {
        let pose = Isometry3::new(Vector3::new(0.02, -0.03, 0.4), Vector3::new(0.4, -0.5, 0.1));
        for course in 0..Course::CODES.len() {
            let Course { lens, board, .. } = Course::random(course, &Params::default(), 3);
            let px: Vec<_> = board
                .corners_in_board_m()
                .iter()
                .map(|m| lens.px_from_board(&pose, m).expect("in front"))
                .collect();
            let found = lens.pose_showing(&board, &px).expect("a board");
            assert!((found.translation.vector - pose.translation.vector).norm() < 1e-9);
            assert!(found.rotation.angle_to(&pose.rotation) < 1e-9);
        }
    }

    #[test]
    fn near_its_centre_the_field_of_view_lens_has_the_focal_length_of_the_others() {
        let lens = Course::random(2, &Params::default(), 0).lens;
        let at = |x: f64| {
            let pose = Isometry3::translation(x, 0.0, 1.0);
            lens.px_from_board(&pose, &Point2::origin()).expect("in front").x
        };
        assert!(((at(1e-4) - at(0.0)) / 1e-4 - F_PX).abs() < 1e-3 * F_PX);
        // At the picture's edge the lens differs from a pinhole by a tenth.
        assert!((0.85..0.95).contains(&((at(0.686) - at(0.0)) / (0.686 * F_PX))));
    }
}
