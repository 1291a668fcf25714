//! The program as met by a person: its words, its ends, and its restraint.

use std::{fs, path::Path};

use boresight::simulation::render_view;
use image::{ImageEncoder, codecs::jpeg::JpegEncoder};
use nalgebra::Isometry3;
use serde_json::Value;
use tempfile::TempDir;

use crate::person::{Ended, boresight, contents, says};
use crate::pictures::{PAIRS, picture, scene};

/// A folder with the named views.
fn views(views: &[(String, f64, f64)]) -> TempDir {
    let folder = TempDir::new().expect("folder");
    for (name, tilt_deg, slot_deg) in views {
        picture(*tilt_deg, *slot_deg).save(folder.path().join(name)).expect("saved");
    }
    folder
}

/// The pairs by name.
fn good() -> Vec<(String, f64, f64)> {
    let named = |(i, (tilt_deg, slot_deg)): (usize, &(f64, f64))| {
        (format!("{i}.png"), *tilt_deg, *slot_deg)
    };
    PAIRS.iter().enumerate().map(named).collect()
}

fn names(views: &[(String, f64, f64)]) -> Vec<String> {
    views.iter().map(|(name, ..)| name.clone()).collect()
}

fn calibrate(folder: &Path, files: &[String], more: &[&str]) -> Ended {
    let mut arguments = vec!["calibrate", "--board", "9x6"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(more);
    boresight(folder, &arguments)
}

#[test]
fn pictures_become_a_calibration_near_the_truth() {
    let folder = views(&good());
    let ended = calibrate(folder.path(), &names(&good()), &["--json", "--out", "result.json"]);
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON on stdout");
    assert_eq!(report["schema"], "boresight.calibration/1");
    assert_eq!(report["image_size"], serde_json::json!([640, 480]));
    let near = |pointer: &str, truth: f64, sigma: &str| {
        let value = |at: &str| report.pointer(at).and_then(Value::as_f64).expect("number");
        let off = (value(pointer) - truth).abs();
        assert!(off < 4.0 * value(sigma) && off < 0.5, "{pointer} off by {off}");
    };
    near("/result/f_px/0", 560.0, "/result/sigma/f_px/0");
    near("/result/pp_px/0", 322.0, "/result/sigma/pp_px/0");
    near("/result/pp_px/1", 236.0, "/result/sigma/pp_px/1");
    let written = fs::read_to_string(folder.path().join("result.json")).expect("written");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), report);
    // Nothing is overwritten unasked.
    let before = contents(folder.path());
    let again = calibrate(folder.path(), &names(&good()), &["--out", "result.json"]);
    says(&again, 1, &["already", "result.json", "--force"]);
    assert_eq!(contents(folder.path()), before);
    let forced = calibrate(folder.path(), &names(&good()), &["--out", "result.json", "--force"]);
    assert_ne!(forced.code, 1, "{}", forced.stderr);
}

#[test]
fn a_folder_stands_for_its_pictures() {
    let folder = views(&good());
    fs::write(folder.path().join("notes.txt"), "taken in the hall").expect("written");
    let by_names = calibrate(folder.path(), &names(&good()), &["--json"]);
    let by_folder = calibrate(folder.path(), &[".".into()], &["--json"]);
    let result = |ended: &Ended| {
        let file: Value = serde_json::from_str(&ended.stdout).expect("JSON");
        (file["result"].clone(), file["views"].as_array().map(Vec::len))
    };
    assert_eq!(result(&by_folder), result(&by_names));
    let table = boresight(folder.path(), &["detect", "--board", "9x6", "."]);
    assert_eq!(table.code, 0, "{}", table.stderr);
    assert!(table.stdout.contains("0.png"), "{}", table.stdout);
    fs::create_dir(folder.path().join("empty")).expect("a folder");
    says(&calibrate(folder.path(), &["empty".into()], &[]), 1, &["empty", "PNG, JPEG, BMP"]);
}

