//! Calibration of a rig so far, and the next place of the board.

use std::cmp::Reverse;

use nalgebra::{Isometry3, Vector2};

use crate::guidance::{GuidanceParams, LensEstimate, Target, posed_board, target_at};
use boresight_calibrate::{
    CalibrationParams, NotARig, PlaceWorth, RigCalibration, RigViews, calibrate_rig, seen_by,
};
use boresight_geometry::{Rig, boards::Board, fit_pose, frame::ImageSize};

/// Tilt of a requested board, and directions in which it recedes.
const TILT_RAD: f64 = 35.0 * std::f64::consts::PI / 180.0;
const DIRECTIONS: u32 = 4;
/// Shares of the picture spanned by requested boards.
const SPANS: [f64; 3] = [0.75, 0.45, 0.25];
/// Share of the picture spanned by the first board, before another camera is known to see it.
const FIRST_SPAN: f64 = 0.4;
/// Places across and down the picture, as shares of its size from the middle.
const PLACES: [f64; 3] = [0.0, -0.27, 0.27];
/// Places from which the lenses are known well enough to weigh further places.
const WEIGHED_FROM: usize = 4;
/// Gain by which another camera must exceed the first one to lead.
const CLEARLY_MORE: f64 = 1.2;

/// Next place of the board.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Camera whose picture the person follows.
    pub lead: usize,
    /// Each camera that sees the place, with the board in its picture.
    pub targets: Vec<(usize, Target)>,
    /// Gain of the place.
    pub gain: f64,
}

/// Calibration of the places taken so far, and the next place.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Number of places behind the plan.
    pub places: usize,
    /// Calibration, or the reason for none.
    pub found: Result<RigCalibration, NotARig>,
    /// Worth of places; `None` before the cameras are linked.
    pub worth: Option<PlaceWorth>,
    /// Next place.
    pub wanted: Option<Wanted>,
}

/// Plans the next place after `places` places with `views` of each camera.
///
/// Candidates are boards across each camera's picture, tipped in four directions. The one with the
/// most gain is chosen, so the pair of cameras with the most to learn follows.
pub fn plan(places: usize, views: &[RigViews], board: &Board, params: &CalibrationParams) -> Plan {
    let found = calibrate_rig(views, board, params);
    let are_known = views.iter().all(|camera| camera.known_lens.is_some());
    let rig = found.as_ref().ok().filter(|_| are_known || places >= WEIGHED_FROM);
    let worth = rig.and_then(|rig| PlaceWorth::of(rig, board));
    let sizes: Vec<ImageSize> = views.iter().map(|camera| camera.image_size).collect();
    let by_gain = worth.as_ref().and_then(|worth| best_place(worth, &sizes, board));
    let wanted = by_gain.or_else(|| first_place(places, views, &sizes, board));
    Plan { places, found, worth, wanted }
}

/// Next place before the cameras are linked, or have lenses: a board where the most cameras see it,
/// by guessed lenses, tipped in another direction each time.
fn first_place(
    places: usize,
    views: &[RigViews],
    sizes: &[ImageSize],
    board: &Board,
) -> Option<Wanted> {
    let shares = |camera: usize, other: usize| {
        let numbers = || views[other].views.iter().map(|(number, _)| *number);
        let mut own = views[camera].views.iter();
        other != camera && own.any(|(number, _)| numbers().any(|it| it == *number))
    };
    let others = |camera: usize| (0..views.len()).filter(move |other| shares(camera, *other));
    let tilt = tipped((places % DIRECTIONS as usize) as u32);
    let guess = |camera: usize| LensEstimate::guess(sizes[camera]);
    let apart = (0..views.len()).find(|camera| others(*camera).next().is_none());
    if let Some(lead) = apart {
        let params =
            GuidanceParams { target_span_fraction: FIRST_SPAN, ..GuidanceParams::default() };
        let pose = posed_board(tilt, Vector2::zeros(), board, &guess(lead), &params)?;
        let target = target_at(&pose, board, &guess(lead))?;
        return Some(Wanted { lead, targets: vec![(lead, target)], gain: 0.0 });
    }
    // Each camera needs views for its lens, whichever sees the board most easily.
    let needs = |camera: &usize| (views[*camera].views.len(), Reverse(others(*camera).count()));
    let lead = (0..views.len()).min_by_key(needs)?;
    let linked: Vec<usize> = [lead].into_iter().chain(others(lead)).collect();
    let points_m = board.corners_in_board_m();
    let pose = |camera: usize, number: u64| {
        let (_, corners) = views[camera].views.iter().find(|(of, _)| *of == number)?;
        Some(fit_pose(&guess(camera).camera, &points_m, corners).ok()?.cam_from_board)
    };
    let from_lead = |camera: &usize| {
        let numbers = views[lead].views.iter().rev().map(|(number, _)| *number);
        let mut both =
            numbers.filter_map(|at| Some(pose(*camera, at)? * pose(lead, at)?.inverse()));
        both.next()
    };
    let rig = Rig {
        cameras: linked.iter().map(|camera| guess(*camera).camera).collect(),
        cam_from_rig: linked.iter().map(from_lead).collect::<Option<_>>()?,
    };
    let sizes: Vec<ImageSize> = linked.iter().map(|camera| sizes[*camera]).collect();
    let seen = |place: &Isometry3<f64>| seen_by(&rig, &sizes, &points_m, place);
    let tipped = candidates(&guess(lead), board, &[tilt]);
    let place = tipped.into_iter().rev().max_by_key(|place| seen(place).len())?;
    let targets = targets(&rig, &sizes, &seen(&place), &place, board);
    let targets = targets.into_iter().map(|(camera, target)| (linked[camera], target)).collect();
    Some(Wanted { lead, targets, gain: 0.0 })
}

