//! Files made, broken or changed by others: each has its reason, and ends nothing else.

use std::{fs, path::Path};

use tempfile::TempDir;

use crate::{
    person::{boresight, says},
    platform::{copied, good, json},
};

/// A PNG with a palette of a fractional number of colours: its decoder panics.
fn panicking_png() -> Vec<u8> {
    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let body = [kind, data].concat();
        let crc32 = crc32fast::hash(&body).to_be_bytes();
        [&(data.len() as u32).to_be_bytes()[..], &body, &crc32].concat()
    }
    let header = [0, 0, 0, 4, 0, 0, 0, 4, 8, 3, 0, 0, 0];
    // Four rows of four pixels, each after its filter, in a stored block of zlib.
    let zlib = [&[0x78, 1, 1, 20, 0, 235, 255][..], &[0; 20], &[0, 20, 0, 1]].concat();
    let chunks = [
        chunk(b"IHDR", &header),
        chunk(b"PLTE", &[9; 4]),
        chunk(b"tRNS", &[0]),
        chunk(b"IDAT", &zlib),
        chunk(b"IEND", &[]),
    ];
    [b"\x89PNG\r\n\x1a\n".to_vec(), chunks.concat()].concat()
}

fn folder_with(place: &Path, broken: &[u8]) {
    let folder = place.join("pictures");
    fs::create_dir_all(&folder).expect("made");
    for entry in fs::read_dir(good().join("frames")).expect("listable") {
        let entry = entry.expect("listable");
        fs::copy(entry.path(), folder.join(entry.file_name())).expect("copied");
    }
    // Before all others, and among them.
    fs::write(folder.join("000.png"), broken).expect("written");
    fs::write(folder.join("0000005x.png"), broken).expect("written");
}

#[test]
fn a_picture_that_breaks_its_decoder_is_a_broken_picture() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    folder_with(place, &panicking_png());
    let ended = boresight(place, &["detect", "--board", "7x5", "pictures/000.png"]);
    says(&ended, 1, &["not a readable picture", "000.png"]);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
    copied("good", &place.join("session"));
    let stored = fs::read_dir(place.join("session/frames")).expect("listable").next();
    let stored = stored.expect("one").expect("listable").path();
    fs::write(&stored, panicking_png()).expect("written");
    let ended = boresight(place, &["doctor", "session"]);
    says(&ended, 1, &["checksum"]);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
}

#[test]
fn a_broken_picture_of_a_folder_is_said_and_left_out() {
    for broken in [panicking_png(), b"no picture".to_vec()] {
        let place = TempDir::new().expect("folder");
        let place = place.path();
        folder_with(place, &broken);
        let ended = boresight(
            place,
            &[
                "guide",
                "--headless",
                "--source",
                "pictures",
                "--board",
                "7x5",
                "--square",
                "30mm",
                "--out",
                "out",
            ],
        );
        assert!(matches!(ended.code, 0 | 3), "{}: {}", ended.code, ended.stderr);
        for word in ["PIC-BAD", "000.png", "0000005x.png"] {
            assert!(ended.stderr.contains(word), "{word}: {}", ended.stderr);
        }
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
        let result = fs::read_to_string(place.join("out/calibration.json")).expect("a result");
        assert!(json(&result)["result"]["f_px"][0].as_f64().is_some());
    }
}

#[test]
fn decisions_that_do_not_follow_are_told_from_those_of_other_rules() {
    let rules = boresight::guidance::RULES;
    let place = TempDir::new().expect("folder");
    let place = place.path();
    for (name, stated) in [("same", rules), ("later", 99)] {
        copied("good", &place.join(name));
        let header = place.join(name).join("session.toml");
        let text = fs::read_to_string(&header).expect("readable");
        let others = text.lines().filter(|line| !line.starts_with("guidance_rules"));
        let mut lines: Vec<String> = others.map(str::to_owned).collect();
        lines.insert(0, format!("guidance_rules = {stated}"));
        fs::write(&header, lines.join("\n")).expect("written");
    }
    says(&boresight(place, &["doctor", "same"]), 1, &["follow from what was recorded"]);
    says(&boresight(place, &["doctor", "later"]), 0, &["No damage found"]);
    says(&boresight(place, &["replay", "later"]), 1, &["newer boresight"]);
    let same = boresight(place, &["replay", "same"]);
    assert!(!same.stderr.contains("newer") && !same.stderr.contains("earlier rules"));
}

/// A program killed before the end: there are views, and no result yet.
#[test]
fn a_session_without_a_result_says_how_to_get_one() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    copied("good", &place.join("session"));
    fs::remove_file(place.join("session/calibration.json")).expect("removed");
    let words = ["no result yet", "boresight guide --session session"];
    for command in [&["export", "session"][..], &["check", "--against", "session"]] {
        says(&boresight(place, command), 1, &words);
    }
}

