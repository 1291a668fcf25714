//! `boresight calibrate --rig`: two cameras and one board.

use std::{f64::consts::TAU, fmt::Write, fs, path::Path};

use boresight_geometry::{Camera, boards::Board};
use nalgebra::{Isometry3, Point2, Vector3};

use crate::{
    person::{boresight, says},
    platform::json,
};

/// Baseline of the cameras, in metres.
const BASELINE_M: f64 = 0.12;

/// Lines of `detect --json` of twelve pictures of a 9x6 board, by the camera at `cam_from_rig`.
/// `wrong_from` shows the boards of other instants from that picture on.
fn table(cam_from_rig: &Isometry3<f64>, wrong_from: usize) -> String {
    let board = Board::new(9, 6, 0.025).expect("a board");
    let camera = Camera::pinhole(900.0, Point2::new(645.0, 352.0));
    let mut lines = String::new();
    for picture in 0..12 {
        let shown = if picture >= wrong_from { (picture * 5 + 3) % 12 } else { picture };
        let (sin, cos) = (TAU / 8.0 * shown as f64).sin_cos();
        let near_m = 0.45 + 0.05 * (shown % 3) as f64;
        let at = Vector3::new(0.06 + 0.05 * cos, 0.04 * sin, near_m);
        let board_in_rig = Isometry3::new(at, Vector3::new(sin, -cos, 0.0) * 0.6);
        let corners: Vec<String> = board
            .corners_in_board_m()
            .iter()
            .enumerate()
            .map(|(place, point)| {
                let px = camera.px_from_board(&(cam_from_rig * board_in_rig), point);
                let px = px.expect("in front of the camera");
                // Errors of up to 0.1 px.
                let off = |seed: f64| 0.1 * ((seed * 12.9898).sin() * 43_758.5).fract();
                let seed = (1000 * picture + place) as f64 + 7.0 * cam_from_rig.translation.x;
                let (x, y) = (px.x + off(seed), px.y + off(seed + 0.5));
                format!("[{},{},{x},{y},0.05]", place % 9, place / 9)
            })
            .collect();
        let _ = writeln!(
            lines,
            r#"{{"file":"{picture:04}.png","found":true,"reason":null,"board":[9,6],"corners":[{}]}}"#,
            corners.join(",")
        );
    }
    lines
}

fn write_tables(place: &Path, wrong_from: usize) {
    let second = Isometry3::translation(-BASELINE_M, 0.0, 0.0);
    let left = table(&Isometry3::identity(), usize::MAX);
    fs::write(place.join("left.jsonl"), left).expect("written");
    fs::write(place.join("right.jsonl"), table(&second, wrong_from)).expect("written");
}

const RIG: [&str; 8] = [
    "calibrate",
    "--rig",
    "left.jsonl",
    "near=right.jsonl",
    "--board",
    "9x6",
    "--image-size",
    "1280x720",
];

#[test]
fn two_cameras_give_their_baseline_and_files_for_other_programs() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    write_tables(place, usize::MAX);
    let with_out = [&RIG[..], &["--out", "rig.json"]].concat();
    let ended = boresight(place, &with_out);
    says(&ended, 0, &["Good: every pair", "left to near: 1", "12 common places", "rig.json"]);
    let rig = json(&fs::read_to_string(place.join("rig.json")).expect("readable"));
    assert_eq!((&rig["schema"], &rig["verdict"]), (&"boresight.rig/1".into(), &"good".into()));
    let pair = &rig["pairs"][0];
    let number = |key: &str| pair[key].as_f64().expect("a number");
    assert!((number("baseline_m") - BASELINE_M).abs() < 3.0 * number("baseline_sd_m"), "{pair}");
    // Two lenses of nine numbers, the second camera's place, and the board's shape.
    let order = rig["covariance"]["order"].as_array().expect("names");
    assert_eq!(order.len(), 9 + 9 + 6 + 4);
    says(&boresight(place, &with_out), 1, &["already a file"]);

    let exported = |more: &[&str]| boresight(place, &[&["export", "rig.json"][..], more].concat());
    let stereo = exported(&["--format", "opencv-stereo", "--name", "near,left"]);
    says(&stereo, 0, &[]);
    assert!(stereo.stdout.contains("from near to left") && stereo.stdout.contains("\nQ: "));
    says(&exported(&["--name", "left"]), 0, &[]);
    says(&exported(&[]), 1, &["names one of its cameras, left, near"]);
    says(&exported(&["--format", "opencv-stereo", "--name", "left,far"]), 1, &["left, near"]);
    let colmap = exported(&["--format", "colmap-rig"]);
    assert!(colmap.stdout.contains("\"near/\""), "{}", colmap.stdout);
}

#[test]
fn a_camera_that_was_knocked_since_is_told() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    write_tables(place, usize::MAX);
    let with_out = [&RIG[..], &["--out", "rig.json"]].concat();
    says(&boresight(place, &with_out), 0, &["Good"]);
    let check = ["check", "--against", "rig.json", "--image-size", "1280x720", "--rig"];
    let check = [&check[..], &["left.jsonl", "near=right.jsonl"]].concat();
    says(&boresight(place, &check), 0, &["left to near: OK", "no camera has moved"]);
    let knocked = Isometry3::new(Vector3::new(-BASELINE_M, 0.0, 0.0), Vector3::x() * 0.01);
    fs::write(place.join("right.jsonl"), table(&knocked, usize::MAX)).expect("written");
    says(&boresight(place, &check), 4, &["left to near: MOVED", "Tighten the mounts"]);
    let unknown = [&check[..6], &["left.jsonl", "far=right.jsonl"]].concat();
    says(&boresight(place, &unknown), 1, &["isn't a camera", "left, near"]);
}

#[test]
fn two_of_three_cameras_are_checked_without_the_third() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    write_tables(place, usize::MAX);
    let third = Isometry3::translation(-0.5 * BASELINE_M, 0.02, 0.0);
    fs::write(place.join("third.jsonl"), table(&third, usize::MAX)).expect("written");
    let three = [&RIG[..4], &["third.jsonl"], &RIG[4..], &["--out", "rig.json"]].concat();
    says(&boresight(place, &three), 0, &["Good", "third"]);
    let check = ["check", "--against", "rig.json", "--image-size", "1280x720", "--rig"];
    let two = [&check[..], &["third.jsonl", "near=right.jsonl"]].concat();
    says(&boresight(place, &two), 0, &["OK, displaced", "no camera has moved"]);
}

#[test]
fn pictures_of_other_moments_are_refused() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    write_tables(place, 0);
    says(&boresight(place, &RIG), 3, &["NOT-PAIRS", "left, near", "same moments"]);
    let one = [&RIG[..3], &RIG[4..]].concat();
    says(&boresight(place, &one), 1, &["two cameras or more"]);
    let twice = [&RIG[..3], &["left.jsonl"], &RIG[4..]].concat();
    says(&boresight(place, &twice), 1, &["two cameras are called"]);
    let unknown = [&RIG[..], &["--known-lens", "far=rig.json"]].concat();
    says(&boresight(place, &unknown), 2, &["no camera is called"]);
}
