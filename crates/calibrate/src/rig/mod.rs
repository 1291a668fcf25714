//! Calibrates several cameras with fixed mutual places from one board, without a trigger.
//!
//! | file | does |
//! |---|---|
//! | `start` | poses seen by each camera; motions on which instants agree; half turns |
//! | `bundle` | joint bundle: lenses, places, board and instants |
//! | `noise`, `fit` | noise by the residuals; covariance by the scatter of instants |
//! | `causes` | camera that moved, pictures of another instant |
//! | `change` | whether a camera has moved against another since |
//! | `result` | the calibrated rig, its findings, and reasons for none |
//! | `stated` | motion, baseline, rows, points and lengths of two cameras, with uncertainty |
//! | `worth` | gain of a further place of the board |

mod bundle;
mod causes;
mod change;
mod fit;
mod noise;
mod result;
mod start;
mod stated;
#[cfg(test)]
mod tests;
mod worth;

use std::collections::BTreeMap;

use nalgebra::Point2;

use self::{
    bundle::RigState,
    causes::{Kind, Named},
    fit::{Fit, open_lens, residuals, stated_from},
    result::{LATE, Minimum, UNUSABLE},
    stated::{lens_rows, rig_of},
};
pub use self::{
    change::{KnownRig, PairChange, moved_camera, pair_change},
    result::{NotARig, RigCalibration, RigCamera, RigFinding, RigInstant},
    stated::{Pair, PairBound, PairSd},
    worth::{PlaceWorth, seen_by},
};
use crate::{
    AcceptanceGoal, Calibration, CalibrationParams, KnownLens, NotCalibrated, Severity, Verdict,
    calibrate,
    solve::{initial_guess::alike_views, reversal::tilts},
};
use boresight_geometry::{
    Corner, LensMatrix, boards::Board, frame::ImageSize, parallel, seen_count,
};

/// Corners that a pose needs.
const POSE_CORNERS: usize = 6;
/// Up to one in three views of a camera, or instants, may be left out; beyond, the board is another
/// or the pictures aren't pairs.
const LEFT_OUT_OF: usize = 3;

/// Pictures of one camera.
#[derive(Clone, Debug)]
pub struct RigViews {
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// Number of the instant and corners of each picture, one corner per board corner.
    pub views: Vec<(u64, Vec<Corner>)>,
    /// Earlier calibration of the same, untouched lens; none of its views may be among these.
    pub known_lens: Option<KnownLens>,
}

/// Picture of an instant.
#[derive(Clone, Debug)]
struct View {
    instant: usize,
    camera: usize,
    corners: Vec<Corner>,
}

