//! Pictures of several cameras, sorted into instants.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use image::GrayImage;

use super::calibration_views::CalibrationViews;
use boresight_calibrate::{KnownLens, RigViews};
use boresight_capture::{Upright, pictures_in, read_picture_turned};
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_formats::import;

/// Pictures or corner table of a camera.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraInput {
    /// Name of the camera.
    pub name: String,
    /// Files, in order.
    pub files: Vec<PathBuf>,
}

impl CameraInput {
    /// The picture with the number; `None` without one, or if it can't be read.
    pub fn picture(&self, wanted: u64, upright: Upright) -> Option<GrayImage> {
        let is_it = |path: &&PathBuf| {
            let name = path.file_name().and_then(|name| name.to_str());
            name.and_then(number) == Some(wanted)
        };
        read_picture_turned(self.files.iter().find(is_it)?, upright).ok()
    }
}

/// Splits `NAME=PATH`; without a name, or if such a path exists, the name is `None`.
pub fn named(text: &Path) -> (Option<String>, PathBuf) {
    let plain = (None, text.to_path_buf());
    let Some((name, path)) = text.to_str().and_then(|text| text.split_once('=')) else {
        return plain;
    };
    let is_name = !name.is_empty() && !name.contains(['/', '\\', '.']);
    if is_name && !text.exists() { (Some(name.into()), path.into()) } else { plain }
}

/// Cameras of a rig: a folder or a corner table each, `NAME=PATH` to name it; or one folder, with
/// a folder for each camera, or with the pictures of all, told apart by their names up to the last
/// number.
///
/// # Errors
///
/// If a folder can't be listed or has no pictures, if only one camera is found, or if two have the
/// same name.
pub fn cameras_in(inputs: &[PathBuf]) -> anyhow::Result<Vec<CameraInput>> {
    let cameras = match inputs {
        [folder] if folder.is_dir() => cameras_of_folder(folder)?,
        inputs => inputs
            .iter()
            .map(|input| {
                let (name, path) = named(input);
                let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                let files = if path.is_dir() { pictures_in(&path)? } else { vec![path] };
                Ok(CameraInput { name: name.unwrap_or(stem), files })
            })
            .collect::<anyhow::Result<_>>()?,
    };
    for (index, camera) in cameras.iter().enumerate() {
        if cameras[..index].iter().any(|other| other.name == camera.name) {
            bail!("two cameras are called {:?}: name them, for example left=FOLDER", camera.name);
        }
    }
    if cameras.len() < 2 {
        bail!(
            "a rig has two cameras or more: name a folder for each, for example left=FOLDER right=FOLDER"
        );
    }
    Ok(cameras)
}

fn cameras_of_folder(folder: &Path) -> anyhow::Result<Vec<CameraInput>> {
    let listed = folder.read_dir().with_context(|| format!("could not list {folder:?}"))?;
    let mut folders: Vec<PathBuf> = listed
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.is_dir() && pictures_in(path).is_ok())
        .collect();
    folders.sort();
    if !folders.is_empty() {
        let of = |folder: &PathBuf| {
            let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok(CameraInput { name, files: pictures_in(folder)? })
        };
        return folders.iter().map(of).collect();
    }
    let mut by_name: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for file in pictures_in(folder)? {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let before = stem.trim_end_matches(|c: char| !c.is_ascii_digit());
        let name = before.trim_end_matches(|c: char| c.is_ascii_digit());
        let name = name.trim_end_matches(['-', '_', '.', ' ']).to_owned();
        by_name.entry(name).or_default().push(file);
    }
    Ok(by_name.into_iter().map(|(name, files)| CameraInput { name, files }).collect())
}

/// Last number in a file name; of a recording's picture, the number behind `#`.
fn number(name: &str) -> Option<u64> {
    let stem = match name.rsplit_once('#') {
        Some((_, number)) => number,
        None => Path::new(name).file_stem()?.to_str()?,
    };
    let end = stem.trim_end_matches(|c: char| !c.is_ascii_digit());
    let start = end.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    end[start..].parse().ok()
}

/// Views of a camera by the numbers in the names of the pictures.
///
/// # Errors
///
/// If a picture has no number, or two have the same.
pub fn by_number(camera: &str, views: &CalibrationViews) -> anyhow::Result<RigViews> {
    let used = views.names.iter().filter(|view| view.reason.is_none());
    let mut numbered: BTreeMap<u64, usize> = BTreeMap::new();
    for (index, view) in used.enumerate() {
        let number = number(&view.name).with_context(|| {
            format!("{camera}: {} has no number: pictures of one moment have the same", view.name)
        })?;
        if numbered.insert(number, index).is_some() {
            bail!(
                "{camera}: two pictures have the number {number}, as {}: the last number in a name is the moment",
                view.name
            );
        }
    }
    let corners = |(number, index): (u64, usize)| (number, views.corners[index].clone());
    let views_of = numbered.into_iter().map(corners).collect();
    Ok(RigViews { image_size: views.image_size, views: views_of, known_lens: None })
}

/// Lens of an earlier calibration with its uncertainty.
///
/// # Errors
///
/// If the file can't be read, or states no uncertainty.
pub fn known_lens(path: &Path) -> anyhow::Result<KnownLens> {
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let old = import::read(&text).with_context(|| format!("could not use {path:?}"))?;
    let covariance = old.covariance.with_context(|| {
        format!("{path:?} states no uncertainty: a lens of boresight's own file can be held")
    })?;
    Ok(KnownLens::new(&old.camera, &covariance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_one_moment_have_one_number() {
        for (name, wanted) in [
            ("left01.jpg", Some(1)),
            ("cam2/right-0007.png", Some(7)),
            ("camera0_3.png", Some(3)),
            ("1403636579763555584.png", Some(1_403_636_579_763_555_584)),
            ("drive.mcap#12", Some(12)),
            ("board7_rect.png", Some(7)),
            ("board.png", None),
        ] {
            assert_eq!(number(name), wanted, "{name}");
        }
    }

    #[test]
    fn a_folder_of_all_pictures_is_told_apart_by_their_names() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["left01.png", "left02.png", "right01.png", "right02.png"] {
            std::fs::write(folder.path().join(name), b"").expect("written");
        }
        let cameras = cameras_in(&[folder.path().to_path_buf()]).expect("two cameras");
        let names: Vec<&str> = cameras.iter().map(|camera| camera.name.as_str()).collect();
        assert_eq!(names, ["left", "right"]);
        assert!(cameras.iter().all(|camera| camera.files.len() == 2));
        std::fs::remove_file(folder.path().join("right01.png")).expect("removed");
        std::fs::remove_file(folder.path().join("right02.png")).expect("removed");
        let one = cameras_in(&[folder.path().to_path_buf()]).expect_err("one camera");
        assert!(one.to_string().contains("two cameras or more"), "{one}");
    }

    #[test]
    fn a_name_before_the_path_names_the_camera() {
        assert_eq!(named(Path::new("left=a/b")), (Some("left".into()), "a/b".into()));
        assert_eq!(named(Path::new("a/b=c")), (None, "a/b=c".into()));
    }
}
