//! Joint bundle adjustment of a rig: the lenses, the cameras' places and the board's shape are
//! shared, the board's place belongs to an instant.

use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix6, Point2, Point3, SMatrix, SVector, Vector3, Vector6,
};

use crate::solve::{
    gram::{Gram, Row},
    schur_lm::{Equations, Problem},
    whitened::Whitened,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensMatrix};

/// Numbers of the board's shape: stretch of the rows' distances, and the sag along x², xy, y².
pub(super) const SHAPE: usize = 4;
/// Shared numbers of a camera: lens and place.
pub(super) const OF_CAMERA: usize = LENS_PARAMETERS + 6;
/// Degrees of freedom of Student's t distribution of the corners' errors, which downweights
/// outliers.
pub(super) const FREEDOM: f64 = 6.0;

/// Lenses, places of the cameras, shape of the board and the board's place at each instant.
#[derive(Clone, Debug)]
pub(super) struct RigState {
    pub(super) cameras: Vec<Camera>,
    pub(super) cam_from_rig: Vec<Isometry3<f64>>,
    pub(super) rig_from_board: Vec<Isometry3<f64>>,
    /// See [`SHAPE`]; 0 for a flat board of the stated size. Sags in 1/m.
    pub(super) shape: [f64; SHAPE],
}

impl RigState {
    /// Point of the board, in metres.
    pub(super) fn on_board(&self, board_m: &Point2<f64>) -> Point3<f64> {
        let [stretch, xx, xy, yy] = self.shape;
        let (x, y) = (board_m.x, board_m.y);
        let y_m = y * libm::exp(stretch);
        Point3::new(x, y_m, xx * x * x + xy * x * y + yy * y * y)
    }

    /// Pixel of a board point in a camera at an instant. `None` outside the field.
    pub(super) fn px(
        &self,
        camera: usize,
        instant: usize,
        board_m: &Point2<f64>,
    ) -> Option<Point2<f64>> {
        let in_rig = self.rig_from_board[instant] * self.on_board(board_m);
        self.cameras[camera].project(&(self.cam_from_rig[camera] * in_rig))
    }

    /// State moved by a change of the shared numbers, the instants left in place.
    pub(super) fn with_shared(&self, change: &DVector<f64>) -> Self {
        let mut moved = self.clone();
        for (index, camera) in moved.cameras.iter_mut().enumerate() {
            let at = OF_CAMERA * index;
            let mut parameters = camera.lens_parameters();
            for (i, parameter) in parameters.iter_mut().enumerate() {
                *parameter += change[at + i];
            }
            *camera = camera.with_lens_parameters(&parameters);
            let step = change.fixed_rows::<6>(at + LENS_PARAMETERS).into_owned();
            moved.cam_from_rig[index] = moved_by(&self.cam_from_rig[index], &step);
        }
        let at = OF_CAMERA * self.cameras.len();
        for (i, value) in moved.shape.iter_mut().enumerate() {
            *value += change[at + i];
        }
        moved
    }
}

fn moved_by(pose: &Isometry3<f64>, step: &Vector6<f64>) -> Isometry3<f64> {
    let turn_rad: Vector3<f64> = step.fixed_rows::<3>(0).into();
    Camera::moved(pose, &turn_rad, &step.fixed_rows::<3>(3).into())
}

/// Corners of one camera at one instant, in units of their error.
#[derive(Clone, Debug)]
pub(super) struct WhitenedView {
    pub(super) instant: usize,
    pub(super) camera: usize,
    pub(super) corners: Vec<Whitened>,
}

/// What is known of a camera's lens before the instants.
#[derive(Clone, Debug)]
pub(super) struct LensKnown {
    /// Estimated parameters.
    pub(super) free: [bool; LENS_PARAMETERS],
    pub(super) mean: SVector<f64, LENS_PARAMETERS>,
    /// Information about the parameters; zero for none.
    pub(super) information: LensMatrix,
}

