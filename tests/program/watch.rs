//! A watched camera, as a process: its statements on a simulated street, its store, and the traces
//! of a crash.

use std::{
    fs,
    path::Path,
    process::Stdio,
    thread,
    time::{Duration, Instant},
};

use boresight_station::street::Street;
use serde_json::Value;
use tempfile::TempDir;

use crate::person::{boresight, contents, program, says};

/// A week's street in few pictures, pushed by 3 px on the fourth day.
const STREET: &str = "sim:street:1,days=3.6,pan=3px@3.2d";
const EVERY: &str = "1h";

fn watch(place: &Path, street: &str, store: &str, more: &[&str]) -> crate::person::Ended {
    let arguments = ["watch", street, "--store", store, "--once", "--every", EVERY];
    boresight(place, &[&arguments[..], more].concat())
}

fn last_state(text: &str) -> Value {
    serde_json::from_str(text.lines().last().expect("a line")).expect("JSON")
}

#[test]
fn a_push_is_found_said_stored_and_replayed_and_accepted() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let ended = watch(
        here,
        STREET,
        "cam",
        &[
            "--json",
            "--metrics",
            "cam.prom",
            "--on-finish",
            "echo $BORESIGHT_CAMERA $BORESIGHT_STATE > told",
        ],
    );
    says(&ended, 5, &["cam: OK", "cam: MOVED", "to the left", "Push it back to the right."]);
    let state = last_state(&ended.stdout);
    assert_eq!(state["state"], "MOVED");
    let pan_px = state["off"]["pan_px"].as_f64().expect("a number");
    assert!((pan_px - 3.0).abs() < 0.4, "{state}");
    let since = state["since"].as_str().expect("a time");
    assert!(("2026-03-24T04".."2026-03-24T10").contains(&since), "{since}");
    let told = fs::read_to_string(here.join("told")).expect("told");
    assert_eq!(told.trim(), "cam MOVED");
    let metrics = fs::read_to_string(here.join("cam.prom")).expect("written");
    assert!(
        metrics.contains("state=\"MOVED\"} 1\n") && metrics.contains("state=\"OK\"} 0\n"),
        "{metrics}"
    );
    assert!(metrics.contains("answer=\"yes\"} "), "{metrics}");

    // The recorded inputs alone give the same states.
    let replayed = boresight(here, &["watch", "replay", "--store", "cam", "--json"]);
    says(&replayed, 5, &[]);
    let again = last_state(&replayed.stdout);
    for part in ["state", "since", "sentence", "off", "smallest_visible", "reference"] {
        assert_eq!(again[part], state[part], "{part}");
    }
    let stored = boresight(here, &["watch", "state", "--store", "cam", "--json"]);
    says(&stored, 5, &[]);
    assert_eq!(last_state(&stored.stdout), state);
    let bytes: usize = contents(&here.join("cam")).iter().map(|(_, bytes)| bytes.len()).sum();
    assert!(bytes < 10 << 20, "{bytes} bytes");
    assert_eq!(
        fs::read_dir(here.join("cam/learning")).expect("a folder").count(),
        0,
        "learning is over"
    );

    // In a list of due cameras, the changed one comes first.
    let due = boresight(here, &["history", "due", "--watch", "cam", "--json"]);
    says(&due, 0, &[]);
    assert_eq!(last_state(&due.stdout)["state"], "MOVED");

    // Its curves are drawn without an index, with the events.
    let page = ["history", "page", "--watch", "cam", "--out", "cam.html"];
    says(&boresight(here, &page), 0, &["Written"]);
    let html = fs::read_to_string(here.join("cam.html")).expect("readable");
    assert_eq!(html.matches("<polygon").count(), 4);
    assert!(html.contains("<p>Watched cameras: 1. Made "), "no calibrated ones are counted");
    assert!(html.contains("MOVED. The camera points") && !html.contains("NaN"));

    // A single look without pictures, any time later, gives CANNOT-TELL.
    fs::create_dir(here.join("silent")).expect("made");
    let silent = boresight(here, &["watch", "silent", "--store", "cam", "--once"]);
    says(&silent, 6, &["CANNOT-TELL", "no picture comes.", "Check the camera"]);

    says(&boresight(here, &["watch", "accept", "--store", "cam"]), 1, &["--reason"]);
    says(
        &boresight(here, &["watch", "accept", "--store", "cam", "--reason", "new pole"]),
        0,
        &["learns again"],
    );
    let ended = watch(here, "sim:street:1,days=3.7,pan=3px@3.2d", "cam", &["--json"]);
    says(&ended, 3, &[]);
    assert_eq!(last_state(&ended.stdout)["state"], "LEARNING");
    let lines = fs::read_to_string(here.join("cam/watch.jsonl")).expect("readable");
    assert!(lines.contains("\"kind\":\"accepted\"") && lines.contains("new pole"));
}

