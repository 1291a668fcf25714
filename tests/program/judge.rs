//! `boresight judge`: files of other programs, held to the lens of a session.

use std::{fmt::Write, fs, path::Path};

use image::{ImageEncoder, codecs::jpeg::JpegEncoder};
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
    let loosely = ["judge", "long.yaml", &session, "--accept", "60px"];
    says(&boresight(place, &loosely), 0, &["TRUE", "limit of 60 px"]);
    let length = ["judge", "long.yaml", &session, "--accept", "length 500mm at 2m <= 1mm"];
    let in_mm = ["OFF", "mm) in a length of 500 mm at 2 m", "beyond the limit of 1 mm"];
    says(&boresight(place, &length), 4, &in_mm);

    let both = ["judge", "long.yaml", "sound.yaml", &session, "--out", "better.yaml"];
    let ended = boresight(place, &both);
    says(&ended, 4, &["Nearest", "Written: better.yaml (ROS)"]);
    let order: Vec<usize> =
        ["sound.yaml", "long.yaml"].map(|name| ended.stderr.rfind(name).expect("listed")).into();
    assert!(order[0] < order[1], "{}", ended.stderr);
    says(&boresight(place, &["judge", "better.yaml", &session]), 0, &["TRUE"]);
    let known = ["judge", "long.yaml", &session, "--out", "known.json"];
    says(&boresight(place, &known), 4, &["Written: known.json (JSON)"]);
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
    says(
        &boresight(place, &["judge", "folded.yaml"]),
        4,
        &["OFF", "no lens is like that", "folds over"],
    );
    says(&boresight(place, &["judge", &good()]), 2, &["no calibration among the inputs"]);
}

#[test]
fn a_folder_with_a_file_and_its_pictures_needs_no_other_name() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    fs::create_dir(place.join("calibrationdata")).expect("a folder");
    planted(place, "calibrationdata/ost.yaml", |_| {});
    pictures(&place.join("calibrationdata"));
    let ended = boresight(place, &["judge", "calibrationdata"]);
    says(&ended, 0, &["calibrationdata/ost.yaml: TRUE"]);
    assert!(!ended.stderr.contains("EXIF"), "{}", ended.stderr);

    // A first picture by a lens of 70 mm, as its EXIF data says.
    let exif = [
        &b"MM\0*\0\0\0\x08\0\x01\x87\x69\0\x04\0\0\0\x01\0\0\0\x1a\0\0\0\0"[..],
        b"\0\x01\xa4\x05\0\x03\0\0\0\x01\0\x46\0\0\0\0\0\0",
    ];
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
    encoder.set_exif_metadata(exif.concat()).expect("room for it");
    let first = image::open(place.join("calibrationdata/left-0000.png")).expect("a picture");
    encoder.encode_image(&first.to_luma8()).expect("encoded");
    fs::write(place.join("calibrationdata/left-.jpg"), bytes).expect("written");
    let ended = boresight(place, &["judge", "calibrationdata", "--json"]);
    says(&ended, 0, &["TRUE", "EXIF data says 70 mm"]);
    assert_eq!(json(ended.stdout.trim())["shown"][0], "F-NOT-OF-EXIF");
}

/// The fixture's pictures, in `folder`.
fn pictures(folder: &Path) {
    let frames = Path::new(&good()).join("frames");
    for (number, frame) in fs::read_dir(frames).expect("frames").flatten().enumerate() {
        fs::copy(frame.path(), folder.join(format!("left-{number:04}.png"))).expect("copied");
    }
}

#[test]
fn of_a_folder_of_cameras_the_worst_is_first_and_nothing_stops_the_others() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    for camera in ["front", "rear", "lost"] {
        fs::create_dir_all(place.join("cameras").join(camera)).expect("a folder");
    }
    planted(place, "cameras/front/ost.yaml", |_| {});
    planted(place, "cameras/lost/ost.yaml", |_| {});
    planted(place, "cameras/rear/ost.yaml", |lens| {
        (0..2).for_each(|axis| scale(&mut lens["f_px"][axis], 1.06));
    });
    pictures(&place.join("cameras/front"));
    pictures(&place.join("cameras/rear"));
    let ended = boresight(place, &["judge", "cameras", "--json"]);
    says(&ended, 4, &["rear/ost.yaml: OFF", "front/ost.yaml: TRUE", "lost/ost.yaml: CAN'T TELL"]);
    let (_, table) = ended.stderr.split_once("Worst first:").expect("a table");
    let rows: Vec<&str> = table.trim().lines().collect();
    for (row, (answer, camera)) in
        rows.iter().zip([("off", "rear"), ("cannot-tell", "lost"), ("true", "front")])
    {
        assert!(row.contains(answer) && row.contains(camera), "{row}");
    }
    assert_eq!((rows.len(), ended.stdout.lines().count()), (3, 2));
    let one = ["judge", "cameras", "--out", "better.yaml"];
    says(&boresight(place, &one), 2, &["--out is about one calibration"]);
}

