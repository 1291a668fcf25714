//! Views of a calibration: from pictures, a table of corners, or the journal of a session.

use std::{
    cell::LazyCell,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};

use super::json::DetectedLine;
#[cfg(feature = "report")]
use crate::session::report::picture_beside;
use crate::{
    Announcer, SavedSession, cores,
    session::{result, scene},
};
use boresight_calibrate::{Calibration, CalibrationParams, NotCalibrated, calibrate};
use boresight_capture::{CaptureError, Upright, read_picture_turned};
use boresight_detect::agreed;
use boresight_files::{Links, TEXT_LIMIT, read_text};
use boresight_formats::{CalibrationFile, ViewName, corner_table};
use boresight_geometry::{
    Corner,
    boards::{Board, BoardChoice},
    expect_unseen,
    frame::{ImageSize, SceneScale},
    seen_count,
};
use boresight_guide::session::Session;
#[cfg(feature = "report")]
use boresight_present::report::Thumbnail;
use boresight_present::text;
use boresight_run::pipeline::detect_many;

/// Minimum number of seen corners in a view: a pose has six parameters.
const LEAST_CORNERS: usize = 6;
/// Up to 1 view in 3 may be left out; beyond, the board or the camera is a different one.
const LEFT_OUT_OF: usize = 3;

/// Corners and names of the pictures of one camera.
#[derive(Clone, Debug)]
pub struct CalibrationViews {
    /// Size of every picture.
    pub image_size: ImageSize,
    /// Corners of each used picture, in the board's numbering order.
    pub corners: Vec<Vec<Corner>>,
    /// Every picture, with the reason if unused.
    pub names: Vec<ViewName>,
    /// Thumbnails of the used pictures, if requested and available.
    pub pictures: Vec<Option<Thumbnail>>,
    /// Files of the used pictures, with their orientation; none if unknown.
    pub files: (Vec<PathBuf>, Upright),
    /// Focal length of each used picture by the scene behind the board, if recorded.
    pub scene: Vec<Option<SceneScale>>,
    /// Board on which the pictures agree that none of them shows the named one.
    pub instead: Option<BoardChoice>,
}

/// Thumbnail in a report; uninhabited in builds without reports.
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

/// Name of a view, with corners row by row over the board, or the reason for missing.
pub type GivenView = (String, Result<Vec<Corner>, String>);

impl CalibrationViews {
    fn none(image_size: ImageSize, upright: Upright) -> Self {
        Self {
            image_size,
            corners: Vec::new(),
            names: Vec::new(),
            pictures: Vec::new(),
            files: (Vec::new(), upright),
            scene: Vec::new(),
            instead: None,
        }
    }

