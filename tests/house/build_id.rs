//! Name of a build, as made by build.rs.

use std::{fs, path::Path};

#[allow(dead_code, reason = "its main function is cargo's")]
#[path = "../../build.rs"]
mod script;

fn sources(root: &Path, source: &str) {
    fs::create_dir_all(root.join("src/room")).expect("made");
    fs::create_dir_all(root.join("config")).expect("made");
    fs::write(root.join("Cargo.lock"), "").expect("written");
    fs::write(root.join("config/default.toml"), "limit = 1").expect("written");
    fs::write(root.join("src/lib.rs"), "mod room;").expect("written");
    fs::write(root.join("src/room/mod.rs"), source).expect("written");
}

fn build_id(root: &Path) -> String {
    script::build_id(root, &[]).expect("readable")
}

#[test]
fn a_build_is_named_by_its_sources_and_not_by_its_folder() {
    let place = tempfile::tempdir().expect("a folder");
    let id = |name: &str, source: &str| {
        let root = place.path().join(name);
        sources(&root, source);
        build_id(&root)
    };
    let first = id("one", "const LIMIT: f64 = 1.0;");
    assert_eq!(first.len(), 16);
    assert_eq!(first, id("another/folder", "const LIMIT: f64 = 1.0;"));
    assert_ne!(first, id("one", "const LIMIT: f64 = 2.0;"));
    fs::create_dir_all(place.path().join("another/folder/.git")).expect("made");
    fs::write(place.path().join("another/folder/.git/HEAD"), "1").expect("written");
    fs::write(place.path().join("another/folder/src/.lib.rs.swp"), "1").expect("written");
    assert_eq!(first, build_id(&place.path().join("another/folder")));
}

#[test]
fn tests_beside_the_sources_name_no_other_build() {
    let place = tempfile::tempdir().expect("a folder");
    sources(place.path(), "");
    let write = |name: &str| {
        let file = place.path().join(name);
        fs::create_dir_all(file.parent().expect("a folder")).expect("made");
        fs::write(file, "fn fact() {}").expect("written");
    };
    write("crates/one/src/lib.rs");
    let first = build_id(place.path());
    write("crates/one/tests/one/main.rs");
    write("crates/testkit/src/lib.rs");
    assert_eq!(first, build_id(place.path()));
    write("crates/two/src/lib.rs");
    assert_ne!(first, build_id(place.path()));
}

#[test]
fn another_default_or_feature_is_another_build() {
    let place = tempfile::tempdir().expect("a folder");
    sources(place.path(), "");
    let first = build_id(place.path());
    let with = |features: &[&str]| {
        let features: Vec<String> = features.iter().map(|&name| name.to_owned()).collect();
        script::build_id(place.path(), &features).expect("readable")
    };
    assert_ne!(first, with(&["CARGO_FEATURE_LIVE"]));
    assert_ne!(
        with(&["CARGO_FEATURE_LIVE"]),
        with(&["CARGO_FEATURE_LIVE", "CARGO_FEATURE_REPORT"])
    );
    fs::write(place.path().join("config/default.toml"), "limit = 2").expect("written");
    assert_ne!(first, build_id(place.path()));
}

/// Files compiled in, except test inputs.
#[test]
fn a_build_is_named_by_every_file_that_is_compiled_in() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("src"), root.join("crates")];
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            if path.extension().is_none_or(|ending| ending != "rs") {
                continue;
            }
            let text = fs::read_to_string(&path).expect("text");
            let program = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            for include in ["include_str!(\"", "include_bytes!(\""] {
                for rest in program.split(include).skip(1) {
                    let name = rest.split('"').next().expect("a name");
                    let file = folder.join(name).canonicalize().expect("a file");
                    let is_hashed =
                        script::SOURCES.iter().any(|source| file.starts_with(root.join(source)));
                    assert!(is_hashed, "{} compiles in {name}", path.display());
                    count += 1;
                }
            }
        }
    }
    assert!(count >= 3, "{count}");
}
