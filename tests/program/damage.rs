//! Broken, missing or misplaced files as met by a person: they are named, the next action is
//! stated, and nothing is touched.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use boresight::{
    config::Config,
    frame::ImageSize,
    recording::{Header, SessionFolder},
};
use image::{GrayImage, codecs::jpeg::JpegEncoder};
use tempfile::TempDir;

use crate::person::{boresight, contents, program, says};
use crate::pictures::{PAIRS, picture};

fn place() -> TempDir {
    TempDir::new().expect("folder")
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

/// An empty session of VGA pictures, open while the value lives.
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
    fs::write(place.path().join("orphan/journal.jsonl"), b"{}").expect("written");
    fs::write(place.path().join("file"), b"mine").expect("written");
    drop(empty_session(&place.path().join("session")));
    let before = contents(place.path());
    for (taken, next_step) in [
        ("holiday", "Choose a new folder"),
        ("orphan", "Choose a new folder"),
        ("session", "--session"),
        ("pictures", "Choose a new folder"),
    ] {
        let ended = boresight(place.path(), &guide("pictures", taken));
        says(&ended, 1, &["already", taken, next_step]);
        assert!(!ended.stderr.contains("--force"), "guide has no --force: {}", ended.stderr);
    }
    for below_a_file in ["file", "file/session"] {
        says(&boresight(place.path(), &guide("pictures", below_a_file)), 1, &[below_a_file]);
    }
    assert_eq!(contents(place.path()), before, "nothing is touched");
    // Leftovers of a crash between the first two writes are no obstacle.
    fs::create_dir_all(place.path().join("begun/frames")).expect("made");
    fs::write(place.path().join("begun/journal.jsonl"), b"").expect("written");
    fs::write(place.path().join("begun/.boresight-x1"), b"schem").expect("written");
    let ended = boresight(place.path(), &guide("pictures", "begun"));
    assert!(ended.stderr.contains("Result: "), "{}", ended.stderr);
}

/// A read-only folder, even for root.
struct ReadOnly {
    place: TempDir,
    mounted: bool,
}

impl ReadOnly {
    fn new() -> Self {
        let place = place();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", "ro,size=64k", "tmpfs"])
            .arg(place.path())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|status| status.success());
        if !mounted {
            let mut mode = fs::metadata(place.path()).expect("there").permissions();
            mode.set_readonly(true);
            fs::set_permissions(place.path(), mode).expect("changed");
        }
        Self { place, mounted }
    }
}

impl Drop for ReadOnly {
    fn drop(&mut self) {
        // Unmounting may fail without harm.
        if self.mounted {
            let _ = Command::new("umount").arg(self.place.path()).status();
        }
    }
}

#[test]
fn a_read_only_folder_is_named() {
    let read_only = ReadOnly::new();
    if fs::write(read_only.place.path().join("probe"), b"").is_ok() {
        println!("SKIPPED: no folder can be made read-only here");
        return;
    }
    let place = place();
    pair_pictures(place.path(), "pictures", 2);
    let at = |name: &str| read_only.place.path().join(name).display().to_string();
    let session = at("session");
    let ended = boresight(place.path(), &guide("pictures", &session));
    says(&ended, 1, &[&session, "is writable"]);
    let result = at("result.json");
    let files = ["calibrate", "--board", "9x6", "pictures/0.png", "pictures/1.png"];
    let ended = boresight(place.path(), &[&files[..], &["--out", &result]].concat());
    says(&ended, 1, &[&result, "is writable"]);
    drop(empty_session(&place.path().join("good")));
    let saved = at("saved");
    let ended = boresight(place.path(), &["doctor", "good", "--recover", &saved]);
    says(&ended, 1, &[&saved, "is writable"]);
}

#[test]
fn a_session_open_elsewhere_or_of_a_newer_version_is_refused() {
    let place = place();
    pair_pictures(place.path(), "pictures", 2);
    let path = place.path().join("session");
    let held = empty_session(&path);
    let before = contents(&path);
    let go_on = ["guide", "--headless", "--source", "pictures", "--session", "session"];
    says(&boresight(place.path(), &go_on), 1, &["another boresight", "session", "Close"]);
    assert_eq!(contents(&path), before, "nothing is touched");
    drop(held);

    let header = fs::read_to_string(path.join("session.toml")).expect("readable");
    fs::write(path.join("session.toml"), header.replace("session/1", "session/2"))
        .expect("written");
    let before = contents(&path);
    for command in [&go_on[..], &["doctor", "session"], &["replay", "session"]] {
        let ended = boresight(place.path(), command);
        says(&ended, 1, &["boresight.session/2", "session.toml", "newer"]);
    }
    assert_eq!(contents(&path), before, "nothing is touched");
    fs::write(path.join("session.toml"), header).expect("written");
    let settings = [&go_on[..], &["--set", "guidance.hold_secs=0.7"]].concat();
    says(&boresight(place.path(), &settings), 2, &["--set", "--session"]);
}