#[test]
fn a_watch_that_is_killed_goes_on_as_if_nothing_had_been() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let (street, half) = ("sim:street:5,days=1.5", "sim:street:5,days=0.6");
    says(&watch(here, street, "whole", &[]), 3, &[]);
    // Killed in the middle, then cut in the middle of a line as by a power cut.
    let arguments = ["watch", street, "--store", "cut", "--once", "--every", EVERY];
    let mut child = program(here, &arguments).stderr(Stdio::null()).spawn().expect("started");
    let lines = here.join("cut/watch.jsonl");
    let began = Instant::now();
    while fs::read_to_string(&lines).map_or(0, |text| text.lines().count()) < 9 {
        assert!(began.elapsed() < Duration::from_secs(120), "no lines");
        thread::sleep(Duration::from_millis(20));
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    let mut text = fs::read(&lines).expect("readable");
    text.extend_from_slice(b"{\"kind\":\"picture\",\"at\":17740");
    fs::write(&lines, text).expect("written");
    says(&watch(here, half, "cut", &[]), 3, &["the newest line was cut"]);
    says(&watch(here, street, "cut", &[]), 3, &[]);
    let read =
        |store: &str| fs::read_to_string(here.join(store).join("watch.jsonl")).expect("readable");
    assert_eq!(read("cut"), read("whole"));
}

#[test]
fn where_people_are_only_patches_are_stored() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    says(&watch(here, "sim:street:2,days=0.6", "cam", &["--patches-only"]), 3, &[]);
    let files = contents(&here.join("cam"));
    assert!(files.iter().any(|(path, _)| path.extension().is_some_and(|e| e == "png")));
    for (path, bytes) in files {
        if path.extension().is_some_and(|e| e == "png") {
            // Patches are 31 and 15 px wide, side by side.
            let picture = image::load_from_memory(&bytes).expect("a picture");
            assert_eq!(picture.width(), 46, "{path:?}");
        }
    }
}

#[test]
fn what_is_wrong_is_said_and_nothing_is_made() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    fs::create_dir(here.join("pictures")).expect("made");
    image::GrayImage::new(64, 48).save(here.join("pictures/a.png")).expect("saved");
    let run = |arguments: &[&str]| boresight(here, &[&["watch"], arguments].concat());
    says(&run(&["pictures", "--once"]), 1, &["--reference"]);
    says(&run(&["sim:street:zoom=3@1d", "--once"]), 1, &["zoom=3@1d", "pan=2px@5d"]);
    says(&run(&["replay", "--store", "nowhere"]), 1, &["no watched camera", "--store"]);
    says(&run(&["accept", "--store", "nowhere", "--reason", "x"]), 1, &["no watched camera"]);
    fs::write(here.join("list.toml"), "[[camera]]\nname = \"../x\"\nsource = \"pictures\"\n")
        .expect("written");
    says(&run(&["--list", "list.toml", "--once"]), 1, &["can't be the name of a folder"]);
    assert!(!here.join("watch").exists());
    // A damaged line is named, and left out on request.
    says(&watch(here, "sim:street:2,days=0.1", "cam", &[]), 3, &[]);
    let lines = here.join("cam/watch.jsonl");
    let text = fs::read_to_string(&lines).expect("readable");
    fs::write(&lines, format!("nonsense\n{text}")).expect("written");
    let recover = "boresight watch --recover --store \"cam\"";
    says(&run(&["state", "--store", "cam"]), 1, &["line 1 of", recover]);
    let whole = ["lines are kept, 1 were damaged", "references are whole"];
    says(&run(&["--recover", "--store", "cam"]), 0, &whole);
    let state = run(&["state", "--store", "cam"]);
    says(&state, 3, &[]);
    assert!(state.stdout.contains("LEARNING"), "{}", state.stdout);
}

