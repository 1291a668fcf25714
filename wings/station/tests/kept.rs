//! The store of a watched camera after crashes, damage and a second program; and clocks that are
//! wrong. One camera over a simulated street is learned, and copied for each test.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{OnceLock, atomic::AtomicBool},
    time::Duration,
};

use boresight_app::Announcer;
use boresight_geometry::frame::ImageSize;
use boresight_station::{
    Access, Feed, Places, Recovered, Round, StateLine, Store, Taken, WatchedCamera, accept, exit,
    recover, street::Street, times,
};
use boresight_watch::{HOUR_SECS, Lens, NoAnswer, State};
use serde_json::Value;
use tempfile::TempDir;

/// The hours of learning, and one more.
const LEARNED_HOURS: u32 = 75;

fn street() -> Street {
    let mut street = Street::new(3);
    street.image_size = ImageSize { width_px: 320, height_px: 240 };
    street.camera = boresight_geometry::Camera::pinhole(210.0, nalgebra::Point2::new(163.0, 118.0));
    street
}

fn begin(folder: &Path, street: &Street) -> WatchedCamera {
    let lens = Lens::new(street.camera, None, street.image_size);
    WatchedCamera::open(folder, "mast", None, (Some(lens), false)).expect("opened").0
}

fn look(camera: &mut WatchedCamera, street: &Street, hours: std::ops::Range<u32>) {
    for hour in hours {
        let at_secs = street.began_secs + HOUR_SECS * f64::from(hour);
        camera.look(vec![street.picture(at_secs)], Taken::at(at_secs)).expect("recorded");
    }
}

/// Copies a learned store, and one in the middle of learning.
fn store(hours: u32) -> TempDir {
    static LEARNED: OnceLock<[TempDir; 2]> = OnceLock::new();
    let [young, learned] = LEARNED.get_or_init(|| {
        let places = [TempDir::new().expect("a folder"), TempDir::new().expect("a folder")];
        let street = street();
        let mut camera = begin(places[1].path(), &street);
        look(&mut camera, &street, 0..14);
        copy(places[1].path(), places[0].path());
        look(&mut camera, &street, 14..LEARNED_HOURS);
        assert_eq!(camera.watch().decision().state, State::Ok);
        assert!(camera.station().is_learned);
        places
    });
    let place = TempDir::new().expect("a folder");
    copy(if hours < LEARNED_HOURS { young.path() } else { learned.path() }, place.path());
    place
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let there = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copy(&path, &there);
        } else {
            fs::copy(&path, &there).expect("copied");
        }
    }
}

fn lines(store: &Path) -> PathBuf {
    store.join("watch.jsonl")
}

fn references(store: &Path) -> usize {
    WatchedCamera::look_at(store).expect("whole").station().gallery.references.len()
}

/// Error of opening a store.
fn refused(store: &Path) -> String {
    let watched = Store::open(store, Access::Watch).map(drop).expect_err("refused");
    let looked = Store::open(store, Access::Look).map(drop).expect_err("refused");
    assert_eq!(format!("{watched:#}"), format!("{looked:#}"));
    format!("{watched:#}")
}

#[test]
fn damage_is_told_with_its_line_and_what_is_whole_is_kept() {
    let place = store(LEARNED_HOURS);
    let here = place.path();
    let (text, before) = (fs::read_to_string(lines(here)).expect("there"), references(here));
    assert!(before > 10, "{before}");
    let count = text.lines().count();
    // A digit of a picture in the middle.
    let mut all: Vec<String> = text.lines().map(str::to_owned).collect();
    assert!(all[30].contains("\"kind\":\"picture\""));
    let at = all[30].find("\"turn\":[").expect("a turn") + 9;
    let other = if all[30].as_bytes()[at] == b'1' { "2" } else { "1" };
    all[30].replace_range(at..=at, other);
    fs::write(lines(here), all.join("\n") + "\n").expect("written");
    let said = refused(here);
    for words in ["line 31 of", "checksum", "boresight watch --recover --store"] {
        assert!(said.contains(words), "{said}");
    }
    let found = recover(here, 1.78e9).expect("recovered");
    assert_eq!(found, Recovered { lines: [count - 1, 1], is_relearned: false });
    assert_eq!(references(here), before);
    let camera = WatchedCamera::look_at(here).expect("whole");
    assert_eq!(camera.watch().decision().state, State::Ok);
    assert_eq!(
        fs::read_to_string(here.join("watch.damaged.jsonl")).expect("kept"),
        all.join("\n") + "\n"
    );
    // A lost line is noticed, too.
    let kept: Vec<&str> = text.lines().enumerate().filter(|(n, _)| *n != 30).map(|l| l.1).collect();
    fs::write(lines(here), kept.join("\n") + "\n").expect("written");
    assert!(refused(here).contains("line 31 of"), "{}", refused(here));
}

