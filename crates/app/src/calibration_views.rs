//! The views of a calibration that has no session: from pictures, or from a table of corners.

use std::{
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use anyhow::{Context, bail};

use super::Announcer;
#[cfg(feature = "report")]
use super::report::picture_beside;
use boresight_capture::{CaptureError, read_picture};
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_formats::{ViewName, corner_table};
use boresight_geometry::{
    Corner, board::Checkerboard, expect_unseen, frame::ImageSize, seen_count,
};
#[cfg(feature = "report")]
use boresight_present::report::Thumbnail;
use boresight_present::text;
use boresight_run::pipeline::detect_many;

/// Least number of seen corners in a view: a pose has six parameters.
const LEAST_CORNERS: usize = 6;

/// Corners and names of the pictures of one camera.
#[derive(Clone, Debug)]
pub struct CalibrationViews {
    /// Size of every picture.
    pub image_size: ImageSize,
    /// Corners of each used picture, in the board's numbering order.
    pub corners: Vec<Vec<Corner>>,
    /// Every picture, and why it isn't used if it isn't.
    pub names: Vec<ViewName>,
    /// Small copies of the used pictures, if they were asked for and exist.
    pub pictures: Vec<Option<Thumbnail>>,
}

/// A small picture in a report, of which this build has none.
#[cfg(not(feature = "report"))]
#[derive(Clone, Debug)]
pub enum Thumbnail {}

#[cfg(not(feature = "report"))]
impl Thumbnail {
    fn of(_image: &image::GrayImage) -> Option<Self> {
        None
    }
}

#[cfg(not(feature = "report"))]
fn picture_beside(_folder: &Path, _name: &str, _size: ImageSize) -> Option<Thumbnail> {
    None
}

/// The views of the corner table in the file `path`, row by row over `board`, of pictures of `image_size`. With
/// `with_pictures`, also small copies of the pictures that lie beside the table.
///
/// # Errors
///
/// If the table can't be read.
pub fn from_table(
    path: &Path,
    image_size: ImageSize,
    board: &Checkerboard,
    with_pictures: bool,
) -> anyhow::Result<CalibrationViews> {
    let mut views = CalibrationViews {
        image_size,
        corners: Vec::new(),
        names: Vec::new(),
        pictures: Vec::new(),
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let table = corner_table::read(&text, board.corner_count())
        .with_context(|| format!("could not use {path:?}"))?;
    let board_m = board.corners_in_board_m();
    for mut view in table {
        let count = view.corners.as_deref().map_or(0, seen_count);
        if count < LEAST_CORNERS {
            view.corners = None;
        }
        let reason = match count {
            0 => Some("no corners in the table".to_owned()),
            _ if count < LEAST_CORNERS => {
                Some(format!("{count} corners in the table: a view needs {LEAST_CORNERS}"))
            }
            _ => None,
        };
        if let Some(corners) = &mut view.corners {
            expect_unseen(&board_m, corners);
        }
        if with_pictures && reason.is_none() {
            views.pictures.push(picture_beside(folder, &view.name, image_size));
        }
        views.names.push(ViewName { name: view.name, reason });
        views.corners.extend(view.corners);
    }
    Ok(views)
}

/// The views of the pictures `inputs`, in which `board` is searched on every core. Calls `progress` after each
/// picture, and announces each that isn't used and why. With `with_thumbnails`, also small copies.
///
/// # Errors
///
/// If a picture can't be read, or if the pictures differ in size.
pub fn from_pictures(
    inputs: &[PathBuf],
    board: &Checkerboard,
    with_thumbnails: bool,
    announcer: &Announcer,
    progress: impl Fn() + Sync,
) -> anyhow::Result<CalibrationViews> {
    let read = std::sync::Mutex::new(vec![None; inputs.len()]);
    let threads = available_parallelism().map_or(1, usize::from);
    let load = |index: usize| -> Result<_, CaptureError> {
        let image = read_picture(&inputs[index])?;
        let thumbnail = if with_thumbnails { Thumbnail::of(&image) } else { None };
        if let Ok(mut read) = read.lock() {
            read[index] = Some((ImageSize::of(&image), thumbnail));
        }
        Ok(image)
    };
    let found = detect_many(inputs.len(), threads, board, load, |_| None, |_| progress())?;
    let read = read.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut views: Option<CalibrationViews> = None;
    for ((path, seen), read) in inputs.iter().zip(found).zip(read) {
        let seen = seen?;
        let (size, thumbnail) = read.context("a picture was not read")?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let views = views.get_or_insert_with(|| CalibrationViews {
            image_size: size,
            corners: Vec::new(),
            names: Vec::new(),
            pictures: Vec::new(),
        });
        if size != views.image_size {
            let first = views.names.first().map_or("the first", |view| view.name.as_str());
            bail!(
                "{name} is {}x{}, {first} is {}x{}: pictures of one calibration have one size",
                size.width_px,
                size.height_px,
                views.image_size.width_px,
                views.image_size.height_px
            );
        }
        let reason = seen.as_ref().err().map(text::miss);
        if let Some(reason) = &reason {
            announcer.say(&format!("{name}: not used. {reason}"));
        }
        if reason.is_none() {
            views.pictures.push(thumbnail);
        }
        views.names.push(ViewName { name, reason });
        views.corners.extend(seen.map(|detection| detection.corners));
    }
    views.context("no pictures")
}
