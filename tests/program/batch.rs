//! Many sessions at once: for any shards, interruptions and damage, a single table of the same
//! bytes.
//!
//! `BORESIGHT_BATCH_KILLS=100` sets the number of killed workers, `BORESIGHT_BATCH_SESSIONS=1000`
//! the number of sessions.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::Value;
use tempfile::TempDir;

use crate::person::{Ended, boresight, contents, program, says};

const RECORDINGS: [&str; 4] =
    ["good", "focus-moved", "focus-moved-unseen", "installed-camera-changed"];

fn number(variable: &str, usual: usize) -> usize {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

fn recording(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1").join(name)
}

/// A copy of the recording `name` at `to`, with links to files: none is changed in place.
fn copy(name: &str, to: &Path) {
    fn copy_folder(from: &Path, to: &Path) {
        fs::create_dir_all(to).expect("made");
        for entry in fs::read_dir(from).expect("listable") {
            let from = entry.expect("listable").path();
            let to = to.join(from.file_name().expect("a name"));
            if from.is_dir() {
                copy_folder(&from, &to);
            } else if fs::hard_link(&from, &to).is_err() {
                fs::copy(&from, &to).expect("copied");
            }
        }
    }
    copy_folder(&recording(name), to);
}

/// A folder with `count` sessions in `sessions`, and a manifest.
fn sessions(count: usize) -> TempDir {
    let place = TempDir::new().expect("folder");
    for number in 0..count {
        let folder = place.path().join(format!("sessions/{:02}/{number:05}", number % 7));
        copy(RECORDINGS[number % RECORDINGS.len()], &folder);
    }
    plan(place.path());
    place
}

fn plan(place: &Path) -> Vec<Value> {
    let ended = boresight(place, &["batch", "plan", "sessions"]);
    says(&ended, 0, &["sessions"]);
    fs::write(place.join("manifest.jsonl"), &ended.stdout).expect("written");
    lines(&ended.stdout)
}

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
}

const RUN: [&str; 5] = ["batch", "run", "manifest.jsonl", "--action", "replay"];

fn run(place: &Path, out: &str, more: &[&str]) -> Ended {
    boresight(place, &[&RUN[..], &["--out", out], more].concat())
}

fn gather(place: &Path, out: &str) -> String {
    let ended = boresight(place, &["batch", "gather", out]);
    says(&ended, 0, &[]);
    ended.stdout
}

#[test]
fn any_number_of_shards_in_any_order_gives_the_same_bytes() {
    let place = sessions(16);
    let place = place.path();
    let before = contents(&place.join("sessions"));
    says(&run(place, "whole", &["--jobs", "1"]), 0, &["16 of 16"]);
    let whole = gather(place, "whole");
    let rows = lines(&whole);
    assert_eq!(rows.len(), 16);
    assert!(rows.windows(2).all(|pair| pair[0]["id"].as_str() < pair[1]["id"].as_str()));
    assert!(rows.iter().all(|row| row["code"] == "OK"));
    for count in [2, 7, 64] {
        let out = format!("out-{count}");
        // Backwards, and the middle ones twice.
        let mut shards: Vec<usize> = (1..=count).rev().collect();
        shards.extend(count / 2..=count / 2 + 1);
        for shard in shards {
            let shard = format!("{shard}/{count}");
            says(&run(place, &out, &["--jobs", "2", "--shard", &shard]), 0, &["Shard"]);
        }
        assert_eq!(gather(place, &out), whole, "{count} shards");
    }
    assert!(contents(&place.join("sessions")) == before, "a session was changed");
}

#[test]
fn rows_hold_what_replay_says() {
    let place = sessions(4);
    let place = place.path();
    run(place, "out", &[]);
    let rows: BTreeMap<String, Value> = lines(&gather(place, "out"))
        .into_iter()
        .map(|row| (row["session"].as_str().expect("a path").to_owned(), row))
        .collect();
    for (session, row) in rows {
        let said = lines(&boresight(place, &["replay", &session, "--json"]).stdout).remove(0);
        assert_eq!(row["verdict"], said["verdict"]);
        assert_eq!(row["lens"]["f_px"], said["result"]["f_px"]);
        assert_eq!(row["lens"]["sigma"], said["result"]["sigma"]);
        assert_eq!(row["decisions"]["crc32"], said["decisions"]["crc32"]);
        assert_eq!(row["decisions"]["different"], said["decisions"]["different_count"]);
    }
}

