//! Rules that `Cargo.toml` can't say: access to the outside world, and no circle of files.
//!
//! The scan reads text: comments, strings and test modules are left out first.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// Words of the outside world, and the crates, folders and files allowed to use each.
const ONLY_IN: &[(&[&str], &[&str])] = &[
    // Decisions are a pure fold. Backends with calls that block have threads of their own.
    (
        &["std::thread", "thread::Builder", "thread::scope", "thread::sleep"],
        &[
            "crates/geometry/src/parallel.rs",
            "crates/capture",
            "crates/run/src/pipeline",
            "crates/app",
            "crates/phone",
            "crates/terminal",
            "crates/window/src/program_services.rs",
            "wings/fleet",
            "wings/station",
            "wings/sources",
            "src/cli",
        ],
    ),
    (
        &["std::fs", "fs::File", "OpenOptions"],
        &[
            "crates/files",
            "crates/capture/src/v4l2",
            "crates/run/src/recording/folder.rs",
            "wings/sources",
        ],
    ),
    (&["std::net", "TcpStream", "UdpSocket"], &["crates/phone", "wings/sources"]),
    (
        &["std::process", "process::Command"],
        &[
            "crates/capture",
            "crates/app",
            "crates/terminal",
            "crates/window/src/sound.rs",
            "crates/window/src/program_services.rs",
            "wings/fleet",
            "src",
        ],
    ),
    (
        &["std::time::Instant", "Instant::now", "Timestamp::now", "Zoned::now"],
        &[
            "crates/capture",
            "crates/run/src/pipeline",
            "crates/run/src/recording",
            "crates/app",
            "crates/phone",
            "crates/terminal",
            "wings",
            "src/cli",
        ],
    ),
    (&["SystemTime", "UNIX_EPOCH", "println!", "eprintln!", "eprint!("], &[]),
    (&["stdin()"], &["crates/terminal", "crates/capture/src/pipe", "wings", "src/cli"]),
    (&["stdout()"], &["crates/terminal", "wings/fleet", "src/cli"]),
    // Randomness of the system is for keys; that of the simulation comes from a seed.
    (&["getrandom::"], &["crates/phone/src/keys.rs"]),
    (&["rand_chacha::"], &["crates/sim", "wings/station/src/street"]),
    (&["egui::", "eframe::"], &["crates/window", "wings/station/src/window_page.rs"]),
    // The system's functions round differently between processors, those of `libm` don't.
    (
        &[
            ".sin()",
            ".cos()",
            ".tan()",
            ".asin()",
            ".acos()",
            ".atan2(",
            ".exp()",
            ".ln()",
            ".powf(",
            ".hypot(",
            ".cbrt()",
            ".log10()",
            ".sin_cos()",
            ".exp_m1()",
            ".ln_1p()",
        ],
        &["crates/window", "wings/station/src/window_page.rs", "src"],
    ),
    // Degrees are for people.
    (
        &[".to_degrees()"],
        &[
            "crates/formats",
            "crates/present/src/text",
            "crates/app",
            "crates/terminal",
            "wings/station",
            "src/cli",
        ],
    ),
    // A stored session is opened in one place.
    (&["recording::replay::replay", "replay::replay("], &["crates/run", "crates/app"]),
    (&["unsafe {", "unsafe fn", "unsafe impl"], &["crates/capture/src/v4l2/linux.rs"]),
];

/// A source file without comments, strings and tests.
struct Source {
    path: PathBuf,
    text: String,
}

fn checkout() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Sources of the program: the lab, the tests' kit and the kernel's bindings aren't part of it.
fn sources() -> Vec<Source> {
    let mut found = Vec::new();
    let mut open = vec![checkout().join("src")];
    for group in ["crates", "wings"] {
        for entry in fs::read_dir(checkout().join(group)).expect("a folder").flatten() {
            open.push(entry.path().join("src"));
        }
    }
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = code_of(&fs::read_to_string(&path).expect("readable"));
                let path = path.strip_prefix(checkout()).expect("below").to_path_buf();
                let is_left_out = path.starts_with("crates/v4l2-sys")
                    || path.starts_with("crates/testkit")
                    || path.file_name().is_some_and(|name| name == "tests.rs");
                if !is_left_out {
                    found.push(Source { path, text });
                }
            }
        }
    }
    found
}