#[test]
fn a_live_camera_is_guided_first() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    let scene = "name = \"installed\"\nseed = 3\nf_px = 520\nimage_size_px = [640, 480]\n\
                 pp_px = [322, 238]\ndistortion = [-0.1, 0.02, 0, 0, 0]\n\
                 [technician]\nperson = \"tripod\"\n";
    fs::write(place.join("scene.toml"), scene).expect("written");
    let file = |f_px: u32| {
        format!(
            "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n\
             camera_matrix: {{rows: 3, cols: 3, data: [{f_px}, 0, 322, 0, {f_px}, 238, 0, 0, 1]}}\n\
             distortion_coefficients: {{rows: 1, cols: 5, data: [-0.1, 0.02, 0, 0, 0]}}\n"
        )
    };
    fs::write(place.join("sound.yaml"), file(520)).expect("written");
    fs::write(place.join("long.yaml"), file(560)).expect("written");
    let live = ["judge", "sound.yaml", "long.yaml", "--source", "sim:scene.toml"];
    let ended = boresight(place, &live);
    says(&ended, 4, &["sound.yaml: TRUE", "long.yaml: OFF", "too long", "Nearest"]);
    let both = [&live[..], &["pictures"]].concat();
    says(&boresight(place, &both), 2, &["--source takes the pictures"]);
}

/// Of formats without corners that can be read, the next action names what has them.
#[test]
fn a_file_without_corners_says_where_they_are() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    for (format, name, action) in [
        ("mrcal", "front.cameramodel", "boresight judge FILE CORNERS.vnl"),
        ("kalibr", "camchain.yaml", "boresight judge FILE --source BAG"),
    ] {
        let export = ["export", &good(), "--format", format, "--out", name];
        says(&boresight(place, &export), 0, &["Written"]);
        says(&boresight(place, &["judge", name]), 3, &["CAN'T TELL", action]);
    }
    let export = ["export", &good(), "--format", "vnl", "--out", "corners.vnl"];
    says(&boresight(place, &export), 0, &["Written"]);
    let judge = ["judge", "front.cameramodel", "corners.vnl", "--board", "7x5"];
    says(&boresight(place, &judge), 0, &["TRUE"]);
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
    for said in
        ["Judged: short.json", "OFF by", "10.00 % too short", "Use the lens of these pictures"]
    {
        assert!(page.contains(said), "{said}");
    }
    // Each by the corners of its own views.
    let both = boresight(place, &["judge", "sound.json", "short.json"]);
    says(&both, 4, &["sound.json: TRUE", "short.json: OFF"]);
}

#[test]
fn no_answer_has_a_number_that_no_picture_has() {
    let place = tempfile::tempdir().expect("folder");
    let place = place.path();
    planted(place, "sound.yaml", |_| {});
    planted(place, "far.yaml", |lens| {
        (0..2).for_each(|axis| scale(&mut lens["f_px"][axis], 40.0));
    });
    // Four boards parallel to the picture.
    let mut table = String::from("# filename x y level\n");
    for (view, index) in (0..4).flat_map(|view| (0..35).map(move |index| (view, index))) {
        let (x, y) = (50 + 9 * view + 40 * (index % 7), 40 + 5 * view + 40 * (index / 7));
        writeln!(table, "view{view}.png {x} {y} 0").expect("room for it");
    }
    fs::write(place.join("flat.vnl"), table).expect("written");
    let flat = ["judge", "sound.yaml", "flat.vnl", "--board", "7x5", "--json"];
    let ended = boresight(place, &flat);
    says(&ended, 3, &["CAN'T TELL", "Tip the board by 30 to 50°"]);
    let said = json(ended.stdout.trim());
    assert_eq!((&said["reason"], &said["off_px"]), (&"NO-FRESH-LENS".into(), &Value::Null));

    let far = ["judge", "far.yaml", &good(), "--json", "--report", "page.html"];
    let ended = boresight(place, &far);
    says(&ended, 4, &["OFF", "beyond the picture", "too long"]);
    let said = json(ended.stdout.trim());
    assert!(said.as_object().expect("fields").contains_key("off_px"), "{said}");
    assert_eq!((&said["reason"], &said["off_px"]), (&"MISSES-PICTURE".into(), &Value::Null));
    assert_eq!(said["wrong"], "FOCAL-LENGTH");
    assert!(!ended.stderr.contains("OFF by"), "{}", ended.stderr);
    let page = fs::read_to_string(place.join("page.html")).expect("readable");
    assert!(page.contains("beyond the picture") && !page.contains("OFF by"));
}
