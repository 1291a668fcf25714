//! Interfaces to build on: files of every program in and out, errors for machines, batches sharing
//! their work.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::person::{boresight, program, says};

pub(crate) fn good() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good")
}

pub(crate) fn copied(name: &str, to: &Path) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1").join(name);
    let ended = Command::new("cp").arg("-r").arg(from).arg(to).status();
    assert!(ended.expect("cp runs").success());
}

pub(crate) fn json(text: &str) -> Value {
    serde_json::from_str(text.trim()).expect("JSON")
}

#[test]
fn a_calibration_goes_through_every_format_that_holds_it() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let calibration = good().join("calibration.json");
    let calibration = calibration.to_str().expect("a path");
    let first = json(&fs::read_to_string(calibration).expect("readable"));
    let mut before = calibration.to_owned();
    // Their names determine the formats.
    for name in [
        "opencv.xml",
        "cameras.txt",
        "transforms.json",
        "metashape.xml",
        "basalt.json",
        "orb_slam3.yaml",
        "photonvision.json",
        "front.cameramodel",
        "opencv.json",
        "ros.yaml",
        "camera.json",
    ] {
        says(&boresight(place, &["convert", &before, name]), 0, &["Written"]);
        before = name.to_owned();
    }
    let last = json(&fs::read_to_string(place.join("camera.json")).expect("written"));
    assert_eq!(last["schema"], "boresight.calibration/1");
    assert_eq!(
        (&last["verdict"], &last["findings"][0]["code"]),
        (&"care".into(), &"IMPORTED".into())
    );
    assert_eq!(last["result"]["distortion"]["k3"], first["result"]["distortion"]["k3"]);
    for name in ["f_px", "pp_px"] {
        for axis in 0..2 {
            let [a, b] =
                [&first, &last].map(|file| file["result"][name][axis].as_f64().expect("px"));
            assert!((a - b).abs() < 1e-9, "{name}: {a} {b}");
        }
    }
    // Refused: a lens beyond the format, a name without a format, and an existing file.
    says(&boresight(place, &["convert", "ros.yaml", "open3d.json"]), 1, &["can't hold this lens"]);
    says(&boresight(place, &["convert", "ros.yaml", "any.yaml"]), 1, &["--format"]);
    says(&boresight(place, &["convert", "ros.yaml", "cameras.txt"]), 1, &["--force"]);
    assert!(!place.join("open3d.json").exists());
    // The name of a file sets the format of `export`, too: no YAML under another extension.
    let session = good();
    let session = session.to_str().expect("a path");
    for (name, begins) in
        [("camera.yml", "%YAML"), ("cameras-2.txt", "# Camera"), ("x.cameramodel", "{")]
    {
        says(&boresight(place, &["export", session, "--out", name]), 0, &["Written"]);
        let text = fs::read_to_string(place.join(name)).expect("written");
        assert!(text.starts_with(begins), "{name}: {text}");
    }
    for name in ["x.xml", "x.json"] {
        says(&boresight(place, &["export", session, "--out", name]), 1, &[name, "--format"]);
        assert!(!place.join(name).exists());
    }
    says(&boresight(place, &["report", "ros.yaml"]), 1, &["boresight convert"]);
    // Nobody judged it: no certificate to sign.
    says(&boresight(place, &["report", "camera.json"]), 3, &["NOT JUDGED", "Report: camera.html"]);
    let page = fs::read_to_string(place.join("camera.html")).expect("written");
    assert!(page.contains("NOT JUDGED") && !page.contains("Use with care"));
    assert!(!page.contains("ertificate</h1>") && !page.contains("id=\"certificate\""));
}

