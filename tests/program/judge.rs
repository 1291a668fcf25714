//! `boresight judge`: files of other programs, held to the lens of a session.

use std::{fs, path::Path};

use serde_json::Value;

use crate::{
    person::{boresight, says},
    platform::json,
};

fn good() -> String {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good");
    fixture.display().to_string()
}

/// A file of ROS with the fixture's lens after `change`, in `folder`.
fn planted(folder: &Path, name: &str, change: fn(&mut Value)) {
    let text = fs::read_to_string(Path::new(&good()).join("calibration.json")).expect("readable");
    let mut tree = json(&text);
    change(&mut tree["result"]);
    fs::write(folder.join("planted.json"), tree.to_string()).expect("written");
    let export = ["export", "planted.json", "--format", "ros-yaml", "--out", name, "--force"];
    says(&boresight(folder, &export), 0, &["Written"]);
}

fn scale(number: &mut Value, by: f64) {
    *number = (number.as_f64().expect("a number") * by).into();
}

#[test]
fn a_sound_file_is_true_and_a_wrong_one_off_by_its_part() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    let session = good();
    planted(place, "sound.yaml", |_| {});
    planted(place, "long.yaml", |lens| {
        (0..2).for_each(|axis| scale(&mut lens["f_px"][axis], 1.06));
    });
    planted(place, "squeezed.yaml", |lens| scale(&mut lens["f_px"][1], 4.0 / 3.0));
    let judge = |file: &str| {
        let ended = boresight(place, &["judge", file, &session, "--json"]);
        let said = json(ended.stdout.lines().last().expect("a line"));
        (ended, said)
    };
    let (ended, said) = judge("sound.yaml");
    says(&ended, 0, &["TRUE", "residuals are no evidence"]);
    assert_eq!(
        (&said["schema"], &said["answer"]),
        (&"boresight.judgement/1".into(), &"true".into())
    );
    assert!(said["off_px"].as_f64().expect("px") < 0.01, "{said}");

    let (ended, said) = judge("long.yaml");
    says(&ended, 4, &["OFF", "6.00 % too long"]);
    assert_eq!(said["wrong"], "FOCAL-LENGTH");

    let (ended, said) = judge("squeezed.yaml");
    says(&ended, 4, &["OFF", "exactly 4:3"]);
    assert_eq!(said["wrong"], "STRETCHED");

    // What matters is the person's to say.
    let loosely = ["judge", "long.yaml", &session, "--limit", "60px"];
    says(&boresight(place, &loosely), 0, &["TRUE", "60.00 px"]);

    let both = ["judge", "long.yaml", "sound.yaml", &session, "--out", "better.yaml"];
    let ended = boresight(place, &both);
    says(&ended, 4, &["Nearest", "Written: better.yaml (ROS)"]);
    let order: Vec<usize> =
        ["sound.yaml", "long.yaml"].map(|name| ended.stderr.rfind(name).expect("listed")).into();
    assert!(order[0] < order[1], "{}", ended.stderr);
    says(&boresight(place, &["judge", "better.yaml", &session]), 0, &["TRUE"]);
    says(&boresight(place, &both), 1, &["already a file", "better.yaml"]);
}

#[test]
fn a_file_alone_cannot_be_true() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    planted(place, "assumed.yaml", |lens| {
        lens["pp_px"] = serde_json::json!([199.5, 149.5]);
    });
    let ended = boresight(place, &["judge", "assumed.yaml"]);
    says(&ended, 3, &["CAN'T TELL", "assumed, not measured", "Give its pictures"]);
    let said = json(boresight(place, &["judge", "assumed.yaml", "--json"]).stdout.trim());
    assert_eq!((&said["reason"], &said["shown"][0]), (&"NO-PICTURES".into(), &"PP-ASSUMED".into()));
    planted(place, "folded.yaml", |lens| lens["distortion"]["k1"] = (-9.0).into());
    says(&boresight(place, &["judge", "folded.yaml"]), 4, &["OFF", "impossible distortion"]);
    says(&boresight(place, &["judge", &good()]), 2, &["no calibration among the inputs"]);
}

