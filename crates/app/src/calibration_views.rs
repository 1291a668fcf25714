//! The views of a calibration: from pictures, a table of corners, or the journal of a session.

use std::{
    cell::LazyCell,
    path::{Path, PathBuf},
    thread::available_parallelism,
};

use anyhow::{Context, anyhow, bail};

#[cfg(feature = "report")]
use super::report::picture_beside;
use super::{Announcer, SavedSession, result};
use boresight_calibrate::{Calibration, CalibrationParams, NotCalibrated, calibrate};
use boresight_capture::{CaptureError, Upright, read_picture_turned};
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_formats::{CalibrationFile, ViewName, corner_table};
use boresight_geometry::{
    Corner, board::Checkerboard, expect_unseen, frame::ImageSize, seen_count,
};
#[cfg(feature = "report")]
use boresight_present::report::Thumbnail;
use boresight_present::text;
use boresight_run::pipeline::detect_many;

/// Least number of seen corners in a view: a pose has six parameters.
const LEAST_CORNERS: usize = 6;
/// Of so many views, one may be left out: of more, it's the board or the camera that is another one.
const LEFT_OUT_OF: usize = 3;

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

/// A view as it comes: its name, and the corners row by row over the board, or why there are none.
pub type GivenView = (String, Result<Vec<Corner>, String>);

impl CalibrationViews {
    /// The views of pictures of `image_size` with these corners of `board`. Views of fewer than six corners are left out.
    pub fn of(
        given: impl IntoIterator<Item = GivenView>,
        image_size: ImageSize,
        board: &Checkerboard,
    ) -> Self {
        let mut views =
            Self { image_size, corners: Vec::new(), names: Vec::new(), pictures: Vec::new() };
        let board_m = board.corners_in_board_m();
        for (name, corners) in given {
            let enough = corners.and_then(|mut corners| match seen_count(&corners) {
                0 => Err("no corners".to_owned()),
                few if few < LEAST_CORNERS => {
                    Err(format!("{few} corners: a view needs {LEAST_CORNERS}"))
                }
                _ => {
                    // Others are in nobody's way: what isn't seen only needs a place.
                    if corners.len() == board_m.len() {
                        expect_unseen(&board_m, &mut corners);
                    }
                    Ok(corners)
                }
            });
            views.names.push(ViewName {
                name,
                number: None,
                reason: enough.as_ref().err().cloned(),
            });
            views.corners.extend(enough);
        }
        views
    }

