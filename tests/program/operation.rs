//! Sessions watched by a machine: metrics, logs for programs, a command at the end.

use std::{
    fs,
    io::{Read, Write},
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::person::{boresight, says};

/// A scene with quickly drawn pictures.
const SCENE: &str = "image_size_px = [200, 150]\nfps = 4.0\nclutter = 0.0\n";

fn value(page: &str, name: &str) -> Option<f64> {
    let start = format!("boresight_session_{name}{{file=\"cell\"}} ");
    page.lines().find_map(|line| line.strip_prefix(start.as_str()))?.parse().ok()
}

#[test]
fn a_session_is_watched_from_its_first_picture_to_its_verdict() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fs::write(place.join("scene.toml"), SCENE).expect("written");
    let guide =
        ["guide", "--headless", "--source", "sim:scene.toml", "--out", "s", "--max-frames", "60"];
    let note = "echo $BORESIGHT_VERDICT $BORESIGHT_RESULT $BORESIGHT_SESSION > note; echo aside";
    let watched = ["--json", "--log", "json", "--metrics", "cell.prom", "--on-finish", note];
    let ended = boresight(place, &[&guide[..], &watched[..]].concat());
    // Machines read the result on stdout, independent of the command's output.
    let result: Value = serde_json::from_str(ended.stdout.trim()).expect("JSON");
    assert!(result["schema"].is_string());
    let lines = ended.stderr.lines();
    let events: Vec<Value> =
        lines.map(|line| serde_json::from_str(line).expect("a line of JSON")).collect();
    assert!(events.iter().all(|event| event["time"].is_string()), "{}", ended.stderr);
    let of = |name: &'static str| events.iter().filter(move |event| event["event"] == name);
    assert!(of("message").any(|event| {
        event["text"].as_str().is_some_and(|text| text.starts_with("Session: s"))
    }));
    assert!(of("message").any(|event| event["text"] == "aside"), "{}", ended.stderr);
    let end = of("end").next().expect("an end");
    assert_eq!((&end["session"], &end["result"]), (&"s".into(), &"s/calibration.json".into()));
    let verdict = end["verdict"].as_str().expect("a verdict");
    let told = fs::read_to_string(place.join("note")).expect("written");
    assert_eq!(told, format!("{verdict} s/calibration.json s\n"));
    let page = fs::read_to_string(place.join("cell.prom")).expect("written");
    assert!(value(&page, "pictures_total").is_some_and(|pictures| pictures > 0.0), "{page}");
    let views = value(&page, "views").expect("views");
    assert_eq!(of("view-taken").count() as f64, views + of("view-removed").count() as f64);
    assert!(page.contains(&format!("{{file=\"cell\",verdict=\"{verdict}\"}} 1\n")), "{page}");
}

/// A script doesn't discard a good calibration for a longer plan.
#[test]
fn the_exit_code_follows_the_verdict_though_the_plan_is_not_complete() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fs::write(place.join("scene.toml"), SCENE).expect("written");
    let guide = ["guide", "--headless", "--source", "sim:scene.toml", "--out", "s"];
    let ending = ["--max-frames", "120", "--set", "guidance.plan=full"];
    let ended = boresight(place, &[&guide[..], &ending[..]].concat());
    says(&ended, 0, &["Ended early", "Good"]);
    says(&boresight(place, &["report", "s"]), 0, &[]);
}

/// Output of a session on a terminal by `script` (Debian's bsdutils), with a key pressed at each of
/// `steps`.
fn on_terminal(options: &str, steps: &[(&str, u8)]) -> String {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fs::write(place.join("scene.toml"), SCENE).expect("written");
    let command = format!(
        "{} guide --headless --source sim:scene.toml --out s --max-frames 3000 {options}",
        env!("CARGO_BIN_EXE_boresight")
    );
    let mut child = Command::new("script")
        .args(["-qec", &command, "/dev/null"])
        .current_dir(place)
        .env("TERM", "xterm")
        .env("LC_ALL", "C.UTF-8")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("script");
    let mut keys = child.stdin.take().expect("piped");
    let mut screen = child.stdout.take().expect("piped");
    let (mut seen, mut part) = (String::new(), [0; 4096]);
    let mut steps = steps.iter().peekable();
    while let Ok(count @ 1..) = screen.read(&mut part) {
        seen += &String::from_utf8_lossy(&part[..count]);
        if let Some((_, key)) = steps.next_if(|(said, _)| seen.contains(said)) {
            keys.write_all(&[*key]).expect("typed");
        }
    }
    child.wait().expect("ended");
    assert_eq!(steps.next(), None, "{seen}");
    seen
}

#[cfg(feature = "serve")]
#[test]
fn the_code_for_a_phone_is_shown_again_by_a_key() {
    let seen = on_terminal(
        "--serve 127.0.0.1:0 --set guidance.plan=full",
        &[("c code for a phone", b'c'), ("c back to the session", 3)],
    );
    // Once when it begins, and once for the key.
    assert!(seen.matches("█▀▀▀▀▀█").count() + seen.matches("█ ▄▄▄▄▄ █").count() >= 4, "{seen}");
}

#[test]
fn a_terminal_shows_what_to_do_in_place_and_obeys_keys() {
    // A taken view is removed, brought back, and the session ended.
    let steps =
        [("Taken: view 1", b'u'), ("Removed: view 1", b'r'), ("Brought back: view 1", b'q')];
    let seen = on_terminal("--set guidance.plan=full", &steps);
    let keys = ["p pause  u undo  t take now  q finish", "u undo  r redo  t take now"];
    for words in keys.into_iter().chain(["taken, about", "tilt ", "Ended early: it needs"]) {
        assert!(seen.contains(words), "no {words:?} in: {seen}");
    }
    assert!(seen.contains("\u{1b}["), "rewritten in place: {seen}");
    let dots = |c: char| ('\u{2801}'..='\u{28ff}').contains(&c);
    assert!(seen.contains(dots), "the card is drawn: {seen}");
    assert!(!seen.contains("\n  Tip"), "the sentence isn't a line of its own: {seen}");
}

#[test]
fn a_command_that_fails_changes_no_verdict() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fs::write(place.join("scene.toml"), SCENE).expect("written");
    let guide = ["guide", "--headless", "--source", "sim:scene.toml", "--max-frames", "10"];
    let plain = boresight(place, &[&guide[..], &["--out", "a"]].concat());
    let failing = ["--out", "b", "--on-finish", "exit 7"];
    let ended = boresight(place, &[&guide[..], &failing[..]].concat());
    says(&ended, plain.code, &["--on-finish failed", "exit 7"]);
    let nowhere = ["--out", "c", "--metrics", "nowhere/cell.prom"];
    says(&boresight(place, &[&guide[..], &nowhere[..]].concat()), 1, &["nowhere"]);
    assert!(!place.join("c").exists());
}