/// An unwritable result is reported before the search of the pictures: here, there are none to
/// search.
#[test]
fn outputs_are_looked_at_before_the_work() {
    let folder = TempDir::new().expect("folder");
    fs::write(folder.path().join("there.json"), "mine").expect("written");
    let refused = |more: &[&str], words: &[&str]| {
        says(&calibrate(folder.path(), &["no.png".into()], more), 1, words);
    };
    refused(&["--out", "there.json"], &["already", "there.json", "--force"]);
    refused(&["--report", "there.json"], &["already", "there.json", "--force"]);
    refused(&["--out", "nowhere/new.json"], &["nowhere/new.json", "folder exists"]);
    refused(&["--out", "new", "--report", "new"], &["same file"]);
    assert_eq!(fs::read_to_string(folder.path().join("there.json")).expect("there"), "mine");
}

#[cfg(unix)]
#[test]
fn names_of_files_command_neither_terminals_nor_spreadsheets() {
    let named = |name: &str, slot_deg| (name.to_owned(), 40.0, slot_deg);
    let all = [named("=cmd.png", 0.0), named("\u{1b}[31mx.png", 180.0), named("h #1.png", 90.0)];
    let folder = views(&all);
    let files = names(&all);
    let mut arguments = vec!["detect", "--board", "9x6"];
    arguments.extend(files.iter().map(String::as_str));
    let table = boresight(folder.path(), &arguments);
    assert_eq!(table.code, 0, "{}", table.stderr);
    assert!(!table.stdout.contains('\u{1b}') && !table.stderr.contains('\u{1b}'));
    // With a byte-order mark, as written by an editor on Windows.
    fs::write(folder.path().join("table.vnl"), format!("\u{feff}{}", table.stdout))
        .expect("written");
    let found = calibrate(
        folder.path(),
        &["table.vnl".into()],
        &["--image-size", "640x480", "--out", "result.json"],
    );
    says(&found, 3, &["3 views"]);
    let csv = boresight(folder.path(), &["export", "result.json", "--format", "views-csv"]);
    assert!(csv.stdout.lines().any(|line| line.starts_with("'=cmd.png,")), "{}", csv.stdout);
}

#[test]
fn a_refusal_is_explained_in_bits_and_drawn() {
    let folder = views(&good());
    let name = &names(&good())[0];
    let explained = |board: &str, why: &str| {
        boresight(folder.path(), &["detect", "--board", board, "--explain", why, name])
    };
    let told = ["Grid of 9x6 corners, 54 seen", "Bits for white / more squares beyond: "];
    says(&explained("9x6", "found"), 0, &[&told[..], &["54 corners of the board"]].concat());
    let other = [&told[..], &["Different board: it has 9x6", "No place on the board: it's larger"]];
    says(&explained("8x5", "why"), 0, &other.concat());
    let drawn = |to: &str, colour: [u8; 3]| {
        let path = folder.path().join(to).join(name);
        let picture = image::open(path).expect("a picture").into_rgb8();
        picture.pixels().filter(|pixel| pixel.0 == colour).count()
    };
    assert!(drawn("found", [60, 210, 90]) >= 54 && drawn("why", [60, 210, 90]) == 0);
    assert!(drawn("why", [255, 180, 30]) >= 54);
    says(&explained("8x5", "why"), 1, &["already a file", "why", "--force"]);
    let again = ["detect", "--board", "8x5", "--explain", "why", "--force", name];
    says(&boresight(folder.path(), &again), 0, &["Different board", "Written: why"]);
}

#[test]
fn corners_go_through_a_table_unchanged() {
    let folder = views(&good());
    let mut arguments = vec!["detect", "--board", "9x6"];
    let names = names(&good());
    arguments.extend(names.iter().map(String::as_str));
    let detected = boresight(folder.path(), &arguments);
    says(&detected, 0, &[]);
    assert_eq!(detected.stdout.lines().filter(|line| !line.starts_with('#')).count(), 6 * 54);
    fs::write(folder.path().join("corners.vnl"), &detected.stdout).expect("written");
    let from_table = boresight(
        folder.path(),
        &["calibrate", "corners.vnl", "--board", "9x6", "--image-size", "640x480", "--json"],
    );
    let report: Value = serde_json::from_str(&from_table.stdout).expect("JSON");
    let f_px = report.pointer("/result/f_px/0").and_then(Value::as_f64).expect("number");
    assert!((f_px - 560.0).abs() < 0.5, "{f_px}");
    let without_size = boresight(folder.path(), &["calibrate", "corners.vnl", "--board", "9x6"]);
    says(&without_size, 2, &["--image-size"]);
    let other_board = boresight(
        folder.path(),
        &["calibrate", "corners.vnl", "--board", "8x6", "--image-size", "640x480"],
    );
    says(&other_board, 1, &["corners.vnl"]);
}