#[test]
fn doctor_names_the_damage_and_the_next_step() {
    let place = place();
    pair_pictures(place.path(), "pictures", 4);
    let ended = boresight(place.path(), &guide("pictures", "session"));
    assert!(ended.stderr.contains("Taken: view"), "{}", ended.stderr);
    let journal = place.path().join("session/journal.jsonl");
    let whole = fs::read(&journal).expect("readable");
    let third = whole.iter().enumerate().filter(|(_, b)| **b == b'\n').nth(1).expect("lines").0 + 1;
    let mut damaged = whole.clone();
    damaged[third + 40] ^= 0x02;
    fs::write(&journal, damaged).expect("written");
    let before = contents(place.path());
    let ended = boresight(place.path(), &["doctor", "session"]);
    says(&ended, 1, &["line 3", "journal.jsonl", "--recover"]);
    for command in [&["replay", "session"][..], &["guide", "--headless", "--session", "session"]] {
        says(
            &boresight(place.path(), command),
            1,
            &["line 3", "boresight doctor session --recover"],
        );
    }
    assert_eq!(contents(place.path()), before, "nothing is touched");
    fs::create_dir(place.path().join("taken")).expect("made");
    let onto = boresight(place.path(), &["doctor", "session", "--recover", "taken"]);
    says(&onto, 1, &["taken", "new folder"]);
    says(
        &boresight(place.path(), &["doctor", "session", "--recover", "saved"]),
        0,
        &["Recovered 2"],
    );
    says(
        &boresight(place.path(), &["doctor", "saved"]),
        0,
        &["2 journal lines", "No damage found"],
    );

    // Without its journal, a folder is no whole session.
    fs::remove_file(&journal).expect("removed");
    says(&boresight(place.path(), &["doctor", "session"]), 1, &["journal.jsonl"]);
}

#[test]
fn a_broken_picture_ends_no_session() {
    let place = place();
    pair_pictures(place.path(), "pictures", 6);
    let third = place.path().join("pictures/2.png");
    let whole = fs::read(&third).expect("readable");
    fs::write(&third, &whole[..whole.len() / 2]).expect("written");
    let ended = boresight(place.path(), &guide("pictures", "session"));
    says(&ended, ended.code, &["PIC-BAD", "2.png"]);
    let taken = ended.stderr.matches("Taken: view").count();
    assert!(taken > 2 && ended.code != 1, "{}", ended.stderr);
    // Nor on resuming the session; the file is repaired by then.
    fs::write(&third, whole).expect("written");
    let ended = boresight(place.path(), &["guide", "--headless", "--session", "session"]);
    says(&ended, ended.code, &[&format!("Resuming with {taken} views")]);
    assert!(ended.code != 1 && !ended.stderr.contains("PIC-BAD"), "{}", ended.stderr);
}

#[test]
fn pictures_of_another_size_are_told_and_left_out() {
    let place = place();
    pair_pictures(place.path(), "pictures", 2);
    let small = image::imageops::thumbnail(&picture(40.0, 90.0), 320, 240);
    small.save(place.path().join("pictures/0b.png")).expect("saved");
    let ended = boresight(place.path(), &guide("pictures", "session"));
    says(&ended, 3, &["320", "640"]);
    assert_eq!(ended.stderr.matches("Taken: view").count(), 2, "{}", ended.stderr);
}

/// A JPEG with a thumbnail in the EXIF segment, as from cameras.
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
    for arguments in [
        &["detect", "--board", "9x6", "pictures/0.png"][..],
        &["--help"],
        &["batch", "run", "--help"],
    ] {
        let full = full.try_clone().expect("open");
        let output = program(place.path(), arguments).stdout(full).output().expect("started");
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stderr.contains("stdout"), "{arguments:?}: {stderr}");
    }
}

#[test]
fn words_that_cannot_be_parsed_are_usage_errors() {
    let place = place();
    for (arguments, word) in [
        (["--board", "0x"], "columns x rows"),
        (["--square", "wide"], "25mm"),
        (["--set", "guidance.hold_secs"], "KEY=VALUE"),
        (["--set", "=3"], "KEY=VALUE"),
        (["--set", "guidance..hold_secs=3"], "KEY=VALUE"),
    ] {
        let ended = boresight(place.path(), &[&guide("sim", "out")[..], &arguments].concat());
        says(&ended, 2, &[word, "--help"]);
    }
    assert_eq!(contents(place.path()), []);
}

#[test]
fn a_value_of_the_wrong_kind_is_named_by_its_key() {
    let place = place();
    for (name, text, option, code, words) in [
        ("scene.toml", "[technician]\nsway_mm = \"much\"", None, 1, "technician.sway_mm"),
        ("scene.toml", "f_px = ", None, 1, "line 1"),
        (
            "settings.toml",
            "[guidance]\nhold_secs = \"long\"",
            Some("--config"),
            2,
            "guidance.hold_secs",
        ),
    ] {
        fs::write(place.path().join(name), text).expect("written");
        let arguments = ["simulate", "--out", "out"].into_iter().chain(option).chain([name]);
        let ended = boresight(place.path(), &arguments.collect::<Vec<_>>());
        says(&ended, code, &[words, name]);
        fs::remove_file(place.path().join(name)).expect("removed");
    }
    assert_eq!(contents(place.path()), []);
}
