//! Pictures without a board: nothing is found in them, not even where one was a moment ago.
//!
//! More pictures, to measure: `BORESIGHT_PICTURES=10000`, half of them parts of the photographs in the folders that
//! `BORESIGHT_EMPTY` lists, separated by colons.

use std::path::{Path, PathBuf};

use boresight::{
    board::Checkerboard,
    detection::{Detection, Detector, DetectorParams, Quality, Search, Track},
    frame::{CaptureTime, FrameKind},
    geometry::Corner,
    simulation::{Scene, render_view},
};
use image::{
    GrayImage,
    imageops::{self, FilterType},
};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SIZES: [(u16, u16); 6] = [(9, 6), (8, 6), (7, 5), (11, 8), (10, 7), (6, 4)];

/// Pictures in the folders, the same order each time.
fn photographs() -> Vec<PathBuf> {
    let folders = std::env::var("BORESIGHT_EMPTY").unwrap_or_default();
    let mut all: Vec<PathBuf> = folders
        .split(':')
        .filter(|folder| !folder.is_empty())
        .flat_map(|folder| Path::new(folder).read_dir().expect("a folder"))
        .map(|entry| entry.expect("readable").path())
        .collect();
    all.sort();
    all
}

/// A part of a photograph at another scale, perhaps mirrored or turned upside down.
fn part_of(photograph: &GrayImage, rng: &mut ChaCha8Rng) -> GrayImage {
    let share = rng.random_range(0.35..1.0);
    let along = |size: u32| ((f64::from(size) * share) as u32).clamp(64.min(size), size);
    let (width, height) = (along(photograph.width()), along(photograph.height()));
    let left = rng.random_range(0..=photograph.width() - width);
    let top = rng.random_range(0..=photograph.height() - height);
    let part = imageops::crop_imm(photograph, left, top, width, height).to_image();
    let scale = rng.random_range(480.0..1280.0) / f64::from(width);
    let sized = |size: u32| ((f64::from(size) * scale) as u32).max(48);
    let part = imageops::resize(&part, sized(width), sized(height), FilterType::Triangle);
    match rng.random_range(0..4) {
        0 => imageops::flip_horizontal(&part),
        1 => imageops::flip_vertical(&part),
        _ => part,
    }
}

/// A picture of the background alone: the board is behind the camera's right shoulder.
fn background(seed: u64, rng: &mut ChaCha8Rng) -> GrayImage {
    let scene = Scene { clutter: rng.random_range(0.0..1.0), ..Scene::default_720p(seed) };
    render_view(&scene, &Isometry3::translation(30.0, 0.0, 0.5))
}

/// Frames of a board that was somewhere in the picture until now.
fn followed(board: &Checkerboard, (width, height): (u32, u32), rng: &mut ChaCha8Rng) -> Track {
    let scene = Scene { board: *board, ..Scene::default_720p(0) };
    let depth_m = rng.random_range(0.25..0.7);
    let axis = Vector3::from_fn(|_, _| rng.random_range(-0.6..0.6_f64));
    let at_m = Vector3::new(
        rng.random_range(-0.4..0.4) * depth_m,
        rng.random_range(-0.2..0.2) * depth_m,
        depth_m,
    );
    let pose = Isometry3::from_parts(at_m.into(), UnitQuaternion::from_scaled_axis(axis));
    let (across, down) = (f64::from(width) / 1280.0, f64::from(height) / 720.0);
    let corners: Vec<Corner> = board
        .corners_in_board_m()
        .iter()
        .map(|point| {
            let mut px = scene.camera.px_from_board(&pose, point).expect("in front");
            (px.x, px.y) = (px.x * across, px.y * down);
            Corner::isotropic(px, 0.1)
        })
        .collect();
    let quality = Quality { blur_px: 0.8, contrast: 80.0, glare: 0.0, motion_px: 0.0 };
    let mut track = Track::default();
    for nanos in [0, 33_000_000] {
        let seen = Ok(Detection { corners: corners.clone(), quality });
        track.add(FrameKind::Video, CaptureTime { nanos }, &seen);
    }
    track
}

#[test]
fn nothing_is_found_in_pictures_without_a_board() {
    let wanted: Option<u64> =
        std::env::var("BORESIGHT_PICTURES").ok().and_then(|count| count.parse().ok());
    let files = photographs();
    let mut rng = ChaCha8Rng::seed_from_u64(97);
    let mut detector = Detector::new(DetectorParams::default());
    let (mut real, mut rendered, mut alone, mut followed_on) = (0, 0, Vec::new(), Vec::new());
    let mut photograph: Option<(usize, GrayImage)> = None;
    let count = wanted.unwrap_or(60);
    for number in 0..count {
        let (columns, rows) = SIZES[rng.random_range(0..SIZES.len())];
        let board = Checkerboard::new(columns, rows, 0.025).expect("valid");
        let is_real = !files.is_empty() && number % 2 == 0;
        let picture = if is_real {
            // Each is opened once.
            let file = (number as usize * files.len()) / count as usize;
            if photograph.as_ref().is_none_or(|(open, _)| *open != file) {
                let image = image::open(&files[file]).expect("a picture").into_luma8();
                photograph = Some((file, image));
            }
            real += 1;
            part_of(&photograph.as_ref().expect("open").1, &mut rng)
        } else {
            rendered += 1;
            background(number, &mut rng)
        };
        if detector.detect(&picture, &board).is_ok() {
            alone.push((number, is_real, columns, rows));
        }
        let track = followed(&board, picture.dimensions(), &mut rng);
        let near = track.predict(FrameKind::Video, CaptureTime { nanos: 66_000_000 });
        let search = Search { near: near.as_ref(), ..Search::FULL };
        if detector.search(&picture, &board, search).is_ok() {
            followed_on.push((number, is_real, columns, rows));
        }
    }
    println!(
        "{real} parts of photographs, {rendered} rendered: found {alone:?}; where a board was followed {followed_on:?}"
    );
    assert!(alone.is_empty() && followed_on.is_empty());
}
