//! Calibration, and the comparison with an old lens, from corners beyond any detector.

use boresight::{
    boards::Board,
    calibration::{CalibrationParams, OldLens, calibrate, drift},
    frame::ImageSize,
    geometry::{Camera, Corner, LensMatrix},
    text,
};
use nalgebra::{Isometry3, Matrix2, Point2, Vector3};

use crate::{
    harness::{only_numbers, run},
    mutator::Mutator,
};

const SIZE: ImageSize = ImageSize { width_px: 640, height_px: 480 };
const ODD: [f64; 12] =
    [0.0, -1.0, 1e300, -1e300, 1e154, f64::NAN, f64::INFINITY, 1e-300, 1e8, -1e-9, 1e-30, 1e30];

fn board() -> Board {
    Board::new(4, 3, 0.03).expect("valid")
}

/// Views of the board as bytes: five numbers a corner, twelve corners a view.
fn views(mutator: &mut Mutator) -> Vec<u8> {
    let f_px = 300.0 + 900.0 * mutator.share();
    let camera = Camera::pinhole(f_px, SIZE.centre_px());
    let (alike, frontal) = (mutator.chance(0.15), mutator.chance(0.1));
    let mut numbers: Vec<f64> = Vec::new();
    let mut pose = Isometry3::identity();
    for view in 0..mutator.below(7) {
        if view == 0 || !alike {
            let azimuth = std::f64::consts::TAU * mutator.share();
            let tilt = if frontal { 0.0 } else { 1.2 * mutator.share() };
            let turn = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0) * tilt;
            let place =
                Vector3::new(0.1 * mutator.share() - 0.05, 0.08 * mutator.share() - 0.04, 0.3);
            pose = Isometry3::new(place, turn);
        }
        let first = numbers.len();
        for point in board().corners_in_board_m() {
            let px = camera.px_from_board(&pose, &point).unwrap_or(Point2::origin());
            let noise = 0.2 * mutator.share();
            numbers.extend([px.x + noise, px.y - noise, 0.01, 0.0, 0.01]);
        }
        if mutator.chance(0.25) {
            for _ in 0..1 + mutator.below(3) {
                let at = first + mutator.below(numbers.len() - first);
                numbers[at] = *mutator.one(&ODD);
            }
        }
        if mutator.chance(0.05) {
            let shorter = numbers.len() - 5 * mutator.below(12);
            numbers.truncate(shorter);
        }
    }
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}

fn corners(input: &[u8]) -> Vec<Vec<Corner>> {
    let number = |bytes: &[u8]| bytes.try_into().map_or(0.0, f64::from_le_bytes);
    let corner = |bytes: &[u8]| {
        let n: Vec<f64> = bytes.chunks_exact(8).map(number).collect();
        Corner::new(Point2::new(n[0], n[1]), Matrix2::new(n[2], n[3], n[3], n[4]))
    };
    let all: Vec<Corner> = input.chunks_exact(40).map(corner).collect();
    all.chunks(12).map(<[Corner]>::to_vec).collect()
}

#[test]
fn calibrations() {
    run("corners", views, |input| {
        match calibrate(&corners(input), &board(), SIZE, &CalibrationParams::default()) {
            Err(err) => {
                if text::not_calibrated(&err, &[]).0.is_empty() {
                    Err("no words".into())
                } else {
                    Ok(false)
                }
            }
            Ok(calibration) => only_numbers(&calibration).map(|()| true),
        }
    });
}

#[test]
fn comparisons() {
    let lens = OldLens {
        camera: Camera::pinhole(600.0, SIZE.centre_px()),
        covariance: Some(LensMatrix::identity() * 1e-4),
        outlines: &[],
        image_size: SIZE,
    };
    run("drift", views, |input| match drift(&corners(input), &board(), SIZE, &lens, None) {
        Err(_) => Ok(false),
        Ok(drift) => only_numbers(&drift).map(|()| true),
    });
}