/// `source` without comments, the contents of strings, and everything from its tests on.
fn code_of(source: &str) -> String {
    let mut code = String::new();
    for line in source.lines().take_while(|line| line.trim() != "#[cfg(test)]") {
        let mut rest = line;
        if rest.trim_start().starts_with("//") {
            continue;
        }
        while let Some((before, after)) = rest.split_once('"') {
            code += before;
            rest = after.split_once('"').map_or("", |(_, after)| after);
        }
        code += rest.split(" // ").next().unwrap_or_default();
        code.push('\n');
    }
    code
}

#[test]
fn the_outside_world_is_touched_only_where_it_may_be() {
    let mut wrong = Vec::new();
    let sources = sources();
    assert!(sources.len() > 500, "{} sources found", sources.len());
    for (words, places) in ONLY_IN {
        for source in &sources {
            let word = words.iter().find(|word| source.text.contains(**word));
            if let Some(word) = word.filter(|_| !places.iter().any(|p| source.path.starts_with(p)))
            {
                wrong.push(format!("{}: {word}", source.path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}\n", wrong.join("\n"));
}

/// Module path of a file below its crate's `src`, such as `["boards", "charuco"]`.
fn module_of(path: &Path) -> Vec<String> {
    let below = path.iter().skip_while(|part| *part != "src").skip(1);
    let mut module: Vec<String> =
        below.map(|part| part.to_string_lossy().trim_end_matches(".rs").to_owned()).collect();
    if module.last().is_some_and(|last| ["mod", "lib", "main"].contains(&last.as_str())) {
        module.pop();
    }
    module
}

/// Paths named by a `use` statement without `use` and semicolon, each as its parts.
fn paths_of(tree: &str) -> Vec<Vec<String>> {
    let (prefix, group) = match tree.split_once('{') {
        None => (tree, None),
        Some((prefix, group)) => (prefix, Some(group.trim_end().trim_end_matches('}'))),
    };
    let parts = |text: &str| -> Vec<String> {
        let text = text.split(" as ").next().unwrap_or_default();
        text.split("::").map(str::trim).filter(|part| !part.is_empty()).map(Into::into).collect()
    };
    let Some(group) = group else { return vec![parts(prefix)] };
    let (mut depth, mut start, mut branches) = (0, 0, Vec::new());
    for (at, letter) in group.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => branches.push(&group[std::mem::replace(&mut start, at + 1)..at]),
            _ => {}
        }
    }
    branches.push(&group[start..]);
    let named = branches.into_iter().filter(|branch| !branch.trim().is_empty());
    let whole = |branch: Vec<String>| [parts(prefix), branch].concat();
    named.flat_map(|branch| paths_of(branch.trim()).into_iter().map(whole)).collect()
}

/// Statements `use …;` of a file, with true for those that pass names on.
fn uses_of(text: &str) -> Vec<(bool, Vec<String>)> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("use ") {
        let before = text[..at].rsplit('\n').next().unwrap_or_default().trim();
        if !before.is_empty() && !before.starts_with("pub") {
            continue;
        }
        if let Some((tree, _)) = text[at + 4..].split_once(';') {
            let tree = tree.split_whitespace().collect::<Vec<_>>().join(" ");
            found.extend(paths_of(&tree).into_iter().map(|path| (!before.is_empty(), path)));
        }
    }
    found
}

/// Files of one crate: who uses whom, through the names that module files pass on.
struct Crate {
    /// Uses of each module.
    uses: BTreeMap<Vec<String>, Vec<Vec<String>>>,
    /// Module that a passed-on name comes from.
    passed: BTreeMap<Vec<String>, Vec<String>>,
}

impl Crate {
    fn new(sources: &[&Source]) -> Self {
        let modules: BTreeSet<Vec<String>> =
            sources.iter().map(|source| module_of(&source.path)).collect();
        let (mut uses, mut passed) = (BTreeMap::new(), BTreeMap::new());
        for source in sources {
            let module = module_of(&source.path);
            let mut used = Vec::new();
            for (is_passed, path) in uses_of(&source.text) {
                let Some(path) = absolute(&module, &path, &modules) else { continue };
                if is_passed {
                    let name = path.last().cloned().unwrap_or_default();
                    passed.insert([module.clone(), vec![name]].concat(), path);
                } else {
                    used.push(path);
                }
            }
            uses.insert(module, used);
        }
        Self { uses, passed }
    }

    /// Module that defines what `path` names.
    fn home(&self, path: &[String]) -> Vec<String> {
        let mut path = path.to_vec();
        for _ in 0..8 {
            match self.passed.get(&path) {
                Some(source) if *source != path => path.clone_from(source),
                _ => break,
            }
        }
        while !self.uses.contains_key(&path) && path.pop().is_some() {}
        path
    }

    /// Modules reached from `start`, directly or indirectly.
    fn reached(&self, start: &[String]) -> BTreeSet<Vec<String>> {
        let (mut reached, mut open) = (BTreeSet::new(), vec![start.to_vec()]);
        while let Some(module) = open.pop() {
            for path in self.uses.get(&module).into_iter().flatten() {
                let home = self.home(path);
                if home != module && reached.insert(home.clone()) {
                    open.push(home);
                }
            }
        }
        reached
    }
}

/// `path` from the crate's root; `None` for a path of another crate.
fn absolute(
    module: &[String],
    path: &[String],
    modules: &BTreeSet<Vec<String>>,
) -> Option<Vec<String>> {
    let mut at = module.to_vec();
    let mut parts = path.iter().peekable();
    match parts.peek().map(|part| part.as_str()) {
        Some("crate") => {
            parts.next();
            at.clear();
        }
        Some("super") => {
            while parts.next_if(|part| *part == "super").is_some() {
                at.pop();
            }
        }
        Some("self") => {
            parts.next();
        }
        Some(first) if modules.contains(&[module, &[first.to_owned()]].concat()) => {}
        _ => return None,
    }
    at.extend(parts.filter(|part| *part != "self").cloned());
    Some(at)
}

#[test]
fn no_file_uses_itself_through_others_of_its_crate() {
    let sources = sources();
    let mut crates: BTreeMap<PathBuf, Vec<&Source>> = BTreeMap::new();
    for source in &sources {
        let root = source.path.iter().take_while(|part| *part != "src").collect();
        crates.entry(root).or_default().push(source);
    }
    let mut circles = Vec::new();
    for (root, files) in crates {
        let house = Crate::new(&files);
        for module in house.uses.keys() {
            if house.reached(module).contains(module) {
                circles.push(format!("{}: {}", root.display(), module.join("::")));
            }
        }
    }
    assert!(circles.is_empty(), "in a circle:\n{}\n", circles.join("\n"));
}

#[test]
fn the_scan_sees_code_and_follows_names() {
    let code = code_of("use a::B; // std::fs\nlet x = \"std::fs\";\n// c\n#[cfg(test)]\nmod t {}");
    assert_eq!(code, "use a::B;\nlet x = ;\n");
    let text = |path: &str| path.split("::").map(Into::into).collect::<Vec<String>>();
    assert_eq!(
        uses_of("use super::{a::{B, C}, d};\npub use e::F as G;"),
        [
            (false, text("super::a::B")),
            (false, text("super::a::C")),
            (false, text("super::d")),
            (true, text("e::F")),
        ]
    );
    // `a` uses `B` of `b` through the root, and `b` uses `a`.
    let file = |path: &str, text: &str| Source { path: path.into(), text: text.into() };
    let [root, a, b] = [
        file("x/src/lib.rs", "mod a;\nmod b;\npub use b::B;"),
        file("x/src/a.rs", "use crate::B;"),
        file("x/src/b.rs", "use super::a::A;"),
    ];
    let house = Crate::new(&[&root, &a, &b]);
    assert!(house.reached(&text("a")).contains(&text("a")));
    let house = Crate::new(&[&root, &a]);
    assert!(!house.reached(&text("a")).contains(&text("a")));
}