#[test]
fn an_emptied_store_isnt_whole() {
    for text in ["", "\n"] {
        let place = store(LEARNED_HOURS);
        let here = place.path();
        fs::write(lines(here), text).expect("written");
        assert!(refused(here).contains("--recover"), "{}", refused(here));
        let found = recover(here, 1.78e9).expect("recovered");
        assert!(found.is_relearned, "{found:?}");
        let camera = WatchedCamera::look_at(here).expect("whole");
        assert!(matches!(camera.watch().decision().state, State::Learning { .. }));
    }
}

#[test]
fn a_lost_reference_is_told() {
    let place = store(LEARNED_HOURS);
    let here = place.path();
    let before = references(here);
    let first = fs::read_dir(here.join("references")).expect("a folder").next().expect("one");
    let first = first.expect("an entry").path();
    let mut bytes = fs::read(&first).expect("read");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&first, bytes).expect("written");
    assert!(refused(here).contains("--recover"), "{}", refused(here));
    assert!(!recover(here, 1.78e9).expect("recovered").is_relearned);
    assert_eq!(references(here), before - 1);
}

#[test]
fn a_line_of_a_newer_version_is_no_damage() {
    let place = store(14);
    let here = place.path();
    let text = fs::read_to_string(lines(here)).expect("there");
    fs::write(lines(here), text + "{\"kind\":\"later\",\"at\":1.0}\n").expect("written");
    let said = refused(here);
    assert!(said.contains("newer boresight") && !said.contains("damaged"), "{said}");
    let err = recover(here, 1.78e9).expect_err("refused");
    assert!(format!("{err:#}").contains("newer boresight"), "{err:#}");
}

#[test]
fn numbers_that_no_picture_gives_are_damage() {
    for (turn, cov) in [("1e300", "1"), ("0", "0"), ("0", "-1")] {
        let place = store(14);
        let here = place.path();
        let line = format!(
            "{{\"kind\":\"picture\",\"at\":1.78e9,\"turn\":[{turn},0,0,0],\
             \"cov\":[{cov},0,0,0,1,0,0,1,0,1],\"patches\":[90,80]}}\n"
        );
        fs::write(lines(here), line).expect("written");
        assert!(refused(here).contains("line 1 of"), "{}", refused(here));
    }
}

#[test]
fn one_program_watches_and_others_may_look() {
    let place = store(14);
    let here = place.path();
    let street = street();
    let mut camera = begin(here, &street);
    let lens = Lens::new(street.camera, None, street.image_size);
    let second = WatchedCamera::open(here, "mast", None, (Some(lens), false));
    let said = format!("{:#}", second.map(drop).expect_err("refused"));
    assert!(said.contains("another boresight is watching"), "{said}");
    assert!(references(here) > 0);
    let mut other = WatchedCamera::look_at(here).expect("looked at");
    other.no_picture(NoAnswer::NoPicture, Taken::at(1.78e9)).expect_err("it's only read");
    look(&mut camera, &street, 14..15);
    drop(camera);
    begin(here, &street);
}

/// A store as an earlier version wrote it, without numbers and checksums.
#[test]
fn a_store_of_an_earlier_version_goes_on() {
    let place = store(14);
    let here = place.path();
    let before = references(here);
    let text = fs::read_to_string(lines(here)).expect("there");
    let older = text.lines().map(|line| {
        let mut line: Value = serde_json::from_str(line).expect("JSON");
        let fields = line.as_object_mut().expect("an object");
        fields.retain(|name, _| !["seq", "sum", "in_use"].contains(&name.as_str()));
        line.to_string() + "\n"
    });
    let older: String = older.collect();
    fs::write(lines(here), &older).expect("written");
    assert_eq!(references(here), before);
    let street = street();
    look(&mut begin(here, &street), &street, 14..26);
    assert!(references(here) >= before);
    // It had been put out of step by a crash: now it's told.
    fs::write(lines(here), &older).expect("written");
    let file = here.join("watch.json");
    let text = fs::read_to_string(&file).expect("there");
    let learned = older.matches("\"kind\":\"learned\"").count();
    let mut stored: Value = serde_json::from_str(&text).expect("JSON");
    stored["learned"] = (learned - 1).into();
    fs::write(&file, stored.to_string()).expect("written");
    assert!(refused(here).contains("about learning"), "{}", refused(here));
}