/// Sum of squares to minimise.
pub(super) struct RigProblem<'a> {
    pub(super) views: &'a [WhitenedView],
    pub(super) lenses: &'a [LensKnown],
    /// Information about the board's shape.
    pub(super) shape: [f64; SHAPE],
    /// Camera that carries the rig's frame.
    pub(super) origin: usize,
}

/// Contribution of an instant, the shared part limited to the cameras that saw the board.
#[derive(Clone, Debug)]
pub(super) struct InstantBlock {
    /// Index of each row in the shared numbers.
    pub(super) at: Vec<usize>,
    shared: DMatrix<f64>,
    shared_gradient: DVector<f64>,
    cross: DMatrix<f64>,
    local: Matrix6<f64>,
    gradient: Vector6<f64>,
}

/// Information about shared numbers, and its gradient.
pub(super) type Reduced = (DMatrix<f64>, DVector<f64>);

impl InstantBlock {
    fn of(cameras: &[usize], all: usize) -> Self {
        let of_camera = |camera: &usize| OF_CAMERA * camera..OF_CAMERA * (camera + 1);
        let shape = OF_CAMERA * all..OF_CAMERA * all + SHAPE;
        let at: Vec<usize> = cameras.iter().flat_map(of_camera).chain(shape).collect();
        let size = at.len();
        Self {
            at,
            shared: DMatrix::zeros(size, size),
            shared_gradient: DVector::zeros(size),
            cross: DMatrix::zeros(size, 6),
            local: Matrix6::zeros(),
            gradient: Vector6::zeros(),
        }
    }

    /// Adds the products of a view; `place` is that of its camera among the block's.
    fn add(&mut self, gram: &Gram<8>, place: usize) {
        let shape = self.at.len() - SHAPE;
        let row = |i: usize| {
            if i < OF_CAMERA { OF_CAMERA * place + i } else { shape + i - OF_CAMERA }
        };
        const SHARED: usize = OF_CAMERA + SHAPE;
        const RESIDUAL: usize = SHARED + 6;
        for i in 0..SHARED {
            for j in 0..SHARED {
                self.shared[(row(i), row(j))] += gram.at(i, j);
            }
            for j in 0..6 {
                self.cross[(row(i), j)] += gram.at(i, SHARED + j);
            }
            self.shared_gradient[row(i)] += gram.at(i, RESIDUAL);
        }
        for i in 0..6 {
            for j in 0..6 {
                self.local[(i, j)] += gram.at(SHARED + i, SHARED + j);
            }
            self.gradient[i] += gram.at(SHARED + i, RESIDUAL);
        }
    }

    fn local_inverse(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut local = self.local;
        for i in 0..6 {
            local[(i, i)] *= 1.0 + damping;
        }
        crate::solve::schur_lm::inverse(&local)
    }

    /// Information and gradient for the shared numbers [`Self::at`], the board's place marginalised
    /// out.
    pub(super) fn reduced(&self) -> Option<Reduced> {
        let gain = &self.cross * self.local_inverse(0.0)?;
        Some((
            &self.shared - &gain * self.cross.transpose(),
            &self.shared_gradient - gain * self.gradient,
        ))
    }
}

/// Normal equations of a rig.
#[derive(Clone, Debug)]
pub(super) struct RigEquations {
    /// Information of the priors, and its gradient.
    pub(super) prior: Reduced,
    /// Estimated shared numbers.
    pub(super) free: Vec<usize>,
    pub(super) instants: Vec<InstantBlock>,
}

/// Step of the shared numbers and of each instant.
pub(super) struct RigStep {
    shared: DVector<f64>,
    instants: Vec<Vector6<f64>>,
    decrement: f64,
}

/// Rows and columns `at` of a matrix.
pub(super) fn part(matrix: &DMatrix<f64>, at: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(at.len(), at.len(), |i, j| matrix[(at[i], at[j])])
}

