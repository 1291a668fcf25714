//! Scene in front of the simulated camera, with lens and sensor.

use std::f64::consts::TAU;

use nalgebra::{Point2, Point3, Vector2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{bend::Bend, rng_stream::RngStream, technician::params::TechnicianParams};
use boresight_geometry::{
    Camera, Distortion, board_code::BoardId, boards::Board, frame::ImageSize,
};

/// Simulated room, person and camera. Equal scenes give equal pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Size of every picture.
    pub image_size: ImageSize,
    /// True lens.
    pub camera: Camera,
    /// Board held up.
    pub board: Board,
    /// Identity in the code in the board's margin, with counts and squares; `None` for a board
    /// without code.
    pub board_id: Option<BoardId>,
    /// Height of the bend: offset of the board's middle along the z-axis (away from the camera)
    /// from the ends of the longer side's corners, as a parabola. Metres; 0 for a flat board.
    pub bend_m: f64,
    /// Frame interval.
    pub frame_interval_nanos: u64,
    /// Brightness of the board and of the room.
    pub light: Light,
    /// Standard deviation of the sensor's noise, grey levels.
    pub noise_sigma: f64,
    /// Optical blur: standard deviation of a Gaussian, before the pixels' own averaging.
    pub psf_sigma_px: f64,
    /// Exposure time; motion during the exposure is smeared.
    pub exposure_secs: f64,
    /// Time from reading the first row to reading the last; 0 for a global shutter. Limited to the
    /// frame interval.
    pub readout_secs: f64,
    /// Clutter of the background, 0 (plain wall) to 1.
    pub clutter: f64,
    /// Person with the board.
    pub technician: TechnicianParams,
}

/// Brightness of the board and of the room, in grey levels of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Grey level of the board's ink in the middle of the picture.
    pub dark_level: f64,
    /// Grey level of the board's paper in the middle of the picture.
    pub light_level: f64,
    /// Relative change of brightness from the middle to a corner's distance.
    pub gradient: f64,
    /// Direction of increasing brightness in the picture.
    pub gradient_direction_rad: f64,
    /// Relative loss of brightness in the corners.
    pub vignette: f64,
}

impl Light {
    /// Brightness at `px` relative to the middle of the picture.
    pub fn gain(&self, px: &Point2<f64>, image_size: ImageSize) -> f64 {
        let centre_px = image_size.centre_px();
        let from_centre = (px - centre_px) / centre_px.coords.norm().max(1.0);
        let (sin, cos) = libm::sincos(self.gradient_direction_rad);
        let slope = 1.0 + self.gradient * (from_centre.x * cos + from_centre.y * sin);
        (slope * (1.0 - self.vignette * from_centre.norm_squared())).max(0.0)
    }
}

impl Default for Light {
    fn default() -> Self {
        Self {
            dark_level: 32.0,
            light_level: 196.0,
            gradient: 0.15,
            gradient_direction_rad: 0.6,
            vignette: 0.12,
        }
    }
}

impl Scene {
    /// Inner corners of the bent board, in the board's frame and in numbering order.
    pub fn corners_as_bent_m(&self) -> Vec<Point3<f64>> {
        let bend = Bend::new(&self.board, self.bend_m);
        let square_m = self.board.measured_m();
        let height_m = |at: &Point2<f64>| {
            bend.map_or(0.0, |bend| square_m * f64::from(bend.height((at / square_m).cast())))
        };
        let corners = self.board.corners_in_board_m();
        corners.iter().map(|at| Point3::new(at.x, at.y, height_m(at))).collect()
    }

    /// Ordinary webcam in a lit room: noise and blur scatter corners by about 0.1 px, an exposure
    /// takes 16 ms, rows are read within 15 ms, and the board is bent by 0.2 mm. Otherwise
    /// [`default_720p`](Self::default_720p).
    ///
    /// Public videos of hand-held boards have exposures of 5 to 60 ms, and residuals of 0.05 to 0.3
    /// px.
    pub fn ordinary_webcam(seed: u64) -> Self {
        Self {
            bend_m: 0.000_2,
            light: Light { dark_level: 50.0, light_level: 130.0, ..Light::default() },
            noise_sigma: 12.0,
            psf_sigma_px: 2.2,
            exposure_secs: 0.016,
            readout_secs: 0.015,
            ..Self::default_720p(seed)
        }
    }

