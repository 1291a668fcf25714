//! Cost of a calibration, linear in the number of corners.

use std::time::Duration;

use boresight_calibrate::{CalibrationParams, calibrate};
use boresight_geometry::{Camera, Corner, boards::Board, frame::ImageSize};
use nalgebra::{Isometry3, Point2, Vector3};
use rustix::time::{ClockId, clock_gettime};

const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

fn processor_time() -> Duration {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(now.tv_sec as u64, now.tv_nsec as u32)
}

/// `views` views of a square board.
fn corners(views: u32, board: &Board) -> Vec<Vec<Corner>> {
    let camera = Camera::pinhole(900.0, Point2::new(650.0, 350.0));
    let view = |number: u32| -> Vec<Corner> {
        let (sin, cos) = (f64::from(number) * 0.9).sin_cos();
        let tilt = Vector3::new(sin, -cos, 0.0) * (0.5 + 0.02 * f64::from(number % 7));
        let pose = Isometry3::new(Vector3::new(0.01 * sin, 0.01 * cos, 0.36), tilt);
        let px = |(i, point): (usize, &Point2<f64>)| {
            let px = camera.px_from_board(&pose, point)?;
            // Some noise, the same each time.
            let noise =
                ((i as f64 * 12.9898 + f64::from(number) * 78.233).sin() * 43758.5453).fract();
            Some(Corner::isotropic(px + nalgebra::Vector2::new(noise, -noise) * 0.05, 0.05))
        };
        board.corners_in_board_m().iter().enumerate().filter_map(px).collect()
    };
    (0..views).map(view).collect()
}

/// Processor time and peak memory of a calibration from `views` views of a square board.
fn cost(views: u32, side: u16) -> (Duration, u64) {
    let board = Board::new(side, side, 0.2 / f64::from(side)).expect("valid");
    let corners = corners(views, &board);
    let began = processor_time();
    let memory = allocation_counter::measure(|| {
        calibrate(&corners, &board, SIZE, &CalibrationParams::default()).expect("calibrates");
    });
    (processor_time() - began, memory.bytes_max)
}

#[test]
fn costs_grow_as_the_corners_do() {
    // The views are compared in pairs, and split in two: their number counts more than once.
    for (small, large, times) in
        [((6, 24), (6, 48), 10), ((60, 6), (240, 6), 7), ((150, 5), (1200, 5), 30)]
    {
        let (little_time, little_memory) = cost(small.0, small.1);
        let (time, memory) = cost(large.0, large.1);
        println!("{small:?} {little_time:?} {little_memory} B, {large:?} {time:?} {memory} B");
        assert!(time < times * little_time, "{time:?} for {little_time:?}");
        assert!(memory < 10 * little_memory, "{memory} B for {little_memory} B");
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let board = Board::new(9, 6, 0.025).expect("valid");
    let corners = corners(250, &board);
    let result = |threads: usize| {
        let params = CalibrationParams { threads, ..CalibrationParams::default() };
        // Floating-point numbers are printed with enough digits to tell them apart.
        format!("{:?}", calibrate(&corners, &board, SIZE, &params).expect("calibrates"))
    };
    let alone = result(1);
    for threads in [2, 3, 8] {
        assert!(result(threads) == alone, "{threads} threads");
    }
}