/// The number is the picture's place among all; its name identifies it.
#[test]
fn a_finding_names_its_picture() {
    let folder = views(&good());
    let names = names(&good());
    let board = ["detect", "--board", "9x6"];
    let pictures: Vec<&str> = names.iter().map(String::as_str).collect();
    let found = boresight(folder.path(), &[&board[..], &pictures].concat()).stdout;
    // The first picture shows no board; in the last, one corner is 40 px off.
    let mut table = String::from("# filename x y level\nblank.png - - -\n");
    let (last, before) = found.trim_end().rsplit_once('\n').map(|(a, b)| (b, a)).expect("lines");
    let mut fields: Vec<String> = last.split(' ').map(Into::into).collect();
    let x_px: f64 = fields[1].parse().expect("a number");
    fields[1] = (x_px + 40.0).to_string();
    table += &format!("{before}\n{}\n", fields.join(" "));
    fs::write(folder.path().join("corners.vnl"), table).expect("written");
    let table = ["calibrate", "corners.vnl", "--board", "9x6", "--image-size", "640x480"];
    let files = ["--json", "--report", "report.html"];
    let ended = boresight(folder.path(), &[&table[..], &files].concat());
    let written: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    let seventh = &written["views"][6]["name"];
    assert_eq!(seventh, names[5].as_str());
    let called = format!("iew 7 ({})", names[5]);
    let is_named = |finding: &Value| finding["message"].to_string().contains(&called);
    assert!(written["findings"].as_array().expect("findings").iter().any(is_named), "{written}");
    let page = fs::read_to_string(folder.path().join("report.html")).expect("readable");
    assert!(ended.stderr.contains(&called) && page.contains(&called), "{}", ended.stderr);
    assert!(page.contains(&format!("aria-label=\"7: {}\"", names[5])));
}

#[test]
fn a_calibration_goes_to_other_programs() {
    let folder = views(&good());
    calibrate(folder.path(), &names(&good()), &["--out", "result.json"]);
    let export = |more: &[&str]| {
        let mut arguments = vec!["export", "result.json"];
        arguments.extend(more);
        boresight(folder.path(), &arguments)
    };
    says(&export(&["--format", "opencv-yaml", "--out", "camera.yaml"]), 0, &[]);
    says(&export(&["--format", "opencv-yaml", "--json"]), 2, &["--json", "--format"]);
    let yaml = fs::read_to_string(folder.path().join("camera.yaml")).expect("written");
    assert!(yaml.starts_with("%YAML:1.0") && yaml.contains("camera_matrix"), "{yaml}");
    says(
        &export(&["--format", "opencv-yaml", "--out", "camera.yaml"]),
        1,
        &["camera.yaml", "--force"],
    );
    fs::write(folder.path().join("broken.json"), "{").expect("written");
    let broken = boresight(folder.path(), &["export", "broken.json", "--format", "opencv-yaml"]);
    says(&broken, 1, &["broken.json"]);
}

#[test]
fn files_that_are_no_pictures_are_named() {
    let folder = views(&good()[..2]);
    let at = |name: &str| folder.path().join(name);
    fs::write(at("empty.png"), b"").expect("written");
    let whole = fs::read(at("0.png")).expect("readable");
    fs::write(at("cut.png"), &whole[..whole.len() / 2]).expect("written");
    picture(40.0, 90.0).save(at("whole.jpg")).expect("saved");
    let jpeg = fs::read(at("whole.jpg")).expect("readable");
    fs::write(at("cut.jpg"), &jpeg[..jpeg.len() / 2]).expect("written");
    fs::write(at("text.png"), b"this is no picture").expect("written");
    fs::create_dir(at("texts")).expect("made");
    fs::write(at("texts/readme.txt"), b"words").expect("written");
    let before = contents(folder.path());
    // A faulty picture is left out of a calibration, with its reason; two aren't enough.
    for (wrong, code, word) in [
        ("missing.png", 1, "could not read"),
        ("empty.png", 3, "not a readable picture"),
        ("cut.png", 3, "not a readable picture"),
        ("cut.jpg", 3, "cut short"),
        ("text.png", 3, "not a readable picture"),
    ] {
        let files = ["0.png".to_owned(), "1.png".to_owned(), wrong.to_owned()];
        says(&calibrate(folder.path(), &files, &[]), code, &[wrong, word]);
        says(&boresight(folder.path(), &["detect", "--board", "9x6", wrong]), 1, &[wrong, word]);
    }
    let guided = ["guide", "--headless", "--source", "texts", "--out", "session"];
    says(&boresight(folder.path(), &guided), 1, &["texts", "no picture that can be read"]);
    assert_eq!(contents(folder.path()), before, "nothing is touched");
}

