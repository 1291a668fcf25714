//! Contents of a bug report: enough to repeat the session, and nothing private.

use std::{fs, path::Path, process::Command};

use tempfile::TempDir;

use crate::person::{boresight, contents, ended, program, says};

fn unpacked(archive: &Path, to: &Path) {
    let tar = Command::new("tar").arg("-xf").arg(archive).current_dir(to).status();
    assert!(tar.expect("tar runs").success());
}

#[test]
fn a_bundle_repeats_the_session_and_hides_whose_it_is() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let frames = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/recordings/v1/good/frames");
    fs::create_dir(place.join("mill-hall")).expect("made");
    for entry in fs::read_dir(frames).expect("listable") {
        let from = entry.expect("listable").path();
        let name = format!("mill-{}", from.file_name().expect("a name").to_string_lossy());
        fs::copy(&from, place.join("mill-hall").join(name)).expect("copied");
    }
    let source = place.join("mill-hall").display().to_string();
    let guide = ["guide", "--headless", "--board", "7x5", "--square", "30mm", "--out", "session"];
    let more = ["--source", &source, "--config", "site.toml"];
    let texts = "[certificate]\ncustomer = \"Mill Ltd\"\nsite = \"Mill hall\"\n\
        [camera]\ntopic = \"/mill/image\"\n\
        [boards.mill-1]\nsquare_mm = 30.0\nmeasured_with = \"Mill caliper\"\n";
    fs::write(place.join("site.toml"), texts).expect("written");
    let taken = boresight(place, &[&guide[..], &more].concat());
    assert!(taken.stderr.contains("Taken: view 4"), "{}", taken.stderr);
    let before = contents(&place.join("session"));

    let mut doctor = program(place, &["doctor", "session", "--bundle", "report.tar"]);
    doctor.env("HOME", place);
    says(
        &ended(doctor),
        0,
        &["Written: report.tar", "session/journal.jsonl", "Left out: pictures"],
    );
    assert_eq!(contents(&place.join("session")), before, "only read");
    says(&boresight(place, &["doctor", "--bundle", "report.tar"]), 1, &["already", "report.tar"]);

    unpacked(&place.join("report.tar"), place);
    let bundle = place.join("boresight-bundle");
    let names = ["about.txt", "devices.json", "doctor.json", "session/calibration.json"];
    assert!(names.iter().all(|name| bundle.join(name).is_file()));
    for (path, bytes) in contents(&bundle) {
        let text = String::from_utf8(bytes).expect("text");
        for secret in ["Mill", "mill", &place.display().to_string()] {
            assert!(!text.contains(secret), "{secret} in {}", path.display());
        }
    }
    let about = fs::read_to_string(bundle.join("about.txt")).expect("readable");
    assert!(
        about.starts_with(&format!("boresight {}\nbuild: ", env!("CARGO_PKG_VERSION"))),
        "{about}"
    );

    // The same decisions follow, to the same views.
    let views = |ended: &crate::person::Ended| {
        let line = ended.stderr.lines().find(|line| line.contains("journal lines"));
        let line = line.expect("counts").split(", ").map(str::to_owned).collect::<Vec<_>>();
        (line[0].clone(), line[2].clone())
    };
    let whole = boresight(place, &["doctor", "session"]);
    let copy = boresight(place, &["doctor", "boresight-bundle/session"]);
    says(&copy, 0, &["No damage found."]);
    assert_eq!(views(&copy), views(&whole));
}

#[test]
fn a_session_that_cannot_be_read_is_reported_too() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    says(
        &boresight(place, &["doctor", "nowhere", "--bundle", "report.tar"]),
        0,
        &["session-error.txt"],
    );
    unpacked(&place.join("report.tar"), place);
    let said = fs::read_to_string(place.join("boresight-bundle/session-error.txt")).expect("there");
    assert!(said.contains("session.toml"), "{said}");
    says(&boresight(place, &["doctor"]), 2, &["SESSION"]);
}
