//! docs/schemas: made from the Rust types, and true of the program's output.

use std::{
    fs,
    path::{Path, PathBuf},
};

use boresight::schemas::schemas;
use jsonschema::Validator;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::person::{boresight, says};

/// Variable to rewrite docs/schemas.
const WRITE: &str = "BORESIGHT_WRITE_SCHEMAS";

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn recording(path: &str) -> PathBuf {
    repository("fixtures/recordings/v1").join(path)
}

fn tree(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

fn file(path: &Path) -> Value {
    tree(&fs::read_to_string(path).expect("readable"))
}

/// The committed schema.
fn validator(name: &str) -> Validator {
    let schema = file(&repository("docs/schemas").join(format!("{name}.v1.json")));
    jsonschema::draft202012::new(&schema).expect("a schema")
}

fn assert_valid(validator: &Validator, value: &Value) {
    let errors: Vec<String> =
        validator.iter_errors(value).map(|err| format!("{}: {err}", err.instance_path())).collect();
    assert!(errors.is_empty(), "{}", errors.join("\n"));
}

#[test]
fn the_committed_schemas_are_those_of_the_types() {
    let folder = repository("docs/schemas");
    let mut names = Vec::new();
    for (name, schema) in schemas() {
        let text = serde_json::to_string_pretty(&schema).expect("JSON") + "\n";
        let path = folder.join(name);
        if std::env::var_os(WRITE).is_some() {
            fs::write(&path, &text).expect("written");
        }
        let committed = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            committed == text,
            "{path:?} is not what the types say. If the change is meant, and adds fields only, rewrite it with:\n\
             {WRITE}=1 cargo test --test program schemas"
        );
        names.push(name.to_owned());
    }
    let listed = fs::read_dir(&folder).expect("listable");
    let mut listed: Vec<String> = listed
        .map(|entry| entry.expect("listable").file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".json"))
        .collect();
    listed.sort();
    names.sort();
    assert_eq!(listed, names, "a schema of no type");
}

#[test]
fn the_program_prints_each_of_them() {
    let folder = TempDir::new().expect("folder");
    let listed = boresight(folder.path(), &["schema"]);
    let mut names: Vec<String> =
        schemas().iter().map(|(name, _)| name.trim_end_matches(".json").to_owned()).collect();
    names.sort();
    let mut printed: Vec<_> = listed.stdout.lines().collect();
    printed.sort_unstable();
    assert_eq!(printed, names);
    for name in &names {
        let printed = boresight(folder.path(), &["schema", name]);
        says(&printed, 0, &[]);
        let committed = file(&repository("docs/schemas").join(format!("{name}.json")));
        assert_eq!(tree(&printed.stdout), committed);
        let id = format!("urn:boresight:schema:{}", name.replace(".v", ":"));
        assert_eq!(committed["$id"], Value::String(id));
    }
    let without_version = boresight(folder.path(), &["schema", "calibration"]);
    assert_eq!(tree(&without_version.stdout)["title"], "CalibrationFile");
    says(&boresight(folder.path(), &["schema", "nothing"]), 1, &["boresight schema"]);
}

#[test]
fn recorded_files_are_valid() {
    let calibration = validator("calibration");
    for name in ["good", "focus-moved", "focus-moved-unseen"] {
        assert_valid(&calibration, &file(&recording(name).join("calibration.json")));
    }
    assert_valid(&validator("check"), &file(&recording("installed-camera-changed/check.json")));
    assert_valid(&validator("truth"), &file(&recording("good/truth.json")));
    let line = validator("session-journal-line");
    let mut lines = 0;
    for name in ["good", "focus-moved", "focus-moved-unseen", "installed-camera-changed"] {
        let journal = fs::read_to_string(recording(name).join("journal.jsonl")).expect("readable");
        for text in journal.lines() {
            assert_valid(&line, &tree(text));
            lines += 1;
        }
    }
    assert_eq!(lines, 196 + 193 + 16 + 101);
}

