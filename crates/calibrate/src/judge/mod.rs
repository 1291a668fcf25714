//! Judges the calibration of another program, or of another day, by a fresh one: the difference
//! between the two lenses is held to the uncertainty of the fresh one. See `docs/method.md`,
//! section 4.1.
//!
//! | file | holds |
//! |---|---|
//! | `mod` | the answer |
//! | `closest` | the turn of the camera, and the numbers, that bring one lens nearest to another |
//! | `wrong_part` | the numbers of a lens that explain a difference, a row a kind |
//! | `sized` | a lens for pictures of another size |
//! | `length` | the error of a measured length |

mod closest;
mod length;
mod sized;
#[cfg(test)]
mod tests;
mod wrong_part;

use nalgebra::{Point2, SVector, Vector2};

use self::closest::Rays;
pub use self::{
    length::LengthError,
    sized::Resized,
    wrong_part::{Axes, WrongPart},
};
use crate::{
    AcceptanceGoal, Calibration, CalibrationParams, LensFlaw, LensModel, Limits, Verdict,
    acceptance::TWO_SIDED_95, calibrate, drift::LEAST_SEEN, projection_jacobian,
};
use boresight_geometry::{
    BoardOutline, Camera, Corner, LENS_PARAMETERS, boards::Board, cell_centres_px, fit_pose,
    frame::ImageSize, seen_count,
};

/// Answer to the question whether a calibration is true, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Answer {
    /// The error of projection is surely within the limit.
    True,
    /// The pictures don't tell.
    CannotTell,
    /// The error of projection is surely beyond the limit.
    Off,
}

impl Answer {
    /// Answer about an error in the interval `[least, most]`.
    fn of([least, most]: [f64; 2], limit: f64) -> Self {
        if least > limit {
            Self::Off
        } else if most <= limit {
            Self::True
        } else {
            Self::CannotTell
        }
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::True => "true",
            Self::Off => "off",
            Self::CannotTell => "cannot-tell",
        }
    }
}

/// A lens to judge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenLens {
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Size of the calibrated pictures.
    pub image_size: ImageSize,
}

/// A judged lens.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// The answer.
    pub answer: Answer,
    /// How the pictures come from those of the calibration. `None` if they have its size.
    pub resized: Option<Resized>,
    /// Error of projection: root mean square per coordinate over the area covered by boards, after
    /// the best turn of the camera, in pixels.
    pub off_px: f64,
    /// Lower bound of the true error, with a probability of 97.5 %, in pixels.
    pub least_px: f64,
    /// Upper bound of the true error, with a probability of 95 %, in pixels: `off_px` and the bound
    /// of the fresh lens.
    pub most_px: f64,
    /// Largest displacement of a ray in that area, in pixels.
    pub worst_px: f64,
    /// Largest error that doesn't matter, in pixels.
    pub goal_px: f64,
    /// Error of the goal's length, decisive for the answer. `None` for a goal about projection.
    pub length: Option<LengthError>,
    /// Displacement at each cell of the picture, from the fresh lens to the given one, in pixels.
    pub displaced_px: Vec<(Point2<f64>, Vector2<f64>)>,
    /// Reprojection residuals per coordinate by the given lens, with the best poses, in pixels.
    /// `None` if no view has a pose.
    pub rms_px: Option<f64>,
    /// Numbers of the lens that explain the error. `None` if several differ, or if nothing is off.
    pub wrong: Option<WrongPart>,
}

/// Reason for no judgement.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotJudged {
    /// No pictures, and nothing that no lens has.
    #[error("a file alone can't show that it's true")]
    NoPictures,
    /// The lens can't be right in any picture.
    #[error("the lens can't be right: {0}")]
    Impossible(LensFlaw),
    /// The pictures have another shape than those of the calibration, and neither squeezed nor cut
    /// from the middle does its lens surely fit.
    #[error("pictures of {pictures}, calibrated for {given}")]
    OtherSize {
        /// Size of the pictures.
        pictures: ImageSize,
        /// Size in the calibration.
        given: ImageSize,
    },
    /// The length of the goal fits nowhere between the boards.
    #[error("the length fits nowhere into the part with boards")]
    LengthTooLong,
    /// The fresh lens isn't trustworthy: its findings say why.
    #[error("the pictures give no trustworthy lens")]
    NoFreshLens,
    /// The lens shows a part of where the boards were beyond the picture, or nowhere.
    #[error("{:.0} % of the part with boards is beyond the picture, or nowhere", 100.0 * share)]
    Misses {
        /// Share of the part with boards.
        share: f64,
        /// Numbers of the lens that explain it, if no others do.
        wrong: Option<WrongPart>,
    },
}