/// Estimates lenses and mutual places of `cameras` from pictures of one `board` at common instants.
///
/// Pictures with the same number were taken at the same moment, with the board at rest or with
/// synchronised cameras. The joint bundle starts from each camera's own calibration by `params`,
/// whose goal applies to every pair: a pixel goal to rows, a length goal to a length between
/// triangulated points. See `docs/method.md`, section 9.
///
/// # Errors
///
/// [`NotARig`] if a camera's views give no lens, if cameras share no instants, or if the pictures
/// aren't of the same moments.
///
/// # Examples
///
/// Two cameras see a board in eight places:
///
/// ```
/// use boresight_calibrate::{CalibrationParams, RigViews, calibrate_rig};
/// use boresight_geometry::{Camera, Corner, boards::Board, frame::ImageSize};
/// use nalgebra::{Isometry3, Point2, Vector3};
///
/// let truth = Camera::pinhole(950.0, Point2::new(648.0, 353.0));
/// let cam_from_rig = [Isometry3::identity(), Isometry3::translation(-0.12, 0.0, 0.0)];
/// let board = Board::new(9, 6, 0.025)?;
/// let place = |number: u64| {
///     let (sin, cos) = (number as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
///     let at_m = Vector3::new(0.06 + 0.02 * cos, 0.02 * sin, 0.45);
///     Isometry3::new(at_m, Vector3::new(sin, -cos, 0.0) * 40_f64.to_radians())
/// };
/// let corners = |cam_from_board: Isometry3<f64>| {
///     let points_m = board.corners_in_board_m();
///     let px = points_m.iter().filter_map(|it| truth.px_from_board(&cam_from_board, it));
///     px.map(|px| Corner::isotropic(px, 0.05)).collect()
/// };
/// let cameras = cam_from_rig.map(|cam_from_rig| RigViews {
///     image_size: ImageSize { width_px: 1280, height_px: 720 },
///     views: (1..=8).map(|at| (at, corners(cam_from_rig * place(at)))).collect(),
///     known_lens: None,
/// });
///
/// let found = calibrate_rig(&cameras, &board, &CalibrationParams::default())?;
///
/// assert!((found.rig.baseline_m(0, 1) - 0.12).abs() < 1e-5);
/// assert!(found.pairs[0].sd.is_some(), "eight places state an uncertainty");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibrate_rig(
    cameras: &[RigViews],
    board: &Board,
    params: &CalibrationParams,
) -> Result<RigCalibration, NotARig> {
    if cameras.len() < 2 {
        return Err(NotARig::OneCamera);
    }
    let alone = parallel::map(params.threads, cameras.len(), |index| {
        Alone::of(&cameras[index], board, params)
            .map_err(|reason| NotARig::NoLens { camera: index, reason })
    });
    let alone = alone.into_iter().collect::<Result<Vec<_>, _>>()?;
    let board_m = board.corners_in_board_m();
    let distinct = distinct_instants(cameras, board);
    let mut posed = Vec::new();
    for (camera, (given, alone)) in cameras.iter().zip(&alone).enumerate() {
        for (number, corners) in given.views.iter().filter(|(number, _)| alone.uses(*number)) {
            let poses = match distinct.binary_search(number) {
                Ok(_) => tilts(&alone.lens, &board_m, corners),
                Err(_) => Vec::new(),
            };
            if !poses.is_empty() {
                posed.push((*number, camera, corners, poses));
            }
        }
    }
    posed.sort_by_key(|(number, camera, ..)| (*number, *camera));
    let mut numbers: Vec<u64> = posed.iter().map(|(number, ..)| *number).collect();
    numbers.dedup();
    let (views, poses): (Vec<View>, Vec<_>) = posed
        .into_iter()
        .map(|(number, camera, corners, poses)| {
            let instant = numbers.partition_point(|earlier| *earlier < number);
            (View { instant, camera, corners: corners.clone() }, poses)
        })
        .unzip();
    let lenses: Vec<_> = alone.iter().map(|alone| alone.lens).collect();
    let started = start::start(views, &poses, numbers.len(), &lenses, board)?;
    let mut known: Vec<_> = alone.iter().map(|alone| alone.known.clone()).collect();
    let state = RigState {
        cameras: lenses,
        cam_from_rig: started.cam_from_rig,
        rig_from_board: started.rig_from_board,
        shape: [0.0; 4],
    };
    let refit = |views, state, known: &[bundle::LensKnown]| {
        let inputs = (board_m.as_slice(), known, started.origin);
        fit::fit(views, state, inputs).ok_or(NotARig::Undetermined)
    };
    let mut fitted = refit(started.views, state, &known)?;
    let mut findings = Vec::new();
    let shared = fitted.shared_instants();
    let wanted = stated_from(alone.iter().all(|alone| alone.rms_px.is_none()));
    let camera_of = |camera: usize| (cameras.len() > 2).then_some(camera);
    let uncertainty = loop {
        let uncertainty = fitted.uncertainty();
        let Some(of_all) = uncertainty.as_ref().filter(|_| shared >= wanted) else {
            break uncertainty;
        };
        match causes::named(&fitted, of_all) {
            Some(Named::One(cause)) if cause.kind == Kind::OtherInstant => {
                let view = fitted
                    .views
                    .iter()
                    .position(|view| view.instant == cause.instant && view.camera == cause.camera);
                let (instant, camera) = (numbers[cause.instant], camera_of(cause.camera));
                findings.push(RigFinding::OtherInstant { instant, camera });
                let left_out = findings.len();
                if LEFT_OUT_OF * left_out > shared {
                    let of = widest(&fitted, &alone, &board_m);
                    return Err(NotARig::NotPairs {
                        of,
                        agreeing: shared - left_out,
                        instants: shared,
                    });
                }
                let (views, state) = fitted.without_pair(view.unwrap_or_default());
                numbers.push(numbers[cause.instant]);
                fitted = refit(views, state, &known)?;
            }
            Some(Named::One(cause)) if cause.kind == Kind::Pixels => {
                for (known, camera) in known.iter_mut().zip(&fitted.state.cameras) {
                    *known = known.with_free_pixels(camera);
                }
                fitted = refit(fitted.views, fitted.state, &known)?;
            }
            Some(Named::One(cause)) => {
                // Clocks differ, too, where a move that explains the misfit isn't all.
                let (views, state) = fitted.with_two_cameras(cause.camera, cause.instant);
                known.push(known[cause.camera].clone());
                let split = refit(views, state, &known)?;
                known.pop();
                if (0..cameras.len()).all(|it| alone[it].ratio(it, &split, &board_m) <= LATE) {
                    let (from, camera) = (numbers[cause.instant], camera_of(cause.camera));
                    findings.push(RigFinding::Touched { camera, from });
                }
                break uncertainty;
            }
            Some(Named::Unclear) => {
                findings.push(RigFinding::CauseUnclear);
                break uncertainty;
            }
            Some(Named::Nothing) | None => break uncertainty,
        }
    };
    let is_touched = findings.iter().any(|it| matches!(it, RigFinding::Touched { .. }));
    let of_cameras = rig_cameras(cameras, &fitted, &alone, &board_m);
    for (camera, of) in of_cameras.iter().enumerate() {
        let ratio = of.alone_rms_px.map_or(1.0, |alone_px| of.rms_px / alone_px);
        if ratio > LATE && !is_touched {
            findings.push(RigFinding::Late { camera, ratio });
        }
    }
    // Instants that turned out to be none don't count.
    let shared = fitted.shared_instants();
    let minimum = uncertainty.map(|uncertainty| Minimum {
        state: fitted.state.clone(),
        covariance: uncertainty.covariance,
    });
    let covariance = minimum.as_ref().filter(|_| shared >= wanted).map(|it| it.covariance.clone());
    if covariance.is_none() {
        findings.push(RigFinding::InstantsFew { instants: shared, wanted });
    }
    let sizes: Vec<ImageSize> = cameras.iter().map(|camera| camera.image_size).collect();
    let length = match params.accept {
        Some(AcceptanceGoal::Length { length_m, at_m, .. }) => Some((length_m, at_m)),
        _ => None,
    };
    let asked = (sizes.as_slice(), length, params.board_scale_sd);
    let both = |a: usize| (a + 1..cameras.len()).map(move |b| [a, b]);
    let pairs: Vec<Pair> = (0..cameras.len())
        .flat_map(both)
        .map(|of| stated::pair(&fitted, covariance.as_ref(), of, asked))
        .collect();
    if covariance.is_some() {
        findings.extend(pairs.iter().filter_map(|pair| judged(pair, params)));
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity()));
    let verdict = match findings.first().map(RigFinding::severity) {
        Some(Severity::Bad) => Verdict::Untrustworthy,
        Some(Severity::Care) => Verdict::Care,
        Some(Severity::Info) | None => Verdict::Good,
    };
    let of_cameras = of_cameras
        .into_iter()
        .enumerate()
        .map(|(index, camera)| {
            let own = covariance.as_ref().map(|all| bundle::part(all, &lens_rows(index)));
            let covariance = own.map(|own| LensMatrix::from_fn(|i, j| own[(i, j)]));
            RigCamera { covariance, ..camera }
        })
        .collect();
    Ok(RigCalibration {
        rig: rig_of(&fitted.state),
        cameras: of_cameras,
        board_m: board_m.iter().map(|point| fitted.state.on_board(point)).collect(),
        stretch: libm::exp(fitted.state.shape[0]) - 1.0,
        covariance,
        instants: instants_of(&fitted, &numbers, &board_m),
        pairs,
        findings,
        verdict,
        minimum,
    })
}

