//! `boresight check`: an installed camera, on site, against its old calibration.

use std::{fs, path::Path};

use serde_json::Value;

use crate::person::{boresight, contents, says};

/// A small camera, quick to render.
fn scene(folder: &Path, name: &str, more: &str) -> String {
    let table = if more.contains("[technician]") { "" } else { "[technician]\n" };
    let text = format!(
        "name = \"installed\"\nseed = 3\nfps = 12\nf_px = 520\ndistortion = [-0.1, 0.02, 0, 0, 0]\n{more}\n\
         {table}person = \"tripod\"\n"
    );
    let file = folder.join(name);
    fs::write(&file, text).expect("written");
    format!("sim:{name}")
}

/// Calibrates the original camera: the file for later checks.
fn calibrated(folder: &Path) -> &'static str {
    let source = scene(folder, "before.toml", "image_size_px = [640, 480]\npp_px = [322, 238]");
    let ended = boresight(folder, &["guide", "--headless", "--source", &source, "--out", "old"]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    "old/calibration.json"
}

fn verdict(stdout: &str) -> Value {
    serde_json::from_str(stdout.lines().last().expect("a line")).expect("JSON")
}

#[test]
fn a_camera_is_checked_and_only_a_changed_one_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let old = calibrated(folder);
    let kept = fs::read(folder.join(old)).expect("readable");

    // Unchanged; another day, another hand.
    let same = scene(
        folder,
        "same.toml",
        "image_size_px = [640, 480]\npp_px = [322, 238]\n[technician]\nreaction_secs = 0.3",
    );
    let check = ["check", "--against", old, "--json", "--same-camera", "--source"];
    let limited = ["--out", "first", "--limit", "8px"];
    let ended = boresight(folder, &[&check[..], &[&same], &limited[..]].concat());
    says(&ended, 0, &["OK", "smallest detectable change", "first/check.json", "first/report.html"]);
    let page = fs::read_to_string(folder.join("first/report.html")).expect("readable");
    assert!(page.contains("id=\"drift\"") && page.contains(old));
    let found = verdict(&ended.stdout);
    assert_eq!(found["schema"], "boresight.check/1");
    assert_eq!(found["verdict"], "ok");
    assert_eq!(found["uncertainty_of_old"], "stated");
    let taken = ended.stderr.matches("Taken: view").count();
    assert!((4..=8).contains(&taken), "{}", ended.stderr);
    assert_eq!(found["views_used"], taken);
    let saved = fs::read_to_string(folder.join("first/check.json")).expect("readable");
    assert_eq!(serde_json::from_str::<Value>(&saved).expect("JSON"), found);

    // What four views can't see, they don't call fine.
    let sharp = ["--out", "sharp", "--limit", "0.05"];
    let ended = boresight(folder, &[&check[..], &[&same], &sharp[..]].concat());
    says(&ended, 3, &["CAN'T TELL", "could hide", "more views"]);
    assert_eq!(verdict(&ended.stdout)["verdict"], "cannot-tell");
    let wrong = boresight(folder, &[&check[..], &[&same, "--limit", "0"]].concat());
    says(&wrong, 2, &["--limit"]);

    // Knocked: the lens sits 5 px further left.
    let moved = scene(folder, "moved.toml", "image_size_px = [640, 480]\npp_px = [317, 238]");
    let again = ["--out", "second", "--recalibrate"];
    let ended = boresight(folder, &[&check[..], &[&moved], &again[..]].concat());
    says(&ended, 0, &["RECALIBRATE", "Recalibrate.", "Good"]);
    let checked = fs::read_to_string(folder.join("second/check.json")).expect("readable");
    let found: Value = serde_json::from_str(&checked).expect("JSON");
    assert_eq!(found["verdict"], "recalibrate");
    let shift = found["change"]["pp_px"][0].as_f64().expect("a number");
    let sd = found["change"]["sigma"]["pp_px"][0].as_f64().expect("a number");
    assert!((shift + 5.0).abs() < 5.0 * sd, "{shift} ± {sd}");
    // The new calibration names the unchanged old one.
    let new = verdict(&ended.stdout);
    assert_eq!(new["schema"], "boresight.calibration/1");
    assert_eq!(new["replaces"], old);
    assert_eq!(fs::read(folder.join(old)).expect("readable"), kept);

    // Without a wish to continue, the exit code tells.
    let ended = boresight(folder, &[&check[..], &[&moved, "--out", "third"]].concat());
    says(
        &ended,
        4,
        &[
            "RECALIBRATE",
            "boresight guide --source",
            "--board 9x6 --square 25mm --against old/calibration.json",
        ],
    );

    // A full session reports it, too; its own verdict decides the exit code.
    let full = ["guide", "--headless", "--json", "--against", old, "--source", &moved];
    let ended = boresight(folder, &[&full[..], &["--out", "fourth"]].concat());
    says(
        &ended,
        0,
        &["Good", "Compared with old/calibration.json:", "RECALIBRATE", "Use the new calibration"],
    );
    assert_eq!(verdict(&ended.stdout)["replaces"], old);
    let checked = fs::read_to_string(folder.join("fourth/check.json")).expect("readable");
    let found: Value = serde_json::from_str(&checked).expect("JSON");
    assert_eq!(found["verdict"], "recalibrate");
    let page = fs::read_to_string(folder.join("fourth/report.html")).expect("readable");
    assert!(page.contains("id=\"drift\"") && page.contains("boresight guide --against"));
    let nowhere = ["guide", "--headless", "--against", "nowhere.json", "--out", "fifth"];
    says(&boresight(folder, &nowhere), 1, &["nowhere.json"]);
    assert!(!folder.join("fifth").exists(), "nothing was recorded");

    // Another camera, another mode, no file, no calibration: no verdict, and nothing is recorded.
    let before = contents(folder);
    let other = ["check", "--against", old, "--json", "--source", &same];
    let ended = boresight(folder, &other);
    says(&ended, 3, &["NO VERDICT", "--same-camera"]);
    assert_eq!(verdict(&ended.stdout)["reason"], "OTHER-CAMERA");
    assert_eq!(contents(folder), before);
    let wide = scene(folder, "wide.toml", "image_size_px = [800, 600]\npp_px = [400, 300]");
    let ended = boresight(folder, &[&check[..], &[&wide]].concat());
    says(&ended, 3, &["NO VERDICT", "800x600", "640x480"]);
    assert_eq!(verdict(&ended.stdout)["reason"], "OTHER-SIZE");
    says(&boresight(folder, &["check", "--against", "nowhere.json"]), 1, &["nowhere.json"]);
    fs::write(folder.join("not.json"), "{}").expect("written");
    says(&boresight(folder, &["check", "--against", "not.json"]), 1, &["not.json"]);
}