#[test]
fn presets_are_found_and_watched_each_by_itself() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let street = "sim:street:4,presets=3,days=0.5";
    // Stopped after the first picture of each preset, it still knows them.
    says(
        &watch(here, "sim:street:4,presets=3,days=0.12", "ptz", &["--presets", "3"]),
        3,
        &["seen twice"],
    );
    assert!(!here.join("ptz/preset-1").exists());
    says(&watch(here, street, "ptz", &["--presets", "3"]), 3, &["ptz preset-3: LEARNING"]);
    for preset in 1..=3 {
        let file = here.join(format!("ptz/preset-{preset}/watch.jsonl"));
        let lines = fs::read_to_string(file).expect("a store");
        let times: Vec<f64> = lines
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).expect("JSON"))
            .filter(|line| line["kind"] == "picture")
            .map(|line| line["at"].as_f64().expect("a time"))
            .collect();
        // Each is visited every third hour.
        assert_eq!(times.len(), 4, "{lines}");
        assert!(times.windows(2).all(|w| w[1] - w[0] == 3.0 * 3600.0), "{times:?}");
    }
    assert_eq!(fs::read_dir(here.join("ptz/learning")).expect("a folder").count(), 0);
    let state = boresight(here, &["watch", "state", "--store", "ptz"]);
    assert!(state.stdout.contains("ptz preset-1: LEARNING"), "{}", state.stdout);
    assert!(state.stdout.contains("ptz preset-3: LEARNING"), "{}", state.stdout);
    // A store of one place isn't turned into one of several, nor are presets watched as one place.
    says(&watch(here, "sim:street:4,days=0.1", "one", &[]), 3, &[]);
    says(&watch(here, street, "one", &["--presets", "3"]), 1, &["watches one place"]);
    says(&watch(here, street, "ptz", &[]), 1, &["--presets", "ptz/preset-1"]);
}

#[test]
fn many_cameras_are_watched_at_once_and_the_worst_decides() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let list = "[[camera]]\nname = \"gate\"\nsource = \"sim:street:1,days=0.3\"\nevery = \"1h\"\n\
                [[camera]]\nname = \"yard\"\nsource = \"sim:street:2,days=0.3\"\nevery = \"2h\"\n";
    fs::write(here.join("cameras.toml"), list).expect("written");
    let ended =
        boresight(here, &["watch", "--list", "cameras.toml", "--store", "all", "--once", "--json"]);
    says(&ended, 3, &[]);
    let names: Vec<String> = ended
        .stdout
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON")["camera"].to_string())
        .collect();
    assert_eq!(names, ["\"gate\"", "\"yard\""]);
    says(&boresight(here, &["watch", "state", "--store", "all"]), 3, &[]);
}

/// A folder filled by a camera over a street, hour by hour.
struct Filled<'a> {
    folder: &'a Path,
    street: Street,
    hours: u32,
}

impl<'a> Filled<'a> {
    fn new(folder: &'a Path) -> Self {
        fs::create_dir(folder).expect("made");
        Self { folder, street: Street::parse("1").expect("a street"), hours: 8 }
    }

