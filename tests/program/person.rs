//! The program, run as a person would.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

/// End of a run.
pub(crate) struct Ended {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// Command with `arguments` in `folder`, not started yet, without input.
pub(crate) fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_boresight"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

/// Runs the program in `folder` to the end.
pub(crate) fn boresight(folder: &Path, arguments: &[&str]) -> Ended {
    ended(program(folder, arguments))
}

/// Runs `command` to the end.
pub(crate) fn ended(mut command: Command) -> Ended {
    let output = command.output().expect("started");
    Ended {
        code: output.status.code().expect("not killed"),
        stdout: String::from_utf8(output.stdout).expect("text"),
        stderr: String::from_utf8(output.stderr).expect("text"),
    }
}

/// Asserts the end of a run with `code`, and `words` for the person, without programmers' jargon.
pub(crate) fn says(ended: &Ended, code: i32, words: &[&str]) {
    for word in words {
        assert!(ended.stderr.contains(word), "no {word:?} in: {}", ended.stderr);
    }
    assert_eq!(ended.code, code, "{}", ended.stderr);
    for word in ["panicked", "backtrace", "unwrap"] {
        assert!(!ended.stderr.contains(word), "{}", ended.stderr);
    }
}

/// Every folder and file below `folder`, with contents.
pub(crate) fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("listable") {
        let path = entry.expect("listable").path();
        if path.is_dir() {
            found.push((path.clone(), Vec::new()));
            found.extend(contents(&path));
        } else {
            found.push((path.clone(), fs::read(&path).expect("readable")));
        }
    }
    found.sort();
    found
}