#[test]
fn a_session_whose_result_was_replaced_is_another_item() {
    let place = sessions(1);
    let place = place.path();
    let before = plan(place);
    let result = Path::new(before[0]["session"].as_str().expect("a path")).join("calibration.json");
    let text = fs::read_to_string(&result).expect("readable");
    // As long as it was.
    let other = text.replacen("good", "care", 1);
    assert_ne!(text, other);
    fs::remove_file(&result).expect("removed");
    fs::write(&result, other).expect("written");
    assert_ne!(plan(place)[0]["content"], before[0]["content"]);
}

/// Two builds of a version may decide differently.
#[test]
fn results_of_another_build_are_not_taken_as_done() {
    let place = sessions(1);
    let place = place.path();
    says(&run(place, "out", &[]), 0, &["1 of 1"]);
    let file = place.join("out/batch.json");
    let job = fs::read_to_string(&file).expect("readable");
    let version = lines(&job.replace('\n', "")).remove(0)["version"].clone();
    let (number, build) = version.as_str().and_then(|it| it.split_once('+')).expect("a build");
    assert_eq!((number, build.len()), (env!("CARGO_PKG_VERSION"), 16));
    fs::write(&file, job.replace(build, "0123456789abcdef")).expect("written");
    says(&run(place, "out", &[]), 1, &["different batch", "0123456789abcdef", "--out"]);
}

/// Next pseudo-random number: the test is the same each time.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

fn start(place: &Path, out: &str, shard: &str) -> Child {
    let more = ["--out", out, "--shard", shard, "--jobs", "1"];
    let mut command = program(place, &[&RUN[..], &more].concat());
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("started")
}

/// Kills without warning: the program gets no chance to clean up.
fn kill(child: &mut Child) {
    let _ = child.kill();
    let _ = child.wait();
}

/// Worker processes of the process `parent`.
fn workers_of(parent: u32) -> Vec<u32> {
    let path = format!("/proc/{parent}/task/{parent}/children");
    let mut found: Vec<u32> = Vec::new();
    // Each thread has its own children.
    for task in fs::read_dir(format!("/proc/{parent}/task")).into_iter().flatten().flatten() {
        let text = fs::read_to_string(task.path().join("children")).unwrap_or_default();
        found.extend(text.split_whitespace().filter_map(|id| id.parse::<u32>().ok()));
    }
    let text = fs::read_to_string(path).unwrap_or_default();
    found.extend(text.split_whitespace().filter_map(|id| id.parse::<u32>().ok()));
    found
}

#[test]
fn killed_workers_lose_nothing_and_double_nothing() {
    let kills = number("BORESIGHT_BATCH_KILLS", 12);
    let place = sessions(number("BORESIGHT_BATCH_SESSIONS", 40));
    let place = place.path();
    let count = plan(place).len();
    run(place, "calm", &[]);
    let mut state = 20_26;
    let mut killed = 0;
    while killed < kills {
        // Two workers of one shard, and one of the other.
        let mut children =
            [start(place, "out", "1/2"), start(place, "out", "1/2"), start(place, "out", "2/2")];
        let began = Instant::now();
        let wait = Duration::from_millis(20 + next(&mut state) % 300);
        while began.elapsed() < wait {
            std::thread::yield_now();
        }
        for child in &mut children {
            if next(&mut state).is_multiple_of(3) {
                // The worker, not the process waiting for it.
                for worker in workers_of(child.id()) {
                    let _ = Command::new("kill").args(["-9", &worker.to_string()]).status();
                    killed += 1;
                }
            }
        }
        for child in &mut children {
            killed += usize::from(child.try_wait().expect("can be waited for").is_none());
            kill(child);
        }
        // When everything is done, there is nothing left to kill.
        if boresight(place, &["batch", "gather", "out"]).code == 0 {
            let items = place.join("out/items");
            let some = contents(&items).into_iter().filter(|(path, _)| path.is_file());
            for (path, _) in some.step_by(2) {
                fs::remove_file(path).expect("removed");
            }
        }
    }
    let ended = run(place, "out", &[]);
    says(&ended, 0, &[&format!("{count} of {count}")]);
    assert!(gather(place, "out") == gather(place, "calm"), "{killed} kills changed the results");
}

