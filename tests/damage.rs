//! What is broken, taken or out of place, as a person meets it: it is named, the next step is said, and
//! nothing is touched.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod pictures;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use boresight::{
    config::Config,
    frame::ImageSize,
    recording::{Header, SessionFolder},
};
use image::{GrayImage, codecs::jpeg::JpegEncoder};
use pictures::{PAIRS, picture};
use tempfile::TempDir;

/// How a run ended.
struct Ended {
    code: i32,
    stdout: String,
    stderr: String,
}

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_boresight"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn boresight(folder: &Path, arguments: &[&str]) -> Ended {
    let output = program(folder, arguments).output().expect("started");
    Ended {
        code: output.status.code().expect("not killed"),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

fn says(ended: &Ended, code: i32, words: &[&str]) {
    for word in words {
        assert!(ended.stderr.contains(word), "no {word:?} in: {}", ended.stderr);
    }
    assert_eq!(ended.code, code, "{}", ended.stderr);
    assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
}

fn place() -> TempDir {
    TempDir::new().expect("folder")
}

/// Every folder and file below `folder`, with its contents.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("listable") {
        let path = entry.expect("listable").path();
        if path.is_dir() {
            found.push((path.clone(), Vec::new()));
            found.extend(contents(&path));
        } else {
            found.push((path.clone(), fs::read(&path).expect("readable")));
        }
    }
    found.sort();
    found
}

/// A folder `name` with the first `count` of the pairs.
fn pair_pictures(place: &Path, name: &str, count: usize) {
    let folder = place.join(name);
    fs::create_dir_all(&folder).expect("made");
    for (i, (tilt_deg, slot_deg)) in PAIRS.iter().take(count).enumerate() {
        picture(*tilt_deg, *slot_deg).save(folder.join(format!("{i}.png"))).expect("saved");
    }
}

fn guide<'a>(source: &'a str, out: &'a str) -> [&'a str; 6] {
    ["guide", "--headless", "--source", source, "--out", out]
}

/// An empty session of VGA pictures, open as long as the value lives.
fn empty_session(path: &Path) -> SessionFolder {
    let size = ImageSize { width_px: 640, height_px: 480 };
    let header = Header::new("pictures", size, Config::load(None, &[]).expect("defaults"));
    SessionFolder::create(path, &header).expect("created")
}

#[test]
fn a_folder_with_something_in_it_is_not_made_a_session() {
    let place = place();
    pair_pictures(place.path(), "pictures", 1);
    fs::create_dir(place.path().join("holiday")).expect("made");
    fs::write(place.path().join("holiday/beach.txt"), b"mine").expect("written");
    fs::create_dir(place.path().join("orphan")).expect("made");
    fs::write(place.path().join("orphan/journal.jsonl"), b"").expect("written");
    fs::write(place.path().join("file"), b"mine").expect("written");
    drop(empty_session(&place.path().join("session")));
    let before = contents(place.path());
    for (taken, next_step) in [
        ("holiday", "Name a new folder"),
        ("orphan", "Name a new folder"),
        ("session", "--session"),
        ("pictures", "Name a new folder"),
    ] {
        let ended = boresight(place.path(), &guide("pictures", taken));
        says(&ended, 1, &["already", taken, next_step]);
        assert!(!ended.stderr.contains("--force"), "guide has no --force: {}", ended.stderr);
    }
    for below_a_file in ["file", "file/session"] {
        says(&boresight(place.path(), &guide("pictures", below_a_file)), 1, &[below_a_file]);
    }
    assert_eq!(contents(place.path()), before, "nothing is touched");
    // What a crash between the first two writes leaves behind is no obstacle.
    fs::create_dir_all(place.path().join("begun/frames")).expect("made");
    fs::write(place.path().join("begun/.boresight-x1"), b"schem").expect("written");
    let ended = boresight(place.path(), &guide("pictures", "begun"));
    assert!(ended.stderr.contains("Result: "), "{}", ended.stderr);
}

/// A JPEG with a thumbnail in its EXIF segment, as cameras write it.
fn with_thumbnail(image: &GrayImage) -> Vec<u8> {
    let encoded = |image: &GrayImage| {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(image).expect("encoded");
        bytes
    };
    let thumbnail = encoded(&image::imageops::thumbnail(image, 64, 48));
    let whole = encoded(image);
    let mut bytes = whole[..2].to_vec();
    bytes.extend([0xFF, 0xE1]);
    bytes.extend((thumbnail.len() as u16 + 8).to_be_bytes());
    bytes.extend(b"Exif\0\0");
    bytes.extend(thumbnail);
    bytes.extend(&whole[2..]);
    bytes
}

#[test]
fn a_cut_photograph_is_not_saved_by_its_thumbnail() {
    let place = place();
    let bytes = with_thumbnail(&picture(40.0, 90.0));
    let detect = |name: &str, bytes: &[u8]| {
        fs::write(place.path().join(name), bytes).expect("written");
        boresight(place.path(), &["detect", "--board", "9x6", name])
    };
    let whole = detect("whole.jpg", &bytes);
    says(&whole, 0, &[]);
    assert!(whole.stdout.lines().count() > 54, "{}", whole.stdout);
    // Cameras append data of their own.
    says(&detect("more.jpg", &[&bytes[..], &[0; 100]].concat()), 0, &[]);
    for share in [30, 60, 90, 99] {
        let name = format!("cut{share}.jpg");
        says(&detect(&name, &bytes[..bytes.len() * share / 100]), 1, &[&name, "cut short"]);
    }
}

#[test]
fn a_reader_that_has_gone_changes_no_exit_code() {
    let place = place();
    pair_pictures(place.path(), "pictures", 1);
    for (arguments, code) in [
        (&["calibrate", "--board", "9x6", "pictures/0.png", "--json"][..], 3),
        (&["detect", "--board", "9x6", "pictures/0.png", "pictures/0.png"], 0),
        (&["detect", "--board", "9x6", "missing.png", "pictures/0.png"], 1),
    ] {
        let (reader, writer) = std::io::pipe().expect("pipe");
        drop(reader);
        let output = program(place.path(), arguments)
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .expect("started");
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("panicked") && !stderr.contains("pipe"), "{stderr}");
    }
    let full = fs::OpenOptions::new().write(true).open("/dev/full");
    let Ok(full) = full else { return println!("SKIPPED: there is no /dev/full") };
    let output = program(place.path(), &["detect", "--board", "9x6", "pictures/0.png"])
        .stdout(full)
        .output()
        .expect("started");
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("stdout"), "{stderr}");
}