#[test]
fn a_crash_between_any_two_files_loses_no_reference() {
    let place = store(14);
    let here = place.path();
    let street = street();
    let old = |name: &str| fs::read(here.join(name)).expect("there");
    let (old_file, old_lines) = (old("watch.json"), old("watch.jsonl"));
    let saved = TempDir::new().expect("a folder");
    copy(here, saved.path());
    let before = references(here);
    look(&mut begin(here, &street), &street, 14..26);
    let after = references(here);
    assert!(after != before, "learned again: {after}");
    // The line is there, and watch.json didn't follow yet.
    fs::write(here.join("watch.json"), &old_file).expect("written");
    assert_eq!(references(here), after);
    drop(begin(here, &street));
    assert_ne!(old("watch.json"), old_file);
    assert_eq!(references(here), after);
    // The references are there, and no line names them yet.
    copy(&here.join("references"), &saved.path().join("references"));
    assert_eq!(fs::read(lines(saved.path())).expect("there"), old_lines);
    assert_eq!(references(saved.path()), before);
    look(&mut begin(saved.path(), &street), &street, 14..26);
    assert_eq!(references(saved.path()), after);
}

/// Watches 14 hours, or the rest of them, and notes the references after each look.
fn watch_on(folder: &Path, street: &Street, told: &mut Vec<usize>) -> Result<(), String> {
    let lens = Lens::new(street.camera, None, street.image_size);
    let opened = WatchedCamera::open(folder, "mast", None, (Some(lens), false));
    let (mut camera, _) = opened.map_err(|err| format!("{err:#}"))?;
    for hour in camera.pictures().iter().sum::<u64>()..14 {
        let at_secs = street.began_secs + HOUR_SECS * hour as f64;
        let looked = camera.look(vec![street.picture(at_secs)], Taken::at(at_secs));
        looked.map_err(|err| format!("{err:#}"))?;
        told.push(camera.station().gallery.references.len());
    }
    Ok(())
}

#[test]
fn a_full_disk_loses_no_reference_and_the_watch_goes_on_with_room() {
    let (street, mut full) = (street(), 0);
    for kib in (1..=20).map(|n| 52 * n) {
        let place = TempDir::new().expect("a folder");
        let mounts = |options: &str| {
            let mut mount = Command::new("mount");
            mount.args(["-t", "tmpfs", "-o", options, "tmpfs"]).arg(place.path());
            mount.stderr(Stdio::null()).status().is_ok_and(|status| status.success())
        };
        if !mounts(&format!("size={kib}k")) {
            return println!("SKIPPED: mounting a small file system needs root");
        }
        let (folder, mut told) = (place.path().join("cam"), Vec::new());
        let first = watch_on(&folder, &street, &mut told);
        // Started again on the full disk, as by a timer.
        full += usize::from(first.is_err() && watch_on(&folder, &street, &mut told).is_err());
        if let Some(before) = told.last() {
            let camera = WatchedCamera::look_at(&folder).expect("whole");
            assert!(camera.pictures().iter().sum::<u64>() >= told.len() as u64, "{kib} KiB");
            assert!(camera.station().gallery.references.len() >= *before, "{kib} KiB: {first:?}");
        }
        assert!(mounts("remount,size=16m"));
        watch_on(&folder, &street, &mut told).expect("goes on");
        assert!(references(&folder) > 0, "{kib} KiB");
        // A mount that stays does no harm.
        drop(Command::new("umount").arg(place.path()).status());
    }
    println!("{full} of 20 disks were full");
    assert!(full >= 10, "{full}");
}

/// A round over a folder of pictures of the street.
struct Ftp {
    place: TempDir,
    street: Street,
    round: Round,
    told: AtomicBool,
}

impl Ftp {
    fn new() -> Self {
        let place = store(LEARNED_HOURS);
        let folder = place.path().join("ftp");
        fs::create_dir(&folder).expect("made");
        let street = street();
        let places = Places::one(begin(place.path(), &street));
        let (name, feed) = ("mast".into(), Feed::Folder(folder));
        let round = Round { name, places, feed, every: Duration::from_secs(900), is_frozen: false };
        Self { place, street, round, told: AtomicBool::new(false) }
    }

