//! Judges a calibration of any program by a fresh lens.

use std::{path::Path, thread::available_parallelism};

use super::calibration_views::CalibrationViews;
use crate::Announcer;
use boresight_calibrate::{
    Answer, Calibration, CalibrationParams, GivenLens, LensFlaw, NotCalibrated, NotJudged, judge,
};
use boresight_formats::{
    CalibrationFile, FindingEntry, JudgementFile,
    import::{FileDoubt, OldCalibration},
};
use boresight_geometry::boards::Board;
use boresight_present::text::judgement as words;

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
}

impl Fresh {
    /// Lens of `views` of `board`, calculated on every core.
    pub fn of(
        mut views: CalibrationViews,
        board: Board,
        params: &CalibrationParams,
        announcer: &Announcer,
    ) -> Self {
        let threads = available_parallelism().map_or(1, usize::from);
        let params = CalibrationParams { threads, ..params.clone() };
        let (lens, file) = views.calibrated_with_file(&board, &params, None, announcer);
        Self { views, board, lens, file }
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

/// Answer about `old` in the file `path`, held to `fresh`, with its file. Errors above `limit_px`
/// matter; without it, those that no GOOD calibration has.
pub fn judgement(
    path: &Path,
    old: &OldCalibration,
    fresh: Option<&Fresh>,
    limit_px: Option<f64>,
) -> (Answer, JudgementFile) {
    let given = GivenLens { camera: old.camera, image_size: old.image_size };
    let shown = FileDoubt::of(old);
    let mut doubts: Vec<String> = shown.iter().map(words::file_doubt).collect();
    let judged = match fresh {
        None => Err(LensFlaw::of(&old.camera, old.image_size, &old.outlines)
            .map_or(NotJudged::NoPictures, NotJudged::Impossible)),
        Some(fresh) => match &fresh.lens {
            Ok(lens) => judge(&given, &fresh.views.corners, &fresh.board, lens, limit_px)
                .map(|judged| (judged, lens)),
            Err(_) => Err(NotJudged::NoFreshLens),
        },
    };
    let (answer, (message, action)) = match &judged {
        Ok((judged, lens)) => {
            let pp_px = Some(&lens.camera.pp_px).filter(|_| shown.iter().any(FileDoubt::is_pp));
            doubts.extend(words::judgement_reasons(judged, pp_px));
            (judged.answer, words::judgement(judged))
        }
        Err(reason) => {
            let bad = |finding: &&FindingEntry| finding.severity == "bad";
            let findings = fresh.map(|fresh| &fresh.file.findings).into_iter().flatten();
            let first = findings.filter(|_| *reason == NotJudged::NoFreshLens).find(bad);
            doubts.extend(first.map(|finding| finding.message.clone()));
            (reason.answer(), words::not_judged(reason))
        }
    };
    let judged = judged.as_ref().map(|(judged, lens)| (judged, *lens));
    let judged = judged.map_err(NotJudged::code);
    let of = (&*path.display().to_string(), old.format.name());
    let words = (message, action, doubts);
    let mut file = JudgementFile::of(of, old.image_size, judged, answer.code(), words);
    file.shown = shown.iter().map(|doubt| doubt.code().into()).collect();
    (answer, file)
}
