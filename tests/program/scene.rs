//! The scene behind the board decides whether the focus moved.

use std::{fs, path::Path};

use boresight::{
    geometry::Camera,
    simulation::{Scene, render_view},
};
use image::imageops::{FilterType, crop_imm, resize};
use nalgebra::{Isometry3, Vector3};
use serde_json::Value;
use tempfile::TempDir;

use crate::{
    person::{boresight, says},
    pictures,
};

/// Twelve views of a cluttered room; from the seventh on, the board alone is seen `of_board` times
/// as large, and then the whole picture `of_all` times.
fn write_views(folder: &Path, of_board: f64, of_all: f64) {
    for view in 0..12_u32 {
        let is_late = view >= 6;
        let scene = pictures::scene();
        let factor = if is_late { of_board } else { 1.0 };
        let camera = Camera { f_px: scene.camera.f_px * factor, ..scene.camera };
        let scene = Scene { camera, clutter: 1.0, ..scene };
        let (sin, cos) = (f64::from(view * 150).to_radians()).sin_cos();
        let turn = Vector3::new(sin, -cos, 0.0) * 40_f64.to_radians();
        let at = Vector3::new(0.03 * cos, 0.02 * sin, 0.45);
        let picture = render_view(&scene, &Isometry3::new(at, turn));
        let size = [picture.width(), picture.height()];
        let enlarged = size.map(|px| (f64::from(px) * of_all).round() as u32);
        let picture = if is_late && enlarged != size {
            let large = resize(&picture, enlarged[0], enlarged[1], FilterType::CatmullRom);
            let [left, top] = [0, 1].map(|i| (enlarged[i] - size[i]) / 2);
            crop_imm(&large, left, top, size[0], size[1]).to_image()
        } else {
            picture
        };
        picture.save(folder.join(format!("{view:02}.png"))).expect("saved");
    }
}

fn codes(file: &Path) -> Vec<String> {
    let json: Value = serde_json::from_slice(&fs::read(file).expect("written")).expect("JSON");
    let findings = json["findings"].as_array().expect("findings").iter();
    findings.map(|finding| finding["code"].as_str().expect("a code").to_owned()).collect()
}

#[test]
fn a_scene_that_keeps_its_scale_rules_the_focus_out() {
    let folder = TempDir::new().expect("folder");
    let calibrated = |name: &str| {
        let arguments = [
            "calibrate",
            name,
            "--board",
            "9x6",
            "--square",
            "25mm",
            "--out",
            "result.json",
            "--force",
        ];
        let ended = boresight(folder.path(), &arguments);
        (ended, codes(&folder.path().join("result.json")))
    };
    for name in ["still", "moved"] {
        fs::create_dir(folder.path().join(name)).expect("made");
    }
    write_views(&folder.path().join("still"), 1.03, 1.0);
    let (ended, found) = calibrated("still");
    says(&ended, 0, &["Looking at the scene behind the board", "it isn't the focus"]);
    assert!(found.contains(&"SCENE-STILL".into()), "{found:?}");
    assert!(!found.contains(&"FOCUS-MOVED".into()), "{found:?}");

    // A session asks once, and records the answer.
    let arguments =
        ["guide", "--headless", "--source", "still", "--board", "9x6", "--square", "25mm"];
    let ended = boresight(folder.path(), &[&arguments[..], &["--out", "session"]].concat());
    says(&ended, 0, &["Looking at the scene behind the board", "it isn't the focus"]);
    assert!(codes(&folder.path().join("session/calibration.json")).contains(&"SCENE-STILL".into()));
    let (again, found) = calibrated("session");
    assert!(found.contains(&"SCENE-STILL".into()), "{found:?}");
    assert!(!again.stderr.contains("Looking at the scene"), "{}", again.stderr);

    write_views(&folder.path().join("moved"), 1.0, 1.03);
    let (ended, found) = calibrated("moved");
    says(&ended, 3, &["Looking at the scene behind the board", "shows it, too"]);
    assert!(found.contains(&"FOCUS-MOVED".into()), "{found:?}");
}
