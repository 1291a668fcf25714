//! Shell completions and manual pages, read by the programs that they are for.

use std::{fs, process::Command};

use tempfile::TempDir;

use crate::person::{boresight, contents, says};

/// Whether a program is there.
fn has(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

#[test]
fn bash_completes_commands_and_options() {
    let folder = TempDir::new().expect("folder");
    let ended = boresight(folder.path(), &["completions", "bash"]);
    says(&ended, 0, &[]);
    fs::write(folder.path().join("script"), &ended.stdout).expect("written");
    let bash = |command: &str| {
        let output = Command::new("bash").args(["-c", command]).current_dir(folder.path()).output();
        let output = output.expect("bash runs");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    bash("bash -n script");
    let completed = |words: &str, count: usize| {
        bash(&format!(
            ". ./script; COMP_WORDS=({words}); COMP_CWORD={count}; _boresight boresight \"${{COMP_WORDS[{count}]}}\" \"\"; echo ${{COMPREPLY[@]}}"
        ))
    };
    assert_eq!(completed("boresight calib", 1).trim(), "calibrate");
    assert_eq!(completed("boresight calibrate --varying", 2).trim(), "--varying-focal");
    for shell in ["zsh", "fish", "powershell", "elvish"] {
        let ended = boresight(folder.path(), &["completions", shell]);
        says(&ended, 0, &[]);
        assert!(ended.stdout.contains("calibrate"), "{shell}");
    }
    says(&boresight(folder.path(), &["completions", "tcsh"]), 2, &["bash", "zsh"]);
}

#[test]
fn every_command_has_a_page() {
    let folder = TempDir::new().expect("folder");
    says(&boresight(folder.path(), &["man", "man1"]), 0, &["pages in man1"]);
    let help = boresight(folder.path(), &["--help"]).stdout;
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands: Vec<&str> = commands
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !name.is_empty() && *name != "help")
        .collect();
    assert!(commands.len() >= 14, "{commands:?}");
    for command in &commands {
        let path = folder.path().join(format!("man1/boresight-{command}.1"));
        let page = fs::read_to_string(&path).expect(command);
        assert!(page.contains("Examples:"), "{command} has no example");
        if has("groff") {
            let output = Command::new("groff")
                .args(["-man", "-Tutf8", "-Kutf8", "-ww"])
                .arg(&path)
                .output()
                .expect("groff runs");
            let warnings = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success() && warnings.is_empty(), "{command}: {warnings}");
        }
        // Examples stand on their own lines.
        let help = boresight(folder.path(), &[command, "--help"]).stdout;
        let examples: Vec<&str> =
            help.lines().skip_while(|line| *line != "Examples:").skip(1).collect();
        assert!(examples.first().is_some_and(|line| line.starts_with("  ")), "{command}: {help}");
    }
    let page = fs::read_to_string(folder.path().join("man1/boresight.1")).expect("written");
    assert!(page.contains("Exit codes"), "{page}");
    // Nothing is overwritten unasked.
    let before = contents(folder.path());
    fs::remove_file(folder.path().join("man1/boresight.1")).expect("removed");
    says(&boresight(folder.path(), &["man", "man1"]), 1, &["already", "--force"]);
    assert!(!folder.path().join("man1/boresight.1").exists());
    says(&boresight(folder.path(), &["man", "man1", "--force"]), 0, &[]);
    assert_eq!(contents(folder.path()), before);
}
