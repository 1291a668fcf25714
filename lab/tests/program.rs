//! The program: it continues where it stopped and overwrites nothing.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{fs, path::Path, process::Command};

use serde_json::Value;
use tempfile::TempDir;

struct Ended {
    code: i32,
    stdout: String,
    stderr: String,
}

fn run(folder: &Path, arguments: &[&str]) -> Ended {
    let mut program = Command::new(env!("CARGO_BIN_EXE_boresight-study"));
    let output = program.current_dir(folder).args(arguments).output().expect("it runs");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    Ended {
        code: output.status.code().expect("it ends by itself"),
        stdout: text(output.stdout),
        stderr: text(output.stderr),
    }
}

#[test]
fn a_study_goes_on_where_it_stopped_and_overwrites_nothing() {
    let folder = TempDir::new().expect("folder");
    let study = |more: &[&str]| {
        let mut arguments = vec!["directionality", "--out", "out"];
        arguments.extend(more);
        run(folder.path(), &arguments)
    };
    let first = study(&["--json"]);
    assert_eq!(first.code, 0, "{}", first.stderr);
    let report: Value = serde_json::from_str(&first.stdout).expect("JSON");
    assert_eq!(report["reproduced"], report["known"]);
    let page = folder.path().join("out/index.html");
    let before = fs::read_to_string(&page).expect("a page");
    assert!(before.contains("Directionality") && before.contains("<svg"));
    let table = fs::read_to_string(folder.path().join("out/directionality.csv")).expect("a table");
    assert!(table.starts_with("direction_deg,shift_m,offset_px,angle_deg\n"));
    // Again: equal; another experiment joins the page; other parameters have no place here.
    assert_eq!(study(&[]).code, 0);
    assert_eq!(fs::read_to_string(&page).expect("a page"), before);
    let second = run(folder.path(), &["pairs", "--out", "out"]);
    assert_eq!(second.code, 0, "{}", second.stderr);
    let both = fs::read_to_string(&page).expect("a page");
    assert!(both.contains("Directionality") && both.contains("Opposed pairs"));
    let refused = study(&["--seed", "7"]);
    assert_eq!(refused.code, 1);
    assert!(refused.stderr.contains("--out"), "{}", refused.stderr);
    assert_eq!(fs::read_to_string(&page).expect("a page"), both);
    // A folder with something else in it, and a file that is no parameter file.
    fs::create_dir(folder.path().join("mine")).expect("made");
    fs::write(folder.path().join("mine/letter.txt"), "dear").expect("written");
    assert_eq!(run(folder.path(), &["pairs", "--out", "mine"]).code, 1);
    fs::write(folder.path().join("wrong.toml"), "sed = 1\n").expect("written");
    let wrong = study(&["--params", "wrong.toml"]);
    assert_eq!(wrong.code, 1);
    assert!(wrong.stderr.contains("sed"), "{}", wrong.stderr);
    // What --print-params prints is a parameter file.
    let printed = run(folder.path(), &["--print-params"]);
    fs::write(folder.path().join("params.toml"), &printed.stdout).expect("written");
    assert_eq!(study(&["--params", "params.toml"]).code, 0);
}