    /// Calibrates from them. A view whose corners can't be an image of the board is left out, with its reason in
    /// [`Self::names`], as long as those are a third at most: else it's the board that is wrong.
    ///
    /// # Errors
    ///
    /// As [`calibrate`].
    pub fn calibrated(
        &mut self,
        board: &Checkerboard,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Result<Calibration, NotCalibrated> {
        let most_left_out = self.corners.len() / LEFT_OUT_OF;
        for left_out in 0.. {
            let result = calibrate(&self.corners, board, self.image_size, params);
            let view = match result {
                Err(NotCalibrated::NoHomography { view } | NotCalibrated::NoGrid { view })
                    if left_out < most_left_out =>
                {
                    view
                }
                result => return result,
            };
            self.corners.remove(view);
            if view < self.pictures.len() {
                self.pictures.remove(view);
            }
            let used = self.names.iter_mut().filter(|name| name.reason.is_none());
            if let Some(name) = used.into_iter().nth(view) {
                announcer.say(&format!("{}: not used. {}", name.name, text::NOT_OF_THE_BOARD));
                name.reason = Some(text::NOT_OF_THE_BOARD.into());
            }
        }
        Err(NotCalibrated::NoViews)
    }

    /// As [`Self::calibrated`], with the file of the result. If the views are those of `session`, it's a file of its camera.
    pub fn calibrated_with_file(
        &mut self,
        board: &Checkerboard,
        params: &CalibrationParams,
        session: Option<&SavedSession>,
        announcer: &Announcer,
    ) -> WithFile {
        let result = self.calibrated(board, params, announcer);
        let (size, words) = (self.image_size, text::FINDING_WORDS);
        let file = CalibrationFile::of(result.as_ref(), size, board, &self.names, words);
        let file = match session {
            Some(SavedSession { session, header, .. }) => {
                result::from_session(file, session, header)
            }
            None => file,
        };
        (result, file)
    }
}

/// What came of a calibration, and its file.
pub type WithFile = (Result<Calibration, NotCalibrated>, CalibrationFile);

/// The views that a session took.
#[derive(Debug)]
pub struct SessionViews {
    /// The views, with the corners that the journal has: those of a board that was cut off, too, which the pictures alone
    /// don't give again.
    pub views: CalibrationViews,
    /// The noise of a corner that the session measured, as a standard deviation in pixels.
    pub noise_floor_px: Option<f64>,
    /// The session: what it was taken with, and by which camera.
    pub saved: SavedSession,
}

/// The views that the session at `path` took.
///
/// # Errors
///
/// As [`SavedSession::open`], and if the board isn't one.
pub fn from_session(path: &Path, announcer: &Announcer) -> anyhow::Result<SessionViews> {
    let saved = SavedSession::open(path)?;
    saved.announce(announcer);
    let corners = saved.session.corners_at_one_instant();
    let taken = saved.session.accepted().iter().zip(corners);
    let given = taken.map(|(taken, corners)| (taken.picture_name(), Ok(corners.clone())));
    let board = saved.header.config.board()?;
    let mut views = CalibrationViews::of(given, saved.header.image_size(), &board);
    for (view, taken) in views.names.iter_mut().zip(saved.session.accepted()) {
        view.number = result::view_name(taken).number;
    }
    let noise_floor_px = saved.session.calibration().and_then(|found| found.noise_floor_px);
    Ok(SessionViews { views, noise_floor_px, saved })
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
    let folder = path.parent().unwrap_or(Path::new("."));
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let table = corner_table::read(&text, board.corner_count())
        .with_context(|| format!("could not use {path:?}"))?;
    let given = table.into_iter().map(|view| (view.name, Ok(view.corners.unwrap_or_default())));
    let mut views = CalibrationViews::of(given, image_size, board);
    if with_pictures {
        let used = views.names.iter().filter(|view| view.reason.is_none());
        views.pictures = used.map(|view| picture_beside(folder, &view.name, image_size)).collect();
    }
    Ok(views)
}

/// Size of a picture as it's stored.
fn stored_size(path: &Path) -> Option<ImageSize> {
    read_picture_turned(path, Upright::AsStored).ok().map(|image| ImageSize::of(&image))
}

/// The views of the pictures `inputs`, read the way up that `upright` says, in which `board` is searched on every core. Calls
/// `progress` after each picture, and announces each that isn't used and why: also those that are damaged, and those that
/// haven't the size of most. With `with_thumbnails`, also small copies.
///
/// # Errors
///
/// If a picture isn't there or all are damaged, or if more than a third haven't the size of most.
pub fn from_pictures(
    (inputs, upright): (&[PathBuf], Upright),
    board: &Checkerboard,
    with_thumbnails: bool,
    announcer: &Announcer,
    progress: impl Fn() + Sync,
) -> anyhow::Result<CalibrationViews> {
    let read = std::sync::Mutex::new(vec![None; inputs.len()]);
    let threads = available_parallelism().map_or(1, usize::from);
    let load = |index: usize| -> Result<_, CaptureError> {
        let image = read_picture_turned(&inputs[index], upright)?;
        let thumbnail = if with_thumbnails { Thumbnail::of(&image) } else { None };
        if let Ok(mut read) = read.lock() {
            read[index] = Some((ImageSize::of(&image), thumbnail));
        }
        Ok(image)
    };
    let found = detect_many(inputs.len(), threads, board, load, |_| None, |_| progress())?;
    let read = read.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let sizes = || read.iter().flatten().map(|(size, _)| *size);
    // Of two sizes that are as frequent, the first.
    let image_size = sizes().rev().max_by_key(|size| sizes().filter(|other| other == size).count());
    let Some(image_size) = image_size else {
        let failed = found.into_iter().find_map(Result::err);
        return Err(failed.map_or_else(|| anyhow!("no pictures"), Into::into));
    };
    let is_few =
        sizes().filter(|size| *size != image_size).count() * LEFT_OUT_OF <= sizes().count();
    // A picture of that size.
    let has_usual =
        |read: &Option<(ImageSize, _)>| read.as_ref().is_some_and(|(size, _)| *size == image_size);
    let usual = read.iter().position(has_usual).map(|place| inputs[place].as_path());
    let usual_stored = LazyCell::new(|| usual.and_then(stored_size));
    let mut views = CalibrationViews {
        image_size,
        corners: Vec::new(),
        names: Vec::new(),
        pictures: Vec::new(),
    };
    for ((path, seen), read) in inputs.iter().zip(found).zip(read) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let other_size = read.as_ref().map(|(size, _)| *size).filter(|size| *size != image_size);
        let corners = match (seen, other_size) {
            (Err(damaged @ CaptureError::Decode { .. }), _) => Err(damaged.to_string()),
            (Err(err), _) => return Err(err.into()),
            (_, Some(size)) => {
                let differs = format!("It's {size}, others are {image_size}");
                let is_turned = upright == Upright::AsMarked
                    && [size.height_px, size.width_px]
                        == [image_size.width_px, image_size.height_px]
                    && stored_size(path) == *usual_stored;
                let remedy = is_turned.then_some(text::source::ALIKE_AS_STORED);
                if !is_few {
                    let remedy = remedy.unwrap_or("Pictures of one calibration have one size");
                    bail!("{name}: {differs}. {remedy}");
                }
                Err(match remedy {
                    Some(remedy) => format!("{differs}. {remedy}"),
                    None => differs,
                })
            }
            (Ok(seen), None) => {
                seen.map(|detection| detection.corners).map_err(|miss| text::miss(&miss))
            }
        };
        let reason = corners.as_ref().err().cloned();
        match &reason {
            Some(reason) => announcer.say(&format!("{name}: not used. {reason}")),
            None => views.pictures.push(read.and_then(|(_, thumbnail)| thumbnail)),
        }
        views.names.push(ViewName { name, number: None, reason });
        views.corners.extend(corners);
    }
    Ok(views)
}
