//! Bundle adjustment with the parameters of a cause that all views share beside the lens.

use nalgebra::{Isometry3, Matrix2, Point2, Point3, SMatrix, SVector, Vector2, Vector3};

use super::{columns::bows, kinds::Kind};
use crate::solve::{
    bundle::{BundleState, Observations},
    gram::{Gram, Row},
    lens_model::{join_focal_lengths, tie_focal_lengths},
    schur_lm::{NormalEquations, Problem, Step, ViewBlock},
    whitened::Whitened,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensParameter};

/// Most parameters of a cause.
pub(super) const EXTRAS: usize = 4;
/// Number of shared parameters, of lens and cause.
pub(super) const SHARED: usize = LENS_PARAMETERS + EXTRAS;

type OfView = ViewBlock<SHARED, 6>;

/// Lens, poses and parameters of a cause.
#[derive(Clone, Debug)]
pub(super) struct ExtendedState {
    pub(super) bundle: BundleState,
    pub(super) extras: [f64; EXTRAS],
}

pub(super) struct ExtendedProblem<'a> {
    pub(super) observations: &'a Observations,
    pub(super) kind: Kind,
    pub(super) half_board_m: f64,
    pub(super) square_pixels: bool,
    /// Estimated lens parameters.
    pub(super) free: [bool; LENS_PARAMETERS],
}

/// Image of a corner under a cause, with derivatives by lens, pose and the cause's parameters.
struct Seen {
    px: Point2<f64>,
    by_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    by_pose: SMatrix<f64, 2, 6>,
    by_extras: [Vector2<f64>; EXTRAS],
}

impl ExtendedProblem<'_> {
    /// Board point in metres on the board as changed by the cause.
    pub(super) fn on_board(&self, extras: &[f64; EXTRAS], point_m: &Point2<f64>) -> Point3<f64> {
        let flat_m = Point3::new(point_m.x, point_m.y, 0.0);
        let moved = self.board_by_extras(point_m).into_iter().zip(extras);
        moved.fold(flat_m, |at, (by_extra, value)| at + by_extra * *value)
    }

    fn board_by_extras(&self, point_m: &Point2<f64>) -> [Vector3<f64>; EXTRAS] {
        let mut by = [Vector3::zeros(); EXTRAS];
        match self.kind {
            Kind::BoardStretched => by[0] = Vector3::y() * point_m.y,
            Kind::BoardBent => {
                let bows = bows(point_m, self.half_board_m);
                by.iter_mut()
                    .zip(bows)
                    .for_each(|(by, bow)| *by = Vector3::z() * (bow * self.half_board_m));
            }
            _ => {}
        }
        by
    }

    /// Image of a corner; `None` outside the field.
    fn seen(&self, view: usize, state: &ExtendedState, corner: &Whitened) -> Option<Seen> {
        let (camera, pose) = (&state.bundle.camera, &state.bundle.cam_from_board[view]);
        let plain =
            camera.project_body_point(pose, &self.on_board(&state.extras, &corner.board_m))?;
        let skew = if self.kind == Kind::PixelSkew { state.extras[0] } else { 0.0 };
        let off = plain.px - camera.pp_px;
        let by_px = Matrix2::new(1.0, skew, 0.0, 1.0);
        let px = Point2::new(plain.px.x + skew * off.y, plain.px.y);
        let by_point = by_px * plain.jac_pose.fixed_columns::<3>(3);
        let mut by_extras =
            self.board_by_extras(&corner.board_m).map(|moved| by_point * (pose.rotation * moved));
        if self.kind == Kind::PixelSkew {
            by_extras[0] = Vector2::new(off.y, 0.0);
        }
        let mut by_lens = by_px * plain.jac_lens;
        let [_, cy] = LensParameter::PP.map(LensParameter::index);
        by_lens[(0, cy)] -= skew;
        if self.square_pixels {
            join_focal_lengths(&mut by_lens);
        }
        Some(Seen { px, by_lens, by_pose: by_px * plain.jac_pose, by_extras })
    }

    /// Shift of each corner in pixels by the cause, view by view, with the same lens and poses.
    /// `None` if a corner is behind the camera.
    pub(super) fn shifts_px(&self, state: &ExtendedState) -> Option<Vec<Vec<Vector2<f64>>>> {
        let shift_px = |view: usize, corner: &Whitened| {
            let pose = &state.bundle.cam_from_board[view];
            let plain = state.bundle.camera.px_from_board(pose, &corner.board_m)?;
            Some(self.seen(view, state, corner)?.px - plain)
        };
        (0..self.observations.view_count())
            .map(|view| self.observations.view(view).iter().map(|c| shift_px(view, c)).collect())
            .collect()
    }

    pub(super) fn cost(&self, state: &ExtendedState) -> Option<f64> {
        self.observations.cost_of(|view, corner| Some(self.seen(view, state, corner)?.px))
    }

    /// True if a shared parameter, of lens or cause, is estimated.
    pub(super) fn is_free(&self, index: usize) -> bool {
        match LensParameter::ALL.get(index) {
            Some(LensParameter::Fy) => !self.square_pixels,
            Some(_) => self.free[index],
            None => index < LENS_PARAMETERS + self.kind.extras(),
        }
    }

    /// Cost and normal equations of a view.
    fn block(&self, view: usize, state: &ExtendedState) -> Option<(f64, OfView)> {
        const TILES: usize = (SHARED + 7).div_ceil(4);
        let free: Vec<usize> = (0..LENS_PARAMETERS).filter(|index| self.is_free(*index)).collect();
        let corners = self.observations.view(view);
        let mut rows: Vec<Row<TILES>> = Vec::with_capacity(2 * corners.len());
        for corner in corners {
            let seen = self.seen(view, state, corner)?;
            let mut pair = [Row::zeros(); 2];
            let mut set = |column: usize, by: Vector2<f64>| {
                let by = corner.whitener * by;
                pair.iter_mut().zip(&by).for_each(|(row, value)| row.set(column, *value));
            };
            free.iter().for_each(|i| set(*i, seen.by_lens.column(*i).into_owned()));
            let extras = LENS_PARAMETERS..LENS_PARAMETERS + self.kind.extras();
            extras.zip(seen.by_extras).for_each(|(column, by)| set(column, by));
            (0..6).for_each(|i| set(SHARED + i, seen.by_pose.column(i).into_owned()));
            set(SHARED + 6, corner.px - seen.px);
            rows.extend(pair);
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        Some(Gram::of(&rows).split())
    }
}

