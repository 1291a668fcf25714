//! A whole session on the kernel's own camera drivers with slow control transfers, as of motor
//! lenses (`tests/vm/run.sh`). `BORESIGHT_CONTROLS_MS=60,250,1000` sets their durations; the
//! longest takes minutes.

use std::{fs, path::Path, process::Command};

use boresight::{
    frame::ImageSize,
    geometry::Camera,
    simulation::{Scene, render_view},
};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Vector3};
use tempfile::TempDir;

const MODE: &str = "320x240@7.5:YUYV";
const USUAL_MILLIS: &str = "60,250";
/// Number of frames of each pose: four seconds.
const HELD: usize = 30;

/// The board tipped towards `slot`, of eight.
fn pose(slot: usize) -> GrayImage {
    let scene = Scene {
        image_size: ImageSize { width_px: 320, height_px: 240 },
        camera: Camera::pinhole(280.0, Point2::new(161.0, 118.0)),
        clutter: 0.0,
        ..Scene::default_720p(7)
    };
    let (sin, cos) = (45.0 * slot as f64).to_radians().sin_cos();
    let turn = Vector3::new(sin, -cos, 0.0) * 40_f64.to_radians();
    render_view(&scene, &Isometry3::new(Vector3::new(0.002, -0.001, 0.25), turn))
}

/// A board repeating poses without regard to the targets.
fn save_poses(folder: &Path) {
    fs::create_dir(folder).expect("a folder");
    for slot in 0..8 {
        let still = pose(slot);
        for count in 0..HELD {
            // A sensor has noise: the same bytes would be the same picture.
            let mut picture = still.clone();
            for (at, value) in picture.iter_mut().enumerate() {
                *value = value.saturating_add(u8::from((at * 7 + count * 13) % 29 < 3));
            }
            let name = format!("{:04}.png", slot * HELD + count);
            picture.save(folder.join(name)).expect("written");
        }
    }
}

#[test]
#[ignore = "needs the machine of tests/vm"]
fn a_whole_session_is_taken_from_cameras_with_slow_controls() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vm");
    let camera = std::env::var("BORESIGHT_UVCSIM").expect("is run by tests/vm/run.sh");
    let folder = TempDir::new().expect("a folder");
    let (pictures, out) = (folder.path().join("pictures"), folder.path().join("out"));
    save_poses(&pictures);
    let limit = std::env::var("BORESIGHT_VM_SECS").unwrap_or_else(|_| "500".into());
    let millis = std::env::var("BORESIGHT_CONTROLS_MS").unwrap_or_else(|_| USUAL_MILLIS.into());
    let millis: Vec<&str> = millis.split(',').collect();
    let status = Command::new(here.join("vm.sh"))
        .args(["--uvcsim", &camera, "--timeout", &limit, "--pace", "counted"])
        .args(["--with", env!("CARGO_BIN_EXE_boresight"), "--pictures"])
        .arg(&pictures)
        .arg("--out")
        .arg(&out)
        .arg(here.join("slow_controls.sh"))
        .arg(MODE)
        .args(&millis)
        .status()
        .expect("the machine starts");
    assert!(status.success(), "{status}");
    let mut times_secs = Vec::new();
    for millis in &millis {
        let said = fs::read_to_string(out.join(format!("{millis}.txt"))).expect("written");
        let (views, stalls) = (said.matches("Taken: ").count(), said.matches("STR-").count());
        let secs = fs::read_to_string(out.join(format!("{millis}.secs"))).expect("written");
        let secs: u64 = secs.trim().parse().expect("a number");
        println!("controls of {millis} ms: {views} views in {secs} s, {stalls} interruptions");
        times_secs.push(secs);
        assert!(said.contains("Result:") && views >= 4 && stalls == 0, "{millis} ms: {said}");
        assert!(said.contains("exit status 0") || said.contains("exit status 3"), "{said}");
        assert!(out.join(millis).join("calibration.json").is_file(), "{millis} ms");
    }
    assert!(times_secs.is_sorted_by(|a, b| a < b), "the controls were not slow: {times_secs:?}");
}
