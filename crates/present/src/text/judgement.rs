//! Whether a calibration is true, in words.

use super::acceptance::{error, limit, named_length};
use boresight_calibrate::{
    AcceptanceGoal, Answer, Axes, Calibration, Judgement, LengthError, LensFlaw, NotJudged,
    Resized, WrongPart,
};
use boresight_formats::import::{FileDoubt, OldFormat};

/// Action for a calibration that is off.
const USE_FRESH: &str = "Use the lens of these pictures instead.";

/// Answer with numbers, and the next action.
pub fn judgement(judged: &Judgement) -> (String, String) {
    let Judgement { goal_px: px, off_px, least_px, most_px, .. } = *judged;
    let (goal, [off, least, most]) = match judged.length {
        Some(LengthError { goal, off_m, least_m, most_m }) => (goal, [off_m, least_m, most_m]),
        None => (AcceptanceGoal::Projection { px }, [off_px, least_px, most_px]),
    };
    let of = named_length(goal).map_or_else(String::new, |length| format!(" in {length}"));
    let hidden = most - off;
    let said = |by: f64| match judged.length {
        None => format!("{by:.2} px"),
        Some(_) => error(goal, by),
    };
    let [hides, off, least, most] = [hidden, off, least, most].map(said);
    let (found, limit) =
        (format!("{off} ({least} to {most}){of} where the board was"), limit(goal));
    match judged.answer {
        Answer::True => (
            format!("TRUE: off by {found}, within the limit of {limit}"),
            "Use it where the board was.".into(),
        ),
        Answer::Off => (
            format!(
                "OFF by {found}, beyond the limit of {limit}; a ray at worst by {:.1} px",
                judged.worst_px
            ),
            USE_FRESH.into(),
        ),
        Answer::CannotTell => (
            format!("CAN'T TELL: off by {found}, around the limit of {limit}"),
            if hidden > goal.limit() {
                format!(
                    "These pictures would hide {hides}. To tell, add some with the board tipped by 30 to 50°, over the whole picture."
                )
            } else {
                "Add pictures, or state what matters.".into()
            },
        ),
    }
}

/// Why there is no answer about a file of `format`, and the next action.
pub fn not_judged(reason: &NotJudged, format: OldFormat) -> (String, String) {
    match reason {
        NotJudged::NoPictures => (
            "CAN'T TELL: a file alone can't show that it's true".into(),
            match format {
                OldFormat::Mrcal => "mrcal packs its corners. Give the table that they came from.",
                OldFormat::Kalibr => {
                    "Kalibr's files hold no corners. Give the pictures, or the bag."
                }
                _ => "Give its pictures, too.",
            }
            .into(),
        ),
        NotJudged::Impossible(flaw) => {
            (format!("OFF: no lens is like that: {}", lens_flaw(flaw)), "Calibrate again.".into())
        }
        NotJudged::OtherSize { pictures, given } => (
            format!("CAN'T TELL: it's for pictures of {given}, and these have {pictures}"),
            "Give the pictures that it was made from, or those of its mode.".into(),
        ),
        NotJudged::LengthTooLong => (
            "CAN'T TELL: the length fits nowhere into the part of the picture where the board was"
                .into(),
            "State a shorter length, or one farther away.".into(),
        ),
        NotJudged::NoFreshLens => (
            "CAN'T TELL: these pictures give no trustworthy lens to hold it to".into(),
            "Take others, with the board tipped and over the whole picture.".into(),
        ),
        NotJudged::Misses { share, .. } => (
            format!(
                "OFF: by this lens, {:.0} % of where the board was is beyond the picture, or nowhere",
                f64::max(100.0 * share, 1.0)
            ),
            USE_FRESH.into(),
        ),
    }
}

/// What explains the answer `judged` by the lens `fresh`, one sentence each.
pub fn judgement_reasons(
    judged: &Judgement,
    fresh: &Calibration,
    pp_is_doubtful: bool,
) -> Vec<String> {
    let mut reasons = Vec::new();
    reasons.extend(judged.resized.map(|how| {
        let how = match how {
            Resized::Turned => "turned by 90°, and was turned".into(),
            Resized::Scaled(by) => format!("{:.3} times as large, and was scaled", by.recip()),
            Resized::Cut(1.0) => "in a different shape: cut from their middle, it fits".into(),
            Resized::Cut(by) => {
                format!(
                    "in a different shape: scaled by {by:.3} and cut from their middle, it fits"
                )
            }
            Resized::Squeezed => "in a different shape: squeezed into these, it fits".into(),
        };
        format!("It's for pictures {how}")
    }));
    if pp_is_doubtful {
        let [x, y]: [f64; 2] = fresh.camera.pp_px.into();
        reasons.push(format!("These pictures put the principal point at ({x:.1}, {y:.1})"));
    }
    if judged.answer == Answer::Off {
        reasons.push(wrong_part(judged.wrong.as_ref()));
    }
    if let Some(rms_px) = judged.rms_px {
        reasons.push(format!(
            "Its residuals are {rms_px:.3} px, those of the best lens {:.3} px: residuals are no evidence",
            fresh.rms_px
        ));
    }
    reasons
}

