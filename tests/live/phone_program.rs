//! Secrets of `boresight serve` as a process.

use std::{
    io::{BufRead, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use serde_json::{Value, json};

use crate::phone::{Ask, Site, follow};

/// `boresight serve` with a camera on the network, until dropped.
struct Program {
    child: Child,
    links: Vec<String>,
}

impl Program {
    fn start(folder: &Path, more: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_boresight"))
            .current_dir(folder)
            .args(["serve", "127.0.0.1:0"])
            .args(more)
            .stdin(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let links = lines
            .map_while(Result::ok)
            .filter_map(|line| line.split(' ').find(|word| word.contains("/#")).map(str::to_owned))
            .take(2)
            .collect();
        Self { child, links }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

#[test]
fn a_cameras_password_is_no_phones_business() {
    let place = tempfile::tempdir().expect("a folder");
    let program =
        Program::start(place.path(), &["--source", "http://admin:s3cret@127.0.0.1:9/a?pwd=s3cret"]);
    let site = Site::of_links(&program.links[0], &program.links[1]);
    let watcher = site.key(&site.watcher);
    let mut offer = Value::Null;
    follow(&site, &watcher, |name, data| {
        if name == "live" && data["stage"] == "waiting" {
            offer = data["offer"].clone();
        }
        offer.is_null()
    });
    let text = offer.to_string();
    assert!(text.contains("http://127.0.0.1:9/a"), "{text}");
    assert!(!text.contains("s3cret") && !text.contains("admin"), "{text}");
    // The program still knows it: the missing answer proves it.
    let owner = site.key(&site.owner);
    let start = json!({"source": offer["cameras"][0]["source"], "board": [9, 6],
        "square_m": 0.025, "plan": "quick"});
    let started = Ask::post("/api/start", &start.to_string()).key(&owner).of(&site);
    assert_eq!(started.status, 204);
    let mut trouble = Value::Null;
    follow(&site, &owner, |name, data| {
        if name == "live" && data["offer"]["trouble"][0] != offer["trouble"][0] {
            trouble = data["offer"]["trouble"].clone();
        }
        trouble.is_null()
    });
    let text = trouble.to_string();
    assert!(text.contains("No network camera answers") && !text.contains("s3cret"), "{text}");
}

#[cfg(unix)]
#[test]
fn a_secret_in_a_file_is_the_owners_alone() {
    use std::os::unix::fs::PermissionsExt;
    let place = tempfile::tempdir().expect("a folder");
    let key = place.path().join("key");
    let arguments = ["--source", "sim", "--serve-key", "key"];
    let first = Program::start(place.path(), &arguments).links.clone();
    assert_eq!(key.metadata().expect("made").permissions().mode() & 0o777, 0o600);
    let fragment = |link: &String| link.split_once('#').map(|(_, token)| token.to_owned());
    let again = Program::start(place.path(), &arguments).links.clone();
    assert_eq!(
        first.iter().map(fragment).collect::<Vec<_>>(),
        again.iter().map(fragment).collect::<Vec<_>>()
    );
    std::fs::set_permissions(&key, PermissionsExt::from_mode(0o644)).expect("changed");
    let refused = Command::new(env!("CARGO_BIN_EXE_boresight"))
        .current_dir(place.path())
        .args(["serve", "127.0.0.1:0"])
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("started");
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(said.contains("others can read this secret") && said.contains("chmod 600"), "{said}");
}