/// A lens belongs to the board that it was found with, even or not.
#[test]
fn an_export_says_that_its_board_was_bent() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let even = good().join("calibration.json");
    let mut tree = json(&fs::read_to_string(&even).expect("readable"));
    // 7 × 5 corners, 30 mm apart; the middle column is up by half a millimetre.
    let point = |i: i32| {
        let (column, row) = (i % 7, i / 7);
        let up_mm = if column == 3 { 0.5 } else { 0.0 };
        serde_json::json!([30.0 * f64::from(column - 3), 30.0 * f64::from(row - 2), up_mm])
    };
    tree["board"]["points_mm"] = (0..35).map(point).collect();
    fs::write(place.join("bent.json"), tree.to_string()).expect("written");
    let note = "its points lie up to 0.50 mm elsewhere";
    for (name, format, has_comments) in [
        ("opencv.yaml", "opencv-yaml", true),
        ("opencv.xml", "opencv-xml", true),
        ("ros.yaml", "ros-yaml", true),
        ("kalibr.yaml", "kalibr", true),
        ("cameras.txt", "colmap", true),
        ("camera.cameramodel", "mrcal", true),
        ("camera.m", "matlab", true),
        ("metashape.xml", "metashape", true),
        ("opencv.json", "opencv-json", false),
        ("basalt.json", "basalt", false),
    ] {
        let export = ["export", "bent.json", "--format", format, "--out", name];
        let ended = boresight(place, &export);
        says(&ended, 0, &["Written", note]);
        assert!(ended.stderr.lines().last().is_some_and(|line| line.contains(note)), "{name}");
        let text = fs::read_to_string(place.join(name)).expect("written");
        assert_eq!(text.contains(note), has_comments, "{name}: {text}");
        let stem = name.split('.').next().expect("a name");
        let beside = fs::read_to_string(place.join(format!("{stem}-board.csv")));
        match beside {
            Ok(points) if !has_comments => assert_eq!(points.lines().count(), 36, "{name}"),
            found => assert!(has_comments && found.is_err(), "{name}"),
        }
        if format != "matlab" {
            let again = ["convert", name, "again.json", "--format", "json", "--force"];
            says(&boresight(place, &again), 0, &["Written"]);
        }
        // An even board needs no word.
        let even = even.to_str().expect("a path");
        let plain = ["export", even, "--format", format, "--out", name, "--force"];
        let ended = boresight(place, &plain);
        assert!(ended.code == 0 && !ended.stderr.contains("points"), "{}", ended.stderr);
        fs::remove_file(place.join(format!("{stem}-board.csv"))).ok();
    }
}

#[test]
fn a_sessions_views_calibrate_again() {
    let place = TempDir::new().expect("folder");
    let session = good();
    let session = session.to_str().expect("a path");
    let ended = boresight(place.path(), &["calibrate", session, "--json"]);
    says(&ended, 0, &["Good"]);
    let recorded = json(&fs::read_to_string(good().join("calibration.json")).expect("readable"));
    let again = json(&ended.stdout);
    let f = |file: &Value| file["result"]["f_px"][0].as_f64().expect("px");
    assert!((f(&again) / f(&recorded) - 1.0).abs() < 1e-4);
    assert_eq!(again["views"].as_array().map(Vec::len), recorded["views"].as_array().map(Vec::len));
    says(
        &boresight(place.path(), &["calibrate", session, "--board", "9x6"]),
        1,
        &["knows its board", "--square"],
    );
    // A person who measures a square afterwards corrects it; a report without effect tells so.
    let larger = boresight(place.path(), &["calibrate", session, "--square", "30mm", "--json"]);
    says(&larger, 0, &["Good"]);
    let square = |file: &Value| file["board"]["square_mm"].as_f64().expect("mm");
    assert!((square(&json(&larger.stdout)) - 30.0).abs() < 1e-9);
    assert!((f(&json(&larger.stdout)) - f(&again)).abs() < 1e-6);
    let report = ["report", session, "--set", "board.square_mm=30", "--out", "page.html"];
    says(
        &boresight(place.path(), &report),
        2,
        &["board.square_mm", "boresight calibrate SESSION --set board.square_mm=…"],
    );
    assert!(!place.path().join("page.html").exists());
}

#[test]
fn a_damaged_picture_and_a_wild_view_end_nothing() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    copied("good", &place.join("session"));
    let frames = place.join("session/frames");
    let first =
        fs::read_dir(&frames).expect("listable").next().expect("one").expect("listable").path();
    let bytes = fs::read(&first).expect("readable");
    fs::write(frames.join("zzz.png"), &bytes[..bytes.len() / 2]).expect("written");
    let pictures: Vec<String> = fs::read_dir(&frames)
        .expect("listable")
        .map(|entry| entry.expect("listable").path().to_str().expect("text").to_owned())
        .collect();
    let mut arguments = vec!["calibrate", "--board", "7x5", "--square", "30mm"];
    arguments.extend(pictures.iter().map(String::as_str));
    says(&boresight(place, &arguments), 0, &["zzz.png: not used", "boresight calibrate"]);
    // A view with corners running backwards over the board is no view of it.
    let table = boresight(place, &["export", "session", "--format", "vnl"]).stdout;
    let mut lines: Vec<&str> = table.lines().collect();
    lines[1..36].sort_unstable();
    fs::write(place.join("c.vnl"), lines.join("\n") + "\n").expect("written");
    let table =
        ["calibrate", "--board", "7x5", "--square", "30mm", "--image-size", "400x300", "c.vnl"];
    says(&boresight(place, &table), 0, &["not used", "corners aren't the board's"]);
}

