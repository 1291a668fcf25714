//! First step and promised gain of a fit under each [`Cause`], from a single pass over the corners.
//!
//! At the minimum of the plain bundle, every cause changes the picture in proportion to its
//! parameters. The derivatives are closed forms, most of them shared between causes. The sums of
//! their products, view by view, contain the normal equations of every cause.

use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector2};

use super::{
    hypotheses::{Cause, LOCAL_EXTRAS, SHARED_EXTRAS},
    picture_effect::field_terms,
};
use crate::solve::{
    bundle::{BundleState, Observations},
    gram::{Gram, Row},
    lens_model::{join_focal_lengths, tie_focal_lengths},
    schur_lm::inverse,
};
use boresight_geometry::{LENS_PARAMETERS, LensParameter, frame::ImageSize};

/// Columns of derivatives; lens parameters come first.
const POSE: usize = LENS_PARAMETERS;
const RESIDUAL: usize = POSE + 6;
/// Derivatives by the logarithm of the focal length, and the same times r².
const SCALE: usize = RESIDUAL + 1;
const SCALE_R2: usize = SCALE + 1;
/// Derivatives by a shift along x and y.
const SHIFT: usize = SCALE_R2 + 1;
/// Derivatives by a shift that increases from row to row.
const SHUTTER: usize = SHIFT + 2;
const SKEW: usize = SHUTTER + 2;
const STRETCH: usize = SKEW + 1;
const BEND: usize = STRETCH + 1;
/// Derivatives by the next two radial terms, and by thin prisms.
const RADIAL: usize = BEND + 3;
const PRISM: usize = RADIAL + 2;
const FIELD: usize = PRISM + 2;
/// Derivatives by a shift of the corners below a tear.
const TORN: usize = FIELD + SHARED_EXTRAS;
const COLUMNS: usize = TORN + 2;
const TILES: usize = COLUMNS / 4;
const _: () = assert!(COLUMNS == 4 * TILES);

/// Lens parameters and parameters of a cause.
const SHARED: usize = LENS_PARAMETERS + SHARED_EXTRAS;
/// Relative increase of diagonals, so that undetermined directions take no step.
const DAMPING: f64 = 1e-9;

/// Sums of products of the columns of a cause, with poses and per-view parameters eliminated.
#[derive(Clone, Debug)]
struct Sums {
    information: SMatrix<f64, SHARED, SHARED>,
    gradient: SVector<f64, SHARED>,
    cost: f64,
}

/// Minimum of the plain bundle.
#[derive(Clone, Copy)]
pub(super) struct Plain<'a> {
    pub(super) observations: &'a Observations,
    pub(super) state: &'a BundleState,
    pub(super) image_size: ImageSize,
    pub(super) square_pixels: bool,
    /// Estimated lens parameters; `fy` with `fx` if pixels are square.
    pub(super) free: [bool; LENS_PARAMETERS],
    /// Variance of the corners as a multiple of the stated covariances, used to weigh priors.
    pub(super) noise_variance: f64,
}

/// Normal equations of each cause.
pub(super) struct FirstSteps {
    square_pixels: bool,
    of_causes: Vec<Option<Sums>>,
}

/// First-order estimate of a cause with a single parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FirstStep {
    /// Most probable value of the parameter.
    pub(super) value: f64,
    /// Variance of the value for corners with the stated error.
    pub(super) unit_variance: f64,
    /// Derivative of the fitted lens parameters by the value.
    pub(super) lens_by_value: SVector<f64, LENS_PARAMETERS>,
}