/// A fault as met by a batch in the field, and the code.
fn poison(folder: &Path, kind: usize) -> &'static str {
    let replace = |name: &str, change: &dyn Fn(String) -> String| {
        let path = folder.join(name);
        let text = fs::read_to_string(&path).expect("readable");
        fs::remove_file(&path).expect("removed");
        fs::write(&path, change(text)).expect("written");
    };
    match kind % 10 {
        0 => {
            replace("journal.jsonl", &|text| text.replacen("\"body\"", "\"bodx\"", 1));
            "JOURNAL-DAMAGED"
        }
        1 => {
            let newer = |text: String| text.replace("boresight.session/1", "boresight.session/9");
            replace("session.toml", &newer);
            "SESSION-NEWER"
        }
        2 => {
            replace("session.toml", &|text| text[..text.len() / 2].to_owned() + "\n[");
            "HEADER-DAMAGED"
        }
        3 => {
            fs::remove_file(folder.join("journal.jsonl")).expect("removed");
            "FILE-MISSING"
        }
        4 => {
            fs::remove_file(folder.join("journal.jsonl")).expect("removed");
            fifo(&folder.join("journal.jsonl"));
            "NOT-A-FILE"
        }
        5 => {
            fs::remove_file(folder.join("session.toml")).expect("removed");
            fifo(&folder.join("session.toml"));
            "NOT-A-FILE"
        }
        6 => {
            fs::remove_file(folder.join("journal.jsonl")).expect("removed");
            std::os::unix::fs::symlink("/dev/zero", folder.join("journal.jsonl")).expect("linked");
            "NOT-A-FILE"
        }
        7 => {
            // Two gigabytes of header, all holes.
            fs::remove_file(folder.join("session.toml")).expect("removed");
            let file = fs::File::create(folder.join("session.toml")).expect("made");
            file.set_len(2 << 30).expect("extended");
            "FILE-TOO-LARGE"
        }
        8 => {
            // A picture claiming 16,384 pixels in width and height, vouched for by the journal.
            bomb(folder);
            "PICTURE-DAMAGED"
        }
        _ => {
            // A crash leaves a cut end: everything before it is worked on.
            replace("journal.jsonl", &|text| text[..text.len() - 20].to_owned());
            "OK"
        }
    }
}

fn fifo(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status().expect("started");
    assert!(made.success());
}

/// Replaces the first stored picture by a small file that grows slightly beyond the largest allowed
/// picture.
fn bomb(folder: &Path) {
    let journal = fs::read_to_string(folder.join("journal.jsonl")).expect("readable");
    let picture = fs::read_dir(folder.join("frames"))
        .expect("listable")
        .map(|entry| entry.expect("listable").path())
        .min()
        .expect("a picture");
    let frame: u64 = picture
        .file_stem()
        .and_then(|name| name.to_str())
        .expect("a name")
        .parse()
        .expect("a number");
    let side = 20_000;
    fs::remove_file(&picture).expect("removed");
    image::GrayImage::new(side, 1).save(&picture).expect("saved");
    let crc32 = format!("{:08x}", crc32fast::hash(&fs::read(&picture).expect("readable")));
    let mut changed = String::new();
    for line in journal.lines() {
        let envelope: BTreeMap<String, Box<serde_json::value::RawValue>> =
            serde_json::from_str(line).expect("JSON");
        let body = envelope["body"].get();
        let mut value: Value = serde_json::from_str(body).expect("JSON");
        if value["stored"]["frame"] != frame {
            changed += line;
            changed.push('\n');
            continue;
        }
        let old = value["stored"]["crc32"].as_str().expect("a checksum").to_owned();
        value["stored"]["crc32"] = crc32.as_str().into();
        let body = body.replace(&old, &crc32);
        let sum = format!("{:08x}", crc32fast::hash(body.as_bytes()));
        let said = envelope["crc32"].get();
        changed += &line.replace(envelope["body"].get(), &body).replace(said, &format!("{sum:?}"));
        changed.push('\n');
    }
    fs::remove_file(folder.join("journal.jsonl")).expect("removed");
    fs::write(folder.join("journal.jsonl"), changed).expect("written");
}

