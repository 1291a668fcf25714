//! Strips of chequered cloth with a part of as many corners as the board: the remaining corners
//! expose the cloth.

use boresight_detect::{Detector, DetectorParams, Miss};
use boresight_geometry::boards::Board;
use image::{GrayImage, Luma};
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A strip of cloth on a plain wall.
struct Strip {
    /// Fields along and across the strip, from homogeneous pixels.
    fields_from_px: Matrix3<f64>,
    fields: [f64; 2],
    /// Grey levels of dark and light fields, and of the wall.
    levels: [f64; 3],
    size_px: [u32; 2],
    /// Cover in front of the strip: its grey level, and its edge as a line.
    cover: Option<(f64, Vector3<f64>)>,
}

const SMALL: [u32; 2] = [640, 360];

impl Strip {
    /// Pixels are the mean of nine places, with noise of up to five grey levels.
    fn picture(&self, seed: u64) -> GrayImage {
        const PLACES: [f64; 3] = [-1.0 / 3.0, 0.0, 1.0 / 3.0];
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let level = |x: f64, y: f64| {
            let px = Vector3::new(x, y, 1.0);
            if let Some((level, _)) = self.cover.filter(|(_, line)| line.dot(&px) > 0.0) {
                return level;
            }
            let at = self.fields_from_px * px;
            let [u, v] = [at.x / at.z, at.y / at.z];
            let is_cloth = (0.0..self.fields[0]).contains(&u) && (0.0..self.fields[1]).contains(&v);
            let is_dark = (u.floor() + v.floor()) % 2.0 == 0.0;
            self.levels[if !is_cloth { 2 } else { usize::from(!is_dark) }]
        };
        let [width, height] = self.size_px;
        GrayImage::from_fn(width, height, |x, y| {
            let (x, y) = (f64::from(x), f64::from(y));
            let sum: f64 =
                PLACES.iter().flat_map(|dx| PLACES.map(|dy| level(x + dx, y + dy))).sum();
            Luma([(sum / 9.0 + rng.random_range(-5.0..5.0)) as u8])
        })
    }

    /// Names the board in four pictures with different noise.
    fn is_refused(&self, (columns, rows): (u16, u16)) {
        let board = Board::new(columns, rows, 0.025).expect("valid");
        for seed in 0..4 {
            let seen = Detector::new(DetectorParams::default()).detect(&self.picture(seed), &board);
            assert!(matches!(seen, Err(Miss::OtherBoard(_))), "#{seed}: {seen:?}");
        }
    }
}

/// Three corners of the next row are in the picture.
#[test]
fn a_strip_that_leaves_the_picture_slantwise_is_no_board() {
    let strip = Strip {
        fields_from_px: Matrix3::new(
            0.124261,
            0.0477976,
            -54.6916,
            -0.00372091,
            0.0619971,
            -4.54041,
            0.00478605,
            -0.00182957,
            1.0,
        ),
        fields: [6.0, 14.0],
        levels: [28.0, 88.0, 170.0],
        size_px: SMALL,
        cover: None,
    };
    strip.is_refused((7, 5));
}

/// Too narrow for the coarse picture, where the remaining part looks like a board.
#[test]
fn a_strip_whose_far_end_is_too_small_is_no_board() {
    let strip = Strip {
        fields_from_px: Matrix3::new(
            -0.0320193,
            -0.0283107,
            19.7327,
            0.010914,
            -0.0435638,
            16.1622,
            -9.81663e-5,
            -0.00167481,
            1.0,
        ),
        fields: [5.0, 17.0],
        levels: [72.0, 133.0, 175.0],
        size_px: SMALL,
        cover: None,
    };
    strip.is_refused((6, 4));
}

/// The picture is wide, and halved first. Then the far fields are too small to be seen.
#[test]
fn a_strip_whose_far_end_is_too_small_in_half_the_picture_is_no_board() {
    let strip = Strip {
        fields_from_px: Matrix3::new(
            0.0294381,
            -0.0633083,
            22.2884,
            0.119719,
            0.00486659,
            -73.2,
            0.00145048,
            -0.00140534,
            1.0,
        ),
        fields: [16.0, 7.0],
        levels: [122.0, 60.0, 170.0],
        size_px: [1280, 720],
        cover: None,
    };
    strip.is_refused((10, 6));
}

/// Two corners of the next row are left.
#[test]
fn a_strip_that_something_covers_slantwise_is_no_board() {
    let strip = Strip {
        fields_from_px: Matrix3::new(
            -0.0278333,
            -0.0500376,
            27.8726,
            0.0580431,
            0.00321007,
            -24.927,
            -0.00139758,
            0.00170685,
            1.0,
        ),
        fields: [19.0, 6.0],
        levels: [40.0, 100.0, 150.0],
        size_px: SMALL,
        cover: Some((200.0, Vector3::new(-0.5098, -0.8603, 393.7391))),
    };
    strip.is_refused((7, 5));
}
