//! Conditions for a release: one version, and nothing of an older installation is lost.

use std::{fs, path::Path};

use tempfile::TempDir;

use crate::person::{boresight, program, says};

fn file(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).expect(name)
}

#[test]
fn every_file_with_a_version_has_this_one() {
    let version = env!("CARGO_PKG_VERSION");
    let own = format!("version = \"{version}\"");
    for name in ["python/Cargo.toml", "python/pyproject.toml"] {
        assert!(file(name).lines().any(|line| line == own), "{name}");
    }
    assert!(file("CITATION.cff").contains(&format!("\nversion: {version}\n")));
    assert!(
        file("examples/fleet/kubernetes.yaml").contains(&format!("image: boresight:{version}\n"))
    );
    assert!(file("CHANGELOG.md").contains(&format!("\n## [{version}]")));
    let manifest = file("Cargo.toml");
    let crates = manifest.lines().filter(|line| {
        (line.contains("path = \"crates/") || line.contains("path = \"wings/"))
            && line.contains("version =")
    });
    let mut count = 0;
    for line in crates {
        assert!(line.contains(&own), "{line}");
        count += 1;
    }
    assert!(count > 10, "{count} crates");
}

/// Files of an older version: a session, and the window's memory.
#[test]
fn an_older_installations_sessions_and_settings_are_kept() {
    let place = TempDir::new().expect("folder");
    let place = place.path();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let sessions = place.join("sessions");
    fs::create_dir(&sessions).expect("made");
    let copied = std::process::Command::new("cp")
        .args([
            "-r".as_ref(),
            fixtures.join("recordings/v1/good").as_os_str(),
            sessions.as_os_str(),
        ])
        .status();
    assert!(copied.expect("cp runs").success());
    let journal = fs::read(sessions.join("good/journal.jsonl")).expect("readable");

    says(&boresight(place, &["doctor", "sessions/good"]), 0, &["No damage found."]);
    says(&boresight(place, &["report", "sessions/good"]), 0, &[]);
    says(&boresight(place, &["history", "add", "sessions"]), 0, &["1 of 1"]);
    assert_eq!(fs::read(sessions.join("good/journal.jsonl")).expect("there"), journal);

    // `paths` names the file that the window has always used.
    let mut paths = program(place, &["paths"]);
    paths.env("XDG_CONFIG_HOME", place.join("config")).env_remove("APPDATA");
    let paths = crate::person::ended(paths);
    says(&paths, 0, &[]);
    assert!(
        paths.stdout.contains(&place.join("config/boresight/window.toml").display().to_string())
    );
}