#[test]
fn poison_becomes_rows() {
    let count = number("BORESIGHT_BATCH_SESSIONS", 60);
    let place = sessions(count);
    let place = place.path();
    let poisoned = if count >= 200 { count / 20 } else { 10 };
    let mut codes = BTreeMap::new();
    for (kind, planned) in plan(place).into_iter().step_by(count / poisoned).enumerate() {
        let session = planned["session"].as_str().expect("a path").to_owned();
        codes.insert(session.clone(), poison(Path::new(&session), kind));
    }
    // The manifest is written after the damage; later damage has its own code.
    assert_eq!(plan(place).len(), count);
    let action = ["batch", "run", "manifest.jsonl", "--action", "redetect", "--out", "out"];
    let began = Instant::now();
    let ended = boresight(place, &[&action[..], &["--budget", "60s"]].concat());
    println!(
        "{count} sessions, {poisoned} of them poisoned: {:.1} s",
        began.elapsed().as_secs_f64()
    );
    says(&ended, 0, &[&format!("{count} of {count}"), "couldn't be worked on"]);
    let rows = lines(&gather(place, "out"));
    assert_eq!(rows.len(), count);
    for row in rows {
        let session = row["session"].as_str().expect("a path");
        let code = codes.get(session).copied().unwrap_or("OK");
        assert_eq!(row["code"], code, "{row}");
        assert_eq!(row["message"].is_null(), code == "OK", "{row}");
    }
}

#[test]
fn a_session_that_takes_too_long_is_a_row_and_the_others_go_on() {
    let place = sessions(8);
    let place = place.path();
    let ended = run(place, "out", &["--budget", "0.000001s", "--jobs", "2"]);
    says(&ended, 0, &["8 of 8", "TIME-BUDGET"]);
    let rows = lines(&gather(place, "out"));
    assert!(rows.iter().any(|row| row["code"] == "TIME-BUDGET"));
    // Left alone until requested.
    says(&run(place, "out", &[]), 0, &["8 had one before"]);
    says(&run(place, "out", &["--again"]), 0, &["8 of 8"]);
    run(place, "calm", &[]);
    assert_eq!(gather(place, "out"), gather(place, "calm"));
}

#[test]
fn a_changed_limit_gives_a_table_of_what_differs() {
    let place = sessions(8);
    let place = place.path();
    says(&run(place, "out", &["--set", "guidance.hold_secs=0.5"]), 0, &["8 of 8"]);
    let ended = boresight(place, &["batch", "gather", "out", "--changes"]);
    says(&ended, 0, &[]);
    assert!(ended.stdout.contains("Decisions that differ: "), "{}", ended.stdout);
    assert!(ended.stdout.contains("accepted -> "), "{}", ended.stdout);
    assert!(ended.stdout.contains("Verdicts that differ: "), "{}", ended.stdout);
    let json = boresight(place, &["batch", "gather", "out", "--changes", "--json"]);
    let changes = lines(&json.stdout).remove(0);
    let different: u64 = changes["different"].as_u64().expect("a number");
    let rows = lines(&gather(place, "out"));
    let counted: u64 = rows.iter().filter_map(|row| row["decisions"]["different"].as_u64()).sum();
    assert_eq!(different, counted);
    // Another question needs another folder.
    let other = run(place, "out", &["--set", "guidance.hold_secs=0.4"]);
    says(&other, 1, &["a different batch", "hold_secs=0.5", "--out"]);
}