    /// Adds the pictures of the next hours, `scale` times smaller than the street's.
    fn put(&mut self, hours: u32, scale: u32) {
        for hour in self.hours..self.hours + hours {
            let at_secs = self.street.began_secs + 3600.0 * f64::from(hour);
            let picture = self.street.picture(at_secs);
            let [width, height] = [picture.width() / scale, picture.height() / scale];
            let picture = image::imageops::thumbnail(&picture, width, height);
            picture.save(self.folder.join(format!("{at_secs}.png"))).expect("saved");
        }
        self.hours += hours;
    }
}

/// Paths of the pictures in a folder beside the store, as command arguments.
fn pictures_in(folder: &Path) -> Vec<String> {
    let name = folder.file_name().expect("a name").to_string_lossy().into_owned();
    let files = fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry"));
    files.map(|file| format!("{name}/{}", file.file_name().to_string_lossy())).collect()
}

/// JSON state printed by a run or `watch state`.
fn told(here: &Path, arguments: &[&str], exit: i32) -> Value {
    let ended = boresight(here, &[&["watch"], arguments, &["--store", "cam", "--json"]].concat());
    says(&ended, exit, &[]);
    last_state(&ended.stdout)
}

#[test]
fn a_picture_that_comes_after_a_look_for_nothing_is_looked_at() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let folder = here.join("ftp");
    let mut camera = Filled::new(&folder);
    // Its lens is known, and no picture yet.
    says(&watch(here, "sim:street:1,days=0", "cam", &[]), 3, &[]);
    camera.put(7, 1);
    assert_eq!(told(here, &["ftp", "--once"], 3)["state"], "LEARNING");
    let unanswered = |state: &Value| state["pictures"][1].as_u64().expect("a number");
    let before = unanswered(&told(here, &["state"], 3));

    // Nothing comes for months, a picture is still being written, and then the backlog comes.
    let empty = told(here, &["ftp", "--once"], 6);
    assert_eq!((&empty["state"], unanswered(&empty)), (&Value::from("CANNOT-TELL"), before + 1));
    assert!(empty["sentence"].to_string().contains("no picture comes."), "{empty}");
    let next = folder.join(format!("{}.png", camera.street.began_secs + 15.0 * 3600.0));
    fs::write(&next, "half of").expect("written");
    told(here, &["ftp", "--once"], 6);
    camera.put(3, 1);
    let state = told(here, &["ftp", "--once"], 3);
    assert_eq!(state["state"], "LEARNING");
    assert_eq!(
        state["pictures"][0].as_u64().expect("a number"),
        4,
        "the seventh, then three: {state}"
    );
    assert_eq!((&state["at"], &state["answered"]), (&"2026-03-21T17:00:00Z".into(), &state["at"]));

    // A picture taken before all of these comes last, and another disappears before being read.
    camera.hours = 7;
    camera.put(1, 1);
    let gone = ["ftp/gone.png".to_owned()].into_iter().chain(pictures_in(&folder));
    let gone: Vec<String> = gone.collect();
    let gone: Vec<&str> = gone.iter().map(String::as_str).chain(["--once"]).collect();
    let late = told(here, &gone, 6);
    assert_eq!((&late["pictures"][0], unanswered(&late)), (&5.into(), unanswered(&state) + 1));
    // The deleted picture isn't there now, and the newest is from long ago.
    assert_eq!((&late["state"], &late["answered"]), (&"CANNOT-TELL".into(), &state["answered"]));
    let lines = fs::read_to_string(here.join("cam/watch.jsonl")).expect("readable");
    assert_eq!(lines.matches("\"late\":true").count(), 1, "{lines}");
    // It's looked at once.
    told(here, &["ftp", "--once"], 6);
    assert_eq!(told(here, &["state"], 6)["pictures"][0], 5);
}

