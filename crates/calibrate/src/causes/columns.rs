//! Derivatives of every corner by lens, pose and the parameters of every cause, at the minimum of
//! the bundle, as products of columns view by view.

use nalgebra::{DMatrix, DVector, Matrix6, Point2, SMatrix, SVector, Vector2};

use crate::solve::{
    bundle::{Bundle, BundleState, Observations},
    gram::{Gram, Row},
    lens_model::{join_focal_lengths, tie_focal_lengths},
    schur_lm::inverse,
};
use boresight_geometry::{LENS_PARAMETERS, frame::ImageSize};

/// Columns of derivatives; lens parameters come first.
const POSE: usize = LENS_PARAMETERS;
pub(super) const RESIDUAL: usize = POSE + 6;
/// Columns of the logarithm of the focal length, and the same times r².
pub(super) const SCALE: usize = RESIDUAL + 1;
pub(super) const SCALE_R2: usize = SCALE + 1;
/// Columns of a shift along x and y in pixels.
pub(super) const SHIFT: usize = SCALE_R2 + 1;
/// Columns of a shift that increases from row to row, in pixels over the picture.
pub(super) const SHUTTER: usize = SHIFT + 2;
pub(super) const SKEW: usize = SHUTTER + 2;
/// Column of the ratio of `fy` to `fx`.
pub(super) const ASPECT: usize = SKEW + 1;
pub(super) const STRETCH: usize = ASPECT + 1;
pub(super) const BEND: usize = STRETCH + 1;
/// Column of the next radial term.
pub(super) const RADIAL: usize = BEND + 3;
/// Columns of thin prisms.
pub(super) const PRISM: usize = RADIAL + 1;
/// Columns of a smooth shift of the picture.
pub(super) const FIELD: usize = PRISM + 2;
/// Terms of a smooth shift.
pub(super) const FIELDS: usize = 12;
pub(super) const COLUMNS: usize = FIELD + FIELDS;
const TILES: usize = COLUMNS.div_ceil(4);

/// Products of the columns of a view, with the pose eliminated.
pub(super) type Products = SMatrix<f64, COLUMNS, COLUMNS>;

/// Derivatives at the minimum of a bundle.
pub(crate) struct Derivatives<'a> {
    pub(super) observations: &'a Observations,
    pub(super) state: &'a BundleState,
    pub(super) image_size: ImageSize,
    pub(super) square_pixels: bool,
    /// Indices of the estimated lens parameters, `fy` with `fx` if pixels are square.
    pub(super) lens: Vec<usize>,
    /// Products of the columns of each view, for corners with the stated error.
    pub(super) of_views: Vec<Products>,
}

/// Effect of a single shared parameter beside the lens, for corners with the stated error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OneColumn {
    /// Most probable value of the parameter.
    pub(crate) value: f64,
    pub(crate) unit_variance: f64,
    /// Derivative of the fitted lens parameters by the value.
    pub(crate) lens_by_value: SVector<f64, LENS_PARAMETERS>,
}

impl<'a> Derivatives<'a> {
    /// Products at the minimum of `bundle`. `None` if a corner is outside the field or a pose is
    /// undetermined.
    pub(crate) fn of(
        observations: &'a Observations,
        bundle: &'a Bundle,
        image_size: ImageSize,
    ) -> Option<Self> {
        let square_pixels = bundle.freedom.square_pixels;
        let lens = bundle.freedom.parameters().iter().map(|it| it.index()).collect();
        let (state, of_views) = (&bundle.state, Vec::new());
        let mut all = Self { observations, state, image_size, square_pixels, lens, of_views };
        all.of_views = observations.by_view(|view| all.products(view))?;
        Some(all)
    }

    fn products(&self, view: usize) -> Option<Products> {
        let gram = self.gram(view)?;
        let settled = inverse(&Matrix6::from_fn(|i, j| gram.at(POSE + i, POSE + j)))?;
        let across = SMatrix::<f64, 6, COLUMNS>::from_fn(|i, j| gram.at(POSE + i, j));
        let whole = Products::from_fn(|i, j| gram.at(i, j));
        Some(whole - across.transpose() * (settled * across))
    }

