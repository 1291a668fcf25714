//! Cameras, boards and hands drawn at random, with known truth: corners only, no pictures.

use boresight_geometry::{Camera, Corner, Distortion, boards::Board, frame::ImageSize};
use nalgebra::{Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Size of every picture.
pub const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

/// The board of every scene: 9×6 corners, squares of 25 mm.
pub fn board() -> Board {
    Board::new(9, 6, 0.025).expect("valid")
}

/// A camera, a board and a hand.
pub struct Scene {
    /// True camera.
    pub camera: Camera,
    /// Standard deviation of a corner, per coordinate.
    pub noise_px: f64,
    /// Source of all chance.
    pub rng: ChaCha8Rng,
    /// True to draw back poses until the camera sees the whole board.
    pub whole_board: bool,
}

/// A board held in front of the camera.
#[derive(Clone, Copy, Debug)]
pub struct Pose {
    /// Angle between board and image plane.
    pub tilt_deg: f64,
    /// Tilt azimuth.
    pub slot_deg: f64,
    /// Width of the board over the width of the picture.
    pub fill: f64,
    /// Off the principal point, as share of the picture's width and height.
    pub off: [f64; 2],
}

impl Scene {
    /// An ordinary webcam: f 0.7–1.1 widths, PP within 40 px of the centre, barrel distortion.
    pub fn ordinary(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let f_px = rng.random_range(900.0..1400.0);
        let (angle, radius): (f64, f64) =
            (rng.random_range(0.0..std::f64::consts::TAU), rng.random_range(0.0..40.0));
        let k1 = rng.random_range(-0.3..0.05);
        let k2 = if k1 < 0.0 { -0.4 * k1 } else { 0.0 };
        let camera = Camera {
            distortion: Distortion { k1, k2, ..Distortion::default() },
            ..Camera::pinhole(
                f_px,
                SIZE.centre_px() + Vector2::new(angle.cos(), angle.sin()) * radius,
            )
        };
        let noise_px = rng.random_range(0.08..0.3);
        Self { camera, noise_px, rng, whole_board: true }
    }

    /// A number with normal distribution about zero.
    pub fn normal(&mut self, sigma: f64) -> f64 {
        Normal::new(0.0, sigma).expect("not negative").sample(&mut self.rng)
    }

    /// The eight slots in opposed pairs as far as `count` goes, then views towards the picture's
    /// corners.
    pub fn plan(&mut self, count: usize) -> Vec<Pose> {
        const SLOTS: [f64; 8] = [0.0, 180.0, 90.0, 270.0, 45.0, 225.0, 135.0, 315.0];
        (0..count)
            .map(|index| {
                let corner = [[0.15, 0.12], [-0.15, -0.12], [-0.15, 0.12], [0.15, -0.12]];
                let off = if index < 8 { [0.0, 0.0] } else { corner[index % 4] };
                Pose {
                    tilt_deg: self.rng.random_range(36.0..46.0),
                    slot_deg: SLOTS[index % 8] + self.normal(4.0),
                    fill: if index < 8 { 0.65 } else { 0.5 } + self.normal(0.03),
                    off: [off[0] + self.normal(0.015), off[1] + self.normal(0.015)],
                }
            })
            .collect()
    }

    /// Pose of the hand's board for `pose`.
    pub fn cam_from_board(&mut self, pose: &Pose) -> Isometry3<f64> {
        let slot = (pose.slot_deg).to_radians();
        let axis = Vector3::new(slot.sin(), -slot.cos(), 0.0) * pose.tilt_deg.to_radians();
        let roll = self.normal(0.05);
        let turn = UnitQuaternion::from_scaled_axis(axis)
            * UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, roll));
        let width = f64::from(SIZE.width_px);
        let f_px = self.camera.f_px.x;
        let mut distance_m = f_px * 8.0 * 0.025 / (pose.fill * width);
        let mut off = pose.off;
        for _ in 0..60 {
            let ahead =
                Vector3::new(off[0] * width / f_px, off[1] * f64::from(SIZE.height_px) / f_px, 1.0);
            let held = Isometry3::from_parts(Translation3::from(ahead * distance_m), turn);
            if !self.whole_board || self.is_whole(&held) {
                return held;
            }
            distance_m *= 1.02;
            off = off.map(|share| share * 0.97);
        }
        unreachable!("a board far away in the middle is whole")
    }

    /// True if every corner is inside the picture, with a margin.
    pub fn is_whole(&self, pose: &Isometry3<f64>) -> bool {
        const MARGIN_PX: f64 = 8.0;
        board().corners_in_board_m().iter().all(|point| {
            self.camera.project_board_point(pose, point).is_some_and(|seen| {
                let fits = |x: f64, size: u32| x > MARGIN_PX && x < f64::from(size) - MARGIN_PX;
                fits(seen.px.x, SIZE.width_px) && fits(seen.px.y, SIZE.height_px)
            })
        })
    }

    /// Corners of the board through `project`, with noise.
    pub fn seen(
        &mut self,
        poses: &[Isometry3<f64>],
        mut project: impl FnMut(usize, &Isometry3<f64>, &Point2<f64>) -> Point2<f64>,
    ) -> Vec<Vec<Corner>> {
        let noise_px = self.noise_px;
        let board_m = board().corners_in_board_m();
        poses
            .iter()
            .enumerate()
            .map(|(view, pose)| {
                board_m
                    .iter()
                    .map(|point| {
                        let noise = Vector2::new(self.normal(noise_px), self.normal(noise_px));
                        Corner::isotropic(project(view, pose, point) + noise, noise_px)
                    })
                    .collect()
            })
            .collect()
    }

    /// A pose of the hand for each of `plan`.
    pub fn poses(&mut self, plan: &[Pose]) -> Vec<Isometry3<f64>> {
        plan.iter().map(|pose| self.cam_from_board(pose)).collect()
    }

    /// Views of `plan` through the scene's own camera.
    pub fn views(&mut self, plan: &[Pose]) -> Vec<Vec<Corner>> {
        let poses = self.poses(plan);
        let camera = self.camera;
        self.seen(&poses, |_, pose, point| px(&camera, pose, point))
    }
}

/// Pixel of a board point; the board is in front of the camera.
pub fn px(camera: &Camera, pose: &Isometry3<f64>, point: &Point2<f64>) -> Point2<f64> {
    at(camera, pose, &Point3::new(point.x, point.y, 0.0))
}

/// Pixel of a point near the board.
pub fn at(camera: &Camera, pose: &Isometry3<f64>, point: &Point3<f64>) -> Point2<f64> {
    camera.project(&(pose * point)).expect("in front of the camera")
}
