//! What a rig states of two cameras, with uncertainty: motion, baseline, rows, points, lengths.
//!
//! Each quantity is a function of the shared numbers; its covariance follows by numeric
//! derivatives, `J C Jᵀ`. Where the rig's frame lies affects none of them.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point2, Point3, Vector3};

use super::{
    KnownRig, RigCalibration,
    bundle::{OF_CAMERA, RigState, SHAPE, part},
    fit::Fit,
};
use crate::{AcceptanceGoal, DEFAULT_TYPICAL_GOAL_PX, acceptance::TWO_SIDED_95};
use boresight_geometry::{LENS_PARAMETERS, Rig, frame::ImageSize};

/// Step of a numeric derivative, in standard deviations.
const STEP: f64 = 0.05;
/// Most places at which rows and points are judged.
const PLACES: usize = 80;

/// Uncertainty of what two cameras measure together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairSd {
    /// Covariance of the small step `(ω, τ)`, radians and metres, of the motion between the
    /// cameras.
    pub motion: Matrix6<f64>,
    /// Standard deviation of the baseline from the views, in metres; the board's scale comes on
    /// top.
    pub baseline_m: f64,
    /// Root mean square standard deviation of a row error over the boards' places, in pixels;
    /// `None` for cameras that face each other, which have no rows.
    pub row_px: Option<f64>,
    /// Root mean square standard deviation of a point's distance, as a share of the distance.
    pub distance: f64,
    /// Mean distance of the boards' places from the first camera, in metres.
    pub at_m: f64,
    /// 95 % bound of the error of the asked-for length, in metres; `None` if none is asked for or
    /// it doesn't fit into both pictures.
    pub length_bound_m: Option<f64>,
}

/// Two cameras of a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The cameras.
    pub of: [usize; 2],
    /// Instants at which both saw the board.
    pub instants: usize,
    /// Rigid motion from the first camera to the second, in metres.
    pub second_from_first: Isometry3<f64>,
    /// Root mean square row error of the corners that both saw, in pixels; `None` without any.
    pub row_rms_px: Option<f64>,
    /// Uncertainty; `None` with too few instants, or if no board was where both see it.
    pub sd: Option<PairSd>,
}

/// Error of a pair beside its goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairBound {
    /// 95 % bound of the typical row error in pixels, or of the length in metres.
    pub bound: f64,
    /// Goal in the same unit.
    pub goal: f64,
    /// True for a length.
    pub is_length: bool,
}

impl Pair {
    /// Error beside the goal; `None` without an uncertainty, or for cameras that share no part of
    /// their pictures to be judged by.
    pub fn bound(&self, accept: Option<AcceptanceGoal>) -> Option<PairBound> {
        let sd = self.sd.as_ref()?;
        let rows = sd.row_px.map(|sd_px| TWO_SIDED_95 * sd_px);
        let (bound, goal, is_length) = match accept {
            None => (rows, DEFAULT_TYPICAL_GOAL_PX, false),
            Some(AcceptanceGoal::Projection { px }) => (rows, px, false),
            Some(AcceptanceGoal::Length { within_m, .. }) => (sd.length_bound_m, within_m, true),
        };
        Some(PairBound { bound: bound?, goal, is_length })
    }
}

/// Length at a distance, metres.
pub(super) type LengthAt = (f64, f64);

pub(super) fn rig_of(state: &RigState) -> Rig {
    Rig { cameras: state.cameras.clone(), cam_from_rig: state.cam_from_rig.clone() }
}

/// Statement about the cameras `of` with the given covariance of the shared numbers.
pub(super) fn pair(
    fit: &Fit,
    covariance: Option<&DMatrix<f64>>,
    of: [usize; 2],
    (sizes, length, scale_sd): (&[ImageSize], Option<LengthAt>, f64),
) -> Pair {
    let rig = rig_of(&fit.state);
    let mut rows = Vec::new();
    let mut instants = 0;
    for one in fit.whitened.iter().filter(|view| view.camera == of[0]) {
        let other =
            fit.whitened.iter().find(|view| view.camera == of[1] && view.instant == one.instant);
        let Some(other) = other else { continue };
        instants += 1;
        for corner in &one.corners {
            let both = other.corners.iter().find(|also| also.place == corner.place);
            rows.extend(both.and_then(|also| rig.row_error_px(of, [corner.px, also.px])));
        }
    }
    let rms = |values: &[f64]| {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    };
    Pair {
        of,
        instants,
        second_from_first: rig.cam_from_cam(of[1], of[0]),
        row_rms_px: (!rows.is_empty()).then(|| rms(&rows)),
        sd: covariance
            .and_then(|covariance| Stated { fit, covariance, of }.sd(sizes, length, scale_sd)),
    }
}