    /// Adds a picture of an hour under a name; panned by 6 px if `is_pushed`.
    fn put(&mut self, hour: u32, name: &str, is_pushed: bool) {
        let pushed = Street::parse("3,pan=6px@0d").expect("a street").planted;
        self.street.planted = if is_pushed { pushed } else { Vec::new() };
        let at_secs = self.street.began_secs + HOUR_SECS * f64::from(hour);
        let folder = self.place.path().join("ftp");
        self.street.picture(at_secs).save(folder.join(name)).expect("saved");
    }

    fn at(&self, hour: u32) -> String {
        let at_secs = self.street.began_secs + HOUR_SECS * f64::from(hour);
        times::for_programs(at_secs).replace(':', "_") + ".png"
    }

    fn state(&mut self) -> State {
        let hear = |_: &WatchedCamera, _: &boresight_watch::Decision| {};
        self.round.look(&self.told, &hear, &Announcer::silent()).expect("looked");
        self.round.places.cameras()[0].watch().decision().state
    }
}

fn is_clock(state: State) -> bool {
    assert!(matches!(exit(state), boresight_app::Exit::CannotTell | boresight_app::Exit::Moved));
    matches!(state, State::CannotTell { reason: NoAnswer::WrongClock, .. })
}

#[test]
fn a_camera_whose_clock_fell_back_to_2000_isnt_ok() {
    let mut ftp = Ftp::new();
    for hour in 0..4 {
        ftp.put(80 + hour, &format!("2000-01-01T0{hour}_00_00.png"), true);
    }
    assert!(is_clock(ftp.state()));
    // A new one comes at each look.
    ftp.put(84, "2000-01-01T05_00_00.png", true);
    assert!(is_clock(ftp.state()));
    // It's set right.
    for hour in 85..88 {
        let name = ftp.at(hour);
        ftp.put(hour, &name, false);
    }
    assert_eq!(ftp.state(), State::Ok);
}

#[test]
fn one_wrong_picture_hides_none() {
    let mut ftp = Ftp::new();
    ftp.put(80, "2099-01-01T00_00_00.png", true);
    ftp.put(80, "latest.png", true);
    for hour in 81..85 {
        let name = ftp.at(hour);
        ftp.put(hour, &name, true);
    }
    assert!(matches!(ftp.state(), State::Moved(_)));
    let newest = ftp.round.places.newest_picture_secs().expect("one");
    assert_eq!(newest, ftp.street.began_secs + 84.0 * HOUR_SECS);
    // If only such ones come, its clock is wrong.
    ftp.put(86, "2099-01-01T01_00_00.png", false);
    assert!(is_clock(ftp.state()));
    ftp.put(87, "latest.png", false);
    assert!(is_clock(ftp.state()));
}

#[test]
fn a_state_comes_with_the_reason_why_no_answer_does() {
    let mut ftp = Ftp::new();
    let reason = |ftp: &mut Ftp| {
        ftp.state();
        StateLine::heard(&ftp.round.places.cameras()[0]).reason
    };
    let name = ftp.at(80);
    ftp.put(80, &name, false);
    assert_eq!(reason(&mut ftp), None);
    // Byte for byte again.
    let folder = ftp.place.path().join("ftp");
    fs::copy(folder.join(name), folder.join(ftp.at(81))).expect("copied");
    assert_eq!(reason(&mut ftp).as_deref(), Some("frozen"));
    let size =
        std::mem::replace(&mut ftp.street.image_size, ImageSize { width_px: 160, height_px: 120 });
    let name = ftp.at(82);
    ftp.put(82, &name, false);
    assert_eq!(reason(&mut ftp).as_deref(), Some("other-size"));
    ftp.street.image_size = size;
    let name = ftp.at(83);
    ftp.put(83, &name, false);
    assert_eq!(reason(&mut ftp), None);
}

#[test]
fn accepting_a_camera_forgets_a_wrong_time() {
    let place = store(LEARNED_HOURS);
    let street = street();
    let mut camera = begin(place.path(), &street);
    let ahead = camera.newest_picture_secs().expect("one") + 1e9;
    camera.look(vec![street.picture(street.began_secs)], Taken::at(ahead)).expect("recorded");
    assert_eq!(camera.newest_picture_secs(), Some(ahead));
    accept(place.path(), ahead - 1e8, "its clock was wrong").expect("accepted");
    look(&mut camera, &street, 80..81);
    assert_eq!(camera.newest_picture_secs(), Some(street.began_secs + 80.0 * HOUR_SECS));
    let inputs = fs::read_to_string(lines(place.path())).expect("there");
    let last: Value = serde_json::from_str(inputs.lines().last().expect("one")).expect("JSON");
    assert_eq!(last["none"], "no-references");
}