#[test]
fn machines_read_why_a_command_failed() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let ended = boresight(place, &["replay", "nowhere", "--json"]);
    says(&ended, 1, &["nowhere"]);
    let error = json(&ended.stdout);
    assert_eq!(
        (&error["schema"], &error["code"]),
        (&"boresight.error/1".into(), &"FILE-MISSING".into())
    );
    assert!(error["message"].is_string() && error["next"].is_string(), "{error}");
    // Every picture has its line, even an unreadable one.
    fs::write(place.join("a.png"), "no picture").expect("written");
    let ended = boresight(place, &["detect", "--board", "7x5", "--json", "a.png", "no.png"]);
    let lines: Vec<Value> = ended.stdout.lines().map(json).collect();
    for (line, name) in lines.iter().zip(["a.png", "no.png"]) {
        assert_eq!((&line["file"], &line["found"]), (&name.into(), &false.into()));
        assert!(line["reason"].as_str().is_some_and(|reason| reason.contains(name)), "{line}");
    }
    assert_eq!(lines[2]["schema"], "boresight.error/1");
    for (arguments, word) in [
        (&["calibrate", "--square", "0mm", "a.png"][..], "square"),
        (&["calibrate", "--set", "nope=1", "a.png"], "nope"),
        (&["calibrate", "--set", "guidance.target_tilt_deg=abc", "a.png"], "target_tilt_deg"),
        (&["target", "--out", "b.docx"], ".pdf"),
        (&["calibrate", "--board", "9x6", "c.vnl"], "--image-size"),
    ] {
        says(&boresight(place, arguments), 2, &[word]);
    }
    // The hint refers to the named file.
    let ended = boresight(place, &["calibrate", "--config", "/nope", "a.png"]);
    assert!(!ended.stderr.contains("session.toml"), "{}", ended.stderr);
}

fn planned(place: &Path, count: usize) -> String {
    for number in 0..count {
        let name = ["good", "focus-moved"][number % 2];
        copied(name, &place.join(format!("s{number:02}")));
    }
    let ended = boresight(place, &["batch", "plan", "."]);
    says(&ended, 0, &[]);
    fs::write(place.join("m.jsonl"), &ended.stdout).expect("written");
    ended.stdout
}

#[test]
fn a_changed_byte_is_another_item() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let before = planned(place, 2);
    let journal = place.join("s00/journal.jsonl");
    let mut bytes = fs::read(&journal).expect("readable");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&journal, bytes).expect("written");
    let after = boresight(place, &["batch", "plan", "."]).stdout;
    let content = |text: &str| {
        let contents = text.lines().map(|line| json(line)["content"].to_string());
        contents.collect::<Vec<_>>()
    };
    let (before, after) = (content(&before), content(&after));
    assert!(before[0] != after[0] && before[1] == after[1], "{before:?} {after:?}");
}

#[test]
fn two_runs_on_one_folder_share_the_work() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    planned(place, 12);
    let arguments = [
        "batch", "run", "m.jsonl", "--action", "replay", "--out", "out", "--jobs", "1", "--log",
        "json",
    ];
    let started: Vec<_> = (0..2)
        .map(|_| {
            let mut command = program(place, &arguments);
            command.stderr(Stdio::piped()).spawn().expect("started")
        })
        .collect();
    let mut rows: Vec<String> = Vec::new();
    for child in started {
        let output = child.wait_with_output().expect("ended");
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(output.status.success(), "{said}");
        let events = said.lines().map(json).filter(|event| event["event"] == "row");
        rows.extend(events.map(|event| event["session"].to_string()));
    }
    // Each was worked on by one of them.
    let all = rows.len();
    rows.sort_unstable();
    rows.dedup();
    assert_eq!((all, rows.len()), (12, 12));
    says(&boresight(place, &["batch", "gather", "out"]), 0, &[]);
    assert_eq!(fs::read_dir(place.join("out/claims")).expect("there").count(), 0);
}

#[test]
fn a_manifest_comes_from_stdin() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    planned(place, 2);
    let run = ["batch", "run", "-", "--action", "calibrate", "--out", "out"];
    let ended = program(place, &run)
        .stdin(fs::File::open(place.join("m.jsonl")).expect("there"))
        .output()
        .expect("started");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    let rows = boresight(place, &["batch", "gather", "out"]).stdout;
    assert_eq!(rows.lines().count(), 2);
}

#[cfg(target_os = "linux")]
#[test]
fn what_could_not_be_written_is_tried_again() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    planned(place, 2);
    let run = ["batch", "run", "m.jsonl", "--action", "export", "--out", "out"];
    // A file where the folder of the files should be.
    fs::create_dir_all(place.join("out")).expect("made");
    fs::write(place.join("out/files"), "").expect("written");
    let ended = boresight(place, &run);
    assert_eq!(ended.code, 1, "{}", ended.stderr);
    fs::remove_file(place.join("out/files")).expect("removed");
    says(&boresight(place, &run), 0, &["2 of 2"]);
    let rows = boresight(place, &["batch", "gather", "out"]).stdout;
    assert!(rows.lines().all(|row| json(row)["code"] == "OK"), "{rows}");
}

