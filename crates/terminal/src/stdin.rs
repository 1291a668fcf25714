//! Inputs named by a person: files, the pictures of folders, and `-` for standard input.

use std::{
    io::{Read, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

use crate::say;
use boresight_app::session::source::is_session;
use boresight_capture::{picture_ending, pictures_in, unread_pictures_in};
use boresight_files::Scratch;
use boresight_present::text;

/// Name of standard input.
pub const DASH: &str = "-";

/// Largest input, in bytes.
const LIMIT: u64 = 1 << 30;

/// Files named by a person, with a copy of standard input where named.
#[derive(Debug)]
pub struct Given {
    /// Paths for repeated reading.
    pub files: Vec<PathBuf>,
    copy: Option<(Scratch, PathBuf)>,
}

impl Given {
    /// Files by `names`.
    ///
    /// # Errors
    ///
    /// If standard input is named twice, can't be read, or the copy can't be written.
    pub fn of(names: &[PathBuf]) -> anyhow::Result<Self> {
        let mut given = Self { files: names.to_vec(), copy: None };
        for file in given.files.iter_mut().filter(|file| **file == Path::new(DASH)) {
            if given.copy.is_some() {
                bail!("standard input can be read once only: name - once");
            }
            let (scratch, path) = copied()?;
            file.clone_from(&path);
            given.copy = Some((scratch, path));
        }
        Ok(given)
    }

    /// Files as [`Self::of`], with folders replaced by their pictures; announces skipped kinds. A
    /// session's folder stays.
    ///
    /// # Errors
    ///
    /// As [`Self::of`]; if a folder can't be listed, or holds no picture.
    pub fn of_pictures(names: &[PathBuf]) -> anyhow::Result<Self> {
        let mut files = Vec::with_capacity(names.len());
        for name in names {
            if name.is_dir() && !is_session(name) {
                let left_out = unread_pictures_in(name);
                if !left_out.is_empty() {
                    say(&text::source::pictures_left_out(&left_out));
                }
                files.extend(pictures_in(name)?);
            } else {
                files.push(name.clone());
            }
        }
        Self::of(&files)
    }

    /// A single file by `name`.
    ///
    /// # Errors
    ///
    /// As [`Self::of`].
    pub fn one(name: &Path) -> anyhow::Result<Self> {
        Self::of(&[name.to_path_buf()])
    }

    /// File of [`Self::one`].
    pub fn file(&self) -> &Path {
        self.files.first().map_or(Path::new(DASH), PathBuf::as_path)
    }

    /// Name of `file` for a person.
    pub fn name(&self, file: &Path) -> String {
        match &self.copy {
            Some((_, copy)) if copy == file => DASH.into(),
            _ => file.display().to_string(),
        }
    }
}

/// Standard input as a file, named as a picture or a table.
fn copied() -> anyhow::Result<(Scratch, PathBuf)> {
    let mut input = std::io::stdin().lock().take(LIMIT + 1);
    let mut start = Vec::new();
    input.by_ref().take(12).read_to_end(&mut start).context("could not read standard input")?;
    if start.is_empty() {
        bail!("nothing came at standard input");
    }
    let ending = picture_ending(&start).unwrap_or("vnl");
    let name = format!("stdin.{ending}");
    let scratch = Scratch::new()?;
    let mut file = scratch.create(Path::new(&name))?;
    file.write_all(&start).context("could not copy standard input")?;
    std::io::copy(&mut input, &mut file).context("could not copy standard input")?;
    if input.limit() == 0 {
        bail!("more than {LIMIT} bytes came at standard input");
    }
    let path = scratch.path().join(name);
    Ok((scratch, path))
}
