//! Violations of the rules.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    circles::Uses,
    resolve::{Resolved, Target},
    rules::Rules,
    scan::{self, Named, Word},
    source::{Workspace, shown},
};

/// The crates, read and resolved, ready to be judged.
pub(crate) struct House {
    files: Vec<File>,
    modules: Vec<Place>,
    problems: Vec<String>,
}

struct File {
    path: String,
    krate: String,
    room: String,
    module: usize,
    named: Vec<(Named, Resolved)>,
    words: Vec<Word>,
}

/// Location of a module.
struct Place {
    module: Vec<String>,
    krate: String,
    room: String,
    file: String,
}

impl House {
    pub(crate) fn new(of: &Workspace) -> Self {
        let files = of.sources.iter().map(|source| File {
            path: source.path.clone(),
            krate: source.krate.clone(),
            room: source.room.clone(),
            module: source.module,
            named: scan::paths(source)
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
            krate: of.sources[module.source].krate.clone(),
            room: of.sources[module.source].room.clone(),
            file: of.sources[module.source].path.clone(),
        });
        Self { files: files.collect(), modules: modules.collect(), problems: of.problems.clone() }
    }

    /// Names beyond the checker: it cannot judge what it does not see.
    pub(crate) fn unknown_names(&self) -> Vec<String> {
        let mut problems = self.problems.clone();
        for File { path: file, named, .. } in &self.files {
            for (named, resolved) in named {
                if let Some(missing) = &resolved.missing {
                    let path = named.path.join("::");
                    problems.push(format!("{}: `{path}`: no `{missing}` found", shown(file)));
                }
            }
        }
        problems
    }

    /// Panels of the window with knowledge beyond plain data and words.
    pub(crate) fn wrong_panels(&self, rules: &Rules) -> Vec<String> {
        let mut problems = Vec::new();
        let mut unseen: BTreeSet<&str> = rules.panels.iter().copied().collect();
        for File { path, named, .. } in &self.files {
            let Some(panel) = rules.panels.iter().find(|panel| is_within(path, panel)) else {
                continue;
            };
            unseen.remove(panel);
            let mut wrong: BTreeMap<&str, BTreeSet<String>> = BTreeMap::new();
            for (named, resolved) in named {
                for target in &resolved.targets {
                    let (Target::Item { module, .. } | Target::Module(module)) = target else {
                        continue;
                    };
                    let file = self.modules[*module].file.as_str();
                    if !rules.panels_may_use.iter().any(|place| is_within(file, place)) {
                        wrong.entry(file).or_default().insert(named.path.join("::"));
                    }
                }
            }
            for (file, names) in wrong {
                let names = listed(&names);
                problems.push(format!(
                    "{}: a panel sees plain data and words, not `{file}`: {names}",
                    shown(path)
                ));
            }
        }
        problems.extend(unseen.iter().map(|panel| format!("{}: no such panel", shown(panel))));
        problems
    }

    /// Files, threads, clocks, chance and printing in forbidden places.
    pub(crate) fn wrong_reaches(&self, rules: &Rules) -> Vec<String> {
        let mut problems = Vec::new();
        for File { path, named, words, .. } in &self.files {
            for (reach, places) in rules.only_in {
                if places.iter().any(|place| is_within(path, place)) {
                    continue;
                }
                let by_path = named.iter().any(|(_, resolved)| {
                    resolved.targets.iter().any(
                        |target| matches!(target, Target::External(path) if reach.is_path(path)),
                    )
                });
                if by_path || words.iter().any(|word| reach.is_word(word)) {
                    problems.push(format!("{}: no {} here", shown(path), reach.words()));
                }
            }
        }
        problems
    }

