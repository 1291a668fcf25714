//! Accepted views are a recorded fact, independent of other builds' decisions.

use std::{fs, path::Path};

use boresight::{
    app::SavedSession,
    config::Config,
    files::{Overwrite, save},
    recording::{Header, SessionFolder},
    session::{Command, Input, Session},
};
use tempfile::TempDir;

use crate::{
    person::{boresight, says},
    world::{SIZE, guided},
};

/// Records a guided session at `path`, with the last view removed and restored; returns the last
/// state.
fn recorded(path: &Path) -> Session {
    let header = Header::new("sim", SIZE, Config::load(None, &[]).expect("defaults"));
    let mut folder = SessionFolder::create(path, &header).expect("created");
    let (_, mut session, _) = guided(3, |input, decision| {
        folder.journal_mut().append(input, decision, None, false).expect("appended");
    });
    // Three views are left.
    let undone = session.accepted().len() - 2;
    let commands = std::iter::repeat_n(Command::UndoLast, undone).chain([Command::Restore]);
    for command in commands {
        let input = Input::Command(command);
        let decision = session.handle(&input);
        folder.journal_mut().append(&input, &decision, None, false).expect("appended");
    }
    session
}

/// Changes the limits in `session.toml`, to make the build decide like another version: it would
/// accept none of the recorded views.
fn make_another_build(path: &Path) {
    let file = path.join("session.toml");
    let text = fs::read_to_string(&file).expect("readable");
    let changed = text
        .replace("hold_secs = 0.3", "hold_secs = 9.0")
        .replace("target_tilt_deg = 40.0", "target_tilt_deg = 64.5");
    assert_ne!(changed, text, "{text}");
    fs::write(&file, changed).expect("written");
    // As in recordings before the checksum of `session.toml`.
    let journal = path.join("journal.jsonl");
    let text = fs::read_to_string(&journal).expect("readable");
    fs::write(&journal, crate::files::without_checksum(&text)).expect("written");
}

fn views(session: &Session) -> Vec<(u32, u64)> {
    session.accepted().iter().map(|view| (view.number.0, view.view.frame_id.0)).collect()
}

#[test]
fn a_session_that_this_build_decides_alike_is_not_restored() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let live = recorded(&path);
    let saved = SavedSession::open(&path).expect("whole");
    assert_eq!((saved.restored, saved.replayed.different_lines.len()), (false, 0));
    assert_eq!(views(&saved.session), views(&live));
}

#[test]
fn a_moving_boards_corners_are_those_of_its_calibration() {
    let place = TempDir::new().expect("folder");
    let scene =
        "name = \"rolling\"\nseed = 3\nf_px = 520\nimage_size_px = [640, 480]\nreadout_ms = 25\n";
    fs::write(place.path().join("rolling.toml"), scene).expect("written");
    let guide = ["guide", "--headless", "--source", "sim:rolling.toml", "--out", "session"];
    boresight(place.path(), &[&guide[..], &["--set", "guidance.plan=quick"]].concat());
    let path = place.path().join("session");
    let live = SavedSession::open(&path).expect("whole").session;
    let found = live.calibration().expect("calibrated");
    // The board moved while the rows were read: the seen corners aren't those of a single instant.
    let seen = live.accepted().iter().flat_map(|view| &view.seen);
    let moved = seen.zip(live.corners_at_one_instant().iter().flatten());
    let farthest_px = moved.map(|(seen, moved)| (seen.px - moved.px).norm()).fold(0.0, f64::max);
    assert!(farthest_px > 0.05, "{farthest_px} px");
    let again = boresight(place.path(), &["calibrate", "session", "--json"]);
    let again: serde_json::Value = serde_json::from_str(&again.stdout).expect("JSON");
    let number = |name: &str| again.pointer(name).and_then(serde_json::Value::as_f64).expect("one");
    for (name, live) in [
        ("/result/f_px/0", found.camera.f_px.x),
        ("/result/pp_px/1", found.camera.pp_px.y),
        ("/result/rms_px", found.rms_px),
    ] {
        assert!((number(name) / live - 1.0).abs() < 1e-9, "{name}: {} {live}", number(name));
    }
    boresight(place.path(), &["report", "session"]);
    let page = fs::read_to_string(path.join("report.html")).expect("written");
    let (before, _) = page.split_once(" px RMS; rings").expect("the cloud of residuals");
    let drawn_px: f64 = before.rsplit(' ').next().and_then(|n| n.parse().ok()).expect("a number");
    assert!((drawn_px / found.rms_px - 1.0).abs() < 0.1, "{drawn_px} px drawn of {}", found.rms_px);
}

#[test]
fn recorded_views_stand_where_this_build_decides_otherwise() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let live = recorded(&path);
    assert!(live.accepted().len() >= 3, "{} views", live.accepted().len());
    make_another_build(&path);
    let saved = SavedSession::open(&path).expect("whole");
    assert!(saved.restored && !saved.replayed.different_lines.is_empty());
    assert_eq!(views(&saved.session), views(&live));
    let roles = |session: &Session| -> Vec<_> {
        session.accepted().iter().map(|view| (view.role, view.view.partner_frame)).collect()
    };
    assert_eq!(roles(&saved.session), roles(&live));
    let camera = |session: &Session| session.calibration().expect("calibrated").camera;
    // The motion of a rolling shutter is unknown in single pictures: less than their error.
    let (restored_px, live_px) = (camera(&saved.session).pp_px, camera(&live).pp_px);
    assert!((restored_px - live_px).norm() < 0.05, "{restored_px} {live_px}");
    // The view removed last comes back first.
    let restored =
        |session: &mut Session| session.handle(&Input::Command(Command::Restore)).outcome;
    assert_eq!(restored(&mut saved.session.clone()), restored(&mut live.clone()));
}

#[test]
fn the_program_reports_and_exports_the_recorded_views() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let live = recorded(&path);
    make_another_build(&path);
    let exported =
        boresight(place.path(), &["export", "session", "--format", "vnl", "--out", "corners.vnl"]);
    says(&exported, 0, &["This version would decide differently"]);
    let table = fs::read_to_string(place.path().join("corners.vnl")).expect("written");
    for view in live.accepted() {
        let name = view.picture_name();
        let lines = table.lines().filter(|line| line.starts_with(&name)).count();
        assert_eq!(lines, 54, "{name}");
    }
    let reported = boresight(place.path(), &["report", "session"]);
    // Three views are too few.
    says(&reported, 3, &["This version would decide differently", "Unfinished"]);
    let page = fs::read_to_string(path.join("report.html")).expect("written");
    assert!(page.contains(&live.accepted()[0].picture_name()), "no first view in the report");
}

#[test]
fn a_result_is_as_readable_as_the_umask_lets_it() {
    let place = TempDir::new().expect("folder");
    let (ordinary, saved) = (place.path().join("ordinary"), place.path().join("saved"));
    fs::write(&ordinary, "by the umask").expect("written");
    save(&saved, b"by the program", Overwrite::Never).expect("written");
    let mode = |path: &Path| {
        std::os::unix::fs::PermissionsExt::mode(&fs::metadata(path).expect("there").permissions())
    };
    assert_eq!(format!("{:o}", mode(&saved)), format!("{:o}", mode(&ordinary)));
}