    /// Scene of `boresight demo`: a decent webcam in good light, with noise and blur that scatter
    /// corners by about 0.05 px, an exposure of 8 ms, rows read within 10 ms, and a flat board in
    /// an adult's hands. Otherwise [`default_720p`](Self::default_720p).
    pub fn demo(seed: u64) -> Self {
        Self {
            name: "demo".to_owned(),
            light: Light { dark_level: 50.0, light_level: 150.0, ..Light::default() },
            noise_sigma: 8.0,
            psf_sigma_px: 1.6,
            readout_secs: 0.010,
            ..Self::default_720p(seed)
        }
    }

    /// Quiet HD camera with a short exposure, a global shutter and a mild barrel lens, and a flat
    /// 9×6 board of 25 mm squares.
    pub fn default_720p(seed: u64) -> Self {
        Self {
            name: "webcam".to_owned(),
            seed,
            image_size: ImageSize { width_px: 1280, height_px: 720 },
            camera: Camera {
                distortion: Distortion { k1: -0.12, k2: 0.05, ..Distortion::default() },
                ..Camera::pinhole(980.0, Point2::new(653.4, 348.2))
            },
            board: default_board(),
            board_id: None,
            bend_m: 0.0,
            frame_interval_nanos: 1_000_000_000 / 30,
            light: Light::default(),
            noise_sigma: 2.0,
            psf_sigma_px: 0.7,
            exposure_secs: 0.008,
            readout_secs: 0.0,
            clutter: 0.5,
            technician: TechnicianParams::default(),
        }
    }

    /// Uncalibrated camera with f, PP, distortion, noise, blur and light drawn at random.
    pub fn random(seed: u64) -> Self {
        let mut rng = RngStream::Lens.rng(seed);
        let scene = Self::default_720p(seed);
        let camera = loop {
            let camera = random_camera(&mut rng, scene.image_size);
            if sees_whole_picture(&camera, scene.image_size) {
                break camera;
            }
        };
        Self {
            name: format!("random-{seed}"),
            camera,
            light: Light {
                dark_level: rng.random_range(20.0..50.0),
                light_level: rng.random_range(150.0..215.0),
                gradient: rng.random_range(0.0..0.2),
                gradient_direction_rad: rng.random_range(0.0..TAU),
                vignette: rng.random_range(0.0..0.25),
            },
            noise_sigma: rng.random_range(1.0..4.0),
            psf_sigma_px: rng.random_range(0.5..1.0),
            ..scene
        }
    }
}

fn default_board() -> Board {
    // The numbers are valid, and `new` is the only constructor of a board.
    match Board::new(9, 6, 0.025) {
        Ok(board) => board,
        Err(_) => unreachable!("9x6 of 25 mm is a board"),
    }
}

fn random_camera(rng: &mut ChaCha8Rng, image_size: ImageSize) -> Camera {
    let f_px = rng.random_range(800.0..1400.0);
    let (off_px, direction_rad) = (rng.random_range(0.0..60.0_f64), rng.random_range(0.0..TAU));
    let k1: f64 = rng.random_range(-0.35..0.1);
    let k2 = rng.random_range(0.3..0.5) * (-k1).max(0.0);
    let pp_px = image_size.centre_px()
        + off_px * Vector2::new(libm::cos(direction_rad), libm::sin(direction_rad));
    Camera {
        distortion: Distortion { k1, k2, ..Distortion::default() },
        ..Camera::pinhole(f_px, pp_px)
    }
}

/// True if every pixel, and a little beyond, has a ray.
fn sees_whole_picture(camera: &Camera, image_size: ImageSize) -> bool {
    let beyond_px = 20.0;
    let (right, bottom) =
        (f64::from(image_size.width_px) + beyond_px, f64::from(image_size.height_px) + beyond_px);
    [(-beyond_px, -beyond_px), (right, -beyond_px), (-beyond_px, bottom), (right, bottom)]
        .iter()
        .all(|&(x, y)| camera.ray_from_px(&Point2::new(x, y)).is_some())
}