#[test]
fn what_is_missing_is_named() {
    let place = sessions(6);
    let place = place.path();
    says(&run(place, "out", &["--shard", "1/3"]), 0, &["2 of 2", "Shard 1 of 3"]);
    let ended = boresight(place, &["batch", "gather", "out"]);
    says(&ended, 1, &["4 sessions have no result", "run` again"]);
    assert_eq!(ended.stdout.lines().count(), 2);
    // A session changed after the plan is not mistaken for the planned one.
    let changed = place.join("sessions/01/00001");
    let header = fs::read_to_string(changed.join("session.toml")).expect("readable");
    fs::remove_file(changed.join("session.toml")).expect("removed");
    fs::write(changed.join("session.toml"), header + "\n").expect("written");
    run(place, "out", &[]);
    let rows = lines(&gather(place, "out"));
    let row = rows.iter().find(|row| row["session"] == changed.to_str().expect("a path"));
    let row = row.expect("a row");
    assert_eq!((&row["code"], row["next"].is_string()), (&"SESSION-CHANGED".into(), true));
}

#[test]
fn schedulers_say_which_shard_it_is() {
    let place = sessions(4);
    let place = place.path();
    let as_in = |variables: &[(&str, &str)]| {
        let mut command = program(place, &[&RUN[..], &["--out", "out"]].concat());
        command.envs(variables.iter().copied());
        let output = command.output().expect("started");
        let code = output.status.code().expect("not killed");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        Ended { code, stdout: text(output.stdout), stderr: text(output.stderr) }
    };
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "2"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
        ("SLURM_ARRAY_TASK_MIN", "1"),
        ("SLURM_ARRAY_TASK_MAX", "2"),
    ];
    says(&as_in(&slurm), 0, &["Shard 2 of 2", "2 of 2"]);
    says(&as_in(&[("JOB_COMPLETION_INDEX", "0")]), 1, &["BORESIGHT_SHARDS"]);
    let kubernetes = [("JOB_COMPLETION_INDEX", "0"), ("BORESIGHT_SHARDS", "2")];
    says(&as_in(&kubernetes), 0, &["Shard 1 of 2", "2 of 2"]);
    assert_eq!(lines(&gather(place, "out")).len(), 4);
}

#[test]
fn every_action_leaves_rows_and_files() {
    let place = sessions(4);
    let place = place.path();
    let act = |action: &str, more: &[&str]| {
        let out = format!("out-{action}");
        let run = ["batch", "run", "manifest.jsonl", "--action", action, "--out", &out];
        says(&boresight(place, &[&run[..], more].concat()), 0, &["4 of 4"]);
        (lines(&gather(place, &out)), place.join(out))
    };
    let (rows, _) = act("calibrate", &[]);
    for row in &rows {
        // A checking session has no result. The first versions called a lens of two focal lengths
        // untrustworthy, where this one asks for care.
        let recorded = &row["recorded_verdict"];
        let expected = match row["session"].as_str() {
            Some(session) if session.ends_with("00002") => "care",
            _ => recorded.as_str().unwrap_or_default(),
        };
        assert!(recorded.is_null() || row["verdict"] == expected, "{row}");
    }
    assert!(rows.iter().filter(|row| !row["recorded_verdict"].is_null()).count() >= 3);
    let old = recording("good/calibration.json").display().to_string();
    let (rows, _) = act("check", &["--against", &old]);
    let changed = rows
        .iter()
        .find(|row| row["session"].as_str().is_some_and(|session| session.ends_with("00003")));
    assert_eq!(changed.expect("a row")["check"]["verdict"], "recalibrate");
    let (rows, out) = act("report", &[]);
    for row in &rows {
        let page = out.join(row["file"].as_str().expect("a file"));
        assert!(fs::read_to_string(page).expect("readable").starts_with("<!DOCTYPE html>"));
    }
    let (rows, out) = act("export", &["--format", "ros-yaml"]);
    let written = rows.iter().filter_map(|row| row["file"].as_str());
    assert!(written.clone().count() >= 3);
    for file in written {
        assert!(fs::read_to_string(out.join(file)).expect("readable").contains("camera_matrix"));
    }
}