/// Inverse of a symmetric positive definite matrix, scaled to a unit diagonal first.
pub(super) fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|it| it.sqrt().recip());
    let scaled = |matrix: &DMatrix<f64>| {
        DMatrix::from_fn(scale.len(), scale.len(), |i, j| matrix[(i, j)] * scale[i] * scale[j])
    };
    let inverse = scaled(&scaled(matrix).cholesky()?.inverse());
    inverse.iter().all(|value| value.is_finite()).then_some(inverse)
}

impl Equations for RigEquations {
    type Step = RigStep;

    fn solve(&self, damping: f64) -> Option<RigStep> {
        let (mut reduced, mut gradient) = self.prior.clone();
        let plain = self.instants.iter().fold(gradient.clone(), |mut sum, block| {
            for (i, row) in block.at.iter().enumerate() {
                sum[*row] += block.shared_gradient[i];
            }
            sum
        });
        let mut inverses = Vec::with_capacity(self.instants.len());
        for block in &self.instants {
            let inverse = block.local_inverse(damping)?;
            let gain = &block.cross * inverse;
            let taken = &gain * block.cross.transpose();
            let pulled = &block.shared_gradient - gain * block.gradient;
            for (i, row) in block.at.iter().enumerate() {
                for (j, column) in block.at.iter().enumerate() {
                    reduced[(*row, *column)] += block.shared[(i, j)] - taken[(i, j)];
                }
                reduced[(*row, *row)] += damping * block.shared[(i, i)];
                gradient[*row] += pulled[i];
            }
            inverses.push(inverse);
        }
        for i in 0..reduced.nrows() {
            reduced[(i, i)] += damping * self.prior.0[(i, i)];
        }
        let of_free = inverse(&part(&reduced, &self.free))?;
        let pull = DVector::from_fn(self.free.len(), |i, _| gradient[self.free[i]]);
        let step = of_free * pull;
        let mut shared = DVector::zeros(gradient.len());
        for (value, row) in step.iter().zip(&self.free) {
            shared[*row] = *value;
        }
        let mut decrement = shared.dot(&plain);
        let of_instant = |(block, inverse): (&InstantBlock, &Matrix6<f64>)| {
            let change = DVector::from_fn(block.at.len(), |i, _| shared[block.at[i]]);
            let left = block.cross.tr_mul(&change);
            let step = inverse * (block.gradient - Vector6::from_fn(|i, _| left[i]));
            decrement += step.dot(&block.gradient);
            step
        };
        let instants = self.instants.iter().zip(&inverses).map(of_instant).collect();
        decrement.is_finite().then_some(RigStep { shared, instants, decrement })
    }

    fn decrement(step: &RigStep) -> f64 {
        step.decrement
    }
}

