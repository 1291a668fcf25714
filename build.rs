//! Names the build: a hash of its sources and features, the same in every folder, with and without git.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

fn main() -> io::Result<()> {
    let package = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let root = package.ancestors().find(|folder| folder.join("Cargo.lock").is_file());
    let root = root.unwrap_or(&package);
    println!("cargo:rustc-env=BORESIGHT_BUILD={}", build_id(root, &features())?);
    for name in SOURCES.iter().filter(|name| root.join(name).exists()) {
        println!("cargo:rerun-if-changed={}", root.join(name).display());
    }
    Ok(())
}

/// What the program is made from, below the folder with `Cargo.lock`. The defaults in `config` are compiled in.
pub(crate) const SOURCES: [&str; 5] = ["Cargo.lock", "Cargo.toml", "config", "crates", "src"];

/// The features that cargo builds the program with, in order.
fn features() -> Vec<String> {
    let names = std::env::vars_os().map(|(name, _)| name.to_string_lossy().into_owned());
    let mut features: Vec<String> =
        names.filter(|name| name.starts_with("CARGO_FEATURE_")).collect();
    features.sort();
    features
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
            if !own.starts_with('.') && !own.ends_with('~') {
                add(&entry.path(), format!("{name}/{own}"), files)?;
            }
        }
    }
    Ok(())
}