#[test]
fn a_folder_with_a_file_and_its_pictures_needs_no_other_name() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    fs::create_dir(place.join("calibrationdata")).expect("a folder");
    planted(place, "calibrationdata/ost.yaml", |_| {});
    let frames = Path::new(&good()).join("frames");
    for (number, frame) in fs::read_dir(frames).expect("frames").flatten().enumerate() {
        let to = place.join(format!("calibrationdata/left-{number:04}.png"));
        fs::copy(frame.path(), to).expect("copied");
    }
    let ended = boresight(place, &["judge", "calibrationdata"]);
    says(&ended, 0, &["calibrationdata/ost.yaml: TRUE"]);
}

/// A file as OpenCV's sample writes it, with the fixture's corners, and its focal length times `by`.
fn with_own_corners(place: &Path, name: &str, by: f64) {
    let export = ["export", &good(), "--format", "vnl", "--out", "corners.vnl", "--force"];
    says(&boresight(place, &export), 0, &["Written"]);
    let table = fs::read_to_string(place.join("corners.vnl")).expect("readable");
    let lines = table.lines().filter(|line| !line.starts_with('#'));
    let px: Vec<f64> = lines
        .flat_map(|line| line.split_whitespace().skip(1).take(2))
        .map(|number| number.parse().unwrap_or(-1.0))
        .collect();
    let own = json(&fs::read_to_string(Path::new(&good()).join("calibration.json")).expect("file"));
    let (lens, board) = (&own["result"], &own["board"]);
    let number = |value: &Value| value.as_f64().expect("a number");
    let f = [0, 1].map(|axis| number(&lens["f_px"][axis]) * by);
    let k = ["k1", "k2", "p1", "p2", "k3"].map(|k| number(&lens["distortion"][k]));
    let (columns, rows) = (number(&board["columns"]), number(&board["rows"]));
    let tree = serde_json::json!({
        "nframes": px.len() as f64 / 2.0 / columns / rows,
        "image_width": own["image_size"][0], "image_height": own["image_size"][1],
        "board_width": columns as u32, "board_height": rows as u32,
        "square_size": number(&board["square_mm"]),
        "camera_matrix": [[f[0], 0.0, lens["pp_px"][0]], [0.0, f[1], lens["pp_px"][1]], [0.0, 0.0, 1.0]],
        "distortion_coefficients": k,
        "image_points": { "type_id": "opencv-matrix", "rows": 1, "cols": px.len() / 2, "dt": "2f", "data": px },
    });
    fs::write(place.join(name), tree.to_string()).expect("written");
}

#[test]
fn a_file_with_its_own_corners_needs_no_pictures() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    with_own_corners(place, "sound.json", 1.0);
    with_own_corners(place, "short.json", 0.9);
    says(&boresight(place, &["judge", "sound.json"]), 0, &["TRUE", "residuals are no evidence"]);
    let ended = boresight(place, &["judge", "short.json", "--out", "better.yml", "--json"]);
    says(&ended, 4, &["OFF", "10.00 % too short", "Written: better.yml"]);
    let report = ["judge", "short.json", "--report", "page.html"];
    says(&boresight(place, &report), 4, &["OFF", "Report: page.html"]);
    let page = fs::read_to_string(place.join("page.html")).expect("readable");
    // A number in each of the 96 cells, and an arrow in every third one.
    assert_eq!(page.matches("font-size=\"8\"").count(), 96);
    assert_eq!(page.matches("<polyline").count(), 32);
    for said in ["Judged: short.json", "OFF by", "10.00 % too short", "add --out FILE"] {
        assert!(page.contains(said), "{said}");
    }
    // Each by the corners of its own views.
    let both = boresight(place, &["judge", "sound.json", "short.json"]);
    says(&both, 4, &["sound.json: TRUE", "short.json: OFF"]);
}
