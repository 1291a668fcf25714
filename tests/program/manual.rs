//! Shell completions and manual pages, read by the target programs.

use std::{fs, process::Command};

use tempfile::TempDir;

use crate::person::{boresight, contents, says};

/// True if a program is installed.
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

/// Typed part of an example: without its input pipe, its redirection, and its comment.
fn typed(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let ends = ["  ", " | ", " > ", " \\"];
    let end = ends.iter().filter_map(|end| line.find(end)).min().unwrap_or(line.len());
    line.starts_with("boresight ").then(|| &line[..end])
}

/// Long name of the option in a line of help.
fn option(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let line = line.split_once(", ").filter(|(short, _)| short.len() == 2).map_or(line, |it| it.1);
    let end = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
    line.starts_with("--").then(|| line.split(end).next()).flatten()
}

#[test]
fn every_example_can_be_typed_and_every_option_is_in_the_documentation() {
    let documented = include_str!("../../docs/commands.md");
    let folder = TempDir::new().expect("folder");
    let help = |command: &str| {
        let words: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        boresight(folder.path(), &words).stdout
    };
    let mut commands = vec![String::new()];
    let (mut at, mut count) = (0, 0);
    while let Some(command) = commands.get(at).cloned() {
        at += 1;
        let help = help(&command);
        let named = help.lines().skip_while(|line| *line != "Commands:").skip(1);
        let named = named
            .take_while(|line| !line.is_empty())
            .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
            .filter(|name| !name.is_empty() && *name != "help");
        commands.extend(named.map(|name| format!("{command} {name}")));
        let options = help.lines().filter_map(option).filter(|name| *name != "--version");
        for name in options {
            assert!(documented.contains(name), "{command} {name} isn't in docs/commands.md");
        }
        for example in help.lines().skip_while(|line| *line != "Examples:").filter_map(typed) {
            // With --help at the end, the arguments are parsed, and nothing is done.
            let program = std::path::Path::new(env!("CARGO_BIN_EXE_boresight"));
            let script = format!(
                "PATH={}:$PATH; {example} --help",
                program.parent().expect("a folder").display()
            );
            let ended =
                Command::new("sh").arg("-c").arg(script).current_dir(folder.path()).output();
            let ended = ended.expect("sh runs");
            let said = String::from_utf8_lossy(&ended.stderr);
            assert!(ended.status.success(), "{command}: {example}: {said}");
            count += 1;
        }
    }
    assert!(count > 40, "{count} examples");
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
            // No command is broken, or its words moved apart.
            let shown = String::from_utf8_lossy(&output.stdout).replace('−', "-");
            let help = boresight(folder.path(), &[command, "--help"]).stdout;
            for example in help.lines().skip_while(|line| *line != "Examples:").skip(1) {
                assert!(shown.contains(example.trim()), "{command}: {example}");
            }
        }
        // Examples are on their own lines.
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
