//! From a name to the defining file, through imports, re-exports and globs.

use std::collections::BTreeSet;

use super::source::{Name, Workspace};

/// Meaning of a path.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Target {
    /// An item defined by `module`.
    Item {
        module: usize,
        name: String,
    },
    Module(usize),
    /// A path into other people's crates, imports replaced.
    External(Vec<String>),
}

/// A path with resolution.
#[derive(Debug, Default)]
pub(crate) struct Resolved {
    pub(crate) targets: BTreeSet<Target>,
    /// Modules on the path's way.
    pub(crate) passed: BTreeSet<usize>,
    /// A name missing from a module of the workspace.
    pub(crate) missing: Option<String>,
}

/// Names being looked up, to end a circular re-export.
type Open = Vec<(usize, String)>;

impl Workspace {
    /// Meaning of `path` in `module`.
    pub(crate) fn resolve(&self, module: usize, path: &[String]) -> Resolved {
        self.resolve_in(module, path, &mut Vec::new())
    }

    fn resolve_in(&self, from: usize, path: &[String], open: &mut Open) -> Resolved {
        let mut resolved = Resolved::default();
        let Some(first) = path.first() else { return resolved };
        let mut now: BTreeSet<Target> = match first.as_str() {
            "crate" => [Target::Module(self.modules[from].root)].into(),
            "self" => [Target::Module(from)].into(),
            "super" => [Target::Module(self.modules[from].parent)].into(),
            _ => self.lookup(from, first, open),
        };
        // Another crate of the workspace, by its name.
        if now.is_empty()
            && let Some(library) = self.libraries.get(first)
        {
            now.insert(Target::Module(*library));
        }
        if now.is_empty() {
            now.insert(Target::External(vec![first.clone()]));
        }
        for part in &path[1..] {
            // A module and a function may share a name; only the module has something inside.
            let any_module = now.iter().any(|target| matches!(target, Target::Module(_)));
            let mut next = BTreeSet::new();
            for target in now {
                match target {
                    Target::Module(module) => {
                        resolved.passed.insert(module);
                        match part.as_str() {
                            "super" => {
                                next.insert(Target::Module(self.modules[module].parent));
                            }
                            "self" => {
                                next.insert(Target::Module(module));
                            }
                            _ => {
                                let mut found = self.lookup(module, part, open);
                                if found.is_empty() && self.modules[module].has_item_macros {
                                    found.insert(Target::Item { module, name: part.clone() });
                                }
                                if found.is_empty() {
                                    resolved.missing = Some(part.clone());
                                }
                                next.extend(found);
                            }
                        }
                    }
                    Target::Item { .. } if any_module => {}
                    Target::Item { .. } => {
                        next.insert(target);
                    }
                    Target::External(mut path) => {
                        path.push(part.clone());
                        next.insert(Target::External(path));
                    }
                }
            }
            now = next;
        }
        resolved.passed.extend(now.iter().filter_map(|target| match target {
            Target::Module(module) => Some(*module),
            _ => None,
        }));
        resolved.targets = now;
        resolved
    }

    /// Meaning of `name` in `module`; empty if the module has no such name.
    pub(crate) fn lookup(&self, module: usize, name: &str, open: &mut Open) -> BTreeSet<Target> {
        let key = (module, name.to_owned());
        // An import may have the name of its target: then only definitions count.
        let again = open.contains(&key);
        let within = &self.modules[module];
        open.push(key);
        let mut found = BTreeSet::new();
        for is in within.names.get(name).into_iter().flatten() {
            match is {
                Name::Item => {
                    found.insert(Target::Item { module, name: name.to_owned() });
                }
                Name::Module(inner) => {
                    found.insert(Target::Module(*inner));
                }
                Name::Import(_) if again => {}
                Name::Import(path) => found.extend(self.resolve_in(module, path, open).targets),
            }
        }
        if found.is_empty() && !again {
            for glob in &within.globs {
                for target in self.resolve_in(module, glob, open).targets {
                    if let Target::Module(inner) = target {
                        found.extend(self.lookup(inner, name, open));
                    }
                }
            }
        }
        open.pop();
        found
    }
}