#[test]
fn sessions_that_are_gone_or_damaged_leave_the_index() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    for name in ["a", "b", "c"] {
        copied(
            "good",
            &place.join("s").join(name).parent().map_or(place.into(), |parent| {
                fs::create_dir_all(parent).expect("made");
                parent.join(name)
            }),
        );
    }
    says(&boresight(place, &["history", "add", "s"]), 0, &["3 of 3"]);
    fs::remove_dir_all(place.join("s/a")).expect("removed");
    fs::write(place.join("s/b/calibration.json"), "{").expect("written");
    says(&boresight(place, &["history", "add", "s"]), 0, &["1 of 2", "2 sessions have left"]);
    assert_eq!(fs::read_to_string(place.join("history.jsonl")).expect("there").lines().count(), 1);
    fs::write(place.join("history.jsonl"), [0, 159, 146, 150]).expect("written");
    let ended = boresight(place, &["history"]);
    assert_eq!(ended.code, 1);
    fs::write(place.join("history.jsonl"), "not JSON\n").expect("written");
    says(&boresight(place, &["history"]), 1, &["delete it", "history add"]);
    fs::write(place.join("history.jsonl"), "").expect("written");
    says(&boresight(place, &["history"]), 0, &["no calibration yet", "history add"]);
    says(
        &boresight(place, &["history", "add", "none"]),
        1,
        &["nothing is there", "Check the name"],
    );
    let nowhere = ["history", "add", "s", "--index", "none/history.jsonl"];
    says(&boresight(place, &nowhere), 1, &["the index", "exists and is writable"]);
}

#[test]
fn what_a_newer_version_wrote_is_not_damage() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    copied("good", &place.join("session"));
    let journal = place.join("session/journal.jsonl");
    let text = fs::read_to_string(&journal).expect("readable");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let at = lines.iter().position(|line| line.contains("\"observed\"")).expect("a frame");
    let mut envelope: Value = json(&lines[at]);
    let body =
        envelope["body"].to_string().replacen("\"observed\":{", "\"observed\":{\"later\":1,", 1);
    envelope["crc32"] = format!("{:08x}", crc32fast::hash(body.as_bytes())).into();
    envelope["body"] = "BODY".into();
    lines[at] = envelope.to_string().replacen("\"BODY\"", &body, 1);
    fs::write(&journal, lines.join("\n") + "\n").expect("written");
    let ended = boresight(place, &["replay", "session"]);
    says(&ended, 1, &["newer boresight"]);
    assert!(!ended.stderr.contains("--recover"), "{}", ended.stderr);
    let ended = boresight(place, &["doctor", "session"]);
    says(&ended, 1, &["newer boresight", "Nothing is damaged"]);
    assert!(!ended.stderr.contains("--recover"), "{}", ended.stderr);
    says(&boresight(place, &["doctor", "session", "--recover", "new"]), 1, &["Nothing is damaged"]);
    assert!(!place.join("new").exists());
}

/// Zeros remain after a power cut, but the pictures prove lines existed.
#[test]
fn a_journal_of_anything_is_no_empty_session() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    for (name, bytes) in
        [("noise", &b"\x07\x00\xff\n\x00 {"[..]), ("zeros", &[0; 2000]), ("empty", b"")]
    {
        copied("good", &place.join(name));
        fs::write(place.join(name).join("journal.jsonl"), bytes).expect("written");
        for command in ["replay", "report", "calibrate", "doctor"] {
            says(&boresight(place, &[command, name]), 1, &["lines are missing", "--recover"]);
        }
    }
    let manifest = boresight(place, &["batch", "plan", "."]).stdout;
    fs::write(place.join("m.jsonl"), manifest).expect("written");
    let run = ["batch", "run", "m.jsonl", "--action", "replay", "--out", "out"];
    says(&boresight(place, &run), 0, &["3 of 3"]);
    let rows = boresight(place, &["batch", "gather", "out"]).stdout;
    assert_eq!(rows.lines().count(), 3);
    assert!(rows.lines().all(|row| json(row)["code"] == "LINES-MISSING"), "{rows}");
}

#[test]
fn every_subcommand_has_a_page() {
    let place = TempDir::new().expect("folder");
    says(&boresight(place.path(), &["man", "man1"]), 0, &[]);
    let page = |name: &str| fs::read_to_string(place.path().join("man1").join(name)).expect(name);
    assert!(page("boresight-batch-run.1").contains("shard"));
    assert!(page("boresight-history-due.1").contains("older"));
    assert!(!place.path().join("man1/boresight-batch-worker.1").exists());
}