impl FirstSteps {
    pub(super) fn of(plain: &Plain<'_>, causes: &[Cause]) -> Self {
        let chunks = plain.observations.by_chunk(|mut views| {
            let mut sums = vec![Some(Sums::zeros()); causes.len()];
            let is_whole = views.all(|view| {
                let Some(gram) = plain.without_pose(view, causes) else { return false };
                for (sums, cause) in sums.iter_mut().zip(causes) {
                    let is_added =
                        sums.as_mut().is_some_and(|sums| plain.add(&gram, view, cause, sums));
                    if !is_added {
                        *sums = None;
                    }
                }
                true
            });
            if is_whole { sums } else { vec![None; causes.len()] }
        });
        let mut of_causes = vec![Some(Sums::zeros()); causes.len()];
        for chunk in chunks {
            for (all, some) in of_causes.iter_mut().zip(chunk) {
                *all = all.take().zip(some).map(|(all, some)| all.with(&some));
            }
        }
        for (sums, cause) in of_causes.iter_mut().zip(causes) {
            if let Some(sums) = sums {
                plain.complete(cause, sums);
            }
        }
        Self { square_pixels: plain.square_pixels, of_causes }
    }

    /// Sum of squared whitened residuals after the first step of the cause with index `place`.
    /// `None` if the views don't determine the step.
    pub(super) fn left(&self, place: usize) -> Option<f64> {
        let sums = self.of_causes[place].as_ref()?;
        let mut damped = sums.information;
        for i in 0..SHARED {
            damped[(i, i)] *= 1.0 + DAMPING;
        }
        Some(sums.cost - sums.gradient.dot(&(inverse(&damped)? * sums.gradient)))
    }

    /// First step of the cause with index `place` and a single shared parameter. `None` if the
    /// corners leave it undetermined.
    pub(super) fn of_one(&self, place: usize) -> Option<FirstStep> {
        let sums = self.of_causes[place].as_ref()?;
        let covariance = inverse(&sums.information)?;
        let unit_variance = covariance[(LENS_PARAMETERS, LENS_PARAMETERS)];
        let mut lens_by_value: SVector<f64, LENS_PARAMETERS> =
            covariance.fixed_view::<LENS_PARAMETERS, 1>(0, LENS_PARAMETERS).into();
        lens_by_value /= unit_variance;
        if self.square_pixels {
            tie_focal_lengths(lens_by_value.as_mut_slice());
        }
        let value = covariance.row(LENS_PARAMETERS).transpose().dot(&sums.gradient);
        Some(FirstStep { value, unit_variance, lens_by_value })
    }
}

impl Sums {
    fn zeros() -> Self {
        Self { information: SMatrix::zeros(), gradient: SVector::zeros(), cost: 0.0 }
    }

    fn with(mut self, other: &Self) -> Self {
        self.information += other.information;
        self.gradient += other.gradient;
        self.cost += other.cost;
        self
    }
}

/// Products of the columns of a view, with the pose eliminated.
type Reduced = [[f64; COLUMNS]; COLUMNS];

