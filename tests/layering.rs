//! The module map as a test: who may use whom, and who may touch the outside world.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::{collections::BTreeMap, fs, path::Path};

/// A module and the modules it may use. A module that is missing here fails the test.
const MAY_USE: &[(&str, &[&str])] = &[
    ("board", &[]),
    ("device", &["frame"]),
    ("frame", &[]),
    ("panic_message", &[]),
    ("geometry", &["frame"]),
    ("detection", &["board", "frame", "geometry"]),
    ("calibration", &["board", "frame", "geometry"]),
    ("guidance", &["board", "frame", "geometry"]),
    ("capture", &["board", "device", "frame", "geometry", "panic_message"]),
    ("session", &["board", "device", "frame", "geometry", "detection", "calibration", "guidance"]),
    (
        "config",
        &["board", "device", "frame", "geometry", "calibration", "guidance", "capture", "session"],
    ),
    ("recording", &["board", "device", "frame", "geometry", "detection", "session", "config"]),
    (
        "pipeline",
        &[
            "board",
            "device",
            "frame",
            "panic_message",
            "detection",
            "capture",
            "session",
            "recording",
        ],
    ),
    ("target", &[]),
    ("chart", &[]),
    (
        "study",
        &["board", "frame", "geometry", "detection", "calibration", "guidance", "capture", "chart"],
    ),
    ("report", &["board", "frame", "geometry", "calibration", "chart", "text"]),
    (
        "text",
        &[
            "board",
            "device",
            "frame",
            "geometry",
            "detection",
            "calibration",
            "guidance",
            "capture",
            "session",
            "config",
            "recording",
            "pipeline",
            "target",
        ],
    ),
    (
        "ui",
        &[
            "board",
            "device",
            "frame",
            "geometry",
            "calibration",
            "guidance",
            "panic_message",
            "session",
            "pipeline",
            "study",
            "text",
        ],
    ),
    (
        "cli",
        &[
            "board",
            "device",
            "frame",
            "geometry",
            "detection",
            "calibration",
            "guidance",
            "capture",
            "session",
            "config",
            "recording",
            "pipeline",
            "study",
            "target",
            "report",
            "text",
            "ui",
        ],
    ),
];

/// What the window's panels may use: plain data and words.
const PANELS: &[&str] = &[
    "ui/guide/",
    "ui/result/",
    "ui/replay/",
    "ui/settings.rs",
    "ui/trouble.rs",
    "ui/picture.rs",
    "ui/screen.rs",
    "ui/theme.rs",
];
const PANELS_USE: &[&str] =
    &["board", "device", "frame", "geometry", "calibration", "guidance", "session", "text"];

/// A word and the modules, or folders of one, in which alone it may stand.
const ONLY_IN: &[(&str, &[&str])] = &[
    // Decisions are a pure fold: no threads, channels, files, clocks, chance or logging below.
    // nokhwa's calls may never return: it has a thread that can be left behind.
    ("std::thread", &["pipeline", "cli", "capture/nokhwa"]),
    ("thread::", &["pipeline", "study", "cli", "capture/nokhwa"]),
    ("crossbeam_channel", &["pipeline", "cli"]),
    ("std::fs", &["capture", "config", "recording", "cli"]),
    ("fs::", &["capture", "config", "recording", "cli"]),
    ("File::", &["capture", "recording", "cli"]),
    ("Instant", &["pipeline", "cli", "capture/nokhwa"]),
    ("SystemTime", &[]),
    ("jiff", &["recording", "cli"]),
    ("rand", &["capture", "study"]),
    ("println!", &[]),
    ("eprintln!", &[]),
    ("toml::", &["config", "recording", "cli"]),
    ("serde_saphyr", &["calibration/import"]),
    ("clap", &["cli"]),
    ("anyhow", &["cli", "text"]),
    ("unsafe ", &["capture"]), // And there in one file: see below.
    ("egui", &["ui"]),
    ("eframe", &["ui"]),
    // People's units stop at the edge.
    ("_mm", &["config", "target", "text", "cli", "report", "calibration/import"]),
    ("to_degrees", &["text", "study", "cli"]),
];

struct Source {
    module: String,
    path: String,
    text: String,
}