    /// Views from pictures of `image_size` with `board` corners. Skips views of fewer than six
    /// corners.
    pub fn of(
        given: impl IntoIterator<Item = GivenView>,
        image_size: ImageSize,
        board: &Board,
    ) -> Self {
        let mut views = Self::none(image_size, Upright::AsStored);
        let board_m = board.corners_in_board_m();
        for (name, corners) in given {
            let enough = corners.and_then(|mut corners| match seen_count(&corners) {
                0 => Err("no corners".to_owned()),
                few if few < LEAST_CORNERS => {
                    Err(format!("{few} corners: a view needs {LEAST_CORNERS}"))
                }
                _ => {
                    // Other views do no harm: unseen corners only need a place.
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

    /// Calibrates from the views. Leaves out views with corners that can't be an image of the
    /// board, with the reason in [`Self::names`], if at most a third are affected: beyond, the
    /// board is wrong.
    ///
    /// # Errors
    ///
    /// As [`calibrate`].
    pub fn calibrated(
        &mut self,
        board: &Board,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Result<Calibration, NotCalibrated> {
        let most_left_out = self.corners.len() / LEFT_OUT_OF;
        for left_out in 0.. {
            let result = self.calibrated_by(self.scene.clone(), board, params);
            let view = match result {
                Err(NotCalibrated::NoHomography { view } | NotCalibrated::NoGrid { view })
                    if left_out < most_left_out =>
                {
                    view
                }
                result => return self.with_scene(result?, board, params, announcer),
            };
            self.corners.remove(view);
            if view < self.pictures.len() {
                self.pictures.remove(view);
            }
            if view < self.files.0.len() {
                self.files.0.remove(view);
            }
            if view < self.scene.len() {
                self.scene.remove(view);
            }
            let used = self.names.iter_mut().filter(|name| name.reason.is_none());
            if let Some(name) = used.into_iter().nth(view) {
                announcer.say(&format!("{}: not used. {}", name.name, text::NOT_OF_THE_BOARD));
                name.reason = Some(text::NOT_OF_THE_BOARD.into());
            }
        }
        Err(NotCalibrated::NoViews)
    }

    /// Calibration with the scene behind the board as a witness, if `found` without it asks for one
    /// and there are pictures.
    fn with_scene(
        &self,
        found: Calibration,
        board: &Board,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Result<Calibration, NotCalibrated> {
        let (files, upright) = (&self.files.0, self.files.1);
        let is_known = !self.scene.is_empty() || files.len() != self.corners.len();
        if is_known || !found.asks_for_scene() {
            return Ok(found);
        }
        announcer.say(text::session_news::ASKS_SCENE);
        let scene = scene::of_pictures((files, upright), &self.corners, &found);
        if scene.iter().all(Option::is_none) {
            return Ok(found);
        }
        self.calibrated_by(scene, board, params)
    }

    fn calibrated_by(
        &self,
        scene: Vec<Option<SceneScale>>,
        board: &Board,
        params: &CalibrationParams,
    ) -> Result<Calibration, NotCalibrated> {
        let params = &CalibrationParams { scene, ..params.clone() };
        calibrate(&self.corners, board, self.image_size, params)
    }

    /// Calibrates as [`Self::calibrated`], with the file of the result. Views of `session` make it
    /// a file of the session's camera.
    pub fn calibrated_with_file(
        &mut self,
        board: &Board,
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

/// Result of a calibration and file.
pub type WithFile = (Result<Calibration, NotCalibrated>, CalibrationFile);

/// Views of a session.
#[derive(Debug)]
pub struct SessionViews {
    /// Views with the corners in the journal, including corners of boards cut off by the edge,
    /// which the pictures alone don't give again.
    pub views: CalibrationViews,
    /// Standard deviation of a corner as measured by the session, in pixels.
    pub noise_floor_px: Option<f64>,
    /// Settings and camera of the session.
    pub saved: SavedSession,
}

/// Reads the views of the session at `path`.
///
/// # Errors
///
/// As [`SavedSession::open`], and if the board isn't usable.
pub fn from_session(path: &Path, announcer: &Announcer) -> anyhow::Result<SessionViews> {
    let saved = SavedSession::open(path)?;
    saved.announce(announcer);
    let (mut views, noise_floor_px) = of_session(&saved.session, &saved.header.config.board()?);
    views.files.0 = scene::stored_pictures(path, &saved.session);
    Ok(SessionViews { views, noise_floor_px, saved })
}

/// Views of `session` with its `board`, and the standard deviation of a corner as measured by it.
pub fn of_session(session: &Session, board: &Board) -> (CalibrationViews, Option<f64>) {
    let corners = session.corners_at_one_instant();
    let taken = session.accepted().iter().zip(corners);
    let given = taken.map(|(taken, corners)| (taken.picture_name(), Ok(corners.clone())));
    let mut views = CalibrationViews::of(given, session.setup().image_size, board);
    views.scene = session.scene();
    for (view, taken) in views.names.iter_mut().zip(session.accepted()) {
        view.number = result::view_name(taken).number;
    }
    (views, session.calibration().and_then(|found| found.noise_floor_px))
}

/// Reads the views from the corner table in `path`, row by row over `board`, of pictures of
/// `image_size`. With `with_pictures`, adds thumbnails of the pictures beside the table.
///
/// # Errors
///
/// If the table can't be read.
pub fn from_table(
    path: &Path,
    image_size: ImageSize,
    board: &Board,
    with_pictures: bool,
) -> anyhow::Result<CalibrationViews> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let text = read_text(path, TEXT_LIMIT, Links::Followed)?;
    let given: Vec<GivenView> = if is_json_lines(path) {
        json_lines(&text, board).with_context(|| format!("could not use {path:?}"))?
    } else {
        let table = corner_table::read(&text, board.corner_count())
            .with_context(|| format!("could not use {path:?}"))?;
        table.into_iter().map(|view| (view.name, Ok(view.corners.unwrap_or_default()))).collect()
    };
    let mut views = CalibrationViews::of(given, image_size, board);
    if with_pictures {
        let used = views.names.iter().filter(|view| view.reason.is_none());
        views.pictures = used.map(|view| picture_beside(folder, &view.name, image_size)).collect();
    }
    Ok(views)
}

/// True for a table of corners: `filename x y level` (.vnl), or the lines of `detect --json`
/// (.jsonl), which keep each corner's standard deviation.
pub fn is_table(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "vnl") || is_json_lines(path)
}

fn is_json_lines(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "jsonl")
}

fn json_lines(text: &str, board: &Board) -> anyhow::Result<Vec<GivenView>> {
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(index, line)| {
            let line: DetectedLine = serde_json::from_str(line)
                .with_context(|| format!("line {} is none of detect --json", index + 1))?;
            Ok((line.file.clone(), line.on_board(board)))
        })
        .collect()
}

/// Size of a stored picture.
fn stored_size(path: &Path) -> Option<ImageSize> {
    read_picture_turned(path, Upright::AsStored).ok().map(|image| ImageSize::of(&image))
}

/// Searches the pictures `inputs`, oriented by `upright`, for `board` on every core. Calls
/// `progress` after each picture, and announces each unused picture with the reason, including
/// damaged ones and those of another size than most. With `with_thumbnails`, adds thumbnails.
///
/// # Errors
///
/// If a picture is missing or all are damaged, or if more than a third differ in size from most.
pub fn from_pictures(
    (inputs, upright): (&[PathBuf], Upright),
    board: &Board,
    with_thumbnails: bool,
    announcer: &Announcer,
    progress: impl Fn() + Sync,
) -> anyhow::Result<CalibrationViews> {
    let read = std::sync::Mutex::new(vec![None; inputs.len()]);
    let load = |index: usize| -> Result<_, CaptureError> {
        let image = read_picture_turned(&inputs[index], upright)?;
        let thumbnail = if with_thumbnails { Thumbnail::of(&image) } else { None };
        if let Ok(mut read) = read.lock() {
            read[index] = Some((ImageSize::of(&image), thumbnail));
        }
        Ok(image)
    };
    let found = detect_many(inputs.len(), cores(), board, load, |_| None, |_| progress())?;
    let read = read.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let sizes = || read.iter().flatten().map(|(size, _)| *size);
    // Of two equally frequent sizes, the first.
    let image_size = sizes().rev().max_by_key(|size| sizes().filter(|other| other == size).count());
    let Some(image_size) = image_size else {
        let failed = found.into_iter().find_map(Result::err);
        return Err(failed.map_or_else(|| anyhow!("no pictures"), Into::into));
    };
    let is_few =
        sizes().filter(|size| *size != image_size).count() * LEFT_OUT_OF <= sizes().count();
    // A picture of the usual size.
    let has_usual =
        |read: &Option<(ImageSize, _)>| read.as_ref().is_some_and(|(size, _)| *size == image_size);
    let usual = read.iter().position(has_usual).map(|place| inputs[place].as_path());
    let usual_stored = LazyCell::new(|| usual.and_then(stored_size));
    let mut views = CalibrationViews::none(image_size, upright);
    let mut misses = Vec::new();
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
            (Ok(seen), None) => seen.map(|detection| detection.corners).map_err(|miss| {
                misses.push(miss);
                text::miss(&miss)
            }),
        };
        let reason = corners.as_ref().err().cloned();
        match &reason {
            Some(reason) => announcer.say(&format!("{name}: not used. {reason}")),
            None => {
                views.pictures.push(read.and_then(|(_, thumbnail)| thumbnail));
                views.files.0.push(path.clone());
            }
        }
        views.names.push(ViewName { name, number: None, reason });
        views.corners.extend(corners);
    }
    text::misses(&misses, inputs.len()).iter().for_each(|line| announcer.say(line));
    views.instead = agreed(&misses).filter(|_| views.corners.is_empty());
    Ok(views)
}