    /// Items reserved for a single file but used by others.
    pub(crate) fn wrong_users(&self, rules: &Rules) -> Vec<String> {
        let mut problems = BTreeSet::new();
        for (item, users) in rules.only_by {
            let mut used_rightly = false;
            for File { path, module: file_module, named, .. } in &self.files {
                for (_, resolved) in named.iter().filter(|(named, _)| !named.passed_on) {
                    let is_it = resolved.targets.iter().any(|target| match target {
                        Target::Item { module, name } => {
                            let place = &self.modules[*module];
                            let path = [&[place.krate.clone()][..], &place.module].concat();
                            file_module != module && format!("{}::{name}", path.join("::")) == *item
                        }
                        _ => false,
                    });
                    let right = users.contains(&path.as_str());
                    used_rightly |= is_it && right;
                    if is_it && !right {
                        let users = users.join(", ");
                        problems.insert(format!("{}: only {users} may use `{item}`", shown(path)));
                    }
                }
            }
            if !used_rightly {
                problems.insert(format!("`{item}` is not used by {}", users.join(", ")));
            }
        }
        problems.into_iter().collect()
    }

    /// Unsafe code, or permission for unsafe code, outside the permitted file.
    pub(crate) fn wrong_unsafe(&self, rules: &Rules) -> Vec<String> {
        let mut problems = BTreeSet::new();
        let mut seen = false;
        for File { path, words, .. } in &self.files {
            let before = std::iter::once(None).chain(words.iter().map(Some));
            for (word, before) in words.iter().zip(before) {
                let is_forbidden = matches!(before, Some(Word::Name(name)) if name == "forbid");
                let is_unsafe = !is_forbidden
                    && matches!(word, Word::Name(name) if name == "unsafe" || name == "unsafe_code");
                if is_unsafe && *path == rules.unsafe_in {
                    seen = true;
                } else if is_unsafe {
                    let only = rules.unsafe_in;
                    let only = shown(only);
                    problems.insert(format!("{}: unsafe code outside {only}", shown(path)));
                }
            }
        }
        if !seen {
            problems.insert(format!("{}: no unsafe code", shown(rules.unsafe_in)));
        }
        problems.into_iter().collect()
    }

    /// Circles between the rooms of a crate; between crates, Cargo forbids them.
    pub(crate) fn circles_of_rooms(&self, rules: &Rules) -> Vec<String> {
        let mut uses = Uses::default();
        for File { path, krate, room, named, .. } in &self.files {
            if rules.of_rooms.contains(&krate.as_str()) {
                for (used, names) in self.rooms_of(krate, named) {
                    uses.add(room, &used, &format!("{}: {}", shown(path), listed(&names)));
                }
            }
        }
        uses.circles()
    }

    /// Circles between the files of a crate by names and definitions.
    pub(crate) fn circles_of_files(&self) -> Vec<String> {
        let mut uses = Uses::default();
        for File { path, krate, named, .. } in &self.files {
            for (_, resolved) in named.iter().filter(|(named, _)| !named.passed_on) {
                for target in &resolved.targets {
                    if let Target::Item { module, name } = target {
                        let used = &self.modules[*module];
                        if used.krate == *krate {
                            uses.add(path, &used.file, name);
                        }
                    }
                }
            }
        }
        uses.circles()
    }

    /// Rooms of `krate` on paths, and the paths.
    fn rooms_of(
        &self,
        krate: &str,
        named: &[(Named, Resolved)],
    ) -> BTreeMap<String, BTreeSet<String>> {
        let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (named, resolved) in named {
            let passed = resolved.passed.iter().copied();
            let defined = resolved.targets.iter().filter_map(|target| match target {
                Target::Item { module, .. } | Target::Module(module) => Some(*module),
                Target::External(_) => None,
            });
            for module in passed.chain(defined) {
                let place = &self.modules[module];
                // Every path may begin at the root.
                if place.krate == krate && !(place.module.is_empty() && place.room == "lib") {
                    found.entry(place.room.clone()).or_default().insert(named.path.join("::"));
                }
            }
        }
        found
    }
}

fn listed(names: &BTreeSet<String>) -> String {
    names.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// True if a file is `place`, or lies in the room or folder named `place`.
fn is_within(path: &str, place: &str) -> bool {
    let stem = path.strip_suffix(".rs").unwrap_or(path);
    stem == place || path == place || path.strip_prefix(place).is_some_and(|r| r.starts_with('/'))
}
