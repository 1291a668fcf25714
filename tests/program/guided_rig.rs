//! `boresight guide --rig`: two cameras without a trigger, and a board that rests in twelve places.

use std::{
    f64::consts::TAU,
    fs::File,
    io::{BufRead, BufReader, BufWriter, Write},
    path::Path,
    process::Stdio,
};

use boresight_geometry::{Camera, boards::Board, frame::ImageSize};
use boresight_sim::{Renderer, Scene};
use image::GrayImage;
use nalgebra::{Isometry3, Point2, Vector3};

use crate::{
    person::{boresight, ended, program, says},
    platform::json,
};

const BASELINE_M: f64 = 0.08;
const SIZE: ImageSize = ImageSize { width_px: 640, height_px: 360 };
const PLACES: u32 = 12;
/// Frames of a rest, and of the way to the next place.
const REST: u32 = 20;
const WAY: u32 = 5;

fn place(number: u32) -> Isometry3<f64> {
    let (sin, cos) = (TAU / 8.0 * f64::from(number)).sin_cos();
    let far_m = 0.5 + 0.06 * f64::from(number % 3);
    let at = Vector3::new(0.5 * BASELINE_M + 0.05 * cos, 0.03 * sin, far_m);
    Isometry3::new(at, Vector3::new(sin, -cos, 0.0) * 0.6)
}

/// Writes what the camera at `cam_from_rig` sees, as a stored stream of 15 pictures per second that
/// begins `late` frames later.
fn film(path: &Path, cam_from_rig: &Isometry3<f64>, late: u32) {
    let scene = Scene {
        image_size: SIZE,
        camera: Camera::pinhole(560.0, Point2::new(318.0, 182.0)),
        board: Board::new(9, 6, 0.025).expect("a board"),
        clutter: 0.0,
        noise_sigma: 2.0,
        exposure_secs: 0.004,
        ..Scene::default_720p(1)
    };
    let mut renderer = Renderer::new(&scene);
    let mut out = BufWriter::new(File::create(path).expect("created"));
    writeln!(out, "YUV4MPEG2 W{} H{} F15:1 Ip A1:1 Cmono", SIZE.width_px, SIZE.height_px)
        .expect("written");
    let mut picture = GrayImage::new(SIZE.width_px, SIZE.height_px);
    for frame in late..PLACES * (REST + WAY) {
        let (number, within) = (frame / (REST + WAY), frame % (REST + WAY));
        let share = f64::from(within.saturating_sub(REST)) / f64::from(WAY);
        let (from, to) = (place(number), place(number + 1));
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * share;
        let at = from.translation.vector.lerp(&to.translation.vector, share);
        let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * from.rotation;
        let pose = cam_from_rig * Isometry3::from_parts(at.into(), rotation);
        renderer.render(&[pose], u64::from(frame), &mut picture);
        out.write_all(b"FRAME\n").expect("written");
        out.write_all(picture.as_raw()).expect("written");
    }
}

fn films(place: &Path) {
    film(&place.join("left.y4m"), &Isometry3::identity(), 0);
    film(&place.join("right.y4m"), &Isometry3::translation(-BASELINE_M, 0.0, 0.0), 2);
}

const GUIDE: [&str; 10] = [
    "guide",
    "--rig",
    "left=pipe:cat left.y4m",
    "right=pipe:cat right.y4m",
    "--board",
    "9x6",
    "--square",
    "25mm",
    "--out",
    "rig",
];

