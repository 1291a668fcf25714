//! Judges a calibration of any program by a fresh lens.

use std::path::Path;

use super::calibration_views::{CalibrationViews, of_session};
use crate::{Announcer, cores};
use boresight_calibrate::{
    AcceptanceGoal, Answer, Calibration, CalibrationParams, GivenLens, NotCalibrated, NotJudged,
    judge,
};
use boresight_formats::{
    CalibrationFile, FindingEntry, JUDGEMENT_SCHEMA, JudgementFile,
    import::{FileDoubt, OldCalibration},
};
use boresight_geometry::boards::Board;
use boresight_guide::session::Session;
use boresight_present::text::judgement as words;
use boresight_run::config::Config;

/// Fresh lens, the views behind it, and its file.
#[derive(Debug)]
pub struct Fresh {
    /// Views behind the lens.
    pub views: CalibrationViews,
    /// The board in them.
    pub board: Board,
    /// The lens.
    pub lens: Result<Calibration, NotCalibrated>,
    /// File of the lens.
    pub file: CalibrationFile,
    /// Focal length on 35 mm film in the pictures' EXIF data, if stated, in millimetres.
    pub exif_mm: Option<f64>,
}

impl Fresh {
    /// Lens of `views` of `board`, calculated on every core.
    pub fn of(
        mut views: CalibrationViews,
        board: Board,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Self {
        let params = CalibrationParams { threads: cores(), ..params.clone() };
        let (lens, file) = views.calibrated_with_file(&board, &params, None, announcer);
        Self { views, board, lens, file, exif_mm: None }
    }

    /// Lens of the views of `session`, by its settings in `config`.
    ///
    /// # Errors
    ///
    /// If the board isn't usable.
    pub fn of_session(
        session: &Session,
        config: &Config,
        announcer: &Announcer,
    ) -> anyhow::Result<Self> {
        let board = config.board()?;
        let (views, noise_floor_px) = of_session(session, &board);
        let params = CalibrationParams { noise_floor_px, ..config.calibration() };
        Ok(Self::of(views, board, &params, announcer))
    }

    /// Lens of the corners in the file of `old`. `None` if it brings none.
    pub fn of_own_corners(
        old: &OldCalibration,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Option<Self> {
        let own = old.corners.as_ref()?;
        let given = own.views.iter().cloned();
        let given = given.map(|view| (view.name, Ok(view.corners.unwrap_or_default())));
        let views = CalibrationViews::of(given, old.image_size, &own.board);
        Some(Self::of(views, own.board, params, announcer))
    }
}

/// Answer about `old` in the file `path`, held to `fresh`, with its file. Errors beyond `goal`
/// matter, by default beyond the goal of a Good calibration.
pub fn judgement(
    path: &Path,
    old: &OldCalibration,
    fresh: Option<&Fresh>,
    goal: Option<AcceptanceGoal>,
) -> (Answer, JudgementFile) {
    let given = GivenLens { camera: old.camera, image_size: old.image_size };
    let mut shown = FileDoubt::of(old);
    let exif_mm = fresh.and_then(|fresh| fresh.exif_mm);
    shown.extend(exif_mm.and_then(|exif_mm| FileDoubt::by_exif(old, exif_mm)));
    let mut doubts: Vec<String> = shown.iter().map(words::file_doubt).collect();
    let judged = match fresh {
        Some(Fresh { lens: Ok(lens), views, board, .. }) => {
            judge(&given, &views.corners, board, lens, goal).map(|judged| (judged, lens))
        }
        Some(_) => Err(NotJudged::NoFreshLens.or_flaw(&given, &old.outlines)),
        None => Err(NotJudged::NoPictures.or_flaw(&given, &old.outlines)),
    };
    let (answer, (message, action), numbers) = match &judged {
        Ok((judged, lens)) => {
            let pp_is_doubtful = shown.iter().any(FileDoubt::is_pp);
            doubts.extend(words::judgement_reasons(judged, lens, pp_is_doubtful));
            (judged.answer, words::judgement(judged), JudgementFile::numbers(judged, lens))
        }
        Err(reason) => {
            let mut none =
                JudgementFile { reason: Some(reason.code().into()), ..JudgementFile::default() };
            let (message, mut action) = words::not_judged(reason, old.format);
            match (reason, fresh) {
                (NotJudged::Misses { wrong, .. }, _) => {
                    doubts.push(words::wrong_part(wrong.as_ref()));
                    none.wrong = wrong.as_ref().map(|part| part.code().into());
                }
                (NotJudged::NoFreshLens, Some(fresh)) => {
                    let bad = |finding: &&FindingEntry| finding.severity == "bad";
                    if let Some(finding) = fresh.file.findings.iter().find(bad) {
                        doubts.push(finding.message.clone());
                        // What would tell.
                        action.clone_from(&finding.action);
                    }
                }
                _ => {}
            }
            (reason.answer(), (message, action), none)
        }
    };
    let file = JudgementFile {
        schema: JUDGEMENT_SCHEMA.into(),
        file: path.display().to_string(),
        format: old.format.name().into(),
        image_size: [old.image_size.width_px, old.image_size.height_px],
        answer: answer.code().into(),
        message,
        action,
        doubts,
        shown: shown.iter().map(|doubt| doubt.code().into()).collect(),
        ..numbers
    };
    (answer, file)
}