impl NotJudged {
    /// Answer without numbers: a lens that can't be right, or misses the picture, is off.
    pub fn answer(&self) -> Answer {
        match self {
            Self::Impossible(_) | Self::Misses { .. } => Answer::Off,
            Self::NoPictures | Self::OtherSize { .. } | Self::LengthTooLong | Self::NoFreshLens => {
                Answer::CannotTell
            }
        }
    }

    /// The flaw of `given` instead of this reason, if it has one and no part explains the reason.
    /// `outlines` as for [`LensFlaw::of`].
    pub fn or_flaw(self, given: &GivenLens, outlines: &[BoardOutline]) -> Self {
        let is_explained = matches!(self, Self::Misses { wrong: Some(_), .. });
        let flaw = LensFlaw::of(&given.camera, given.image_size, outlines);
        flaw.filter(|_| !is_explained).map_or(self, Self::Impossible)
    }

    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoPictures => "NO-PICTURES",
            Self::Impossible(_) => "LENS-IMPOSSIBLE",
            Self::OtherSize { .. } => "OTHER-SIZE",
            Self::LengthTooLong => "LENGTH-TOO-LONG",
            Self::NoFreshLens => "NO-FRESH-LENS",
            Self::Misses { .. } => "MISSES-PICTURE",
        }
    }
}

/// Judges `given` by `fresh`, the calibration of `views` of `board`.
///
/// Errors beyond `goal` matter, by default beyond the goal of a Good calibration. The error of
/// projection is the root mean square over the area covered by boards, after the best turn of the
/// camera: the orientation of a camera is no part of its calibration. The residuals of the given
/// lens never count.
///
/// With the difference `d` of the lenses and the error `ε` of the fresh one, the true error is
/// `|d − ε|`: at most `|d| + |ε|`, and at least `|d| − ε·d/|d|`, whose variance follows from the
/// covariance of the fresh lens. Both hold however the two lenses' errors depend on each other.
///
/// # Errors
///
/// [`NotJudged`].
pub fn judge(
    given: &GivenLens,
    views: &[Vec<Corner>],
    board: &Board,
    fresh: &Calibration,
    goal: Option<AcceptanceGoal>,
) -> Result<Judgement, NotJudged> {
    let outlines: Vec<BoardOutline> =
        views.iter().filter_map(|view| outline(view, board)).collect();
    let known: &[_] = if given.image_size == fresh.image_size { &outlines } else { &[] };
    held_to(given, views, board, fresh, &outlines, goal)
        .map_err(|reason| reason.or_flaw(given, known))
}

