//! Whatever kills the program or fills the disk: announced views are on disk, once, and the session
//! can be resumed.

use std::{
    collections::BTreeSet,
    fs,
    io::{BufRead, BufReader, Write},
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use boresight::{
    recording::{Replayed, SessionFolder, replay, stored_frame},
    session::Session,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

/// A small camera and a quick hand, for a session of a second.
const SCENE: &str = r#"
name = "quick"
image_size_px = [320, 240]
fps = 15
clutter = 0.0
noise_levels = 2.0
[technician]
person = "tripod"
reaction_secs = 0.05
max_speed_mm_per_s = 3000.0
max_turn_deg_per_s = 900.0
"#;

fn guide(place: &Path, more: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_boresight"));
    command
        .current_dir(place)
        .args(["guide", "--headless"])
        .args(more)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

pub(crate) fn fresh(place: &Path, session: &str) -> Command {
    let scene = ["--source", "sim:scene.toml", "--max-frames", "1000"];
    let settings = ["--set", "guidance.hold_secs=0.1", "--set", "guidance.plan=quick"];
    let mut command = guide(place, &["--out", session]);
    command.args(scene).args(settings);
    command
}

pub(crate) fn place() -> TempDir {
    let place = TempDir::new().expect("folder");
    fs::write(place.path().join("scene.toml"), SCENE).expect("written");
    place
}

/// Contents of a session folder.
struct Held {
    views: usize,
    /// Frames accepted, in order.
    frames: Vec<u64>,
}

/// Opens a session as a newcomer would, and checks integrity. `None` without a session yet.
fn held(path: &Path) -> Option<Held> {
    if !path.join("session.toml").exists() {
        return None;
    }
    let header = SessionFolder::header(path).expect("a header is whole or absent");
    let contents = SessionFolder::journal(path).expect("at most the last line is cut");
    let mut stored = BTreeSet::new();
    for picture in &contents.stored {
        assert!(stored.insert(picture.frame), "frame {} is there twice", picture.frame);
        stored_frame(path, picture).expect("a stored picture is whole");
    }
    let setup = header.config.session(header.image_size()).expect("board");
    let mut session = Session::new(setup);
    let replayed = replay(&mut session, &contents.lines, |_, _| ()).expect("readable");
    assert_eq!(replayed, Replayed::default());
    let frames: Vec<u64> =
        session.accepted().iter().map(|accepted| accepted.view.frame_id.0).collect();
    assert!(frames.iter().all(|frame| stored.contains(frame)), "every view has its picture");
    Some(Held { views: frames.len(), frames })
}

/// Lines of a finished or killed run's stderr.
pub(crate) fn lines(child: &mut std::process::Child) -> Vec<String> {
    let stderr = child.stderr.take().expect("piped");
    BufReader::new(stderr).lines().map_while(Result::ok).collect()
}

fn taken(lines: &[String]) -> usize {
    lines.iter().filter(|line| line.starts_with("Taken: view")).count()
}

/// Bytes in the journal, the pictures and the header: grows throughout a session.
fn written(path: &Path) -> u64 {
    let size = |path: PathBuf| fs::metadata(path).map_or(0, |metadata| metadata.len());
    let frames = fs::read_dir(path.join("frames"))
        .map_or(0, |frames| frames.filter_map(Result::ok).map(|frame| size(frame.path())).sum());
    size(path.join("journal.jsonl")) + size(path.join("session.toml")) + frames
}

#[test]
fn a_session_that_is_killed_keeps_every_view_and_goes_on() {
    let kills: u64 =
        std::env::var("BORESIGHT_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(6);
    let place = place();
    let whole = place.path().join("whole");
    let mut child = fresh(place.path(), "whole").spawn().expect("started");
    let told = lines(&mut child);
    child.wait().expect("ended");
    let all = held(&whole).expect("a session");
    assert!(all.views >= 4 && taken(&told) == all.views, "{told:?}");
    let all_bytes = written(&whole);

    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let (mut resumed, mut acknowledged, mut midway) = (0, 0, 0);
    for kill in 0..kills {
        let name = format!("killed{kill}");
        let path = place.path().join(&name);
        // The instant: after this many bytes on disk.
        let at_bytes = rng.random_range(0..all_bytes);
        let mut child = fresh(place.path(), &name).spawn().expect("started");
        while written(&path) < at_bytes && child.try_wait().expect("asked").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        // SIGKILL on Unix.
        child.kill().expect("killed");
        let told = taken(&lines(&mut child));
        child.wait().expect("ended");
        let Some(before) = held(&path) else {
            assert_eq!(told, 0, "views were told of a session that is not there");
            continue;
        };
        assert!(before.views >= told, "told of {told} views, {} are there", before.views);
        assert!(before.views <= told + 1, "at most one view was not yet told of");
        assert_eq!(before.frames, all.frames[..before.views], "the same views as undisturbed");
        acknowledged += told;
        midway += u64::from(before.views < all.views);
        let mut child = guide(place.path(), &["--session", &name, "--max-frames", "1000"])
            .spawn()
            .expect("started");
        let told = lines(&mut child);
        child.wait().expect("ended");
        let after = held(&path).expect("a session");
        let going_on = match before.views {
            1 => "Resuming with 1 view.".to_owned(),
            views => format!("Resuming with {views} views."),
        };
        assert!(told.contains(&going_on), "{told:?}");
        assert_eq!(after.frames[..before.views], before.frames, "nothing lost, nothing doubled");
        assert_eq!(after.views, before.views + taken(&told));
        assert!(after.views >= 4, "the session goes on to its end: {told:?}");
        resumed += 1;
        fs::remove_dir_all(&path).expect("removed");
    }
    println!(
        "{kills} kills, {midway} of them before the last view; {acknowledged} acknowledged views, all there; {resumed} sessions went on"
    );
}

/// A file system of `kib` KiB, gone when dropped.
struct SmallDisk {
    place: TempDir,
}

impl SmallDisk {
    fn mount(kib: u32) -> Option<Self> {
        let place = TempDir::new().expect("folder");
        let size = format!("size={kib}k");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &size, "tmpfs"])
            .arg(place.path())
            .stderr(Stdio::null())
            .status();
        mounted.is_ok_and(|status| status.success()).then_some(Self { place })
    }
}

impl SmallDisk {
    /// Simulates freed space.
    fn enlarge(&self, kib: u32) {
        let size = format!("remount,size={kib}k");
        let status = Command::new("mount").args(["-o", &size]).arg(self.place.path()).status();
        assert!(status.is_ok_and(|status| status.success()));
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Unmounting may fail without harm.
        let _ = Command::new("umount").arg(self.place.path()).status();
    }
}

#[test]
fn a_full_disk_is_said_and_costs_no_view() {
    let place = place();
    let (mut full, mut gone_on) = (0, 0);
    for kib in [4, 16, 64, 128, 192, 256, 384, 512, 4096] {
        let Some(disk) = SmallDisk::mount(kib) else {
            println!("SKIPPED: mounting a small file system needs root");
            return;
        };
        let path = disk.place.path().join("session");
        let name = path.display().to_string();
        let mut child = fresh(place.path(), &name).spawn().expect("started");
        let told = lines(&mut child);
        let status = child.wait().expect("ended");
        let views = held(&path).map_or(0, |held| held.views);
        assert!(views >= taken(&told), "{kib} KiB: told of {}, {views} are there", taken(&told));
        if !told.iter().any(|line| line.starts_with("Result: ")) {
            full += 1;
            assert_eq!(status.code(), Some(1), "{told:?}");
            assert!(told.iter().any(|line| line.contains("The disk is full")), "{told:?}");
            assert!(!told.iter().any(|line| line.contains("panicked")), "{told:?}");
            let before = held(&path);
            disk.enlarge(16 * 1024);
            // After freeing space, the session continues or begins.
            let mut child = match before {
                Some(_) => guide(place.path(), &["--session", &name, "--max-frames", "1000"]),
                None => fresh(place.path(), &name),
            }
            .spawn()
            .expect("started");
            let again = lines(&mut child);
            child.wait().expect("ended");
            assert!(again.iter().any(|line| line.starts_with("Result: ")), "{again:?}");
            let after = held(&path).expect("a session");
            let kept = before.map_or(Vec::new(), |before| before.frames);
            assert_eq!(after.frames[..kept.len()], kept, "nothing lost, nothing doubled");
            assert!(after.views >= 4, "{again:?}");
            gone_on += 1;
        }
        println!("{kib} KiB: {} views told, {views} there, {status}", taken(&told));
        assert!(kib < 4096 || status.code() != Some(1), "this disk is large enough: {told:?}");
    }
    assert!(full >= 4, "the disks were too large to fill: {full}");
    println!("{full} disks were filled; with space freed, {gone_on} sessions went on");
}

#[cfg(unix)]
#[test]
fn a_session_that_is_interrupted_ends_in_order() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let place = place();
        let mut child = fresh(place.path(), "session").spawn().expect("started");
        let mut stderr = BufReader::new(child.stderr.take().expect("piped")).lines();
        let mut told = Vec::new();
        while taken(&told) == 0 {
            told.push(stderr.next().expect("a view is taken").expect("text"));
        }
        let sent = Command::new("kill").arg(signal).arg(child.id().to_string()).status();
        assert!(sent.expect("kill is there").success());
        told.extend(stderr.map_while(Result::ok));
        let status = child.wait().expect("ended");
        assert!(matches!(status.code(), Some(0 | 3)), "{signal}: {status}: {told:?}");
        assert!(told.iter().any(|line| line.starts_with("Result: ")), "{told:?}");
        let held = held(&place.path().join("session")).expect("a session");
        assert_eq!(held.views, taken(&told));
    }
}