#[test]
fn a_recording_is_guided_through_rather_than_calibrated() {
    let folder = TempDir::new().expect("folder");
    fs::write(folder.path().join("hall.mp4"), b"moving").expect("written");
    let ended = calibrate(folder.path(), &["hall.mp4".into()], &[]);
    says(&ended, 1, &["hall.mp4", "boresight guide --headless --source"]);
}

/// A picture of another size was cut or scaled, and shows another camera.
#[test]
fn a_picture_of_another_size_is_left_out_and_of_two_sizes_none_is_used() {
    let folder = views(&good()[..3]);
    for name in ["small.png", "tiny.png"] {
        let small = image::imageops::thumbnail(&picture(40.0, 90.0), 320, 240);
        small.save(folder.path().join(name)).expect("saved");
    }
    let mut files = vec!["small.png".to_owned()];
    files.extend(names(&good()[..3]));
    let without = calibrate(folder.path(), &files[1..], &["--json"]);
    let with = calibrate(folder.path(), &files, &["--json"]);
    says(&with, without.code, &["small.png: not used", "320x240", "640x480"]);
    let result = |ended: &Ended| -> Value {
        serde_json::from_str::<Value>(&ended.stdout).expect("JSON")["result"].clone()
    };
    assert_eq!(result(&with), result(&without));
    files.push("tiny.png".into());
    says(&calibrate(folder.path(), &files, &[]), 1, &["small.png", "320x240", "640x480"]);
}

/// A phone marks the orientation: for pictures alike as stored, the message tells how to use all.
#[test]
fn pictures_of_a_turned_phone_are_alike_as_stored() {
    let folder = TempDir::new().expect("folder");
    let files: Vec<String> = (0..PAIRS.len()).map(|i| format!("{i}.jpg")).collect();
    for (i, (file, (tilt_deg, slot_deg))) in files.iter().zip(PAIRS).enumerate() {
        let mark = if i == 1 { 6 } else { 1 };
        let orientation = [0x12, 1, 3, 0, 1, 0, 0, 0, mark, 0, 0, 0];
        let exif = [&b"II*\0\x08\0\0\0\x01\0"[..], &orientation, &[0; 4]].concat();
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 95);
        encoder.set_exif_metadata(exif).expect("JPEG has room for it");
        picture(tilt_deg, slot_deg).write_with_encoder(encoder).expect("encoded");
        fs::write(folder.path().join(file), bytes).expect("written");
    }
    let turned = calibrate(folder.path(), &files, &["--json"]);
    says(&turned, turned.code, &["1.jpg: not used", "480x640", "640x480", "--as-stored"]);
    let stored = calibrate(folder.path(), &files, &["--json", "--as-stored"]);
    assert!(!stored.stderr.contains("not used"), "{}", stored.stderr);
}

#[test]
fn another_board_is_recognised() {
    let folder = views(&good()[..2]);
    let ended = boresight(folder.path(), &["calibrate", "--board", "8x6", "0.png", "1.png"]);
    says(&ended, 3, &["--board 9x6", "No calibration"]);
    let last = ended.stderr.lines().last().expect("a sentence");
    assert!(last.starts_with("No calibration") && last.contains("--board 9x6"), "{last}");
}

#[test]
fn too_little_to_calibrate_from_says_what_is_missing() {
    let folder = views(&good()[..1]);
    let one = calibrate(folder.path(), &["0.png".into()], &["--json"]);
    says(&one, 3, &["views"]);
    let report: Value = serde_json::from_str(&one.stdout).expect("JSON");
    assert_eq!(report["verdict"], "untrustworthy");

    let mut copies = Vec::new();
    for copy in 0..20 {
        let name = format!("copy{copy}.png");
        fs::copy(folder.path().join("0.png"), folder.path().join(&name)).expect("copied");
        copies.push(name);
    }
    says(&calibrate(folder.path(), &copies, &[]), 3, &["Copies of a view add nothing"]);

    let flat: Vec<(String, f64)> = (0..4).map(|i| (format!("flat{i}.png"), f64::from(i))).collect();
    for (name, i) in &flat {
        let pose = Isometry3::translation(0.01 * i - 0.015, 0.005 * i, 0.34 + 0.03 * i);
        render_view(&scene(), &pose).save(folder.path().join(name)).expect("saved");
    }
    let files: Vec<String> = flat.into_iter().map(|(name, _)| name).collect();
    says(&calibrate(folder.path(), &files, &[]), 3, &["tip"]);
}