    fn gram(&self, view: usize) -> Option<Gram<TILES>> {
        let (camera, pose) = (&self.state.camera, &self.state.cam_from_board[view]);
        let kind = camera.distortion.kind;
        let half_board_m = half_board_m(self.observations);
        let turn = pose.rotation.to_rotation_matrix();
        let (along_y, off_board) = (turn.matrix().column(1), turn.matrix().column(2));
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
            set(ASPECT, Vector2::new(0.0, off.y));
            set(STRETCH, by_cam * along_y * corner.board_m.y);
            let rise = by_cam * off_board * half_board_m;
            for (i, bow) in bows(&corner.board_m, half_board_m).into_iter().enumerate() {
                set(BEND + i, rise * bow);
            }
            set(RADIAL, (flat * r2.powi(kind.next_radial_power())).component_mul(&camera.f_px));
            set(PRISM, Vector2::new(r2 * camera.f_px.x, 0.0));
            set(PRISM + 1, Vector2::new(0.0, r2 * camera.f_px.y));
            for (i, term) in field_terms(self.image_size, &seen.px).into_iter().enumerate() {
                set(FIELD + i, term);
            }
            rows.extend(pair);
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        Some(Gram::of(&rows))
    }

    /// Effect of the next radial term. `None` if the corners leave it undetermined.
    pub(crate) fn next_radial(&self) -> Option<OneColumn> {
        let all: Products = self.of_views.iter().sum();
        let information = all.select_rows(&self.lens).select_columns(&self.lens);
        let across = all.select_rows(&self.lens).column(RADIAL).into_owned();
        let pull = all.column(RESIDUAL).select_rows(&self.lens);
        let lens = solve(&information, &DMatrix::from_columns(&[across.clone(), pull]))?;
        let own = all[(RADIAL, RADIAL)] - across.dot(&lens.column(0));
        let gradient = all[(RADIAL, RESIDUAL)] - across.dot(&lens.column(1));
        let lens_by_value = self.spread(&-lens.column(0));
        (own > 0.0).then(|| OneColumn {
            value: gradient / own,
            unit_variance: own.recip(),
            lens_by_value,
        })
    }

    /// Lens vector from the estimated parameters, `fy` as `fx` if pixels are square.
    pub(super) fn spread(&self, estimated: &DVector<f64>) -> SVector<f64, LENS_PARAMETERS> {
        let mut all = SVector::<f64, LENS_PARAMETERS>::zeros();
        self.lens.iter().zip(estimated).for_each(|(index, value)| all[*index] = *value);
        if self.square_pixels {
            tie_focal_lengths(all.as_mut_slice());
        }
        all
    }
}

/// Solves `matrix x = columns` for a symmetric positive matrix, scaled to a unit diagonal.
pub(super) fn solve(matrix: &DMatrix<f64>, columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    /// Keeps undetermined directions from taking a step.
    const DAMPING: f64 = 1e-12;
    let scale = matrix.diagonal().map(|it| (it.abs() + f64::MIN_POSITIVE).sqrt().recip());
    let mut scaled = matrix.clone();
    for (j, mut column) in scaled.column_iter_mut().enumerate() {
        column.component_mul_assign(&scale);
        column *= scale[j];
        column[j] += DAMPING;
    }
    let mut solution = columns.clone();
    solution.column_iter_mut().for_each(|mut column| column.component_mul_assign(&scale));
    scaled.cholesky()?.solve_mut(&mut solution);
    solution.column_iter_mut().for_each(|mut column| column.component_mul_assign(&scale));
    Some(solution)
}

/// Half the longer side of the board, the unit of a bend.
pub(super) fn half_board_m(observations: &Observations) -> f64 {
    observations.board_m().iter().map(|p| p.coords.amax()).fold(f64::MIN_POSITIVE, f64::max)
}

/// Rise of a board point under each bend of unit size, relative to half the board.
pub(super) fn bows(point_m: &Point2<f64>, half_board_m: f64) -> [f64; 3] {
    let (x, y) = (point_m.x / half_board_m, point_m.y / half_board_m);
    [1.0 - x * x, 1.0 - y * y, x * y]
}

/// Terms of a smooth shift at `px`: those of second order, except the two given by p1 and p2, and
/// of third order, 1 px at the sides of the picture.
fn field_terms(image_size: ImageSize, px: &Point2<f64>) -> [Vector2<f64>; FIELDS] {
    let off = (px - image_size.centre_px()) * 2.0 / f64::from(image_size.width_px);
    let (u, v) = (off.x, off.y);
    let along_x = |value: f64| Vector2::new(value, 0.0);
    let along_y = |value: f64| Vector2::new(0.0, value);
    let square = u * u + v * v;
    let [a, b, c, d] = [u * u * u, u * u * v, u * v * v, v * v * v];
    [
        along_x(square),
        along_y(square),
        Vector2::new(u * u - v * v, -2.0 * u * v),
        Vector2::new(2.0 * u * v, u * u - v * v),
        along_x(a),
        along_x(b),
        along_x(c),
        along_x(d),
        along_y(a),
        along_y(b),
        along_y(c),
        along_y(d),
    ]
}
