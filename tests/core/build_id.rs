//! The name of a build, as build.rs makes it.

use std::{fs, path::Path};

#[allow(dead_code, reason = "its main function is cargo's")]
#[path = "../../build.rs"]
mod script;

fn sources(root: &Path, source: &str) {
    fs::create_dir_all(root.join("src/room")).expect("made");
    fs::write(root.join("Cargo.lock"), "").expect("written");
    fs::write(root.join("src/lib.rs"), "mod room;").expect("written");
    fs::write(root.join("src/room/mod.rs"), source).expect("written");
}

#[test]
fn a_build_is_named_by_its_sources_and_not_by_its_folder() {
    let place = tempfile::tempdir().expect("a folder");
    let id = |name: &str, source: &str| {
        let root = place.path().join(name);
        sources(&root, source);
        script::build_id(&root).expect("readable")
    };
    let first = id("one", "const LIMIT: f64 = 1.0;");
    assert_eq!(first.len(), 16);
    assert_eq!(first, id("another/folder", "const LIMIT: f64 = 1.0;"));
    assert_ne!(first, id("one", "const LIMIT: f64 = 2.0;"));
    fs::create_dir_all(place.path().join("another/folder/.git")).expect("made");
    fs::write(place.path().join("another/folder/.git/HEAD"), "1").expect("written");
    fs::write(place.path().join("another/folder/src/.lib.rs.swp"), "1").expect("written");
    assert_eq!(first, script::build_id(&place.path().join("another/folder")).expect("readable"));
}