impl Plain<'_> {
    /// Products of a view; `None` if a corner is outside the field or the pose is undetermined.
    fn without_pose(&self, view: usize, causes: &[Cause]) -> Option<Reduced> {
        let gram = self.gram(view, causes)?;
        let of_pose = Matrix6::from_fn(|i, j| gram.at(POSE + i, POSE + j));
        let settled = inverse(&of_pose)?;
        let across = SMatrix::<f64, 6, COLUMNS>::from_fn(|i, j| gram.at(POSE + i, j));
        let absorbed = settled * across;
        let left = |i: usize, j: usize| gram.at(i, j) - across.column(i).dot(&absorbed.column(j));
        Some(std::array::from_fn(|i| std::array::from_fn(|j| left(i, j))))
    }

    fn gram(&self, view: usize, causes: &[Cause]) -> Option<Gram<TILES>> {
        let (camera, pose) = (&self.state.camera, &self.state.cam_from_board[view]);
        let kind = camera.distortion.kind;
        let half_board_m = half_board_m(self.observations);
        let torn_px = causes.iter().find_map(|cause| match cause {
            Cause::Torn(rows) => rows[view],
            _ => None,
        });
        let turn = pose.rotation.to_rotation_matrix();
        let (along_y, off_board) =
            (turn.matrix().column(1).into_owned(), turn.matrix().column(2).into_owned());
        let corners = self.observations.view(view);
        let mut rows: Vec<Row<TILES>> = Vec::with_capacity(2 * corners.len());
        for corner in corners {
            let seen = camera.project_board_point(pose, &corner.board_m)?;
            let flat = seen.flat.coords;
            let r2 = flat.norm_squared();
            let off = seen.px - camera.pp_px;
            let by_cam = seen.jac_pose.fixed_columns::<3>(3);
            let mut pair = [Row::zeros(); 2];
            let mut set = |column: usize, by: Vector2<f64>| {
                let by = corner.whitener * by;
                pair.iter_mut().zip(&by).for_each(|(row, value)| row.set(column, *value));
            };
            let mut jac_lens = seen.jac_lens;
            if self.square_pixels {
                join_focal_lengths(&mut jac_lens);
            }
            (0..LENS_PARAMETERS).for_each(|i| set(i, jac_lens.column(i).into_owned()));
            (0..6).for_each(|i| set(POSE + i, seen.jac_pose.column(i).into_owned()));
            set(RESIDUAL, corner.px - seen.px);
            set(SCALE, off);
            set(SCALE_R2, off * r2);
            set(SHIFT, Vector2::x());
            set(SHIFT + 1, Vector2::y());
            let row = seen.px.y / f64::from(self.image_size.height_px) - 0.5;
            set(SHUTTER, Vector2::new(row, 0.0));
            set(SHUTTER + 1, Vector2::new(0.0, row));
            set(SKEW, Vector2::new(off.y, 0.0));
            set(STRETCH, by_cam * along_y * corner.board_m.y);
            let rise = by_cam * off_board * half_board_m;
            let (x, y) = (corner.board_m.x / half_board_m, corner.board_m.y / half_board_m);
            set(BEND, rise * (1.0 - x * x));
            set(BEND + 1, rise * (1.0 - y * y));
            set(BEND + 2, rise * (x * y));
            let radial = (flat * r2.powi(kind.next_radial_power())).component_mul(&camera.f_px);
            set(RADIAL, radial);
            set(RADIAL + 1, radial * r2);
            set(PRISM, Vector2::new(r2 * camera.f_px.x, 0.0));
            set(PRISM + 1, Vector2::new(0.0, r2 * camera.f_px.y));
            for (i, term) in field_terms(self.image_size, &seen.px).into_iter().enumerate() {
                set(FIELD + i, term);
            }
            if torn_px.is_some_and(|torn_px| corner.px.y > torn_px) {
                set(TORN, Vector2::x());
                set(TORN + 1, Vector2::y());
            }
            rows.extend(pair);
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        Some(Gram::of(&rows))
    }

    /// Adds a view to the sums of `cause`, with local parameters eliminated. Returns false if those
    /// are undetermined.
    fn add(&self, gram: &Reduced, view: usize, cause: &Cause, sums: &mut Sums) -> bool {
        let times = cause.times(view, self.observations.view_count());
        let (extras, local) = columns(cause);
        let is_whole = matches!(cause, Cause::Torn(rows) if rows[view].is_none());
        let local = if is_whole { &[] } else { local };
        // Columns and factors.
        let mut used = [(0, 0.0); SHARED + 1];
        (0..LENS_PARAMETERS).for_each(|i| used[i] = (i, 1.0));
        for (used, column) in used[LENS_PARAMETERS..].iter_mut().zip(extras) {
            *used = (*column, times);
        }
        let count = LENS_PARAMETERS + extras.len();
        used[count] = (RESIDUAL, 1.0);
        let used = &used[..=count];
        let mut of_local = Matrix3::identity();
        let mut across = SMatrix::<f64, LOCAL_EXTRAS, { SHARED + 1 }>::zeros();
        let prior = cause.local_sd().map_or(0.0, |(sd, _)| self.noise_variance / (sd * sd));
        for (i, row) in local.iter().enumerate() {
            for (j, column) in local.iter().enumerate() {
                of_local[(i, j)] = gram[*row][*column];
            }
            of_local[(i, i)] = (of_local[(i, i)] + prior) * (1.0 + DAMPING);
            for (j, (column, times)) in used.iter().enumerate() {
                across[(i, j)] = gram[*row][*column] * times;
            }
        }
        let Some(settled) = inverse(&of_local) else { return false };
        let absorbed = settled * across;
        let sum = |i: usize, j: usize| {
            let ((row, first), (column, second)) = (used[i], used[j]);
            let whole = gram[row][column] * (first * second);
            if local.is_empty() { whole } else { whole - across.column(i).dot(&absorbed.column(j)) }
        };
        for j in 0..count {
            for i in 0..count {
                sums.information[(i, j)] += sum(i, j);
            }
            sums.gradient[j] += sum(j, count);
        }
        sums.cost += sum(count, count);
        true
    }

    /// Adds the priors of `cause`, and fixes unestimated parameters.
    fn complete(&self, cause: &Cause, sums: &mut Sums) {
        let is_free = |index: usize| match LensParameter::ALL.get(index) {
            Some(LensParameter::Fy) => !self.square_pixels || *cause == Cause::PixelAspect,
            Some(_) => self.free[index],
            None => index < LENS_PARAMETERS + cause.shared_extras(),
        };
        for index in (0..SHARED).filter(|index| !is_free(*index)) {
            sums.information.row_mut(index).fill(0.0);
            sums.information.column_mut(index).fill(0.0);
            sums.information[(index, index)] = 1.0;
            sums.gradient[index] = 0.0;
        }
        for (index, sd) in cause.held_to().iter().enumerate() {
            let index = LENS_PARAMETERS + index;
            sums.information[(index, index)] += self.noise_variance / (sd * sd);
        }
    }
}

