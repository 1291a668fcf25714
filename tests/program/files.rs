//! Files leading elsewhere, endless, special, or changed: nothing outside a session is touched,
//! nothing hangs, and `doctor` tells the truth.

use std::{
    fs,
    os::unix::fs::{MetadataExt, PermissionsExt, symlink},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::OnceLock,
    time::{Duration, Instant},
};

use tempfile::TempDir;

use crate::crash::{fresh, lines, place};
use crate::person::{Ended, boresight, contents, program, says};

/// A finished session of the simulated camera, made once.
fn good() -> &'static Path {
    static GOOD: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let (_, path) = GOOD.get_or_init(|| {
        let place = place();
        let mut child = fresh(place.path(), "session").spawn().expect("started");
        let told = lines(&mut child);
        child.wait().expect("ended");
        assert!(told.iter().any(|line| line.starts_with("Result: ")), "{told:?}");
        let path = place.path().join("session");
        (place, path)
    });
    path
}

/// A place with a copy of the session, and scene.
fn copy() -> TempDir {
    let place = place();
    let copied = Command::new("cp").arg("-r").arg(good()).arg(place.path()).status();
    assert!(copied.expect("cp is there").success());
    place
}

/// Result of a program, killed unless ended within seconds.
fn ends_soon(place: &Path, arguments: &[&str]) -> Ended {
    let mut child = program(place, arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    let began = Instant::now();
    while child.try_wait().expect("asked").is_none() {
        if began.elapsed() > Duration::from_secs(60) {
            child.kill().expect("killed");
            panic!("{arguments:?} doesn't end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().expect("ended");
    Ended {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo is there").success());
}

#[test]
fn force_replaces_nothing_but_files() {
    let place = copy();
    let at = |name: &str| place.path().join(name);
    fifo(&at("fifo"));
    fs::write(at("target"), "mine").expect("written");
    symlink("target", at("link")).expect("linked");
    symlink("nowhere", at("dangling")).expect("linked");
    fs::create_dir(at("folder")).expect("made");
    let kind = |name: &str| fs::symlink_metadata(at(name)).expect("there").file_type();
    for (name, what) in
        [("fifo", "a FIFO"), ("link", "a link"), ("dangling", "a link"), ("folder", "a folder")]
    {
        let before = kind(name);
        let ended = ends_soon(place.path(), &["export", "session", "--force", "--out", name]);
        says(&ended, 1, &[name, what, "Name a plain file"]);
        assert_eq!(kind(name), before, "{name}");
    }
    assert_eq!(fs::read_to_string(at("target")).expect("there"), "mine");
    // As root, a device could be replaced.
    if Command::new("mknod")
        .arg(at("full"))
        .args(["c", "1", "7"])
        .status()
        .is_ok_and(|s| s.success())
    {
        let ended = ends_soon(place.path(), &["export", "session", "--force", "--out", "full"]);
        says(&ended, 1, &["full", "a device"]);
    }
    // A file is replaced, and keeps its mode.
    fs::write(at("old.yaml"), "old").expect("written");
    fs::set_permissions(at("old.yaml"), fs::Permissions::from_mode(0o640)).expect("set");
    let ended = boresight(place.path(), &["export", "session", "--force", "--out", "old.yaml"]);
    says(&ended, 0, &["Written"]);
    assert_eq!(fs::metadata(at("old.yaml")).expect("there").mode() & 0o777, 0o640);
}

#[test]
fn a_session_leads_nowhere_else() {
    let place = copy();
    let session = place.path().join("session");
    let victim = place.path().join("victim");
    fs::write(&victim, "precious, no newline").expect("written");
    let go_on = ["guide", "--headless", "--session", "session", "--max-frames", "3"];
    let unharmed = || {
        assert_eq!(fs::read_to_string(&victim).expect("there"), "precious, no newline");
    };
    for file in ["journal.jsonl", "session.toml"] {
        let original = fs::read(session.join(file)).expect("there");
        fs::remove_file(session.join(file)).expect("removed");
        symlink("../victim", session.join(file)).expect("linked");
        for command in [&go_on[..], &["doctor", "session"], &["replay", "session"]] {
            says(&ends_soon(place.path(), command), 1, &[file, "a link"]);
        }
        unharmed();
        fs::remove_file(session.join(file)).expect("removed");
        // Nor does anything wait for an absent writer.
        fifo(&session.join(file));
        says(&ends_soon(place.path(), &["doctor", "session"]), 1, &[file, "a FIFO"]);
        says(&ends_soon(place.path(), &go_on), 1, &[file, "a FIFO"]);
        fs::remove_file(session.join(file)).expect("removed");
        fs::write(session.join(file), original).expect("written");
    }
    // A picture as a link, and a folder of pictures as a link.
    let picture = fs::read_dir(session.join("frames")).expect("there").next().expect("one");
    let picture = picture.expect("readable").path();
    fs::rename(&picture, place.path().join("moved.png")).expect("moved");
    symlink("../../moved.png", &picture).expect("linked");
    says(&boresight(place.path(), &["doctor", "session"]), 1, &["png", "a link"]);
    fs::remove_file(&picture).expect("removed");
    fs::rename(session.join("frames"), place.path().join("frames")).expect("moved");
    symlink("../frames", session.join("frames")).expect("linked");
    says(&ends_soon(place.path(), &go_on), 1, &["frames"]);
    says(&boresight(place.path(), &["doctor", "session"]), 1, &["frames"]);
    unharmed();
}

#[test]
fn a_refused_session_is_not_changed() {
    let place = copy();
    let session = place.path().join("session");
    let journal = session.join("journal.jsonl");
    let mut bytes = fs::read(&journal).expect("there");
    bytes.extend(b"{\"seq\":9999,\"crc");
    fs::write(&journal, &bytes).expect("written");
    let before = contents(&session);
    let other = "image_size_px = [640, 480]\n";
    fs::write(place.path().join("other.toml"), other).expect("written");
    let go_on = [
        "guide",
        "--headless",
        "--session",
        "session",
        "--source",
        "sim:other.toml",
        "--max-frames",
        "3",
    ];
    says(&boresight(place.path(), &go_on), 1, &["320", "640", "one size"]);
    assert_eq!(contents(&session), before, "nothing is cut before it goes on");
}

#[test]
fn doctor_is_not_fooled() {
    let doctor = |place: &TempDir| boresight(place.path(), &["doctor", "session"]);
    let place = copy();
    says(&doctor(&place), 0, &["No damage found"]);
    let at = |name: &str| place.path().join("session").join(name);
    let journal = fs::read(at("journal.jsonl")).expect("there");
    let go_on = ["guide", "--headless", "--session", "session", "--max-frames", "3"];

    // Emptied, or cut where a line ends.
    let line_ends: Vec<usize> =
        journal.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(at, _)| at + 1).collect();
    for kept in [0, line_ends[3]] {
        fs::write(at("journal.jsonl"), &journal[..kept]).expect("written");
        let ended = doctor(&place);
        says(&ended, 1, &["missing", "journal.jsonl"]);
        assert!(!ended.stderr.contains("No damage found"), "{}", ended.stderr);
        says(
            &ends_soon(place.path(), &go_on),
            1,
            &["missing", "boresight doctor session --recover"],
        );
    }
    // The result alone reveals it, too.
    fs::remove_dir_all(at("frames")).expect("removed");
    fs::create_dir(at("frames")).expect("made");
    says(&doctor(&place), 1, &["calibration.json has"]);

    // The header of another session.
    let place = copy();
    let at = |name: &str| place.path().join("session").join(name);
    let header = fs::read_to_string(at("session.toml")).expect("there");
    let other = header.replace("image_size_px = [320, 240]", "image_size_px = [321, 240]");
    assert_ne!(other, header);
    fs::write(at("session.toml"), &other).expect("written");
    let before = contents(place.path());
    says(&doctor(&place), 1, &["another session.toml"]);
    for command in [&go_on[..], &["report", "session"], &["replay", "session"]] {
        says(
            &ends_soon(place.path(), command),
            1,
            &["another session.toml", "Restore the session.toml"],
        );
    }
    let recover = ["doctor", "session", "--recover", "new"];
    says(&boresight(place.path(), &recover), 1, &["another session.toml"]);
    assert_eq!(contents(place.path()), before, "nothing is touched");
    // A recording from before checksums: every decision differs.
    let journal = fs::read_to_string(at("journal.jsonl")).expect("there");
    fs::write(at("journal.jsonl"), without_checksum(&journal)).expect("written");
    says(&doctor(&place), 1, &["doesn't belong"]);
    fs::write(at("session.toml"), &header).expect("written");
    says(&doctor(&place), 0, &["No damage found"]);
}

/// A journal from before the checksum of `session.toml` in the first line.
pub(crate) fn without_checksum(journal: &str) -> String {
    const NAMED: &str = ",\"session\":\"";
    let (first, rest) = journal.split_once('\n').expect("a line");
    let (_, body) = first.split_once("\"body\":").expect("a body");
    let body = body.strip_suffix('}').expect("an object");
    let at = body.rfind(NAMED).expect("a checksum");
    // Eight digits and the quotation mark.
    let body = format!("{}{}", &body[..at], &body[at + NAMED.len() + 9..]);
    let crc32 = crc32fast::hash(body.as_bytes());
    format!("{{\"seq\":0,\"crc32\":\"{crc32:08x}\",\"body\":{body}}}\n{rest}")
}

#[test]
fn what_is_recovered_is_whole() {
    let place = copy();
    let frames = place.path().join("session/frames");
    let mut pictures: Vec<PathBuf> = fs::read_dir(&frames)
        .expect("there")
        .map(|entry| entry.expect("readable").path())
        .collect();
    pictures.sort();
    // One is damaged, one leads elsewhere, one is gone.
    let mut bytes = fs::read(&pictures[0]).expect("there");
    bytes.push(b'x');
    fs::write(&pictures[0], bytes).expect("written");
    fs::write(place.path().join("secret"), "secret").expect("written");
    fs::remove_file(&pictures[1]).expect("removed");
    symlink("../../secret", &pictures[1]).expect("linked");
    fs::remove_file(&pictures[2]).expect("removed");
    says(&boresight(place.path(), &["doctor", "session"]), 1, &["3 problems"]);
    let recovered = boresight(place.path(), &["doctor", "session", "--recover", "new"]);
    says(&recovered, 0, &["Recovered", "3 pictures are damaged or missing"]);
    says(&boresight(place.path(), &["doctor", "new"]), 0, &["No damage found"]);
    let copied = contents(&place.path().join("new"));
    assert!(!format!("{copied:?}").contains("secret"));
    let views = |name: &str| {
        let ended = boresight(place.path(), &["doctor", name, "--json"]);
        let found: serde_json::Value = serde_json::from_str(&ended.stdout).expect("JSON");
        found["views"].as_u64()
    };
    assert_eq!(views("new"), views("session"), "the views don't need their pictures");
    let left: Vec<_> = fs::read_dir(place.path())
        .expect("there")
        .filter(|entry| {
            entry.as_ref().is_ok_and(|e| e.file_name().to_string_lossy().starts_with(".boresight"))
        })
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn files_without_an_end_are_refused() {
    let place = copy();
    fifo(&place.path().join("pipe"));
    let fifo_vnl = place.path().join("pipe.vnl");
    fifo(&fifo_vnl);
    symlink("/dev/zero", place.path().join("zero")).expect("linked");
    symlink("/dev/zero", place.path().join("zero.vnl")).expect("linked");
    for (arguments, what) in [
        (&["export", "/dev/zero"][..], "a device"),
        (&["export", "zero"], "a device"),
        (&["export", "pipe"], "a FIFO"),
        (&["report", "pipe"], "a FIFO"),
        (&["check", "--against", "pipe", "--source", "sim"], "a FIFO"),
        (&["calibrate", "zero.vnl", "--image-size", "320x240"], "a device"),
        (&["calibrate", "pipe.vnl", "--image-size", "320x240"], "a FIFO"),
        (&["guide", "--headless", "--config", "pipe", "--source", "sim"], "a FIFO"),
        (&["guide", "--headless", "--source", "sim:/dev/zero"], "a device"),
        (&["detect", "pipe"], "file"),
    ] {
        let ended = ends_soon(place.path(), arguments);
        assert_ne!(ended.code, 0, "{arguments:?}");
        assert!(ended.stderr.contains(what), "{arguments:?}: {}", ended.stderr);
    }
    // A file larger than any of its kind takes no memory.
    let huge = fs::File::create(place.path().join("huge.json")).expect("made");
    huge.set_len(1 << 40).expect("sparse");
    says(&ends_soon(place.path(), &["export", "huge.json"]), 1, &["huge.json", "larger than"]);
}