/// As [`judge`], without a look at what no lens has: a lens for another size may have it in
/// pictures of this one.
fn held_to(
    given: &GivenLens,
    views: &[Vec<Corner>],
    board: &Board,
    fresh: &Calibration,
    outlines: &[BoardOutline],
    goal: Option<AcceptanceGoal>,
) -> Result<Judgement, NotJudged> {
    let pictures = fresh.image_size;
    let reach_px = fresh.longer_side_px();
    let is_known = fresh.verdict != Verdict::Untrustworthy && !fresh.is_undetermined();
    let bound_px = fresh.covered_bound_px.filter(|_| is_known).ok_or(NotJudged::NoFreshLens)?;
    let is_covered = |px: &Point2<f64>| outlines.iter().any(|outline| outline.covers(px));
    let covered = Rays::of(&fresh.camera, cell_centres_px(pictures).filter(is_covered));
    if covered.count() == 0 {
        return Err(NotJudged::NoFreshLens);
    }
    let sized = sized::sized(given, pictures);
    let compared =
        sized.iter().filter_map(|(how, camera)| Some((*how, covered.closest_to(camera, &[])?)));
    let nearest = compared.min_by(|(_, a), (_, b)| a.off_px.total_cmp(&b.off_px));
    let (resized, closest) = nearest.ok_or(NotJudged::Misses { share: 1.0, wrong: None })?;
    let off_px = closest.off_px;
    let wrong = |off_px| WrongPart::of(&closest.camera, fresh, &covered, bound_px, off_px);
    let other_size = || NotJudged::OtherSize { pictures, given: given.image_size };
    let is_guess = resized.is_some_and(Resized::is_guess);
    let hits = closest.displaced_px.iter().filter(|(_, by)| by.norm() < reach_px).count();
    if hits < covered.count() {
        if is_guess {
            return Err(other_size());
        }
        let share = 1.0 - hits as f64 / covered.count() as f64;
        return Err(NotJudged::Misses { share, wrong: wrong(f64::INFINITY) });
    }
    let goal_px = match goal {
        Some(AcceptanceGoal::Projection { px }) => px,
        _ => Limits::of(pictures).goal_px,
    };
    let sd_px = sd_along(&closest.displaced_px, fresh, is_covered).ok_or(NotJudged::NoFreshLens)?;
    let (least_px, most_px) = ((off_px - TWO_SIDED_95 * sd_px).max(0.0), off_px + bound_px);
    let length = match goal {
        Some(goal @ AcceptanceGoal::Length { .. }) => {
            let error = LengthError::of(goal, &closest, fresh, is_covered);
            Some(error.ok_or(NotJudged::LengthTooLong)?)
        }
        _ => None,
    };
    let by_px = Answer::of([least_px, most_px], goal_px);
    let answer = length.as_ref().map_or(by_px, LengthError::answer);
    if is_guess && answer != Answer::True {
        return Err(other_size());
    }
    let is_off = answer == Answer::Off;
    let few_terms = || {
        let stated = LensModel::simplest_with(&closest.camera);
        if stated.coefficients() >= fresh.model.coefficients() {
            return None;
        }
        let params = CalibrationParams { models: vec![stated], ..CalibrationParams::default() };
        let simple = calibrate(views, board, pictures, &params).ok()?.camera;
        let px = cell_centres_px(pictures).filter(is_covered);
        WrongPart::is_of_few_terms(&closest.camera, &simple, px, off_px)
            .then_some(WrongPart::TooFewTerms)
    };
    let whole = Rays::of(&fresh.camera, cell_centres_px(pictures));
    let displaced_px = whole.displaced(&closest.camera, &closest.turn).into_iter();
    Ok(Judgement {
        answer,
        resized,
        off_px,
        least_px,
        most_px,
        worst_px: closest.displaced_px.iter().map(|(_, by)| by.norm()).fold(0.0, f64::max),
        goal_px,
        length,
        displaced_px: displaced_px.filter(|(_, by)| by.norm() < reach_px).collect(),
        rms_px: rms_px(&closest.camera, views, board).filter(|px| *px < reach_px),
        wrong: is_off.then(|| few_terms().or_else(|| wrong(off_px))).flatten(),
    })
}

/// Standard deviation of the mean displacement along the measured ones, by the covariance of the
/// fresh lens. `None` if the covered part determines no turn of the camera.
fn sd_along(
    displaced_px: &[(Point2<f64>, Vector2<f64>)],
    fresh: &Calibration,
    is_covered: impl Fn(&Point2<f64>) -> bool,
) -> Option<f64> {
    let whole = projection_jacobian(&fresh.camera, fresh.image_size)?;
    let jacobian = whole.turned_over(is_covered)?;
    let (mut by_lens, mut squares) = (SVector::<f64, LENS_PARAMETERS>::zeros(), 0.0);
    for (px, by) in displaced_px {
        let cell = jacobian.px.iter().position(|cell| cell == px)?;
        by_lens += jacobian.jac_lens[cell].transpose() * by;
        squares += by.norm_squared();
    }
    let variance = (by_lens.transpose() * fresh.covariance_all * by_lens).x;
    let scale = squares * (2 * displaced_px.len()) as f64;
    Some((variance / scale.max(f64::MIN_POSITIVE)).max(0.0).sqrt())
}

fn outline(view: &[Corner], board: &Board) -> Option<BoardOutline> {
    let px: Vec<Point2<f64>> = view.iter().map(|corner| corner.px).collect();
    board.target().outline(&px, &|index| view[index].is_seen())
}

/// Reprojection residuals of `views` per coordinate, each with its best pose.
fn rms_px(camera: &Camera, views: &[Vec<Corner>], board: &Board) -> Option<f64> {
    let board_m = board.corners_in_board_m();
    let (mut sum, mut count) = (0.0, 0);
    for view in views.iter().filter(|view| view.len() == board_m.len()) {
        let seen = seen_count(view);
        if seen < LEAST_SEEN {
            continue;
        }
        if let Ok(pose) = fit_pose(camera, &board_m, view) {
            sum += pose.rms_px.powi(2) * seen as f64;
            count += 2 * seen;
        }
    }
    (count > 0).then(|| (sum / count as f64).sqrt())
}