impl RigProblem<'_> {
    /// Sums of products of a view's rows, weighted against outliers, and its cost.
    fn view(&self, view: &WhitenedView, state: &RigState) -> Option<(f64, Gram<8>)> {
        let camera = &state.cameras[view.camera];
        let cam_from_rig = &state.cam_from_rig[view.camera];
        let rig_from_board = &state.rig_from_board[view.instant];
        let rig_to_cam = cam_from_rig.rotation.to_rotation_matrix();
        let board_to_rig = rig_from_board.rotation.to_rotation_matrix();
        let mut rows: Vec<Row<8>> = Vec::with_capacity(2 * view.corners.len());
        let mut cost = 0.0;
        for corner in &view.corners {
            let on_board = state.on_board(&corner.board_m);
            let turned = board_to_rig * on_board.coords;
            let in_rig = Point3::from(turned + rig_from_board.translation.vector);
            let at = camera.project_body_point(cam_from_rig, &in_rig)?;
            let residual = corner.whitener * (corner.px - at.px);
            let square = residual.norm_squared();
            cost += (FREEDOM + 2.0) * libm::log1p(square / FREEDOM);
            let weight = ((FREEDOM + 2.0) / (FREEDOM + square)).sqrt();
            let whitener = corner.whitener * weight;
            let lens = whitener * at.jac_lens;
            let place = whitener * at.jac_pose;
            let by_rig: SMatrix<f64, 2, 3> = place.fixed_columns::<3>(3) * rig_to_cam.matrix();
            let by_turn = by_rig * -turned.cross_matrix();
            let by_board = by_rig * board_to_rig.matrix();
            let (x, y) = (corner.board_m.x, corner.board_m.y);
            let residual = residual * weight;
            for axis in 0..2 {
                let mut row = Row::zeros();
                (0..LENS_PARAMETERS).for_each(|i| row.set(i, lens[(axis, i)]));
                (0..6).for_each(|i| row.set(LENS_PARAMETERS + i, place[(axis, i)]));
                row.set(OF_CAMERA, by_board[(axis, 1)] * on_board.y);
                for (i, rise) in [x * x, x * y, y * y].into_iter().enumerate() {
                    row.set(OF_CAMERA + 1 + i, by_board[(axis, 2)] * rise);
                }
                let local = OF_CAMERA + SHAPE;
                (0..3).for_each(|i| row.set(local + i, by_turn[(axis, i)]));
                (0..3).for_each(|i| row.set(local + 3 + i, by_rig[(axis, i)]));
                row.set(local + 6, residual[axis]);
                rows.push(row);
            }
        }
        Some((cost, Gram::of(&rows)))
    }

    /// Shared numbers that are estimated.
    fn free(&self) -> Vec<usize> {
        let count = OF_CAMERA * self.lenses.len() + SHAPE;
        let is_free = |row: &usize| {
            let (camera, i) = (row / OF_CAMERA, row % OF_CAMERA);
            match self.lenses.get(camera) {
                Some(lens) if i < LENS_PARAMETERS => lens.free[i],
                Some(_) => camera != self.origin,
                None => true,
            }
        };
        (0..count).filter(is_free).collect()
    }
}

impl Problem<RigEquations> for RigProblem<'_> {
    type State = RigState;

    fn linearise(&self, state: &RigState) -> Option<(f64, RigEquations)> {
        let cameras = state.cameras.len();
        if state.cameras.iter().any(|camera| camera.f_px.min() <= 1.0) {
            return None;
        }
        let mut seen_by = vec![Vec::new(); state.rig_from_board.len()];
        for view in self.views {
            seen_by[view.instant].push(view.camera);
        }
        let mut instants: Vec<InstantBlock> =
            seen_by.iter().map(|of| InstantBlock::of(of, cameras)).collect();
        let mut cost = 0.0;
        let mut next = vec![0; instants.len()];
        for view in self.views {
            let (of_view, gram) = self.view(view, state)?;
            instants[view.instant].add(&gram, next[view.instant]);
            next[view.instant] += 1;
            cost += of_view;
        }
        let size = OF_CAMERA * cameras + SHAPE;
        let mut prior = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (index, (lens, camera)) in self.lenses.iter().zip(&state.cameras).enumerate() {
            let at = OF_CAMERA * index;
            let miss = lens.mean - SVector::from(camera.lens_parameters());
            let pull = lens.information * miss;
            cost += miss.dot(&pull);
            prior
                .0
                .view_mut((at, at), (LENS_PARAMETERS, LENS_PARAMETERS))
                .copy_from(&lens.information);
            prior.1.rows_mut(at, LENS_PARAMETERS).copy_from(&pull);
        }
        for (i, (information, value)) in self.shape.iter().zip(state.shape).enumerate() {
            let at = OF_CAMERA * cameras + i;
            prior.0[(at, at)] = *information;
            prior.1[at] = -information * value;
            cost += information * value * value;
        }
        let equations = RigEquations { prior, free: self.free(), instants };
        cost.is_finite().then_some((cost, equations))
    }

    fn moved(&self, state: &RigState, step: &RigStep) -> RigState {
        let mut moved = state.with_shared(&step.shared);
        for (place, step) in moved.rig_from_board.iter_mut().zip(&step.instants) {
            *place = moved_by(place, step);
        }
        moved
    }
}