#[test]
fn modules_use_only_what_they_may() {
    let may_use: BTreeMap<_, _> = MAY_USE.iter().copied().collect();
    let mut problems = Vec::new();
    for Source { module, path, text } in sources() {
        let Some(allowed) = may_use.get(module.as_str()) else {
            problems.push(format!("src/{path}: the module `{module}` is not on the map"));
            continue;
        };
        for used in used_modules(&text) {
            if used != module && !allowed.contains(&used.as_str()) {
                problems.push(format!("src/{path}: `{module}` may not use `{used}`"));
            }
        }
    }
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

#[test]
fn panels_see_plain_data_and_words_only() {
    let mut seen = 0;
    for Source { path, text, .. } in sources() {
        if PANELS.iter().any(|panel| path.starts_with(panel)) {
            seen += 1;
            for used in used_modules(&text) {
                assert!(PANELS_USE.contains(&used.as_str()), "src/{path} uses `{used}`");
            }
        }
    }
    assert!(seen >= PANELS.len(), "{seen} files of panels");
}

#[test]
fn the_outside_world_is_touched_only_where_it_may_be() {
    let mut problems = Vec::new();
    for Source { module, path, text } in sources() {
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            for (word, places) in ONLY_IN {
                let may =
                    |place: &&str| module == **place || path.starts_with(&format!("{place}/"));
                if stands_in(code, word) && !places.iter().any(may) {
                    problems.push(format!("src/{path}:{}: no `{word}` in `{module}`", number + 1));
                }
            }
        }
    }
    assert!(problems.is_empty(), "\n{}\n", problems.join("\n"));
}

#[test]
fn unsafe_code_stands_in_one_file() {
    let with_unsafe: Vec<String> = sources()
        .into_iter()
        .filter(|source| {
            let code = source.text.lines().map(|line| line.split("//").next().unwrap_or_default());
            code.into_iter()
                .any(|code| stands_in(code, "unsafe ") || stands_in(code, "unsafe_code"))
        })
        .map(|source| source.path)
        .collect();
    assert_eq!(with_unsafe, ["capture/v4l2/linux.rs"]);
}

#[test]
fn the_map_notices_what_it_should() {
    let text = "use crate::{\n    board::Checkerboard,\n    geometry::{Camera, Corner},\n};\nuse crate::text;\nfn f() -> crate::frame::Frame {}";
    assert_eq!(used_modules(text), ["board", "geometry", "text", "frame"]);
    assert!(stands_in("let x = rand::random();", "rand"));
    assert!(!stands_in("let operand = 1;", "rand"));
}

/// Modules of this crate that `text` names, in order.
fn used_modules(text: &str) -> Vec<String> {
    let code: String = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join(" ");
    let name = |rest: &str| -> String {
        rest.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut used = Vec::new();
    for rest in code.split("crate::").skip(1) {
        match rest.strip_prefix('{') {
            // The names at depth one of `use crate::{ … }`.
            Some(group) => {
                let mut depth = 0;
                let mut start = Some(0);
                for (at, c) in group.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => start = Some(at + 1),
                        _ => {}
                    }
                    if let Some(from) = start.take_if(|_| c == ':' && depth == 0) {
                        used.push(name(&group[from..]));
                    }
                }
                // A name without a path of its own, such as `text`.
                used.extend(
                    group.split('}').next().into_iter().flat_map(|group| {
                        group.split(',').map(&name).filter(|word| word == "text")
                    }),
                );
            }
            None => used.push(name(rest)),
        }
    }
    used.retain(|word| word.chars().next().is_some_and(char::is_lowercase));
    used
}

/// Whether `word` stands in `code` and not within a longer name.
fn stands_in(code: &str, word: &str) -> bool {
    let starts_a_name = word.starts_with(char::is_alphanumeric);
    code.match_indices(word).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let after = code[at + word.len()..].chars().next();
        let free_before =
            !starts_a_name || !before.is_some_and(|c| c.is_alphanumeric() || c == '_');
        let ends_a_name = word.ends_with(|c: char| c.is_alphanumeric());
        let free_after = !ends_a_name || !after.is_some_and(|c| c.is_alphanumeric() || c == '_');
        free_before && free_after
    })
}

/// Every source file that belongs to a module, its unit tests left out.
fn sources() -> Vec<Source> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    let mut folders = vec![src.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("listable") {
            let path = entry.expect("listable").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let relative = path.strip_prefix(&src).expect("below src").to_string_lossy();
            if relative.ends_with(".rs") && relative != "lib.rs" && relative != "main.rs" {
                let module = relative.split(['/', '.']).next().unwrap_or_default().to_owned();
                let text = fs::read_to_string(&path).expect("readable");
                let text = text.split("#[cfg(test)]").next().unwrap_or_default().to_owned();
                found.push(Source { module, path: relative.into_owned(), text });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(found.len() > 20, "{} files", found.len());
    found
}