#[test]
fn a_board_that_rests_where_two_cameras_see_it_gives_their_places() {
    let folder = tempfile::tempdir().expect("folder");
    let folder = folder.path();
    films(folder);
    let note = "echo $BORESIGHT_VERDICT, $BORESIGHT_RESULT, $BORESIGHT_SESSION > note";
    let guided = boresight(folder, &[&GUIDE[..], &["--on-finish", note]].concat());
    says(&guided, guided.code, &["Taken: place 8, seen by left, right", "left to right: "]);
    let noted = std::fs::read_to_string(folder.join("note")).expect("a note");
    assert!(noted.ends_with(", rig/rig.json, rig\n") && !noted.starts_with("none"), "{noted}");
    let text = std::fs::read_to_string(folder.join("rig/rig.json")).expect("a rig");
    let pair = &json(&text)["pairs"][0];
    let number = |key: &str| pair[key].as_f64().expect("a number");
    assert!((number("baseline_m") - BASELINE_M).abs() < 3.0 * number("baseline_sd_m"), "{pair}");
    let page = std::fs::read_to_string(folder.join("rig/rig.html")).expect("a page");
    let page = page.replacen("<!DOCTYPE html>", "", 1);
    let page = roxmltree::Document::parse(&page).expect("well-formed");
    let told: String = page.descendants().filter_map(|it| it.text()).collect();
    let parts = [
        "Calibration certificate",
        "How exact",
        "Until a camera, its mount or its lens is touched.",
        "Scan to check that this sheet belongs to the file",
        "left to right",
        "Cameras, and places of the board",
        "Distances by two cameras",
        "Rows of two pictures",
    ];
    for words in parts {
        assert!(told.contains(words), "{words}: {told}");
    }
    let pictures = page.descendants().filter(|it| it.has_tag_name("image")).count();
    assert_eq!(pictures, 4, "a pair as taken, and rectified");
    says(&boresight(folder, &["report", "rig"]), guided.code, &["Report: rig/rig.html"]);
    let copied = ["report", "rig/rig.json", "--out", "page.html"];
    says(&boresight(folder, &copied), guided.code, &["Report: page.html"]);
    says(&boresight(folder, &copied), 1, &["page.html", "--force"]);
    // A rig that isn't to be used has no certificate, and no number.
    let bad = folder.join("bad.json");
    let verdict = format!("\"verdict\": \"{}\"", json(&text)["verdict"].as_str().expect("one"));
    std::fs::write(&bad, text.replace(&verdict, "\"verdict\": \"untrustworthy\""))
        .expect("written");
    says(&boresight(folder, &["report", "bad.json"]), 3, &["Report: bad.html"]);
    let page = std::fs::read_to_string(folder.join("bad.html")).expect("a page");
    let (sheet, _) = page.split_once("</section>").expect("the customer's sheet");
    assert!(sheet.contains("Calibration record (not a certificate)"), "{sheet}");
    assert!(!sheet.contains("How exact") && !sheet.contains("±"), "{sheet}");
    // The recording is the same rig, to the last digit.
    says(
        &boresight(folder, &["calibrate", "--rig", "rig", "--out", "again.json"]),
        guided.code,
        &[],
    );
    let again = std::fs::read_to_string(folder.join("again.json")).expect("a rig");
    assert_eq!(text.trim_end(), again.trim_end());
    // Each camera's session decides again as it was recorded.
    for camera in ["rig/left", "rig/right"] {
        let replayed = boresight(folder, &["replay", camera]);
        says(&replayed, replayed.code, &["\n0 of ", "decisions differ"]);
    }
    says(&boresight(folder, &GUIDE), 1, &["there is a session already", "--session rig"]);
}

#[test]
fn a_rig_that_is_killed_keeps_its_places_and_goes_on() {
    let folder = tempfile::tempdir().expect("folder");
    let folder = folder.path();
    films(folder);
    let mut child =
        program(folder, &GUIDE).stderr(Stdio::piped()).spawn().expect("the program starts");
    let lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let mut said = Vec::new();
    for line in lines.map_while(Result::ok) {
        let is_third = line.contains("Taken: place 3");
        said.push(line);
        if is_third {
            break;
        }
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    assert!(said.iter().any(|line| line.contains("Taken: place 3")), "{said:?}");
    let kept = std::fs::read_to_string(folder.join("rig/rig-session.json")).expect("a session");
    assert_eq!(json(&kept)["places"].as_array().map(Vec::len), Some(3));
    // A command is never taken from a recording; the person names it again.
    says(&boresight(folder, &["guide", "--session", "rig"]), 1, &["camera left"]);
    let again = [&["guide", "--session", "rig"][..], &GUIDE[1..4]].concat();
    let resumed = ended(program(folder, &again));
    says(&resumed, resumed.code, &["Taken: place 4", "Taken: place 8"]);
}

#[test]
fn cameras_are_named() {
    let folder = tempfile::tempdir().expect("folder");
    let folder = folder.path();
    let guide = |cameras: &[&str]| boresight(folder, &[&["guide", "--rig"][..], cameras].concat());
    says(&guide(&["left=sim"]), 1, &["two to eight cameras"]);
    says(&guide(&["sim", "sim"]), 2, &["--rig takes NAME=SOURCE"]);
    says(&guide(&["a=sim", "a=sim"]), 1, &["two cameras are called"]);
    says(&guide(&["a/b=sim", "c=sim"]), 1, &["no name of a camera"]);
    says(&guide(&["a=nowhere", "b=sim"]), 1, &["camera a", "no source"]);
    says(&guide(&["a=sim", "b=sim", "--metrics", "a.prom"]), 2, &["--metrics is for one camera"]);
}