#[test]
fn wrong_words_are_usage_errors_that_teach() {
    let folder = views(&good()[..1]);
    for arguments in [
        &["calibrate", "0.png", "--board", "9by6"][..],
        &["calibrate", "0.png", "--square", "25"],
        &["detect", "0.png", "--board", "2x2"],
        &["detect", "0.png", "--board", "65536x1"],
        &["calibrate"],
        &["guide", "--max-frames", "many"],
        &["calibate", "0.png"],
    ] {
        let ended = boresight(folder.path(), arguments);
        assert_eq!(ended.code, 2, "{arguments:?}: {}", ended.stderr);
        assert!(ended.stderr.contains("--help"), "{}", ended.stderr);
    }
    let unknown = ["calibrate", "0.png", "--set", "guidance.hold=3"];
    says(&boresight(folder.path(), &unknown), 2, &["hold", "config/default.toml"]);
    let nowhere = ["guide", "--headless", "--source", "nowhere"];
    says(&boresight(folder.path(), &nowhere), 1, &["nowhere", "sim"]);
    for command in [
        "guide",
        "replay",
        "calibrate",
        "check",
        "judge",
        "detect",
        "simulate",
        "export",
        "report",
        "doctor",
        "target",
    ] {
        let help = boresight(folder.path(), &[command, "--help"]);
        assert!(
            help.code == 0 && help.stdout.contains("Examples:\n  boresight"),
            "{}",
            help.stdout
        );
        let words = format!(" {} ", help.stdout.split_whitespace().collect::<Vec<_>>().join(" "));
        for never in ["want", "wants", "mend", "anew", "go on", "told", "by itself", "of another"] {
            assert!(!words.contains(&format!(" {never} ")), "{command}: {never}");
        }
    }
    // The exit codes are those of the documentation, word for word.
    let help = boresight(folder.path(), &["--help"]).stdout;
    let page = include_str!("../../docs/commands.md").replace('`', "");
    for code in 0..=6 {
        let row = |line: &str| Some(line.strip_prefix(&format!("| {code} | "))?.replace(" |", ""));
        let meaning = page.lines().find_map(row).expect("a row");
        assert!(help.contains(&format!("\n  {code}  {meaning}\n")), "{meaning}: {help}");
    }
    // Without a command, the options are those of `guide`.
    says(&boresight(folder.path(), &["--headless", "--source", "nowhere"]), 1, &["nowhere"]);
}

/// A folder that holds the named views in a folder called `pictures`.
fn views_below(pictures: &str) -> TempDir {
    let folder = views(&good());
    fs::create_dir(folder.path().join(pictures)).expect("made");
    for name in names(&good()) {
        fs::rename(folder.path().join(&name), folder.path().join(pictures).join(&name))
            .expect("moved");
    }
    folder
}

#[test]
fn a_folder_whose_name_begins_like_the_simulations_is_a_folder() {
    let folder = views_below("simulation_2026");
    let guide = ["guide", "--headless", "--source", "simulation_2026", "--out", "session"];
    says(&boresight(folder.path(), &guide), 0, &["Taken: view 4"]);
    let nowhere = ["guide", "--headless", "--source", "simpics"];
    says(&boresight(folder.path(), &nowhere), 1, &["no source \"simpics\""]);
}

#[test]
fn every_source_ends_after_as_many_pictures_as_were_asked_for() {
    let folder = views_below("pictures");
    let guide = ["guide", "--headless", "--source", "pictures", "--out", "session", "--json"];
    let guide = [&guide[..], &["--max-frames", "3"]].concat();
    let ended = boresight(folder.path(), &guide);
    let journal = fs::read_to_string(folder.path().join("session/journal.jsonl")).expect("written");
    assert_eq!(journal.matches("\"observed\"").count(), 3, "{}", ended.stderr);
    // Going on takes as many again.
    let more = ["guide", "--headless", "--session", "session", "--max-frames", "2"];
    let ended = boresight(folder.path(), &more);
    let journal = fs::read_to_string(folder.path().join("session/journal.jsonl")).expect("written");
    assert_eq!(journal.matches("\"observed\"").count(), 5, "{}", ended.stderr);
}