/// Derivatives of values of `value` by the numbers of the cameras `of`: the rows of `covariance`
/// that they depend on, and the Jacobian, without the values that a lens model leaves undefined.
pub(super) fn derivatives(
    state: &RigState,
    covariance: &DMatrix<f64>,
    of: [usize; 2],
    value: &dyn Fn(&RigState) -> Vec<f64>,
) -> (Vec<usize>, DMatrix<f64>) {
    let size = covariance.nrows();
    let rows: Vec<usize> = (0..size - SHAPE)
        .filter(|row| of.contains(&(row / OF_CAMERA)))
        .filter(|row| covariance[(*row, *row)] > 0.0)
        .collect();
    let columns: Vec<DVector<f64>> = rows
        .iter()
        .map(|row| {
            let step = STEP * covariance[(*row, *row)].sqrt();
            let moved = |by: f64| {
                let mut change = DVector::zeros(size);
                change[*row] = by;
                DVector::from_vec(value(&state.with_shared(&change)))
            };
            (moved(step) - moved(-step)) / (2.0 * step)
        })
        .collect();
    // A file may state no uncertainty of these cameras.
    let Some(first) = columns.first() else { return (rows, DMatrix::zeros(0, 0)) };
    let mut jacobian = DMatrix::zeros(first.len(), columns.len());
    jacobian.column_iter_mut().zip(&columns).for_each(|(mut to, from)| to.copy_from(from));
    let defined: Vec<usize> = (0..jacobian.nrows())
        .filter(|value| jacobian.row(*value).iter().all(|by| by.is_finite()))
        .collect();
    (rows, jacobian.select_rows(&defined))
}

struct Stated<'a> {
    fit: &'a Fit,
    covariance: &'a DMatrix<f64>,
    of: [usize; 2],
}

impl Stated<'_> {
    /// Covariance of those values of a function that the lens models define about the state; empty
    /// if there are none. A function marks others by NaN.
    fn covariance_of(&self, of: &dyn Fn(&RigState) -> Vec<f64>) -> DMatrix<f64> {
        let (rows, jacobian) = derivatives(&self.fit.state, self.covariance, self.of, of);
        &jacobian * part(self.covariance, &rows) * jacobian.transpose()
    }

    fn sd(&self, sizes: &[ImageSize], length: Option<LengthAt>, scale_sd: f64) -> Option<PairSd> {
        let [a, b] = self.of;
        let now = rig_of(&self.fit.state);
        let of_now = now.cam_from_cam(b, a);
        let motion = self.covariance_of(&|state| {
            let moved = rig_of(state).cam_from_cam(b, a);
            let turn = (moved.rotation * of_now.rotation.inverse()).scaled_axis();
            let shift = moved.translation.vector - of_now.translation.vector;
            turn.iter().chain(shift.iter()).copied().collect()
        });
        let baseline = self.covariance_of(&|state| vec![rig_of(state).baseline_m(a, b)]);
        let boards = self.fit.state.rig_from_board.iter().copied();
        let board_m = self.fit.board_m();
        let places = places(&now, boards, &board_m, self.of.map(|camera| (camera, sizes[camera])));
        let px = |point: &Point3<f64>| {
            let [one, other] = self
                .of
                .map(|camera| now.cameras[camera].project(&(now.cam_from_rig[camera] * point)));
            Some([one?, other?])
        };
        let seen: Vec<[Point2<f64>; 2]> = places.iter().filter_map(px).collect();
        let root_mean = |matrix: &DMatrix<f64>| {
            let count = matrix.nrows();
            (count > 0).then(|| (matrix.trace() / count as f64).max(0.0).sqrt())
        };
        let rows = self.covariance_of(&|state| {
            let rig = rig_of(state);
            let row = |px: &[Point2<f64>; 2]| rig.row_error_px(self.of, *px).unwrap_or(f64::NAN);
            seen.iter().map(row).collect()
        });
        let in_first = |rig: &Rig, px: &[Point2<f64>; 2]| {
            let point = rig.triangulate(&[(a, px[0]), (b, px[1])])?;
            Some(rig.cam_from_rig[a] * point)
        };
        let distances = self.covariance_of(&|state| {
            let rig = rig_of(state);
            let far = |px| in_first(&rig, px).map_or(f64::NAN, |at| libm::log(at.coords.norm()));
            seen.iter().map(far).collect()
        });
        let far = places.iter().map(|place| (now.cam_from_rig[a] * place).coords.norm());
        let at_m = far.sum::<f64>() / places.len().max(1) as f64;
        let length_bound_m = length.and_then(|length| {
            let inside = |end: Point3<f64>| {
                let both = px(&end)?;
                (holds(&sizes[a], &both[0]) && holds(&sizes[b], &both[1])).then_some(both)
            };
            let ends: Vec<[[Point2<f64>; 2]; 2]> = length_ends(&now, self.of, length)
                .into_iter()
                .filter_map(|[one, other]| Some([inside(one)?, inside(other)?]))
                .collect();
            let lengths = self.covariance_of(&|state| {
                let rig = rig_of(state);
                let apart = |[one, other]: &[[Point2<f64>; 2]; 2]| {
                    Some((in_first(&rig, one)? - in_first(&rig, other)?).norm())
                };
                ends.iter().map(|ends| apart(ends).unwrap_or(f64::NAN)).collect()
            });
            let of_scale = scale_sd * length.0;
            let widest = (lengths.nrows() > 0).then(|| lengths.diagonal().max())?;
            Some(TWO_SIDED_95 * (widest + of_scale * of_scale).sqrt())
        });
        Some(PairSd {
            motion: Matrix6::from_fn(|i, j| motion[(i, j)]),
            baseline_m: root_mean(&baseline)?,
            row_px: root_mean(&rows),
            distance: root_mean(&distances)?,
            at_m,
            length_bound_m,
        })
    }
}