/// A command that sends no picture has the camera until somebody ends it.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_before_the_first_picture_ends_the_command_of_a_pipe() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let place = place();
        let camera = "pipe:sh -c 'echo $$ > own; exec sleep 1000'";
        let mut child =
            guide(place.path(), &["--source", camera, "--out", "s"]).spawn().expect("started");
        let own = || fs::read_to_string(place.path().join("own")).unwrap_or_default();
        while !own().ends_with('\n') {
            std::thread::sleep(Duration::from_millis(10));
        }
        let sent = Command::new("kill").arg(signal).arg(child.id().to_string()).status();
        assert!(sent.expect("kill is there").success());
        let status = child.wait().expect("ended");
        assert_eq!(status.code(), Some(1), "{signal}");
        let stat = fs::read_to_string(format!("/proc/{}/stat", own().trim())).unwrap_or_default();
        assert!(stat.is_empty() || stat.contains(") Z "), "{signal}: {stat}");
    }
}

#[cfg(unix)]
#[test]
fn a_second_ctrl_c_ends_what_hangs() {
    let place = place();
    let (output, mut input) = std::io::pipe().expect("a pipe");
    let mut child = fresh(place.path(), "session")
        .stderr(input.try_clone().expect("cloned"))
        .spawn()
        .expect("started");
    let mut told = BufReader::new(output).lines();
    let mut line = String::new();
    while !line.starts_with("Taken: view") {
        line = told.next().expect("a view is taken").expect("text");
    }
    // From here on nobody reads: the program's next write never returns.
    let filler = std::thread::Builder::new()
        .spawn(move || while input.write_all(&[b'.'; 512]).is_ok() {})
        .expect("started");
    let began = Instant::now();
    while child.try_wait().expect("asked").is_none() {
        assert!(began.elapsed().as_secs() < 60, "it doesn't end");
        let _ = Command::new("kill").arg("-INT").arg(child.id().to_string()).status();
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(child.wait().expect("ended").code(), Some(130));
    drop(told);
    filler.join().expect("the pipe is closed");
    assert!(held(&place.path().join("session")).expect("a session").views >= 1);
}
