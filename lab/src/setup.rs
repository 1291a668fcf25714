//! The paper's synthetic camera and board.

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use super::params::{Params, SetupParams};
use boresight_detect::{DetectorParams, detect};
use boresight_geometry::{Camera, Distortion, boards::Board, frame::ImageSize};
use boresight_sim::{Scene, render_view};

/// Number of slots, 45° apart.
pub const SLOTS: usize = 8;

/// Camera of known truth with a board rotating in front.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// True camera.
    pub camera: Camera,
    /// Size of the picture; corners outside it are kept, as in the paper.
    pub image_size: ImageSize,
    /// Rotating board.
    pub board: Board,
    /// Distance of the centre of rotation along the optical axis.
    pub distance_m: f64,
    /// Angle between the board and the image plane.
    pub tilt_rad: f64,
    /// True if corners are found by the detector in rendered pictures.
    pub rendered: bool,
}

/// Treatment of exact corners before an estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corners {
    /// Corners as computed, without error.
    Exact,
    /// Corners with independent normal errors of a standard deviation.
    Noisy {
        /// Standard deviation per axis.
        sigma_px: f64,
    },
    /// Corners rounded to whole pixels.
    Digitised,
}

impl Setup {
    /// Setup of `params`, with corners computed or found in rendered pictures as requested.
    pub fn of(params: &Params) -> Self {
        Self { rendered: params.rendered, ..Self::new(&params.setup, params.setup.square_m) }
    }

    /// Camera and board of [`SetupParams`], with squares of `square_m`; corners are computed.
    pub fn new(params: &SetupParams, square_m: f64) -> Self {
        let [k1, k2] = params.distortion;
        let distortion = Distortion { k1, k2, ..Distortion::default() };
        let [width_px, height_px] = params.image_size_px;
        Self {
            camera: Camera { distortion, ..Camera::pinhole(params.f_px, params.pp_px.into()) },
            image_size: ImageSize { width_px, height_px },
            board: board(params.board, square_m),
            distance_m: params.distance_m,
            tilt_rad: params.tilt_rad,
            rendered: false,
        }
    }

    /// Pose of the board tilted, shifted by `shift_m` (x across its principal line, y along), and
    /// then all of it rotated by `slot_rad` about an axis parallel to the optical one through
    /// `centre_m`.
    pub fn pose(
        &self,
        slot_rad: f64,
        shift_m: &Vector2<f64>,
        centre_m: &Vector2<f64>,
    ) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), slot_rad);
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.tilt_rad);
        Translation3::new(centre_m.x, centre_m.y, self.distance_m)
            * turn
            * Translation3::new(shift_m.x, shift_m.y, 0.0)
            * tilt
    }

    /// Poses of all slots, with the same shift and centre of rotation.
    pub fn slot_poses(
        &self,
        shift_m: &Vector2<f64>,
        centre_m: &Vector2<f64>,
    ) -> Vec<Isometry3<f64>> {
        (0..SLOTS).map(|slot| self.pose(slot_rad(slot), shift_m, centre_m)).collect()
    }

    /// Pixels of the board's corners: computed, or found in a rendered picture. `None` if a corner
    /// is behind the camera, or if the board is not found.
    pub fn corners_px(&self, cam_from_board: &Isometry3<f64>) -> Option<Vec<Point2<f64>>> {
        let exact: Option<Vec<Point2<f64>>> = self
            .board
            .corners_in_board_m()
            .iter()
            .map(|point| self.camera.px_from_board(cam_from_board, point))
            .collect();
        if self.rendered { self.found_px(cam_from_board, &exact?) } else { exact }
    }

    /// Corners found by the detector, in the order of `exact`: a board looks the same from both
    /// ends.
    fn found_px(
        &self,
        cam_from_board: &Isometry3<f64>,
        exact: &[Point2<f64>],
    ) -> Option<Vec<Point2<f64>>> {
        let scene = Scene {
            image_size: self.image_size,
            camera: self.camera,
            board: self.board,
            clutter: 0.0,
            ..Scene::default_720p(1)
        };
        let picture = render_view(&scene, cam_from_board);
        let seen = detect(&picture, &self.board, DetectorParams::default()).ok()?;
        let mut found: Vec<Point2<f64>> = seen.corners.iter().map(|corner| corner.px).collect();
        let first_off = |found: &[Point2<f64>]| {
            found.first().zip(exact.first()).map_or(f64::MAX, |(a, b)| (a - b).norm())
        };
        let forwards = first_off(&found);
        found.reverse();
        if first_off(&found) > forwards {
            found.reverse();
        }
        Some(found)
    }
}

impl Corners {
    /// `exact_px` as seen by an estimate.
    pub fn seen(self, exact_px: &[Point2<f64>], rng: &mut ChaCha8Rng) -> Vec<Point2<f64>> {
        let noise = match self {
            Self::Exact => return exact_px.to_vec(),
            Self::Digitised => {
                return exact_px.iter().map(|px| px.map(f64::round)).collect();
            }
            Self::Noisy { sigma_px } => Normal::new(0.0, sigma_px),
        };
        let Ok(noise) = noise else { return exact_px.to_vec() };
        exact_px.iter().map(|px| px.map(|value| value + noise.sample(rng))).collect()
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Noisy { .. } => "noisy",
            Self::Digitised => "digitised",
        }
    }
}

/// Direction of a slot.
pub fn slot_rad(slot: usize) -> f64 {
    std::f64::consts::TAU * slot as f64 / SLOTS as f64
}

/// Board with valid numbers: constants, or checked by [`Params::problem`].
pub(super) fn board([columns, rows]: [u16; 2], square_m: f64) -> Board {
    match Board::new(columns, rows, square_m) {
        Ok(board) => board,
        Err(problem) => unreachable!("{problem}"),
    }
}

/// Random numbers of a trial, independent of every other trial's.
pub fn chance(seed: u64, trial: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(trial);
    rng
}