/// Printed with `--nocapture`; run it in a release build on an idle machine.
#[test]
fn a_done_item_costs_little_and_metrics_count() {
    let place = sessions(number("BORESIGHT_BATCH_SESSIONS", 40));
    let place = place.path();
    let count = plan(place).len();
    let began = Instant::now();
    run(place, "out", &["--jobs", "1"]);
    let first = began.elapsed();
    let began = Instant::now();
    says(&run(place, "out", &["--jobs", "1", "--metrics", "run.prom"]), 0, &["had one before"]);
    let again = began.elapsed();
    let none = Instant::now();
    boresight(place, &["--version"]);
    let each = again.saturating_sub(none.elapsed()).as_secs_f64() * 1e3 / count as f64;
    println!("{count} sessions: {:.2} s, then {each:.3} ms for each done one", first.as_secs_f64());
    assert!(again < first);
    let metrics = fs::read_to_string(place.join("run.prom")).expect("written");
    let there = format!("boresight_batch_items_there{{file=\"run\",action=\"replay\"}} {count}\n");
    assert!(metrics.contains(&there), "{metrics}");
}

#[test]
fn programs_follow_a_run_and_are_told_of_its_end() {
    let place = sessions(4);
    let place = place.path();
    poison(&place.join("sessions/00/00000"), 3);
    plan(place);
    let told = "echo $BORESIGHT_VERDICT $BORESIGHT_OUT > told";
    let ended = run(place, "out", &["--log", "json", "--on-finish", told]);
    assert_eq!(ended.code, 0, "{}", ended.stderr);
    let events = lines(&ended.stderr);
    let of = |name: &str| events.iter().filter(|event| event["event"] == name).count();
    assert_eq!((of("begin"), of("row"), of("end")), (1, 4, 1), "{}", ended.stderr);
    assert!(events.iter().all(|event| event["time"].is_string()));
    let end = events.last().expect("an end");
    assert_eq!((&end["verdict"], &end["rows"]["FILE-MISSING"]), (&"failed".into(), &1.into()));
    assert_eq!(fs::read_to_string(place.join("told")).expect("told"), "failed out\n");
    // A failure is reported, and changes nothing about the run.
    says(&run(place, "out", &["--on-finish", "exit 7"]), 0, &["--on-finish failed", "exit 7"]);
}

#[cfg(feature = "parquet")]
#[test]
fn the_table_in_parquet_holds_the_same_rows() {
    use parquet::{
        file::reader::{FileReader, SerializedFileReader},
        record::Field,
    };

    let place = sessions(5);
    let place = place.path();
    poison(&place.join("sessions/04/00004"), 3);
    plan(place);
    run(place, "out", &[]);
    let rows = lines(&gather(place, "out"));
    let parquet = ["batch", "gather", "out", "--parquet", "t.parquet"];
    says(&boresight(place, &parquet), 0, &["Written: t.parquet"]);
    says(&boresight(place, &parquet), 1, &["--force"]);
    says(&boresight(place, &[&parquet[..], &["--force"]].concat()), 0, &["Written: t.parquet"]);
    let file = fs::File::open(place.join("t.parquet")).expect("there");
    let reader = SerializedFileReader::new(file).expect("Parquet");
    let stored: Vec<_> =
        reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
    assert_eq!(stored.len(), rows.len());
    for (stored, row) in stored.iter().zip(&rows) {
        let column = |name: &str| {
            stored.get_column_iter().find(|(own, _)| *own == name).map(|(_, field)| field.clone())
        };
        let text = |value: &Value| value.as_str().map_or(Field::Null, |s| Field::Str(s.into()));
        let number = |value: &Value| value.as_f64().map_or(Field::Null, Field::Double);
        for name in ["id", "session", "code", "message", "verdict", "source", "model"] {
            assert_eq!(column(name), Some(text(&row[name])), "{name}");
        }
        let lens = &row["lens"];
        for (name, value) in [
            ("fx_px", &lens["f_px"][0]),
            ("cy_px", &lens["pp_px"][1]),
            ("cy_sd_px", &lens["sigma"]["pp_px"][1]),
            ("k1", &lens["distortion"]["k1"]),
            ("rms_px", &lens["rms_px"]),
        ] {
            assert_eq!(column(name), Some(number(value)), "{name}");
        }
        let created = row["created"].as_str().map(|created| {
            let created: jiff::Timestamp = created.parse().expect("a time");
            Field::TimestampMillis(created.as_millisecond())
        });
        assert_eq!(column("created"), Some(created.unwrap_or(Field::Null)));
    }
    assert_eq!(rows.iter().filter(|row| row["code"] != "OK").count(), 1);
}

