//! `boresight target`: its output, its words and its restraint.

use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::person::{boresight, contents, says};

#[test]
fn the_command_writes_and_says_what_to_do() {
    let folder = TempDir::new().expect("folder");
    let target = |arguments: &[&str]| boresight(folder.path(), &[&["target"], arguments].concat());
    let says = |arguments: &[&str], code: i32, words: &[&str]| {
        says(&target(arguments), code, words);
    };
    let written = |name: &str| fs::read(folder.path().join(name)).expect("written");
    says(
        &["--board", "9x6", "--square", "25mm", "--out", "board.pdf"],
        0,
        &[
            "100 %",
            "100 mm",
            "250 mm",
            "straight edge",
            "Calibrate: boresight guide. The code in the margin",
            "--board 9x6 --square 25mm",
            "6.1 mm",
        ],
    );
    assert!(written("board.pdf").starts_with(b"%PDF-"));
    let before = contents(folder.path());
    says(&["--board", "7x5", "--out", "board.pdf"], 1, &["board.pdf", "--force"]);
    says(&["--board", "7x5", "--out", "board.jpg"], 2, &["board.jpg"]);
    assert_eq!(contents(folder.path()), before, "nothing is touched");
    says(&["--board", "7x5", "--out", "board.pdf", "--force"], 0, &["--board 7x5 --square 23mm"]);
    assert_ne!(contents(folder.path()), before);
    says(&[], 0, &["checkerboard-9x6-20mm.pdf", "--square 20mm"]);
    assert!(written("checkerboard-9x6-20mm.pdf").starts_with(b"%PDF-"));
    let charuco = ["--board", "charuco:8x11:DICT_4X4_50", "--square", "20mm"];
    says(&charuco, 0, &["charuco-8x11-20mm-DICT_4X4_50.pdf"]);
    says(&["--kind", "charuco"], 0, &["charuco-8x11-21mm-DICT_4X4_50.pdf", "--board charuco:8x11"]);
    says(&["--kind", "charuco", "--board", "9x6"], 2, &["--kind", "--board"]);
    says(&["--board", "charuco:12x12:DICT_4X4_50"], 2, &["72 markers", "only 50"]);
    says(&["--out", "board.svg", "--paper", "letter"], 0, &[]);
    assert!(written("board.svg").starts_with(b"<svg"));
    says(&["--paper", "A3", "--out", "board.PNG", "--dpi", "72"], 0, &[]);
    assert!(written("board.PNG").starts_with(b"\x89PNG"));
    says(&["--paper", "screen"], 1, &["--dpi"]);
    let screen = ["--paper", "screen", "--dpi", "92", "--square", "25mm", "--pixels", "1280x800"];
    says(&screen, 0, &["25.124 mm instead of 25 mm", "checkerboard-9x6-25.124mm.png"]);
    says(&["--square", "40mm"], 1, &["25 mm", "doesn't fit"]);
    says(&["--square", "30mm"], 1, &["25 mm", "A3"]);
    says(&["--out", "board.jpg"], 2, &["board.jpg", ".pdf", ".svg", ".png"]);
    says(&["--out", "board"], 2, &[".pdf"]);
    says(&["--dpi", "1e9"], 2, &["20 to 1200"]);
    // A square in the settings counts as asked for.
    fs::write(folder.path().join("mine.toml"), "[board]\nsquare_mm = 22\n").expect("written");
    says(&["--config", "mine.toml"], 0, &["checkerboard-9x6-22mm.pdf"]);
    says(&["--set", "board.square_mm=23"], 0, &["checkerboard-9x6-23mm.pdf"]);
    let ended = target(&["--json", "--out", "j.svg"]);
    let report: Value = serde_json::from_str(&ended.stdout).expect("JSON");
    assert_eq!(report["schema"], "boresight.target/1");
    assert_eq!((&report["board"]["square_mm"], &report["ruler_mm"]), (&20.0.into(), &100.0.into()));
}

#[test]
fn a_printed_board_names_itself() {
    let folder = TempDir::new().expect("folder");
    let run = |arguments: &[&str]| boresight(folder.path(), arguments);
    let print = [
        "target",
        "--board",
        "7x5",
        "--id",
        "k7q2",
        "--out",
        "board.png",
        "--dpi",
        "100",
        "--json",
    ];
    let printed = run(&print);
    says(&printed, 0, &["Board ID K7Q2"]);
    let report: Value = serde_json::from_str(&printed.stdout).expect("JSON");
    assert_eq!((&report["id"], &report["board"]["square_mm"]), (&"K7Q2".into(), &23.0.into()));
    // As through a lens.
    let seen = |name: &str, to: &str| {
        let picture = image::open(folder.path().join(name)).expect("a picture").into_luma8();
        fs::create_dir_all(folder.path().join(to)).expect("made");
        let mut picture = image::imageops::blur(&picture, 0.8);
        picture.iter_mut().for_each(|level| *level = 30 + *level / 5 * 3);
        picture.save(folder.path().join(to).join("0.png")).expect("saved");
    };
    seen("board.png", "seen");
    let detected = run(&["detect", "seen/0.png"]);
    says(&detected, 0, &["Board from its code: 7x5, 23 mm, ID K7Q2"]);
    assert_eq!(detected.stdout.lines().filter(|line| !line.starts_with('#')).count(), 35);
    // The print was measured; the command line wins.
    let measured = ["--set", "boards.K7Q2.square_mm=23.05", "--json"];
    let board = |arguments: &[&str]| -> Value {
        let ended = run(&[&["calibrate", "seen/0.png"], arguments].concat());
        serde_json::from_str::<Value>(&ended.stdout).expect("JSON")["board"].clone()
    };
    assert_eq!(board(&measured)["square_mm"], 23.05);
    assert_eq!(board(&[&measured[..], &["--square", "24mm"]].concat())["square_mm"], 24.0);
    assert_eq!(board(&["--json"])["columns"], 7);
    assert_eq!(board(&["--json", "--board", "9x6"])["columns"], 9);
    // A code beside the named board gives the size of its squares; beside another one, nothing.
    assert_eq!(board(&["--json", "--board", "7x5"])["square_mm"], 23.0);
    assert_eq!(board(&["--json", "--board", "9x6"])["square_mm"], 25.0);
    assert_eq!(board(&["--json", "--square", "24mm"])["columns"], 7);
    let guide = ["guide", "--headless", "--source", "seen", "--out", "session"];
    says(&run(&guide), 3, &["Board from its code: 7x5, 23 mm, ID K7Q2", "calibration.json"]);
    let header = fs::read_to_string(folder.path().join("session/session.toml")).expect("readable");
    assert!(header.contains("columns = 7") && header.contains("board_id = \"K7Q2\""), "{header}");
    // Without a code nothing changes.
    says(&run(&["target", "--no-code", "--out", "plain.png", "--dpi", "100"]), 0, &["plain.png"]);
    seen("plain.png", "plain");
    let plain = run(&["detect", "plain/0.png"]);
    says(&plain, 0, &[]);
    assert!(!plain.stderr.contains("code"), "{}", plain.stderr);
    assert_eq!(plain.stdout.lines().filter(|line| !line.starts_with('#')).count(), 54);
    says(&run(&["target", "--id", "K-Q2"]), 2, &["K7Q2"]);
}
