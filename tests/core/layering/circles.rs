//! Circular dependencies.

use std::collections::{BTreeMap, BTreeSet};

/// Uses between units, with the names used.
#[derive(Debug, Default)]
pub(crate) struct Uses(BTreeMap<String, BTreeMap<String, BTreeSet<String>>>);

impl Uses {
    pub(crate) fn add(&mut self, user: &str, used: &str, name: &str) {
        if user != used {
            let edges = self.0.entry(user.to_owned()).or_default();
            edges.entry(used.to_owned()).or_default().insert(name.to_owned());
        }
    }

    /// Every circle as text: its members, and the names tying them together.
    pub(crate) fn circles(&self) -> Vec<String> {
        let mut left: BTreeSet<&String> = self.0.keys().collect();
        let mut circles = Vec::new();
        while let Some(start) = left.pop_first() {
            let from_here = self.reached_from(start);
            let members: BTreeSet<&String> = from_here
                .iter()
                .copied()
                .filter(|other| self.reached_from(other).contains(start))
                .collect();
            if members.is_empty() {
                continue;
            }
            left.retain(|other| !members.contains(other));
            let mut text = format!("circle of {}:", members.len());
            for user in &members {
                for (used, names) in self.0.get(*user).into_iter().flatten() {
                    if members.contains(used) {
                        let names: Vec<&str> = names.iter().map(String::as_str).collect();
                        text += &format!("\n    {user} uses {used}: {}", names.join(", "));
                    }
                }
            }
            circles.push(text);
        }
        circles
    }

    /// Everything used by `start`, directly or indirectly.
    fn reached_from(&self, start: &String) -> BTreeSet<&String> {
        let mut reached = BTreeSet::new();
        let mut open = vec![start];
        while let Some(user) = open.pop() {
            for used in self.0.get(user).into_iter().flat_map(BTreeMap::keys) {
                if reached.insert(used) {
                    open.push(used);
                }
            }
        }
        reached
    }
}