/// Half the longer side of the board, the unit of a bend.
pub(super) fn half_board_m(observations: &Observations) -> f64 {
    observations.board_m().iter().map(|p| p.coords.amax()).fold(f64::MIN_POSITIVE, f64::max)
}

/// Columns of a cause's shared and per-view parameters.
fn columns(cause: &Cause) -> (&'static [usize], &'static [usize]) {
    const FIELDS: [usize; SHARED_EXTRAS] = {
        let mut columns = [FIELD; SHARED_EXTRAS];
        let mut i = 0;
        while i < SHARED_EXTRAS {
            columns[i] += i;
            i += 1;
        }
        columns
    };
    match cause {
        Cause::Focus => (&[], &[SCALE]),
        Cause::FocusDrift | Cause::FocusJump(_) | Cause::FocusBreathes(_) => (&[SCALE], &[]),
        Cause::Mixed(_) => (&[SCALE, SHIFT, SHIFT + 1, SCALE_R2], &[]),
        Cause::Shifted => (&[], &[SHIFT, SHIFT + 1]),
        Cause::PixelAspect => (&[], &[]),
        Cause::PixelSkew => (&[SKEW], &[]),
        Cause::BoardStretched => (&[STRETCH], &[]),
        Cause::BoardBent => (&[BEND, BEND + 1, BEND + 2], &[]),
        Cause::BoardFlexes => (&[], &[BEND, BEND + 1, BEND + 2]),
        Cause::RollingShutter => (&[], &[SHUTTER, SHUTTER + 1]),
        Cause::LensShape => (&[RADIAL, RADIAL + 1, PRISM, PRISM + 1], &[]),
        Cause::NextRadial => (&[RADIAL], &[]),
        Cause::SmoothField => (&FIELDS, &[]),
        Cause::Torn(_) => (&[], &[TORN, TORN + 1]),
    }
}