fn best_place(worth: &PlaceWorth, sizes: &[ImageSize], board: &Board) -> Option<Wanted> {
    let rig = worth.rig();
    let tilts: Vec<(f64, f64)> = (0..DIRECTIONS).map(tipped).chain([(0.0, 0.0)]).collect();
    let mut best: Option<(f64, usize, Isometry3<f64>)> = None;
    for lead in 0..sizes.len() {
        let rig_from_lead = rig.cam_from_rig[lead].inverse();
        // The first camera leads unless another shows much more: the person looks at one picture.
        let mut least = best.map_or(0.0, |(gain, ..)| CLEARLY_MORE * gain);
        for pose in candidates(&lens(&rig, sizes, lead), board, &tilts) {
            let place = rig_from_lead * pose;
            let gain = worth.gain(&place);
            if gain > least {
                (best, least) = (Some((gain, lead, place)), gain);
            }
        }
    }
    let (gain, lead, place) = best?;
    let targets = targets(&rig, sizes, &worth.seen_by(&place), &place, board);
    Some(Wanted { lead, targets, gain })
}

/// Direction and angle of the requested tilt with this number.
fn tipped(number: u32) -> (f64, f64) {
    let turn = std::f64::consts::TAU / f64::from(DIRECTIONS);
    (f64::from(number) * turn, TILT_RAD)
}

fn lens(rig: &Rig, sizes: &[ImageSize], camera: usize) -> LensEstimate {
    LensEstimate { camera: rig.cameras[camera], ..LensEstimate::guess(sizes[camera]) }
}

/// Board at a place in the rig's frame, in the pictures of `cameras`.
fn targets(
    rig: &Rig,
    sizes: &[ImageSize],
    cameras: &[usize],
    place: &Isometry3<f64>,
    board: &Board,
) -> Vec<(usize, Target)> {
    let of = |camera: &usize| {
        let pose = rig.cam_from_rig[*camera] * place;
        Some((*camera, target_at(&pose, board, &lens(rig, sizes, *camera))?))
    };
    cameras.iter().filter_map(of).collect()
}

/// Poses of the board in a camera's frame with each of `tilts`, direction and angle: the middle of
/// the picture and large boards first.
fn candidates(lens: &LensEstimate, board: &Board, tilts: &[(f64, f64)]) -> Vec<Isometry3<f64>> {
    let ImageSize { width_px, height_px } = lens.image_size;
    let mut poses = Vec::new();
    for span in SPANS {
        let params = GuidanceParams { target_span_fraction: span, ..GuidanceParams::default() };
        for down in PLACES {
            for across in PLACES {
                let offset_px =
                    Vector2::new(across * f64::from(width_px), down * f64::from(height_px));
                poses.extend(
                    tilts
                        .iter()
                        .filter_map(|tilt| posed_board(*tilt, offset_px, board, lens, &params)),
                );
            }
        }
    }
    poses
}