/// Numbers of the instants, in order, of which no camera shows the board where it showed it at an
/// earlier one: pictures of a board at rest share errors, and count once.
fn distinct_instants(cameras: &[RigViews], board: &Board) -> Vec<u64> {
    let mut groups: BTreeMap<u64, Vec<(usize, usize)>> = BTreeMap::new();
    for (camera, given) in cameras.iter().enumerate() {
        let views: Vec<Vec<Corner>> =
            given.views.iter().map(|(_, corners)| corners.clone()).collect();
        let (_, place) = alike_views(&views, board, given.image_size);
        for ((number, _), group) in given.views.iter().zip(place) {
            groups.entry(*number).or_default().push((camera, group));
        }
    }
    let mut kept: Vec<(u64, Vec<(usize, usize)>)> = Vec::new();
    for (number, seen) in groups {
        let repeats = |(_, earlier): &(u64, Vec<_>)| seen.iter().all(|it| earlier.contains(it));
        if !kept.iter().any(repeats) {
            kept.push((number, seen));
        }
    }
    kept.into_iter().map(|(number, _)| number).collect()
}

/// Calibration of a camera by its own views, or its known lens.
struct Alone {
    lens: boresight_geometry::Camera,
    known: bundle::LensKnown,
    rms_px: Option<f64>,
    /// Numbers of pictures that are no image of the board.
    left_out: Vec<u64>,
}