#[test]
fn the_schemas_refuse_what_is_no_such_file() {
    let good = file(&recording("good/calibration.json"));
    let calibration = validator("calibration");
    let refused = |pointer: &str, value: Value| {
        let mut changed = good.clone();
        *changed.pointer_mut(pointer).expect(pointer) = value;
        assert!(!calibration.is_valid(&changed), "{pointer}");
    };
    refused("/schema", json!("boresight.calibration/2"));
    refused("/verdict", json!("fine"));
    refused("/result/f_px", json!([1.0]));
    refused("/result/pp_px/0", json!("243"));
    refused("/result/sigma/k1", json!(null));
    refused("/views/0/outline_px/0", json!([1.0, 2.0, 3.0]));
    refused("/image_size/0", json!(-1));
    refused("/findings", json!([{ "code": "X" }]));
    let mut without = good.clone();
    without.as_object_mut().expect("an object").remove("views");
    assert!(!calibration.is_valid(&without));
    // Fields of later versions are allowed.
    let mut later = good.clone();
    later["shutter"] = json!({ "rolls": true });
    assert_valid(&calibration, &later);
    let line = validator("session-journal-line");
    for text in [
        r#"{"seq":0,"crc32":"00000000","body":{"input":"begun","decision":{}}}"#,
        r#"{"seq":0,"body":{"input":"stop","decision":{}}}"#,
    ] {
        assert!(!line.is_valid(&tree(text)), "{text}");
    }
}

#[test]
fn what_the_program_writes_now_is_valid() {
    let folder = TempDir::new().expect("folder");
    let here = folder.path();
    fs::create_dir(here.join("pictures")).expect("made");
    for entry in fs::read_dir(recording("good/frames")).expect("listable") {
        let from = entry.expect("listable").path();
        let name = from.file_name().expect("a name");
        fs::copy(&from, here.join("pictures").join(name)).expect("copied");
    }
    image::GrayImage::new(400, 300).save(here.join("pictures/9.png")).expect("saved");
    let pictures: Vec<String> = fs::read_dir(here.join("pictures"))
        .expect("listable")
        .map(|entry| format!("pictures/{}", entry.expect("listable").file_name().to_string_lossy()))
        .collect();
    let run = |arguments: &[&str], code: i32| {
        let ended = boresight(here, arguments);
        says(&ended, code, &[]);
        tree(ended.stdout.lines().last().expect("JSON"))
    };
    let calibration = validator("calibration");

    // With an unused picture, and without a used one.
    let mut calibrate = vec!["calibrate", "--board", "7x5", "--square", "30mm", "--out", "c.json"];
    calibrate.extend(pictures.iter().map(String::as_str));
    boresight(here, &calibrate);
    let written = file(&here.join("c.json"));
    assert_valid(&calibration, &written);
    assert!(written.get("source").is_none() && written.get("camera").is_none());
    boresight(here, &["calibrate", "--board", "7x5", "pictures/9.png", "--out", "none.json"]);
    let none = file(&here.join("none.json"));
    assert_eq!(none["result"], Value::Null);
    assert_valid(&calibration, &none);

    // A session, its comparison, and their messages.
    let guide =
        ["guide", "--headless", "--source", "pictures", "--board", "7x5", "--square", "30mm"];
    let old = recording("good/calibration.json").display().to_string();
    let with = ["--out", "session", "--against", old.as_str(), "--json"];
    let ended = boresight(here, &[&guide[..], &with].concat());
    let session = tree(ended.stdout.lines().last().expect("JSON"));
    assert_valid(&calibration, &session);
    assert_eq!(session["replaces"], Value::String(old));
    assert_valid(&calibration, &file(&here.join("session/calibration.json")));
    assert_valid(&validator("check"), &file(&here.join("session/check.json")));
    let line = validator("session-journal-line");
    let journal = fs::read_to_string(here.join("session/journal.jsonl")).expect("readable");
    for text in journal.lines() {
        assert_valid(&line, &tree(text));
    }
    assert_valid(&validator("doctor"), &run(&["doctor", "session", "--json"], 0));
    let report = boresight(here, &["report", "session", "--json"]);
    assert_valid(&validator("report"), &tree(report.stdout.trim()));

    // No verdict: another picture size.
    let other = fs::read_to_string(here.join("c.json")).expect("readable").replace("400,", "404,");
    fs::write(here.join("other.json"), other).expect("written");
    let check =
        ["check", "--against", "other.json", "--source", "pictures", "--board", "7x5", "--json"];
    let check = run(&check, 3);
    assert_eq!((&check["verdict"], &check["reason"]), (&Value::Null, &json!("OTHER-SIZE")));
    assert_valid(&validator("check"), &check);

    let paths = run(&["paths", "--json"], 0);
    assert_valid(&validator("paths"), &paths);
    assert_eq!(paths["sessions"], json!(here.canonicalize().expect("there").join("sessions")));

    // Any cameras of this computer.
    let devices = boresight(here, &["devices", "--json"]);
    assert_valid(&validator("devices"), &tree(devices.stdout.trim()));
}