/// Places of board corners, in the rig's frame, that both cameras have in their pictures.
fn places(
    rig: &Rig,
    boards: impl Iterator<Item = Isometry3<f64>>,
    board_m: &[Point3<f64>],
    of: [(usize, ImageSize); 2],
) -> Vec<Point3<f64>> {
    let is_in = |place: &Point3<f64>| {
        of.iter().all(|(camera, size)| {
            let px = rig.cameras[*camera].project(&(rig.cam_from_rig[*camera] * place));
            px.is_some_and(|px| holds(size, &px))
        })
    };
    let all = boards.flat_map(|board| board_m.iter().map(move |point| board * point));
    let both: Vec<Point3<f64>> = all.filter(is_in).collect();
    let step = both.len().div_ceil(PLACES).max(1);
    both.into_iter().step_by(step).collect()
}

/// Places of the boards of a calibrated rig that both cameras have in their pictures.
pub(super) fn shared_places(rig: &RigCalibration, of: [usize; 2]) -> Vec<Point3<f64>> {
    let boards = rig.instants.iter().map(|instant| instant.rig_from_board);
    let sizes = of.map(|camera| (camera, rig.cameras[camera].image_size));
    places(&rig.rig, boards, &rig.board_m, sizes)
}

pub(super) fn holds(size: &ImageSize, px: &Point2<f64>) -> bool {
    let inside = |value: f64, count: u32| (-0.5..f64::from(count) - 0.5).contains(&value);
    inside(px.x, size.width_px) && inside(px.y, size.height_px)
}

/// Ends of the length in four directions across the first camera's axis, in the rig's frame, about
/// the point at the distance where the cameras' axes pass each other.
fn length_ends(rig: &Rig, of: [usize; 2], (length_m, at_m): LengthAt) -> Vec<[Point3<f64>; 2]> {
    let rig_from_first = rig.cam_from_rig[of[0]].inverse();
    let middle = between_axes(rig, of, at_m);
    let direction = |eighth: u32| {
        let (sin, cos) = libm::sincos(f64::from(eighth) * core::f64::consts::FRAC_PI_4);
        let half = Vector3::new(cos, sin, 0.0) * (0.5 * length_m);
        [middle - half, middle + half].map(|end| rig_from_first * Point3::from(end))
    };
    (0..4).map(direction).collect()
}

/// Point at the depth `at_m` between the cameras' axes, in the first camera's frame.
fn between_axes(rig: &Rig, [a, b]: [usize; 2], at_m: f64) -> Vector3<f64> {
    let second = rig.cam_from_cam(a, b);
    let axis = second.rotation * Vector3::z();
    // The second camera's axis at the same distance.
    let along = (at_m - second.translation.vector.z) / axis.z;
    let there = second.translation.vector + axis * along;
    match along > 0.0 && there.iter().all(|value| value.is_finite()) {
        true => 0.5 * (there + Vector3::z() * at_m),
        false => Vector3::z() * at_m,
    }
}

impl KnownRig {
    /// Standard deviation of a point's distance by the calibration alone, as a share of the
    /// distance: for the point between the axes of the cameras `of`, at the depth `at_m` in metres
    /// of the first one. `None` if a picture of the given sizes doesn't hold the point.
    pub fn distance_sd(&self, of: [usize; 2], sizes: [ImageSize; 2], at_m: f64) -> Option<f64> {
        let Rig { cameras, cam_from_rig } = self.rig.clone();
        let point = cam_from_rig[of[0]].inverse() * Point3::from(between_axes(&self.rig, of, at_m));
        let px = |which: usize| {
            let camera = of[which];
            let px = cameras[camera].project(&(cam_from_rig[camera] * point))?;
            holds(&sizes[which], &px).then_some((camera, px))
        };
        let seen = [px(0)?, px(1)?];
        let (rig_from_board, shape) = (Vec::new(), [0.0; SHAPE]);
        let state = RigState { cameras, cam_from_rig, rig_from_board, shape };
        let (rows, jacobian) = derivatives(&state, &self.covariance, of, &|state| {
            let rig = rig_of(state);
            let in_first = rig.triangulate(&seen).map(|point| rig.cam_from_rig[of[0]] * point);
            vec![in_first.map_or(f64::NAN, |at| libm::log(at.coords.norm()))]
        });
        let variance = &jacobian * part(&self.covariance, &rows) * jacobian.transpose();
        variance.get(0).map(|variance| variance.max(0.0).sqrt())
    }
}

/// Indices of a camera's lens parameters among the shared numbers.
pub(super) fn lens_rows(camera: usize) -> Vec<usize> {
    (0..LENS_PARAMETERS).map(|i| OF_CAMERA * camera + i).collect()
}