/// Reason why a lens can't be right.
pub(super) fn lens_flaw(flaw: &LensFlaw) -> String {
    match *flaw {
        LensFlaw::FocalLength { widths } => {
            format!("its focal length is {widths:.3} times the width of the picture")
        }
        LensFlaw::Distortion { share } => format!(
            "its distortion folds over or stretches {:.0} % of the picture as no lens does",
            100.0 * share
        ),
    }
}

/// The part of a lens that is wrong, as a sentence.
pub fn wrong_part(wrong: Option<&WrongPart>) -> String {
    let longer = |ratio: f64| {
        let percent = 100.0 * (ratio - 1.0);
        format!("{:.2} % too {}", percent.abs(), if percent > 0.0 { "long" } else { "short" })
    };
    match wrong {
        Some(WrongPart::FocalLength { ratio }) => format!(
            "Its focal length is {}: another focus, zoom or camera, or too few tipped views",
            longer(*ratio)
        ),
        Some(WrongPart::Stretched { exactly: Some((a, b)), .. }) => {
            format!("Its pixels are stretched by exactly {a}:{b}: made from pictures in a different shape")
        }
        Some(WrongPart::Stretched { ratio, .. }) => {
            format!("Its focal length along y is {} against that along x", longer(*ratio))
        }
        Some(WrongPart::Scaled { ratio }) => {
            format!("It's for pictures {ratio:.2} times as large: another mode of the camera")
        }
        Some(WrongPart::PrincipalPoint { off_px: [x, y] }) => {
            format!("Its principal point is off by ({x:+.1}, {y:+.1}) px")
        }
        Some(WrongPart::Axes(axes)) => {
            let mistake = match axes {
                Axes::HalfTurned => "its pictures were turned by 180°",
                Axes::Mirrored => "its pictures were mirrored",
                Axes::FromBelow => "its rows are counted from below",
                Axes::Exchanged => "its cx and cy are exchanged",
            };
            format!("Its numbers fit in other axes: {mistake}")
        }
        Some(WrongPart::TooFewTerms) => {
            "Its distortion has too few terms: with as few, these pictures give the same error".into()
        }
        Some(WrongPart::Distortion { none_stated: true }) => "It states no distortion".into(),
        Some(WrongPart::Distortion { none_stated: false }) => "Its distortion is wrong".into(),
        None => "Several of its numbers are off: another camera, focus or mode, or views that couldn't tell them apart".into(),
    }
}

/// A doubt about the file, as a sentence.
pub fn file_doubt(doubt: &FileDoubt) -> String {
    match doubt {
        FileDoubt::PpAssumed => {
            "Its principal point is the exact middle of the picture: assumed, not measured".into()
        }
        FileDoubt::OtherSize { fits } => {
            format!(
                "Its principal point fits pictures of about {fits}: perhaps made at another size"
            )
        }
        FileDoubt::PpFar { widths } => format!(
            "Its principal point is {:.0} % of the width from the middle: unusual, not impossible",
            100.0 * widths
        ),
        FileDoubt::Units => "Its numbers aren't in pixels: perhaps millimetres or fractions".into(),
        FileDoubt::Stretched { ratio, exactly } => {
            let shape = exactly.map_or_else(String::new, |(a, b)| format!(", exactly {a}:{b}"));
            format!(
                "Its fy is {ratio:.4} times fx{shape}: stretched pictures, or views that couldn't tell"
            )
        }
        FileDoubt::Tangential { largest } => format!(
            "A tangential coefficient is {largest:.3}: a lens mounted askew, or views that couldn't tell it from the principal point"
        ),
        FileDoubt::Cancelling { share } => format!(
            "A term of its distortion shifts the picture's edge by {:.0} %, and others take it back: too many terms for its views",
            100.0 * share
        ),
        FileDoubt::FewViews { views, terms } => {
            let s = if *views == 1 { "" } else { "s" };
            format!("{views} view{s} can't support {terms} distortion coefficients")
        }
        FileDoubt::NoRotation => "Its R is no rotation: rectified pictures will be wrong".into(),
        FileDoubt::NotOfExif { film_mm, exif_mm } => format!(
            "It has the field of view of a {film_mm:.0} mm lens on film, and its pictures' EXIF data says {exif_mm:.0} mm: perhaps another camera, zoom or size"
        ),
        FileDoubt::Projection => {
            "Its P isn't a projection of this lens's rectified pictures: they will be wrong".into()
        }
    }
}