impl Alone {
    fn of(
        given: &RigViews,
        board: &Board,
        params: &CalibrationParams,
    ) -> Result<Self, NotCalibrated> {
        let (mut numbers, mut views): (Vec<u64>, Vec<Vec<Corner>>) = given
            .views
            .iter()
            .filter(|(_, corners)| seen_count(corners) >= POSE_CORNERS)
            .cloned()
            .unzip();
        let few = given.views.iter().filter(|(number, _)| !numbers.contains(number));
        let mut left_out: Vec<u64> = few.map(|(number, _)| *number).collect();
        if let Some(known) = &given.known_lens
            && let Some(prior) = fit::known_lens(known)
        {
            return Ok(Self { lens: known.camera(), known: prior, rms_px: None, left_out });
        }
        let params = CalibrationParams { accept: None, threads: 1, ..params.clone() };
        let most = views.len() / LEFT_OUT_OF;
        let mut refused = 0;
        loop {
            match calibrate(&views, board, given.image_size, &params) {
                Err(NotCalibrated::NoHomography { view } | NotCalibrated::NoGrid { view })
                    if refused < most =>
                {
                    refused += 1;
                    left_out.push(numbers.remove(view));
                    views.remove(view);
                }
                Err(reason) => return Err(reason),
                Ok(Calibration { camera, model, rms_px, .. }) => {
                    let known = open_lens(&camera, model, &params.models);
                    return Ok(Self { lens: camera, known, rms_px: Some(rms_px), left_out });
                }
            }
        }
    }

    fn uses(&self, number: u64) -> bool {
        !self.left_out.contains(&number)
    }

    /// Ratio of the residual of the joint fit to that of camera `camera` alone; 1 if unknown.
    fn ratio(&self, camera: usize, fitted: &Fit, board_m: &[Point2<f64>]) -> f64 {
        self.rms_px.map_or(1.0, |alone| rms_px(camera, fitted, board_m) / alone)
    }
}

/// Root mean square residual of a camera in the joint fit.
fn rms_px(camera: usize, fitted: &Fit, board_m: &[Point2<f64>]) -> f64 {
    let own = fitted.views.iter().filter(|view| view.camera == camera);
    let residuals = own.filter_map(|view| residuals(view, &fitted.state, board_m)).flatten();
    rms(residuals.map(|(off, _)| off.norm_squared()))
}

fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = squares.fold((0.0, 0_u32), |(sum, count), square| (sum + square, count + 1));
    (sum / f64::from(2 * count.max(1))).sqrt()
}

fn rig_cameras(
    given: &[RigViews],
    fitted: &Fit,
    alone: &[Alone],
    board_m: &[Point2<f64>],
) -> Vec<RigCamera> {
    let of = |(camera, (given, alone)): (usize, (&RigViews, &Alone))| RigCamera {
        image_size: given.image_size,
        covariance: None,
        rms_px: rms_px(camera, fitted, board_m),
        alone_rms_px: alone.rms_px,
        views: fitted.views.iter().filter(|view| view.camera == camera).count(),
    };
    given.iter().zip(alone).enumerate().map(of).collect()
}

/// The two cameras whose residuals grow most beside the others.
fn widest(fitted: &Fit, alone: &[Alone], board_m: &[Point2<f64>]) -> [usize; 2] {
    let ratio = |camera: usize| alone[camera].ratio(camera, fitted, board_m);
    let mut by_ratio: Vec<usize> = (0..alone.len()).collect();
    by_ratio.sort_by(|a, b| ratio(*b).total_cmp(&ratio(*a)));
    let mut two = [by_ratio[0], by_ratio[1]];
    two.sort_unstable();
    two
}

fn instants_of(fitted: &Fit, numbers: &[u64], board_m: &[Point2<f64>]) -> Vec<RigInstant> {
    let mut instants: Vec<RigInstant> = numbers
        .iter()
        .zip(&fitted.state.rig_from_board)
        .enumerate()
        .map(|(instant, (number, place))| {
            let of = fitted.views.iter().filter(|view| view.instant == instant);
            let of = of.filter_map(|view| {
                let off = residuals(view, &fitted.state, board_m)?;
                Some((view.camera, rms(off.iter().map(|(off, _)| off.norm_squared()))))
            });
            RigInstant { number: *number, rig_from_board: *place, residual_rms_px: of.collect() }
        })
        .collect();
    instants.sort_by_key(|instant| instant.number);
    instants
}

/// Finding about a pair held to the goal; `None` if it meets the goal.
fn judged(pair: &Pair, params: &CalibrationParams) -> Option<RigFinding> {
    let of = pair.of;
    let Some(PairBound { bound, goal, is_length }) = pair.bound(params.accept) else {
        return Some(RigFinding::PairUnseen { of });
    };
    let is_unfinished = bound > UNUSABLE * goal;
    let uncertain = RigFinding::PairUncertain { of, bound, goal, is_length, is_unfinished };
    (bound > goal).then_some(uncertain)
}
