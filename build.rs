//! Names the build: a hash of its sources and features, the same in every folder, with and without git. And what
//! `--version` says beside it.

use std::{
    env, fs, io,
    path::{Path, PathBuf},
    process::Command,
};

fn main() -> io::Result<()> {
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let root = package.ancestors().find(|folder| folder.join("Cargo.lock").is_file());
    let root = root.unwrap_or(&package);
    let features = features();
    println!("cargo:rustc-env=BORESIGHT_BUILD={}", build_id(root, &features)?);
    println!("cargo:rustc-env=BORESIGHT_COMMIT={}", commit(root));
    println!("cargo:rustc-env=BORESIGHT_FEATURES={}", in_words(&features));
    let lock = fs::read_to_string(root.join("Cargo.lock")).unwrap_or_default();
    println!("cargo:rustc-env=BORESIGHT_LIBRARIES={}", libraries(&lock, &features));
    println!("cargo:rerun-if-env-changed=BORESIGHT_COMMIT");
    for source in watched(root)? {
        println!("cargo:rerun-if-changed={}", source.display());
    }
    Ok(())
}

/// What the program is made from, below the folder with `Cargo.lock`. The defaults in `config` are compiled in.
pub(crate) const SOURCES: [&str; 7] =
    ["Cargo.lock", "Cargo.toml", "config", "crates", "docs/schemas", "src", "wings"];

/// Folders of tests and their fixtures, compiled into no program.
const OF_TESTS: [&str; 2] = ["tests", "testkit"];

/// Libraries that a bug report asks for first, with the feature that brings each; none for those of every build.
const LIBRARIES: [(&str, &str); 12] = [
    ("", "image"),
    ("", "nalgebra"),
    ("WINDOW", "eframe"),
    ("LIVE", "v4l"),
    ("NOKHWA", "nokhwa"),
    ("GIGE", "telegenic"),
    ("BAGS", "mcap"),
    ("BAGS", "rusqlite"),
    ("SERVE", "axum"),
    ("SERVE", "rustls"),
    ("PARQUET", "parquet"),
    ("CLOUD", "object_store"),
];

/// The commit, if this is a release from a clone; a package's build says which it is in `BORESIGHT_COMMIT`. Builds for
/// work on the program don't ask git: each commit would build it again.
fn commit(root: &Path) -> String {
    if let Ok(named) = env::var("BORESIGHT_COMMIT") {
        return named;
    }
    let is_release = env::var("PROFILE").is_ok_and(|profile| profile == "release");
    if !is_release {
        return "not recorded in a development build".to_owned();
    }
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).current_dir(root).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
        (output.status.success() && !text.is_empty()).then_some(text)
    };
    // A copy without git's folder may lie in somebody else's clone.
    let described = root.join(".git").exists().then(|| {
        for file in ["HEAD", "logs/HEAD"] {
            if let Some(path) = git(&["rev-parse", "--git-path", file]) {
                println!("cargo:rerun-if-changed={}", root.join(path).display());
            }
        }
        git(&["describe", "--always", "--dirty=, changed", "--abbrev=12", "--exclude=*"])
    });
    described.flatten().unwrap_or_else(|| "unknown".to_owned())
}

/// Features as their table in `Cargo.toml` names them.
fn in_words(features: &[String]) -> String {
    let names =
        features.iter().map(|name| name.trim_start_matches("CARGO_FEATURE_").to_lowercase());
    let names: Vec<String> = names.filter(|name| name != "default").collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// The libraries of this build with the versions that `Cargo.lock` has.
fn libraries(lock: &str, features: &[String]) -> String {
    let of_this_build = LIBRARIES.iter().filter(|(feature, _)| {
        feature.is_empty() || features.contains(&format!("CARGO_FEATURE_{feature}"))
    });
    let versions = of_this_build.filter_map(|(_, name)| {
        let entry = lock
            .split("[[package]]")
            .find(|entry| entry.lines().any(|line| line == format!("name = \"{name}\"")))?;
        let version = entry.lines().find_map(|line| line.strip_prefix("version = "))?;
        Some(format!("{name} {}", version.trim_matches('"')))
    });
    versions.collect::<Vec<_>>().join(", ")
}

/// The features that cargo builds the program with, in order.
fn features() -> Vec<String> {
    let names = env::vars_os().map(|(name, _)| name.to_string_lossy().into_owned());
    let mut features: Vec<String> =
        names.filter(|name| name.starts_with("CARGO_FEATURE_")).collect();
    features.sort();
    features
}

/// Sources whose change makes another build, whole folders where they hold nothing else.
fn watched(root: &Path) -> io::Result<Vec<PathBuf>> {
    let mut watched = Vec::new();
    for name in SOURCES.iter().filter(|name| root.join(name).exists()) {
        if !["crates", "wings"].contains(name) {
            watched.push(root.join(name));
            continue;
        }
        for member in parts(&root.join(name))? {
            watched.extend(if member.is_dir() { parts(&member)? } else { vec![member] });
        }
    }
    Ok(watched)
}

/// What lies in `folder`, but tests.
fn parts(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    let is_part = |entry: &fs::DirEntry| !OF_TESTS.iter().any(|name| entry.file_name() == *name);
    Ok(entries.iter().filter(|entry| is_part(entry)).map(fs::DirEntry::path).collect())
}

/// 16 hexadecimal digits, which differ if a source's name or contents do, or if the features do.
///
/// # Errors
///
/// If a source can't be read.
pub(crate) fn build_id(root: &Path, features: &[String]) -> io::Result<String> {
    let mut files = Vec::new();
    for name in SOURCES {
        add(&root.join(name), name.to_owned(), &mut files)?;
    }
    files.sort();
    let mut hash = hmac_sha256::Hash::new();
    let mut add_part = |part: &[u8]| {
        hash.update((part.len() as u64).to_le_bytes());
        hash.update(part);
    };
    add_part(&(files.len() as u64).to_le_bytes());
    for (name, path) in files {
        add_part(name.as_bytes());
        add_part(&fs::read(path)?);
    }
    for feature in features {
        add_part(feature.as_bytes());
    }
    Ok(hash.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Adds the files at and below `path`, each with its name below the root.
fn add(path: &Path, name: String, files: &mut Vec<(String, PathBuf)>) -> io::Result<()> {
    if path.is_file() {
        files.push((name, path.to_path_buf()));
    } else if path.is_dir() {
        for entry in fs::read_dir(path)? {
            let entry = entry?;
            let own = entry.file_name().to_string_lossy().into_owned();
            // Not what an editor keeps beside a file.
            if !own.starts_with('.') && !own.ends_with('~') && !OF_TESTS.contains(&&*own) {
                add(&entry.path(), format!("{name}/{own}"), files)?;
            }
        }
    }
    Ok(())
}
