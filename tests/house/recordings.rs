//! Sessions recorded by earlier versions: every decision and every result comes out again.
//!
//! `fixtures/recordings/README.md` describes each recording.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use boresight::{
    app::{
        Announcer, SavedSession,
        commands::doctor,
        session::{comparison, result::calibration_file},
    },
    calibration::files::{CalibrationFile, CheckFile},
    guidance::RULES,
    text,
};
use boresight_testkit::fixture;
use serde_json::Value;

/// Tolerated difference of two numbers, relative above 1: a tenth of the uncertainty of these
/// results. Later versions weigh distant outliers.
const SAME_RESULT: f64 = 1e-4;
/// Tolerated difference of an unusable result.
const SAME_UNUSABLE_RESULT: f64 = 1e-2;

/// Tolerated difference of uncertainties: later versions weigh correlated noise and heavy tails,
/// too.
const SAME_UNCERTAINTY: f64 = 0.75;
/// Names of uncertainties.
const UNCERTAINTIES: [&str; 7] =
    ["covariance", "sigma", "sd", "noise", "excess", "expected", "scatter"];
/// Sentences may be worded better, and later versions find more; the verdict stays. Rejected models
/// and the limits of a test aren't a result, and of covariances the standard deviations represent
/// the rest.
const MAY_DIFFER: [&str; 10] = [
    "message",
    "action",
    "reason",
    "findings",
    "candidates",
    "limit",
    "visible",
    "covariance",
    "covariance_all",
    "covariance_px2",
];

const UNTRUSTWORTHY: &str = "untrustworthy";

fn recording(name: &str) -> PathBuf {
    fixture("recordings/v1").join(name)
}

fn json(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("readable");
    serde_json::from_str(&text).expect("JSON")
}

/// The replayed session with the recorded views, each from the recorded frame. Recorded under the
/// first rules: this version decides differently on other pictures, and reports it.
fn replayed(name: &str) -> SavedSession {
    let saved = SavedSession::open(&recording(name)).expect("a session");
    assert!(!saved.contents.cut, "{name}");
    assert!(saved.header.guidance_rules < RULES, "{name}");
    let taken: Vec<(String, u64)> = saved
        .session
        .accepted()
        .iter()
        .map(|view| (view.number.to_string(), view.view.frame_id.0))
        .collect();
    assert!(!taken.is_empty(), "{name}");
    let said = Arc::new(Mutex::new(Vec::new()));
    let listener = Arc::clone(&said);
    saved.announce(&Announcer::new(move |sentence| {
        listener.lock().expect("one thread").push(sentence.to_owned());
    }));
    let said = said.lock().expect("one thread");
    let explained = said.iter().any(|sentence| sentence == text::replay::EARLIER_RULES);
    assert_eq!(explained, !saved.replayed.different_lines.is_empty(), "{name}: {said:?}");
    println!(
        "{name}: {} decisions, {} differ by the rules, {} by rounding",
        saved.contents.lines.len(),
        saved.replayed.different_lines.len(),
        saved.replayed.rounding.count
    );
    saved
}

/// Different names and numbers, with places: numbers beyond [`SAME_RESULT`]; sentences are ignored,
/// for they may be worded better.
fn differences(recorded: &Value, now: &Value, at: &str, found: &mut Vec<String>) {
    match (recorded, now) {
        (Value::Object(recorded), Value::Object(now)) => {
            // Fields are only ever added.
            found.extend(
                recorded
                    .keys()
                    .filter(|name| !now.contains_key(*name))
                    .map(|n| format!("{at}: {n}")),
            );
            for (name, value) in recorded.iter().filter(|(name, _)| now.contains_key(*name)) {
                if !MAY_DIFFER.contains(&name.as_str()) {
                    differences(value, &now[name], &format!("{at}/{name}"), found);
                }
            }
        }
        (Value::Array(recorded), Value::Array(now)) => {
            if recorded.len() != now.len() {
                found.push(format!("{at}: {} and {} items", recorded.len(), now.len()));
            }
            for (i, (recorded, now)) in recorded.iter().zip(now).enumerate() {
                differences(recorded, now, &format!("{at}/{i}"), found);
            }
        }
        (Value::Number(recorded), Value::Number(now)) => {
            let [a, b] = [recorded, now].map(|number| number.as_f64().expect("a double"));
            let uncertain = UNCERTAINTIES.iter().any(|name| at.contains(name));
            let unusable = at.starts_with(UNTRUSTWORTHY);
            let (same, least) = match (uncertain, unusable) {
                (true, _) => (SAME_UNCERTAINTY, 0.0),
                (false, true) => (SAME_UNUSABLE_RESULT, 1.0),
                // Coefficients and angles near zero are as uncertain as large ones.
                (false, false) if at.contains("distortion") || at.contains("_deg") => {
                    (SAME_RESULT, 10.0)
                }
                (false, false) => (SAME_RESULT, 1.0),
            };
            // Of an unusable result, no uncertainty has to stay.
            let skipped = uncertain && unusable;
            if !skipped && (a - b).abs() > same * a.abs().max(least) {
                found.push(format!("{at}: {recorded} {now}"));
            }
        }
        (recorded, now) if recorded == now => {}
        (recorded, now) => found.push(format!("{at}: {recorded} {now}")),
    }
}