#[test]
fn a_camera_that_sends_one_picture_again_and_again_isnt_ok() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let folder = here.join("ftp");
    let mut camera = Filled::new(&folder);
    says(&watch(here, "sim:street:1,days=0", "cam", &[]), 3, &[]);
    camera.put(5, 1);
    assert_eq!(told(here, &["ftp", "--once"], 3)["state"], "LEARNING");
    let newest = |hours: u32| {
        let at_secs = camera.street.began_secs + 3600.0 * f64::from(camera.hours - 1 + hours);
        folder.join(format!("{at_secs}.png"))
    };
    for hours in 1..30 {
        fs::copy(newest(0), newest(hours)).expect("copied");
    }
    let ended = boresight(here, &["watch", "ftp", "--once", "--store", "cam", "--json"]);
    says(&ended, 6, &["again, byte for byte"]);
    assert_eq!(ended.stderr.matches("again, byte for byte").count(), 1, "{}", ended.stderr);
    let state = last_state(&ended.stdout);
    assert_eq!(state["state"], "CANNOT-TELL");
    assert_eq!(state["reason"], "frozen");
    assert!(state["sentence"].to_string().contains("the same picture comes again"), "{state}");
}

#[test]
fn pictures_of_another_size_are_told_by_every_run() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let folder = here.join("ftp");
    let mut camera = Filled::new(&folder);
    fs::create_dir(here.join("empty")).expect("made");
    says(&watch(here, "sim:street:1,days=0", "cam", &[]), 3, &[]);
    let empty = told(here, &["empty", "--once"], 6);
    assert_eq!((&empty["state"], &empty["pictures"][1]), (&"CANNOT-TELL".into(), &1.into()));

    camera.put(2, 2);
    let arguments = [&["ftp", "--once"][..], &["ftp", "--once"], &["state"]];
    for arguments in arguments {
        let state = told(here, arguments, 6);
        assert_eq!(state["state"], "CANNOT-TELL", "{state}");
        assert!(state["sentence"].to_string().contains("another size"), "{state}");
        assert!(state["action"].to_string().contains("Set the camera to the size"), "{state}");
    }
    // It's set right.
    camera.put(1, 1);
    assert_eq!(told(here, &["ftp", "--once"], 3)["state"], "LEARNING");
}

#[test]
fn a_camera_that_is_away_or_wrong_keeps_no_other_from_being_watched() {
    let place = TempDir::new().expect("a folder");
    let here = place.path();
    let listed = |name: &str, rest: &str| format!("[[camera]]\nname = \"{name}\"\n{rest}\n");
    let gate = listed("gate", "source = \"sim:street:1,days=0.3\"\nevery = \"1h\"");
    let run = |list: String| {
        fs::write(here.join("cameras.toml"), list).expect("written");
        boresight(here, &["watch", "--list", "cameras.toml", "--store", "all", "--once"])
    };
    // A failing camera fails the run, but the other has been looked at.
    let wrong = listed("hall", "source = \"yard\"\nreference = \"nothing.json\"");
    let ended = run(wrong + &gate);
    says(&ended, 1, &["hall isn't watched", "nothing.json", "Check the name"]);
    assert!(ended.stdout.contains("gate: LEARNING"), "{}", ended.stdout);

    // A camera on an unmounted disk can't be told, and is looked at once it's there.
    says(&watch(here, "sim:street:2,days=0.01", "all/yard", &[]), 3, &[]);
    let list = listed("yard", "source = \"yard\"") + &gate;
    let ended = run(list.clone());
    says(&ended, 6, &["yard: no source \"yard\""]);
    assert!(ended.stdout.contains("gate: LEARNING"), "{}", ended.stdout);
    Filled::new(&here.join("yard")).put(1, 1);
    let ended = run(list);
    assert!(!ended.stderr.contains("no source"), "{}", ended.stderr);
    let lines = fs::read_to_string(here.join("all/yard/watch.jsonl")).expect("readable");
    assert_eq!(lines.lines().count(), 3, "a picture, none, a picture: {lines}");
}
