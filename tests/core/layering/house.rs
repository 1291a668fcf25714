//! What breaks the rules.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    circles::Uses,
    resolve::{Resolved, Target},
    rules::Rules,
    scan::{self, Named, Word},
    source::Crate,
};

/// The crate, read and resolved, ready to be judged.
pub(crate) struct House {
    files: Vec<File>,
    modules: Vec<Place>,
    problems: Vec<String>,
}

struct File {
    path: String,
    room: String,
    module: usize,
    named: Vec<(Named, Resolved)>,
    words: Vec<(Word, usize)>,
}

/// Where a module is.
struct Place {
    module: Vec<String>,
    room: String,
    file: String,
}

impl House {
    pub(crate) fn new(of: &Crate) -> Self {
        let files = of.sources.iter().map(|source| File {
            path: source.path.clone(),
            room: source.room.clone(),
            module: source.module,
            named: scan::paths(of, source)
                .into_iter()
                .map(|named| {
                    let path = named.path.strip_suffix(&["*".to_owned()]).unwrap_or(&named.path);
                    let resolved = of.resolve(named.module, path);
                    (named, resolved)
                })
                .collect(),
            words: scan::words(source),
        });
        let modules = of.modules.iter().map(|module| Place {
            module: module.path.clone(),
            room: of.sources[module.source].room.clone(),
            file: of.sources[module.source].path.clone(),
        });
        Self { files: files.collect(), modules: modules.collect(), problems: of.problems.clone() }
    }

    /// Names that this checker cannot follow: what it does not see it cannot judge.
    pub(crate) fn unknown_names(&self) -> Vec<String> {
        let mut problems = self.problems.clone();
        for File { path: file, named, .. } in &self.files {
            for (named, resolved) in named {
                if let Some(missing) = &resolved.missing {
                    let path = named.path.join("::");
                    let line = named.line;
                    problems.push(format!("src/{file}:{line}: `{path}`: no `{missing}` found"));
                }
            }
        }
        problems
    }

    /// Rooms that use rooms they may not.
    pub(crate) fn wrong_rooms(&self, rules: &Rules) -> Vec<String> {
        let may_use: BTreeMap<_, _> = rules.may_use.iter().copied().collect();
        let mut problems = Vec::new();
        for File { path, room, named, .. } in &self.files {
            let Some(allowed) = may_use.get(room.as_str()) else {
                problems.push(format!("src/{path}: the room `{room}` is not on the map"));
                continue;
            };
            for (used, names) in self.rooms_of(named) {
                if used != *room && !allowed.contains(&used.as_str()) {
                    let names = names.words();
                    problems.push(format!("src/{path}: `{room}` may not use `{used}`: {names}"));
                }
            }
        }
        problems
    }

    /// Panels of the window that know more than plain data and words.
    pub(crate) fn wrong_panels(&self, rules: &Rules) -> Vec<String> {
        let mut problems = Vec::new();
        let mut unseen: BTreeSet<&str> = rules.panels.iter().copied().collect();
        for File { path, room, named, .. } in &self.files {
            let Some(panel) = rules.panels.iter().find(|panel| is_within(path, panel)) else {
                continue;
            };
            unseen.remove(panel);
            for (used, names) in self.rooms_of(named) {
                if used != *room && !rules.panels_may_use.contains(&used.as_str()) {
                    problems.push(format!(
                        "src/{path}: a panel sees plain data and words, not `{used}`: {}",
                        names.words()
                    ));
                }
            }
        }
        problems.extend(unseen.iter().map(|panel| format!("src/{panel}: no such panel")));
        problems
    }

    /// Files, threads, clocks, chance and printing where none may be.
    pub(crate) fn wrong_reaches(&self, rules: &Rules) -> Vec<String> {
        let mut problems = BTreeSet::new();
        for File { path, room, named, words, .. } in &self.files {
            for (reach, places) in rules.only_in {
                if places.iter().any(|place| is_within(path, place)) {
                    continue;
                }
                let mut lines = Vec::new();
                for (named, resolved) in named {
                    for target in &resolved.targets {
                        if let Target::External(path) = target
                            && reach.is_path(path)
                        {
                            lines.push(named.line);
                        }
                    }
                }
                lines.extend(words.iter().filter(|(word, _)| reach.is_word(word)).map(|w| w.1));
                problems.extend(
                    lines
                        .into_iter()
                        .map(|line| format!("src/{path}:{line}: no {} in `{room}`", reach.words())),
                );
            }
        }
        problems.into_iter().collect()
    }

