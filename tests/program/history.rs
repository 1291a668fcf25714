//! Every calibration of every camera: found again after the index is deleted, and drift told from
//! chance.
//!
//! `BORESIGHT_HISTORY_CAMERAS=1000` sets the number of cameras, `BORESIGHT_HISTORY_EACH=100` the
//! number of calibrations of each.

use std::{fs, path::Path, process::Stdio, time::Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::person::{boresight, program, says};

const SD_PX: [f64; 3] = [0.5, 0.4, 0.3];

fn number(variable: &str, usual: usize) -> usize {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Normally distributed pseudo-random numbers, the same each time.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Sessions of `cameras` cameras with `each` calibrations; the first `drifting` lose 1 % of their
/// focal length.
fn fleet(place: &Path, cameras: usize, each: usize, drifting: usize) {
    let good = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good");
    let header = fs::read_to_string(good.join("session.toml")).expect("readable");
    let result = fs::read_to_string(good.join("calibration.json")).expect("readable");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    let line =
        |name: &str| header.lines().find(|line| line.starts_with(name)).expect("a line").to_owned();
    let (source, created) = (line("source"), line("created"));
    let mut chance = Chance(26);
    for camera in 0..cameras {
        for time in 0..each {
            let folder = place.join(format!("sessions/{camera:05}/{time:04}"));
            fs::create_dir_all(&folder).expect("made");
            let stamp = format!("20{:02}-{:02}-01T00:00:00Z", 20 + time / 12, 1 + time % 12);
            let header = header
                .replacen(
                    &source,
                    &format!("source = \"usb:0000:{:04}:{camera:05}\"", camera % 5),
                    1,
                )
                .replacen(&created, &format!("created = \"{stamp}\""), 1);
            fs::write(folder.join("session.toml"), header).expect("written");
            let part = if each > 1 { time as f64 / (each - 1) as f64 } else { 0.0 };
            let lost = if camera < drifting { 0.01 * part } else { 0.0 };
            let f = 350.0 * (1.0 - lost) + SD_PX[0] * chance.normal();
            let pp = [200.0 + SD_PX[1] * chance.normal(), 150.0 + SD_PX[2] * chance.normal()];
            let mut result = result.clone();
            result["result"]["f_px"] = json!([f, f]);
            result["result"]["pp_px"] = json!(pp);
            let v = SD_PX.map(|sd| sd * sd);
            result["result"]["covariance_all"] = json!({
                "order": ["f", "cx", "cy"],
                "matrix": [[v[0], 0.0, 0.0], [0.0, v[1], 0.0], [0.0, 0.0, v[2]]],
            });
            fs::write(folder.join("calibration.json"), result.to_string()).expect("written");
        }
    }
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

#[test]
fn drift_is_told_from_chance_and_the_index_is_made_again() {
    let (cameras, each) =
        (number("BORESIGHT_HISTORY_CAMERAS", 60), number("BORESIGHT_HISTORY_EACH", 4));
    let drifting = (cameras / 50).max(4);
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fleet(place, cameras, each, drifting);
    let began = Instant::now();
    says(
        &boresight(place, &["history", "add", "sessions"]),
        0,
        &[&format!("{} of", cameras * each)],
    );
    println!("{} calibrations indexed in {:.1} s", cameras * each, began.elapsed().as_secs_f64());
    let listed = boresight(place, &["history", "--json"]);
    says(&listed, 0, &[]);
    let rows = lines(&listed.stdout);
    assert_eq!(rows.len(), cameras);
    let changed = |row: &&Value| row["changed"] == true;
    let number_of = |row: &Value| -> usize {
        let name = row["camera"].as_str().expect("a name");
        name.rsplit(':').next().expect("a serial number").parse().expect("a number")
    };
    let found = rows.iter().filter(changed).filter(|row| number_of(row) < drifting).count();
    let wrong = rows.iter().filter(changed).filter(|row| number_of(row) >= drifting).count();
    println!("{found} of {drifting} found, {wrong} of {} others", cameras - drifting);
    assert!(found * 100 >= drifting * 95);
    assert!(wrong * 100 <= (cameras - drifting) * 2);
    // One camera, by a part of its name.
    let began = Instant::now();
    let one = lines(&boresight(place, &["history", ":00001", "--json"]).stdout).remove(0);
    println!(
        "one camera: {:.0} ms with the start of the program",
        began.elapsed().as_secs_f64() * 1e3
    );
    assert_eq!(one["calibrations"].as_array().expect("a list").len(), each);
    let first = &one["calibrations"][0];
    assert_eq!((&first["since_first"], &first["verdict"]), (&Value::Null, &json!("good")));
    let began = Instant::now();
    let named = boresight(place, &["history", "usb:0000:0001:00001"]);
    println!("by its whole name: {:.0} ms", began.elapsed().as_secs_f64() * 1e3);
    says(&named, 0, &[]);
    // Deleted, the index is restored from the sessions in any order.
    fs::remove_file(place.join("history.jsonl")).expect("removed");
    for camera in (0..cameras).rev().step_by(2).chain((0..cameras).rev().skip(1).step_by(2)) {
        if cameras > 100 && camera > 0 {
            continue;
        }
        let root = format!("sessions/{camera:05}");
        let root = if cameras > 100 { "sessions" } else { &root };
        says(&boresight(place, &["history", "add", root]), 0, &[]);
    }
    assert!(boresight(place, &["history", "--json"]).stdout == listed.stdout);
}

#[test]
fn what_is_due_is_listed_and_the_page_shows_every_camera() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fleet(place, 6, 3, 1);
    // One camera is new enough, one has nothing usable.
    let now = jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string();
    let path = place.join("sessions/00003/0002/session.toml");
    let header = fs::read_to_string(&path).expect("readable").replace("2020-03-01T00:00:00Z", &now);
    fs::write(&path, header).expect("written");
    // A wrong clock makes no calibration new.
    let path = place.join("sessions/00002/0002/session.toml");
    let header = fs::read_to_string(&path).expect("readable");
    let ahead = header.replace("2020-03-01T00:00:00Z", "2300-03-01T00:00:00Z");
    assert_ne!(ahead, header);
    fs::write(&path, ahead).expect("written");
    for time in 0..3 {
        let path = place.join(format!("sessions/00004/{time:04}/calibration.json"));
        let result = fs::read_to_string(&path).expect("readable");
        let result = result.replace(r#""verdict":"good""#, r#""verdict":"untrustworthy""#);
        fs::write(&path, result).expect("written");
    }
    fs::remove_file(place.join("sessions/00005/0000/calibration.json")).expect("removed");
    fs::write(place.join("sessions/00005/0001/calibration.json"), "{").expect("written");
    let added = boresight(place, &["history", "add", "sessions"]);
    says(&added, 0, &["16 of 18", "1 have no result", "Left out"]);
    let due = lines(&boresight(place, &["history", "due", "--older", "180d", "--json"]).stdout);
    let names: Vec<&str> = due.iter().filter_map(|row| row["camera"].as_str()).collect();
    assert_eq!(names.len(), 5, "{names:?}");
    assert!(names[0].ends_with(":00004") && due[0]["newest"].is_null(), "{names:?}");
    assert!(!names.iter().any(|name| name.ends_with(":00003")));
    assert!(names.iter().any(|name| name.ends_with(":00002")));
    says(&boresight(place, &["history", "page", "--out", "page.html"]), 0, &["page.html"]);
    let page = fs::read_to_string(place.join("page.html")).expect("written");
    roxmltree::Document::parse(&page.replacen("<!DOCTYPE html>", "", 1)).expect("well-formed");
    assert!((0..6).all(|camera| page.contains(&format!(":0000{camera} 400x300"))));
    assert!(page.contains("changed since the first"));
    says(&boresight(place, &["history", "page", "--out", "page.html"]), 1, &["--force"]);
}

#[test]
fn what_cannot_be_used_says_what_to_do() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    says(&boresight(place, &["history"]), 1, &["no index", "history add"]);
    fleet(place, 2, 1, 0);
    says(&boresight(place, &["history", "add", "sessions"]), 0, &["2 of 2"]);
    says(&boresight(place, &["history", "usb"]), 1, &["2 cameras"]);
    says(&boresight(place, &["history", "other"]), 1, &["no camera"]);
    says(&boresight(place, &["history", "due", "--older", "soon"]), 2, &["180d"]);
}

#[test]
fn what_several_programs_add_at_once_is_all_there() {
    const PROGRAMS: usize = 8;
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fleet(place, PROGRAMS, 2, 0);
    // Long enough for a measurable time of reading and writing.
    says(&boresight(place, &["history", "add", "sessions/00000"]), 0, &["2 of 2"]);
    let index = place.join("history.jsonl");
    let line = fs::read_to_string(&index).expect("there");
    let line = line.lines().next().expect("a line");
    let others = (0..3000).map(|other| {
        let mut row: Value = serde_json::from_str(line).expect("JSON");
        row["session"] = format!("elsewhere/{other}").into();
        format!("{row}\n")
    });
    fs::write(&index, others.collect::<String>()).expect("written");
    let started: Vec<_> = (0..PROGRAMS)
        .map(|camera| {
            let root = format!("sessions/{camera:05}");
            let mut adding = program(place, &["history", "add", &root]);
            adding.stderr(Stdio::null()).spawn().expect("started")
        })
        .collect();
    for mut adding in started {
        assert!(adding.wait().expect("waited for").success());
    }
    let count = fs::read_to_string(&index).expect("there").lines().count();
    assert_eq!(count, 3000 + 2 * PROGRAMS);
}

/// `add` and looking alike.
#[test]
fn a_file_of_another_program_is_refused_and_stays_as_it_is() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    fleet(place, 1, 1, 0);
    let files: [(&str, Vec<u8>); 3] = [
        ("text.txt", b"not an index, by far not\n".repeat(50)),
        ("other.jsonl", b"{\"schema\":\"boresight.calibration/1\",\"session\":\"s\"}\n".to_vec()),
        ("other.sqlite", b"SQLite format 3\0\x10\0\x01\x01".repeat(50)),
    ];
    for (name, bytes) in files {
        let file = place.join(name);
        fs::write(&file, &bytes).expect("written");
        says(&boresight(place, &["history", "--index", name]), 1, &["index", name]);
        says(&boresight(place, &["history", "add", "sessions", "--index", name]), 1, &["index"]);
        assert!(fs::read(&file).expect("readable") == bytes, "{name} was changed");
        assert!(name.ends_with("jsonl") || !file.with_extension("jsonl").exists(), "{name}");
        fs::remove_file(&file).expect("removed");
    }
}

/// The same table from any program.
#[test]
fn the_table_of_a_batch_is_an_index() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let good = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good");
    let good = good.to_str().expect("a path");
    let planned = boresight(place, &["batch", "plan", good]);
    fs::write(place.join("manifest.jsonl"), planned.stdout).expect("written");
    let run = ["batch", "run", "manifest.jsonl", "--action", "calibrate", "--out", "out"];
    says(&boresight(place, &run), 0, &["1 of 1"]);
    let table = boresight(place, &["batch", "gather", "out"]).stdout;
    fs::write(place.join("results.jsonl"), table).expect("written");
    let listed = boresight(place, &["history", "--index", "results.jsonl", "--json"]);
    says(&listed, 0, &[]);
    says(&boresight(place, &["history", "add", good]), 0, &["1 of 1"]);
    assert_eq!(lines(&boresight(place, &["history", "--json"]).stdout), lines(&listed.stdout));
}