/// Without boards and pictures: a file that no lens can have made.
#[test]
fn a_file_that_is_no_lens_is_not_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let source = scene(folder, "any.toml", "image_size_px = [640, 480]");
    let file = "image_width: 640\nimage_height: 480\n\
                camera_matrix: {rows: 3, cols: 3, data: [520, 0, 320, 0, 520, 240, 0, 0, 1]}\n\
                distortion_model: plumb_bob\n\
                distortion_coefficients: {rows: 1, cols: 5, data: [16, -4242, 0, 0, 294239]}\n";
    fs::write(folder.join("ost.yaml"), file).expect("written");
    let before = contents(folder);
    let check = ["check", "--against", "ost.yaml", "--json", "--source", &source];
    let ended = boresight(folder, &check);
    says(&ended, 3, &["isn't a lens that can be right", "Don't use the file"]);
    assert_eq!(verdict(&ended.stdout)["reason"], "LENS-IMPOSSIBLE");
    assert_eq!(contents(folder), before);
}

/// A file of another program may never have been right, and that is no change of the camera: what
/// its own pictures say is checked instead.
#[test]
fn a_file_without_uncertainty_is_judged_before_the_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let old = calibrated(folder);
    let export = ["export", old, "--format", "ros-yaml", "--out", "ost.yaml"];
    says(&boresight(folder, &export), 0, &["Written"]);
    let source = scene(folder, "before.toml", "image_size_px = [640, 480]\npp_px = [322, 238]");
    let against = |file: &str| {
        let out = ["--out", "checked", "--limit", "8px"];
        let check = ["check", "--against", file, "--json", "--same-camera", "--source", &source];
        boresight(folder, &[&check[..], &out[..]].concat())
    };
    let before = contents(folder);
    let ended = against("ost.yaml");
    let command = "boresight judge FILE PICTURES --out calibration.json";
    says(&ended, 3, &["NO VERDICT", "may never have been right", command]);
    assert_eq!(verdict(&ended.stdout)["reason"], "NOT-JUDGED");
    assert_eq!(contents(folder), before, "no camera was opened");
    let judge = ["judge", "ost.yaml", "old", "--out", "calibration.json"];
    says(&boresight(folder, &judge), 0, &["TRUE", "Written: calibration.json"]);
    says(&against("calibration.json"), 0, &["OK: no change detected"]);
}

/// A recalibrated session is still a session of the same camera, simulated or not.
#[test]
fn a_session_calibrated_again_keeps_its_source() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let old = calibrated(folder);
    let again = ["calibrate", "old", "--out", "again.json", "--report", "again.html"];
    says(&boresight(folder, &again), 0, &["Good (SIMULATED)"]);
    let read = |name: &str| fs::read_to_string(folder.join(name)).expect("readable");
    let file = |name: &str| serde_json::from_str::<Value>(&read(name)).expect("JSON");
    for field in ["source", "camera"] {
        assert_eq!(file("again.json").get(field), file(old).get(field), "{field}");
    }
    for page in ["old/report.html", "again.html"] {
        assert!(read(page).contains("Calibration record (not a certificate)"), "{page}");
    }
    let other = scene(folder, "other.toml", "image_size_px = [640, 480]\npp_px = [317, 238]");
    // The folder of the session names its result.
    for against in [old, "again.json", "old"] {
        let check = ["check", "--against", against, "--json", "--source", &other];
        let ended = boresight(folder, &check);
        says(&ended, 3, &["NO VERDICT", "--same-camera"]);
        assert_eq!(verdict(&ended.stdout)["reason"], "OTHER-CAMERA");
    }
}