#[cfg(not(feature = "parquet"))]
#[test]
fn a_build_without_parquet_says_so() {
    let place = sessions(1);
    run(place.path(), "out", &[]);
    let parquet = ["batch", "gather", "out", "--parquet", "t.parquet"];
    says(&boresight(place.path(), &parquet), 2, &["no tables in Parquet", "--features parquet"]);
}

#[cfg(not(feature = "cloud"))]
#[test]
fn a_build_without_object_stores_says_so() {
    let place = sessions(1);
    let place = place.path();
    let said = ["no object stores", "--features cloud"];
    says(&boresight(place, &["batch", "plan", "s3://fleet"]), 2, &said);
    says(&boresight(place, &["batch", "gather", "s3://fleet/out"]), 2, &said);
    says(&run(place, "s3://fleet/out", &[]), 2, &said);
    let item = r#"{"session":"s3://fleet/a","content":"00","bytes":1}"#;
    fs::write(place.join("manifest.jsonl"), format!("{item}\n")).expect("written");
    says(&run(place, "out", &[]), 2, &said);
}

#[cfg(feature = "cloud")]
#[test]
fn an_object_store_that_cannot_be_used_is_told_apart() {
    let place = sessions(1);
    let plan = |address: &str, variables: &[(&str, &str)]| {
        let mut command = program(place.path(), &["batch", "plan", address]);
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("AWS_")) {
            command.env_remove(name);
        }
        let output = command.envs(variables.iter().copied()).output().expect("started");
        let text = |bytes| String::from_utf8(bytes).expect("text");
        let code = output.status.code().expect("not killed");
        Ended { code, stdout: text(output.stdout), stderr: text(output.stderr) }
    };
    for wrong in ["s3://", "s3://fleet//a", "s3://fleet/../a"] {
        says(&plan(wrong, &[]), 1, &["s3://BUCKET/PREFIX"]);
    }
    let nobody = ("AWS_ENDPOINT_URL", "http://127.0.0.1:9");
    says(&plan("s3://fleet", &[nobody]), 1, &["no TLS", "AWS_ALLOW_HTTP"]);
    let roles = ("AWS_METADATA_ENDPOINT", "http://127.0.0.1:9");
    let said = ["no credentials", "AWS_ACCESS_KEY_ID"];
    says(&plan("s3://fleet", &[nobody, roles, ("AWS_ALLOW_HTTP", "true")]), 1, &said);
}

#[test]
fn nonsense_is_refused_with_what_to_do() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    says(&boresight(place, &["batch", "plan", "nowhere"]), 1, &["nowhere"]);
    says(&boresight(place, &["batch", "plan", "."]), 1, &["no session"]);
    fs::write(place.join("manifest.jsonl"), "{}\n").expect("written");
    says(&run(place, "out", &[]), 1, &["line 1", "manifest.jsonl"]);
    assert!(!place.join("out").exists());
    says(&run(place, "out", &["--shard", "0/4"]), 2, &["from 1 to N"]);
    says(&run(place, "out", &["--against", "x"]), 1, &["--action check"]);
    says(&run(place, "out", &["--set", "guidance.nonsense=1"]), 2, &["nonsense"]);
    says(&boresight(place, &["batch", "gather", "out"]), 1, &["batch.json", "nothing is there"]);
}
