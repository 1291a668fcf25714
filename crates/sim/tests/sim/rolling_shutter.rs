//! A camera with sequential rows shows each with the board at its own time.

use std::time::Duration;

use boresight_capture::{Arrival, FrameSource};
use boresight_detect::{DetectorParams, detect};
use boresight_sim::{
    Light, NoCues, Renderer, Scene, SyntheticSource,
    technician::{Person, Technician},
};
use image::GrayImage;
use nalgebra::{Isometry3, Point3};

use crate::simulation::{corners_px, edge_px, pose, secs};

/// A pinhole camera without noise in even light: the light on a row tells the position of its edge.
fn plain(seed: u64) -> Scene {
    let mut scene = Scene { noise_sigma: 0.0, ..Scene::default_720p(seed) };
    scene.camera.distortion = Default::default();
    scene.light = Light { gradient: 0.0, vignette: 0.0, ..scene.light };
    scene
}

/// Rows of upright edges, and displacement to the right from the middle of the picture's time, with
/// a board moving to the right at `speed_px_per_s`.
fn shear_px(speed_px_per_s: f64, readout_secs: f64, exposure_secs: f64) -> Vec<(f64, f64)> {
    let scene = plain(1);
    let middle = pose([0.0; 3], [0.0013, -0.0021, 0.33]);
    let metres_per_px = middle.translation.z / scene.camera.f_px.x;
    let last_row = f64::from(scene.image_size.height_px - 1);
    let of_row = |row: u32| -> Vec<Isometry3<f64>> {
        let row_secs = (f64::from(row) / last_row - 0.5) * readout_secs;
        (0..8)
            .map(|i| row_secs + ((f64::from(i) + 0.5) / 8.0 - 0.5) * exposure_secs)
            .map(|secs| {
                let mut moved = middle;
                moved.translation.x += speed_px_per_s * secs * metres_per_px;
                moved
            })
            .collect()
    };
    let mut picture = GrayImage::new(1, 1);
    Renderer::new(&scene).render_rolling(&of_row, 0, &mut picture);
    let corners_m = scene.board.corners_in_board_m();
    let edge = |corner_m: &nalgebra::Point2<f64>| {
        let at = middle * Point3::new(corner_m.x, corner_m.y + 0.5 * scene.board.square_m(), 0.0);
        let px = scene.camera.project(&at).expect("in front");
        let row = px.y.round();
        let expected_px = speed_px_per_s * (row / last_row - 0.5) * readout_secs;
        let near = nalgebra::Point2::new((px.x + expected_px).round(), row);
        (row, edge_px(&scene, &picture, &near) + near.x - px.x)
    };
    corners_m.iter().map(edge).collect()
}

#[test]
fn a_moving_board_is_sheared_by_its_speed_times_the_readout() {
    for (speed_px_per_s, readout_ms, exposure_ms) in
        [(400.0, 20.0, 2.0), (-250.0, 30.0, 8.0), (900.0, 10.0, 1.0), (400.0, 0.0, 2.0)]
    {
        let edges = shear_px(speed_px_per_s, 1e-3 * readout_ms, 1e-3 * exposure_ms);
        let mut farthest_px = 0.0_f64;
        for (row, right_px) in &edges {
            let wanted_px = speed_px_per_s * 1e-3 * readout_ms * (row / 719.0 - 0.5);
            farthest_px = farthest_px.max((right_px - wanted_px).abs());
        }
        println!("{speed_px_per_s} px/s, {readout_ms} ms: off by {farthest_px:.3} px at most");
        assert!(farthest_px < 0.1, "off by {farthest_px} px");
        let rows = edges.iter().map(|(row, _)| *row).fold(0.0, f64::max)
            - edges.iter().map(|(row, _)| *row).fold(f64::INFINITY, f64::min);
        assert!(rows > 250.0, "the edges reach over {rows} rows");
    }
}

/// Rms distance of the corners detected in pictures of a hand's board from the truth at the time of
/// the rows, and in the middle of the picture's time.
fn off_px(readout_secs: f64) -> [f64; 2] {
    let scene = Scene {
        technician: Person::Shaky.params(),
        noise_sigma: 1.0,
        exposure_secs: 0.002,
        readout_secs,
        ..Scene::default_720p(5)
    };
    let mut person = Technician::new(&scene);
    // Each millisecond, since the person moves only forward.
    let way: Vec<Isometry3<f64>> =
        (0..2000).map(|ms| person.pose_at(secs(1e-3 * f64::from(ms)))).collect();
    let last_row = f64::from(scene.image_size.height_px - 1);
    let mut source = SyntheticSource::new(scene.clone(), Box::new(NoCues), Some(50), 2);
    let truth = source.truth();
    let (mut squares, mut count) = ([0.0; 2], 0.0);
    while let Arrival::Frame(frame) = source.next_frame(Duration::ZERO).expect("never breaks") {
        if frame.id.0 % 7 != 0 {
            continue;
        }
        let found = detect(&frame.image, &scene.board, DetectorParams::default()).expect("whole");
        let middle = truth.snapshot().poses.last().expect("a pose").1;
        let middle_ms = 1e-6 * frame.captured_at.nanos as f64;
        for (index, corner) in found.corners.iter().enumerate() {
            let row_ms = middle_ms + 1e3 * readout_secs * (corner.px.y / last_row - 0.5);
            let then = corners_px(&scene, &way[row_ms.round() as usize])[index];
            let in_middle = corners_px(&scene, &middle)[index];
            squares[0] += (corner.px - then).norm_squared();
            squares[1] += (corner.px - in_middle).norm_squared();
            count += 1.0;
        }
    }
    assert!(count > 300.0, "{count} corners");
    squares.map(|sum| f64::sqrt(sum / count))
}

#[test]
fn corners_are_where_the_hand_held_the_board_when_their_row_was_read() {
    let [then_px, in_middle_px] = off_px(0.030);
    println!("30 ms: {then_px:.3} px off at the row's time, {in_middle_px:.3} px at the picture's");
    assert!(then_px < 0.05 && in_middle_px > 2.0 * then_px, "{then_px}, {in_middle_px} px");
    let [then_px, in_middle_px] = off_px(0.0);
    println!("0 ms: {then_px:.3} px off, {in_middle_px:.3} px");
    assert!(then_px < 0.05 && in_middle_px < 0.05, "{then_px}, {in_middle_px} px");
}