#[test]
fn photographs_are_guided_replayed_and_verified() {
    let folder = views_below("pictures");
    let guide = ["guide", "--headless", "--source", "pictures", "--out", "session", "--json"];
    let ended = boresight(folder.path(), &guide);
    let report: Value =
        serde_json::from_str(ended.stdout.lines().last().expect("a line")).expect("JSON");
    let taken = report["views"].as_array().expect("views").len();
    assert!(taken >= 4, "{}", ended.stderr);
    let again = ["guide", "--headless", "--source", "pictures", "--out", "session"];
    says(&boresight(folder.path(), &again), 1, &["already"]);

    let before = contents(&folder.path().join("session"));
    let replayed = boresight(folder.path(), &["replay", "session", "--json"]);
    assert_eq!(replayed.code, ended.code, "{}", replayed.stderr);
    says(&replayed, ended.code, &["0 of"]);
    let replayed: Value = serde_json::from_str(&replayed.stdout).expect("JSON");
    assert_eq!(replayed["result"], report["result"]);
    let what_if = boresight(folder.path(), &["replay", "session", "--set", "guidance.min_views=8"]);
    assert!(!what_if.stderr.contains("\n0 of"), "{}", what_if.stderr);
    says(&boresight(folder.path(), &["doctor", "session"]), 0, &["No damage found"]);
    assert_eq!(contents(&folder.path().join("session")), before, "nothing is touched");

    let journal = folder.path().join("session/journal.jsonl");
    let mut bytes = fs::read(&journal).expect("readable");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(&journal, bytes).expect("written");
    let damaged = boresight(folder.path(), &["replay", "session"]);
    says(&damaged, 1, &["line", "journal.jsonl", "doctor"]);
    let recovered =
        boresight(folder.path(), &["doctor", "session", "--recover", "session/../saved"]);
    says(&recovered, 0, &["damaged", "Recovered"]);
    says(&boresight(folder.path(), &["doctor", "saved"]), 0, &["No damage found"]);
}

#[test]
fn photographs_of_real_boards() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/principal-lines");
    if !shared.is_dir() {
        println!("SKIPPED: the photographs are not beside the project");
        return;
    }
    // Chuang et al. 2021 publish v from the bottom: y = height − v.
    for (set, square, pp_px, tolerance_px, mean_f_px) in [
        ("set07", "25mm", [313.5, 480.0 - 246.3], 1.5, 617.1),
        ("set14", "39mm", [1917.6, 2560.0 - 1270.5], 3.0, 3827.8),
    ] {
        let mut files: Vec<String> = fs::read_dir(shared.join(set))
            .expect("listable")
            .map(|entry| entry.expect("listable").path().display().to_string())
            .collect();
        files.sort();
        let mut arguments = vec!["calibrate", "--board", "6x7", "--square", square, "--json"];
        arguments.extend(files.iter().map(String::as_str));
        let ended = boresight(&shared, &arguments);
        let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
        let pp = &report["principal_point"]["pl_unweighted"]["px"];
        let off = |i: usize| pp[i].as_f64().expect("number") - pp_px[i];
        assert!(off(0).hypot(off(1)) < tolerance_px, "{set}: {pp}");
        let views = report["views"].as_array().expect("views");
        assert_eq!(views.len(), files.len());
        let f_px: Vec<f64> =
            views.iter().map(|view| view["focal_as_seen_px"].as_f64().expect("number")).collect();
        let mean = f_px.iter().sum::<f64>() / f_px.len() as f64;
        assert!((mean / mean_f_px - 1.0).abs() < 0.01, "{set}: mean f {mean}");
        if set == "set14" {
            let published = [3851.7, 3787.6, 3817.9, 3836.3, 3837.9, 3835.6];
            for (f, published) in f_px.iter().zip(published) {
                assert!((f / published - 1.0).abs() < 0.005, "{f} for {published}");
            }
        }
    }
}