    /// Items that one file alone may use, and others do.
    pub(crate) fn wrong_users(&self, rules: &Rules) -> Vec<String> {
        let mut problems = Vec::new();
        for (item, users) in rules.only_by {
            let mut used_rightly = false;
            for File { path, module: file_module, named, .. } in &self.files {
                for (named, resolved) in named.iter().filter(|(named, _)| !named.passed_on) {
                    let is_it = resolved.targets.iter().any(|target| match target {
                        Target::Item { module, name } => {
                            file_module != module
                                && format!("{}::{name}", self.modules[*module].module.join("::"))
                                    == *item
                        }
                        _ => false,
                    });
                    let right = users.contains(&path.as_str());
                    used_rightly |= is_it && right;
                    if is_it && !right {
                        let line = named.line;
                        let users = users.join(", ");
                        problems.push(format!("src/{path}:{line}: only {users} may use `{item}`"));
                    }
                }
            }
            if !used_rightly {
                problems.push(format!("`{item}` is not used by {}", users.join(", ")));
            }
        }
        problems
    }

    /// Unsafe code, or leave for it, outside its one file.
    pub(crate) fn wrong_unsafe(&self, rules: &Rules) -> Vec<String> {
        let mut problems = BTreeSet::new();
        let mut seen = false;
        for File { path, words, .. } in &self.files {
            for (word, line) in words {
                let is_unsafe =
                    matches!(word, Word::Name(name) if name == "unsafe" || name == "unsafe_code");
                if is_unsafe && *path == rules.unsafe_in {
                    seen = true;
                } else if is_unsafe {
                    let only = rules.unsafe_in;
                    problems.insert(format!("src/{path}:{line}: unsafe code outside src/{only}"));
                }
            }
        }
        if !seen {
            problems.insert(format!("src/{}: no unsafe code", rules.unsafe_in));
        }
        problems.into_iter().collect()
    }

    /// Circles between rooms.
    pub(crate) fn circles_of_rooms(&self) -> Vec<String> {
        let mut uses = Uses::default();
        for File { path, room, named, .. } in &self.files {
            for (used, names) in self.rooms_of(named) {
                uses.add(room, &used, &format!("src/{path}: {}", names.words()));
            }
        }
        uses.circles()
    }

    /// Circles between the files of a room: who names what another defines.
    pub(crate) fn circles_of_files(&self) -> Vec<String> {
        let mut uses = Uses::default();
        for File { path, room, named, .. } in &self.files {
            for (_, resolved) in named.iter().filter(|(named, _)| !named.passed_on) {
                for target in &resolved.targets {
                    if let Target::Item { module, name } = target {
                        let used = &self.modules[*module];
                        if used.room == *room {
                            uses.add(path, &used.file, name);
                        }
                    }
                }
            }
        }
        uses.circles()
    }

    /// Rows of the map that stand in no order, twice, or for rooms that are not there.
    pub(crate) fn wrong_map(&self, rules: &Rules) -> Vec<String> {
        let rooms: BTreeSet<&str> = self.files.iter().map(|file| file.room.as_str()).collect();
        let mut above = BTreeSet::new();
        let mut problems = Vec::new();
        for (room, uses) in rules.may_use {
            for used in uses.iter().filter(|used| !above.contains(*used)) {
                problems
                    .push(format!("map: `{used}` does not stand above `{room}`, which uses it"));
            }
            if !above.insert(room) {
                problems.push(format!("map: `{room}` stands there twice"));
            }
            if !rooms.contains(room) {
                problems.push(format!("map: there is no room `{room}`"));
            }
        }
        problems
    }

    /// Rooms that paths lead to or through, and the paths.
    fn rooms_of(&self, named: &[(Named, Resolved)]) -> BTreeMap<String, Names> {
        let mut found: BTreeMap<String, Names> = BTreeMap::new();
        for (named, resolved) in named {
            let passed = resolved.passed.iter().copied();
            let defined = resolved.targets.iter().filter_map(|target| match target {
                Target::Item { module, .. } | Target::Module(module) => Some(*module),
                Target::External(_) => None,
            });
            for module in passed.chain(defined) {
                let Place { module: path, room, .. } = &self.modules[module];
                // Every path may begin at the root.
                if path.is_empty() && room == "lib" {
                    continue;
                }
                let names = found.entry(room.clone()).or_default();
                names.0.entry(named.path.join("::")).or_insert(named.line);
            }
        }
        found
    }
}

/// Paths, and the line where each stands first.
#[derive(Default)]
struct Names(BTreeMap<String, usize>);

impl Names {
    fn words(&self) -> String {
        let names: Vec<String> =
            self.0.iter().map(|(name, line)| format!("{name} (line {line})")).collect();
        names.join(", ")
    }
}

/// Whether a file is `place`, or lies in the room or folder of that name.
fn is_within(path: &str, place: &str) -> bool {
    let stem = path.strip_suffix(".rs").unwrap_or(path);
    stem == place || path == place || path.strip_prefix(place).is_some_and(|r| r.starts_with('/'))
}
