//! Interfaces for scripts: standard input, errors as JSON, plans of boards, work ending with a
//! reason.

use std::{
    fs,
    io::Write,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::{
    person::{boresight, program, says},
    platform::{copied, good, json},
};

/// Output of the program with `input` at standard input.
fn with_input(place: &TempDir, arguments: &[&str], input: &[u8]) -> (i32, String, String) {
    let mut command: Command = program(place.path(), arguments);
    let pipes = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = pipes.spawn().expect("started");
    // A program with refused arguments reads nothing.
    let _ = child.stdin.take().expect("a pipe").write_all(input);
    let output = child.wait_with_output().expect("ended");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("not killed"), text(output.stdout), text(output.stderr))
}

#[test]
fn a_dash_is_standard_input() {
    let place = TempDir::new().expect("folder");
    let pictures = fs::read_dir(good().join("frames")).expect("listable");
    let mut pictures: Vec<_> = pictures.map(|entry| entry.expect("listable").path()).collect();
    pictures.sort();
    // A picture.
    let bytes = fs::read(&pictures[0]).expect("readable");
    let detect = ["detect", "--board", "7x5", "--json"];
    let (code, piped, _) = with_input(&place, &[&detect[..], &["-"]].concat(), &bytes);
    let file = pictures[0].to_str().expect("text");
    let named = boresight(place.path(), &[&detect[..], &[file]].concat());
    let (piped, named) = (json(&piped), json(&named.stdout));
    assert_eq!((code, &piped["file"]), (0, &"-".into()));
    assert_eq!(piped["corners"], named["corners"]);
    // A table of corners, from one command to the next.
    let mut all = vec!["detect", "--board", "7x5"];
    all.extend(pictures.iter().map(|path| path.to_str().expect("text")));
    let table = boresight(place.path(), &all).stdout;
    let calibrate = [
        "calibrate",
        "--board",
        "7x5",
        "--square",
        "30mm",
        "--image-size",
        "400x300",
        "--json",
        "-",
    ];
    let (code, result, said) = with_input(&place, &calibrate, table.as_bytes());
    assert_eq!(code, 0, "{said}");
    assert!(json(&result)["result"]["f_px"][0].as_f64().is_some());
    // A calibration.
    let (code, ros, said) =
        with_input(&place, &["export", "-", "--format", "ros-yaml"], result.as_bytes());
    assert!(code == 0 && ros.contains("camera_matrix"), "{said}");
    let (code, _, said) = with_input(&place, &["convert", "-", "cameras.txt"], ros.as_bytes());
    assert!(code == 0 && place.path().join("cameras.txt").exists(), "{said}");
    // Nothing, and twice.
    let (code, _, said) = with_input(&place, &["detect", "--board", "7x5", "-"], b"");
    assert!(code == 1 && said.contains("nothing came"), "{said}");
    let (code, _, said) = with_input(&place, &["detect", "--board", "7x5", "-", "-"], &bytes);
    assert!(code == 1 && said.contains("once"), "{said}");
}

#[test]
fn wrong_usage_is_an_object_too() {
    let place = TempDir::new().expect("folder");
    for arguments in [
        &["calibrate", "--nonsense", "--json"][..],
        &["calibrate", "--json"],
        &["target", "--json", "--out", "b.docx"],
        &["plan-board", "--json", "--distance", "1m"],
        &["plan-board", "--json", "--distance", "1m", "--fov", "170deg"],
    ] {
        let ended = boresight(place.path(), arguments);
        assert_eq!(ended.code, 2, "{arguments:?}: {}", ended.stderr);
        let error = json(&ended.stdout);
        assert_eq!(error["schema"], "boresight.error/1", "{arguments:?}");
        assert_eq!(error["code"], "USAGE", "{arguments:?}");
        assert!(error["message"].as_str().is_some_and(|message| !message.is_empty()));
    }
    // In a log, too.
    let run = ["batch", "run", "none.jsonl", "--action", "replay", "--out", "out", "--log", "json"];
    let ended = boresight(place.path(), &run);
    assert_eq!(ended.code, 1);
    let events: Vec<Value> = ended.stderr.lines().map(json).collect();
    let error = events.iter().find(|event| event["event"] == "error").expect("an error");
    assert_eq!(error["code"], "MANIFEST", "{error}");
}

#[test]
fn a_board_is_planned_from_distance_and_view() {
    let place = TempDir::new().expect("folder");
    let plan = |distance: &str| {
        let arguments = ["plan-board", "--distance", distance, "--fov", "60deg", "--json"];
        let ended = boresight(place.path(), &arguments);
        says(&ended, 0, &["the picture shows", "A4", "Filling"]);
        (json(&ended.stdout), ended.stderr)
    };
    let (near, said) = plan("40cm");
    let smallest = near["smallest"].as_str().expect("a paper");
    assert!(said.contains(&format!("{smallest} is enough: boresight target")), "{said}");
    // That command writes it.
    let command = said.lines().find_map(|line| line.split_once("is enough: boresight "));
    let words: Vec<&str> = command.expect("a command").1.split(' ').collect();
    says(&boresight(place.path(), &words), 0, &["Written"]);
    let (far, said) = plan("8m");
    assert!(far["smallest"].is_null() && said.contains("Have a board of"), "{said}");
    let enough = |plan: &Value| plan["enough"]["square_mm"].as_f64().expect("mm");
    assert!(said.contains(&format!("({} mm squares) made", enough(&far))), "{said}");
    let square = |plan: &Value| plan["filling"]["square_mm"].as_f64().expect("mm");
    assert!((square(&far) / square(&near) - 20.0).abs() < 0.6);
}

#[test]
fn a_cameras_two_words_on_its_change_agree() {
    let place = TempDir::new().expect("folder");
    for name in ["a", "b", "c"] {
        copied("good", &place.path().join(name));
    }
    says(&boresight(place.path(), &["history", "add", "."]), 0, &["3 of 3"]);
    let camera = json(&boresight(place.path(), &["history", "--json"]).stdout);
    assert_eq!(camera["schema"], "boresight.history/1");
    let said = (camera["changed"].as_bool(), camera["change"]["verdict"].as_str());
    assert_eq!(said, (Some(false), Some("cannot-tell")));
    // A folder named explicitly leaves, too.
    fs::remove_dir_all(place.path().join("a")).expect("removed");
    says(&boresight(place.path(), &["history", "add", "a"]), 0, &["1 session has left"]);
    let camera = json(&boresight(place.path(), &["history", "--json"]).stdout);
    assert_eq!(camera["count"], 2);
    // One dated after today counts as not calibrated.
    let index = place.path().join("history.jsonl");
    let text = fs::read_to_string(&index).expect("readable").replace("\"2026-", "\"2300-");
    fs::write(&index, text).expect("written");
    let due = boresight(place.path(), &["history", "due", "--older", "36500d"]);
    says(&due, 0, &["1 camera lacks a usable calibration"]);
}