fn assert_same(recorded: &Value, now: &Value) {
    let mut found = Vec::new();
    let unusable = recorded["verdict"] == UNTRUSTWORTHY;
    differences(recorded, now, if unusable { UNTRUSTWORTHY } else { "" }, &mut found);
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// Asserts that the calibration of `saved` equals the recorded calibration.
fn assert_same_calibration(saved: &SavedSession) {
    let recorded = json(&saved.path.join("calibration.json"));
    let now = calibration_file(&saved.session, &saved.header).to_json().expect("JSON");
    assert_same(&recorded, &now);
}

/// Stable names of the outcomes without a frame in a recorded journal.
fn outcomes(saved: &SavedSession) -> Vec<String> {
    let outcome =
        |line: Result<boresight::recording::Line, boresight::recording::RecordingError>| {
            let decision = line.expect("readable").decision;
            let decision: Value = serde_json::from_str(decision.get()).expect("JSON");
            decision["outcome"]["outcome"].as_str().expect("an outcome").to_owned()
        };
    saved.contents.lines.iter().map(outcome).collect()
}

#[test]
fn a_good_session_comes_out_again() {
    let saved = replayed("good");
    assert_eq!(saved.session.accepted().len(), 8);
    assert_same_calibration(&saved);
}

#[test]
fn a_session_whose_focus_moved_comes_out_again() {
    let saved = replayed("focus-moved");
    let outcomes = outcomes(&saved);
    let count = |wanted: &str| outcomes.iter().filter(|outcome| *outcome == wanted).count();
    // One view was taken after the focus was last seen in its place.
    assert_eq!((count("accepted"), count("removed")), (7, 1));
    let ids: Vec<u32> = saved.session.accepted().iter().map(|view| view.number.0).collect();
    assert_eq!(ids, [0, 1, 2, 4, 5, 6]);
    assert_same_calibration(&saved);
}

#[test]
fn pictures_of_two_focal_lengths_are_told_again() {
    let saved = replayed("focus-moved-unseen");
    let recorded =
        CalibrationFile::read(&json(&saved.path.join("calibration.json"))).expect("whole");
    let now = calibration_file(&saved.session, &saved.header);
    assert_eq!(recorded.verdict, "untrustworthy");
    assert_eq!(recorded.findings[0].code, "FOCUS-MOVED");
    assert_ne!(now.verdict, "good");
    // The first versions let the focal length vary by themselves.
    assert!(recorded.result.expect("a lens").focal_varies());
    assert!(!now.result.expect("a lens").focal_varies());
}

#[test]
fn an_installed_camera_that_changed_is_told_again() {
    let saved = replayed("installed-camera-changed");
    let old = comparison::read(&recording("good").join("calibration.json")).expect("a calibration");
    let found = comparison::compare(&saved.session, &old, None);
    let recorded = CheckFile::read(&json(&saved.path.join("check.json"))).expect("whole");
    let now = comparison::check_file(
        Path::new(&recorded.against),
        &saved.header.source,
        &old,
        &found,
        &recorded.action,
    );
    assert_eq!(now.verdict.as_deref(), Some("recalibrate"));
    assert_same(&recorded.to_json().expect("JSON"), &now.to_json().expect("JSON"));
    assert_eq!(recorded.to_json().expect("JSON"), json(&saved.path.join("check.json")));
}

#[test]
fn every_picture_of_a_recording_is_whole() {
    for entry in fs::read_dir(recording("")).expect("listable") {
        let path = entry.expect("listable").path();
        let diagnosis = doctor::verify(&path).expect("a session");
        assert_eq!(diagnosis.problems, [""; 0], "{path:?}");
        assert!(diagnosis.pictures >= diagnosis.views && diagnosis.views >= 4, "{path:?}");
    }
}

/// The type of the file holds the output of an earlier version, to the last digit and in the same
/// order.
#[test]
fn a_recorded_calibration_is_written_as_it_was() {
    for name in ["good", "focus-moved", "focus-moved-unseen"] {
        let path = recording(name).join("calibration.json");
        let text = fs::read_to_string(&path).expect("readable");
        let tree: Value = serde_json::from_str(&text).expect("JSON");
        let written = CalibrationFile::read(&tree).expect("whole").to_json().expect("JSON");
        let mut found = Vec::new();
        differences(&tree, &written, "", &mut found);
        assert_eq!(found, [""; 0], "{name}");
        assert_eq!(tree, written, "{name}");
    }
    // As this program wrote it: the same bytes.
    let path = recording("good").join("calibration.json");
    let text = fs::read_to_string(&path).expect("readable");
    let file = CalibrationFile::read(&serde_json::from_str(&text).expect("JSON")).expect("whole");
    let again = serde_json::to_string_pretty(&file.to_json().expect("JSON")).expect("JSON");
    assert!(again == text, "another order or other digits");
}