/// The recorded scene is missing.
#[test]
fn a_resumed_session_asks_for_a_source_that_is_gone() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    copied("good", &place.join("session"));
    let ended = boresight(place, &["guide", "--headless", "--session", "session"]);
    says(&ended, 1, &["site.toml", "boresight guide --session session --source SOURCE"]);
    let named = ["guide", "--headless", "--session", "session", "--source", "elsewhere"];
    let ended = boresight(place, &named);
    says(&ended, 1, &["elsewhere"]);
    assert!(!ended.stderr.contains("--source SOURCE"), "{}", ended.stderr);
}

/// `check` and `export` take a session's folder alike, and a goal has the same verdict everywhere.
#[test]
fn a_session_has_one_verdict_for_a_goal() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    copied("good", &place.join("session"));
    let goal = ["--accept", "0.001px", "--json"];
    let again = boresight(place, &[&["calibrate", "session"][..], &goal].concat());
    let report = boresight(place, &[&["report", "session"][..], &goal].concat());
    assert_eq!(json(&again.stdout)["verdict"], json(&report.stdout)["verdict"]);
    assert_eq!(again.code, report.code);
    let first = |stderr: &str| stderr.lines().find(|l| l.contains("(SIMULATED)")).map(String::from);
    assert!(first(&again.stderr).is_some());
    assert_eq!(first(&again.stderr), first(&report.stderr));
    says(&again, 3, &["below 0.001 px", "Doesn't meet your goal"]);
}

#[test]
fn the_pictures_of_a_folder_that_are_not_read_are_said() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    folder_with(place, b"no picture");
    for name in ["a.dng", "b.HEIC", "c.avif"] {
        fs::write(place.join("pictures").join(name), b"other").expect("written");
    }
    fs::write(place.join("pictures/notes.txt"), b"words").expect("written");
    for command in [
        &["calibrate", "--board", "7x5", "pictures"][..],
        &["detect", "--board", "7x5", "pictures"],
        &["guide", "--headless", "--board", "7x5", "--source", "pictures"],
    ] {
        let ended = boresight(place, command);
        says(&ended, ended.code, &["they can't be read: a.dng, b.HEIC, c.avif."]);
        assert!(!ended.stderr.contains("notes.txt"), "{}", ended.stderr);
    }
}

/// Names of files reach the terminal, and sources of sessions, which others may have made.
#[cfg(unix)]
#[test]
fn names_from_others_command_no_terminal() {
    // Clears the screen, sets the title by C1, turns the direction of writing.
    const NAME: &str = "e\u{1b}[2J\u{9b}2J\u{202e}c";
    let place = TempDir::new().expect("folder");
    let place = place.path();
    folder_with(place, b"no picture");
    fs::rename(place.join("pictures"), place.join(NAME)).expect("renamed");
    for (number, entry) in fs::read_dir(place.join(NAME)).expect("listable").enumerate() {
        let path = entry.expect("listable").path();
        fs::rename(&path, place.join(NAME).join(format!("{NAME}{number:02}.png"))).expect("named");
    }
    let session = format!("{NAME}/session");
    let (table, index) = (format!("{NAME}.json"), format!("{NAME}.jsonl"));
    let out = format!("{NAME}.out");
    let lines: &[&[&str]] = &[
        &["guide", "--headless", "--source", NAME, "--board", "7x5", "--out", &session],
        &["guide", "--headless", "--source", NAME, "--board", "7x5", "--out", &session],
        &["guide", "--headless", "--source", &format!("{NAME}2"), "--log-format", "json"],
        &["detect", "--board", "7x5", NAME],
        &["detect", "--board", "7x5", NAME, "--json"],
        &["detect", "--board", "7x5", &session],
        &["calibrate", "--board", "7x5", NAME],
        &["calibrate", &session],
        &["replay", &session],
        &["replay", &session, "--json"],
        &["doctor", &session],
        &["doctor", &session, "--json"],
        &["report", &session, "--out", &format!("{NAME}.html")],
        &["export", &session],
        &["export", &session, "--format", "ros-yaml", "--name", NAME],
        &["export", &session, "--json"],
        &["export", &session, "--format", "vnl"],
        &["export", &session, "--format", "views-csv"],
        &["convert", &session, &table, "--format", "json"],
        &["convert", &session, &table, "--format", "json"],
        &["check", "--against", &table, "--source", NAME, "--headless"],
        &["check", "--against", &table, "--source", NAME, "--headless", "--json"],
        &["history", "add", &session, "--index", &index],
        &["history", "--index", &index],
        &["history", "--index", &index, "--json"],
        &["history", "due", "--index", &index, "--older", "1d"],
        &["batch", "plan", NAME],
        &["batch", "run", NAME, "--action", "replay", "--out", &out],
        &["batch", "gather", &out],
        &["watch", "--source", NAME, "--store", &format!("{NAME}.watch"), "--once"],
        &["plan-board", NAME],
        &["paths"],
    ];
    let mut seen = 0;
    for arguments in lines {
        let ended = boresight(place, arguments);
        for text in [&ended.stdout, &ended.stderr] {
            let harmful = text.chars().find(|c| matches!(c, '\u{1b}' | '\u{9b}' | '\u{202e}'));
            assert_eq!(harmful, None, "{arguments:?}: {text:?}");
            seen += usize::from(text.contains("[2J"));
        }
    }
    assert!(seen > 15, "names are shown in {seen} texts");
}