impl Problem<NormalEquations<SHARED, 6>> for ExtendedProblem<'_> {
    type State = ExtendedState;

    fn linearise(&self, state: &ExtendedState) -> Option<(f64, NormalEquations<SHARED, 6>)> {
        if state.bundle.camera.f_px.min() <= 1.0 {
            return None;
        }
        let views = self.observations.by_view(|view| self.block(view, state))?;
        let (mut normal, cost) = NormalEquations::from_views(views);
        for index in (0..SHARED).filter(|index| !self.is_free(*index)) {
            normal.shared[(index, index)] = 1.0;
        }
        cost.is_finite().then_some((cost, normal))
    }

    fn noise_variance(&self, cost: f64) -> f64 {
        self.observations.noise_variance(cost)
    }

    fn moved(&self, state: &ExtendedState, step: &Step<SHARED, 6>) -> ExtendedState {
        let mut lens = state.bundle.camera.lens_parameters();
        lens.iter_mut().zip(step.shared.iter()).for_each(|(value, change)| *value += change);
        if self.square_pixels {
            tie_focal_lengths(&mut lens);
        }
        let mut extras = state.extras;
        let changes = step.shared.iter().skip(LENS_PARAMETERS);
        extras.iter_mut().zip(changes).for_each(|(value, change)| *value += change);
        let moved = |(pose, step): (&Isometry3<f64>, &SVector<f64, 6>)| {
            let turn_rad: Vector3<f64> = step.fixed_rows::<3>(0).into();
            let shift_m: Vector3<f64> = step.fixed_rows::<3>(3).into();
            Camera::moved(pose, &turn_rad, &shift_m)
        };
        let cam_from_board =
            state.bundle.cam_from_board.iter().zip(&step.views).map(moved).collect();
        let camera = state.bundle.camera.with_lens_parameters(&lens);
        ExtendedState { bundle: BundleState { camera, cam_from_board }, extras }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::{Corner, Distortion, LensKind, boards::Board};

    #[test]
    fn derivatives_are_what_a_small_step_changes() {
        const HALF_STEP: f64 = 1e-6;
        let board = Board::new(9, 6, 0.025).expect("a board");
        let board_m = board.corners_in_board_m();
        for (lens, kind) in [LensKind::Perspective, LensKind::Fisheye]
            .into_iter()
            .flat_map(|lens| Kind::FITTED.map(|kind| (lens, kind)))
        {
            let distortion =
                Distortion { kind: lens, k1: -0.2, k2: 0.03, p1: 1e-3, ..Distortion::default() };
            let mut camera =
                Camera { distortion, ..Camera::pinhole(700.0, Point2::new(650.0, 350.0)) };
            camera.f_px.y = 710.0;
            let turn = Vector3::new(-0.3, 0.4, 0.2);
            let pose = Isometry3::new(Vector3::new(0.05, -0.02, 0.4), turn);
            let px = |p| camera.px_from_board(&pose, p).expect("in front");
            let view: Vec<Corner> =
                board_m.iter().map(|p| Corner::isotropic(px(p), 0.05)).collect();
            let observations = Observations::new(&board_m, &[&view]).expect("corners");
            let problem = ExtendedProblem {
                observations: &observations,
                kind,
                half_board_m: 0.1,
                square_pixels: false,
                free: [true; LENS_PARAMETERS],
            };
            let bundle = BundleState { camera, cam_from_board: vec![pose] };
            let extras = std::array::from_fn(|i| 0.02 + 0.01 * i as f64);
            let state = ExtendedState { bundle, extras };
            let moved = |place: usize, by: f64| {
                let views = vec![SVector::zeros()];
                let mut step =
                    Step::<SHARED, 6> { shared: SVector::zeros(), views, decrement: 0.0 };
                match place.checked_sub(SHARED) {
                    None => step.shared[place] = by,
                    Some(place) => step.views[0][place] = by,
                }
                problem.moved(&state, &step)
            };
            for corner in observations.view(0) {
                let here = problem.seen(0, &state, corner).expect("seen");
                for place in 0..SHARED + 6 {
                    let stated = match place {
                        place if place < LENS_PARAMETERS => here.by_lens.column(place).into_owned(),
                        place if place < SHARED => here.by_extras[place - LENS_PARAMETERS],
                        place => here.by_pose.column(place - SHARED).into_owned(),
                    };
                    let at = |by| problem.seen(0, &moved(place, by), corner).expect("seen").px;
                    let found = (at(HALF_STEP) - at(-HALF_STEP)) / (2.0 * HALF_STEP);
                    let off = (found - stated).norm() / (1.0 + stated.norm());
                    assert!(off < 1e-5, "{kind:?}, {lens:?}, {place}: {stated} but {found}");
                }
            }
        }
    }
}
