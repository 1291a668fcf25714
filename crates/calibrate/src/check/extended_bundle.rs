//! Bundle adjustment with the parameters of a [`Cause`] of a misfit added to the lens and the
//! poses.

use nalgebra::{Isometry3, Point2, Point3, SMatrix, SVector, Vector2, Vector3};

use super::{
    hypotheses::{Cause, FEW_SHARED_EXTRAS, LOCAL_EXTRAS, SHARED_EXTRAS},
    picture_effect::PictureAt,
};
use crate::solve::{
    bundle::{BundleState, Observations},
    gram::{Gram, Row},
    lens_model::{join_focal_lengths, tie_focal_lengths},
    schur_lm::{NormalEquations, Problem, Step, ViewBlock},
    whitened::Whitened,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensParameter, frame::ImageSize};

pub(super) const LOCAL: usize = 6 + LOCAL_EXTRAS;
/// Number of shared parameters of lens and cause: `FEW` for every cause except
/// [`Cause::SmoothField`], `MANY` for that.
pub(super) const FEW: usize = LENS_PARAMETERS + FEW_SHARED_EXTRAS;
pub(super) const MANY: usize = LENS_PARAMETERS + SHARED_EXTRAS;

/// Lens, poses and parameters of a cause.
#[derive(Clone, Debug)]
pub(super) struct ExtendedState {
    pub(crate) bundle: BundleState,
    pub(crate) shared: [f64; SHARED_EXTRAS],
    pub(crate) local: Vec<[f64; LOCAL_EXTRAS]>,
}

impl ExtendedState {
    /// State of `bundle` without a cause.
    pub(super) fn plain(bundle: &BundleState) -> Self {
        Self {
            bundle: bundle.clone(),
            shared: [0.0; SHARED_EXTRAS],
            local: vec![[0.0; LOCAL_EXTRAS]; bundle.cam_from_board.len()],
        }
    }

    /// Root mean square of the first `count` local parameters over the views.
    pub(super) fn local_rms(&self, count: usize) -> f64 {
        let squares: f64 = self.local.iter().flat_map(|l| &l[..count]).map(|x| x * x).sum();
        (squares / (count * self.local.len()).max(1) as f64).sqrt()
    }

    /// Root mean square length of the first two local parameters over the views.
    pub(super) fn local_rms_length(&self) -> f64 {
        std::f64::consts::SQRT_2 * self.local_rms(2)
    }
}

pub(super) struct ExtendedProblem<'a> {
    pub(super) observations: &'a Observations,
    pub(super) cause: &'a Cause,
    pub(super) image_size: ImageSize,
    pub(super) half_board_m: f64,
    pub(super) square_pixels: bool,
    /// Estimated lens parameters.
    pub(super) free: [bool; LENS_PARAMETERS],
    /// Prior standard deviation of the local parameters, if given by [`Cause::local_sd`].
    pub(super) local_sd: f64,
    /// Variance of the corners as a multiple of the stated covariances, used to weigh priors.
    pub(super) noise_variance: f64,
}

/// Image of a corner under a cause, with derivatives by lens, pose and the parameters of the cause,
/// shared by all views or the view's own.
struct Seen {
    px: Point2<f64>,
    by_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    by_pose: SMatrix<f64, 2, 6>,
    by_cause: [Vector2<f64>; SHARED_EXTRAS],
}

impl ExtendedProblem<'_> {
    /// Board point in metres on the board as changed by the cause.
    pub(super) fn on_board(
        &self,
        shared: &[f64; SHARED_EXTRAS],
        local: &[f64; LOCAL_EXTRAS],
        point_m: &Point2<f64>,
    ) -> Point3<f64> {
        let flat_m = Point3::new(point_m.x, point_m.y, 0.0);
        let by = self.cause.of_view(shared, local);
        let moved = self.board_by_cause(point_m).into_iter().zip(by);
        moved.fold(flat_m, |at, (by_cause, value)| at + by_cause * *value)
    }

    /// Derivatives of a board point in metres by the parameters of a cause that changes the board.
    fn board_by_cause(&self, point_m: &Point2<f64>) -> [Vector3<f64>; 3] {
        let (x, y) = (point_m.x / self.half_board_m, point_m.y / self.half_board_m);
        match self.cause {
            Cause::BoardStretched => [Vector3::y() * point_m.y, Vector3::zeros(), Vector3::zeros()],
            Cause::BoardBent | Cause::BoardFlexes => [1.0 - x * x, 1.0 - y * y, x * y]
                .map(|rise| Vector3::z() * (rise * self.half_board_m)),
            _ => [Vector3::zeros(); 3],
        }
    }

    /// Image of a corner; `None` outside the field.
    fn seen(&self, view: usize, state: &ExtendedState, corner: &Whitened) -> Option<Seen> {
        let (camera, pose) = (&state.bundle.camera, &state.bundle.cam_from_board[view]);
        let local = &state.local[view];
        let point_m = self.on_board(&state.shared, local, &corner.board_m);
        let plain = camera.project_body_point(pose, &point_m)?;
        let times = self.cause.times(view, self.observations.view_count());
        let by = self.cause.of_view(&state.shared, local);
        let at = PictureAt { view, corner, camera, plain: &plain, image_size: self.image_size };
        let effect = at.effect(self.cause, by, times);
        let mut by_cause = effect.by_cause;
        if self.cause.is_of_board() {
            let px_by_point = effect.by_px * plain.jac_pose.fixed_columns::<3>(3);
            for (by_cause, moved) in by_cause.iter_mut().zip(self.board_by_cause(&corner.board_m)) {
                *by_cause = px_by_point * (pose.rotation * moved);
            }
        }
        let mut by_lens = effect.by_px * plain.jac_lens;
        let mut lens = by_lens.fixed_columns_mut::<4>(LensParameter::Fx.index());
        lens += effect.by_f_and_pp;
        if self.square_pixels {
            join_focal_lengths(&mut by_lens);
        }
        let by_pose = effect.by_px * plain.jac_pose + effect.by_flat * plain.flat_by_pose;
        Some(Seen { px: effect.px, by_lens, by_pose, by_cause })
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

    pub(super) fn view_cost(&self, state: &ExtendedState, view: usize) -> Option<f64> {
        self.observations.view_cost_of(view, |corner| Some(self.seen(view, state, corner)?.px))
    }

    /// True if a shared parameter, lens or extra, is estimated.
    pub(super) fn is_free(&self, index: usize) -> bool {
        match LensParameter::ALL.get(index) {
            Some(LensParameter::Fy) => !self.square_pixels,
            Some(_) => self.free[index],
            None => index < LENS_PARAMETERS + self.cause.shared_extras(),
        }
    }
}

impl ExtendedProblem<'_> {
    /// Adds the priors of the local parameters to `block`, fixes parameters missing from the view
    /// at zero, and returns the cost of the priors.
    fn weigh_local<const S: usize>(
        &self,
        view: usize,
        local: &[f64; LOCAL_EXTRAS],
        block: &mut ViewBlock<S, LOCAL>,
    ) -> f64 {
        let count = self.cause.local_extras();
        let is_whole = matches!(self.cause, Cause::Torn(rows) if rows[view].is_none());
        for index in if is_whole { 6 } else { 6 + count }..LOCAL {
            block.local[(index, index)] = 1.0;
        }
        if self.cause.local_sd().is_none() {
            return 0.0;
        }
        let information = self.noise_variance / (self.local_sd * self.local_sd);
        for (index, value) in local[..count].iter().enumerate() {
            block.local[(6 + index, 6 + index)] += information;
            block.gradient[6 + index] -= value * information;
        }
        local[..count].iter().map(|value| value * value * information).sum()
    }
}

impl ExtendedProblem<'_> {
    /// Cost and normal equations of a view of `S + LOCAL` parameters, at most `4 T − 1`.
    fn block<const S: usize, const T: usize>(
        &self,
        view: usize,
        state: &ExtendedState,
    ) -> Option<(f64, ViewBlock<S, LOCAL>)> {
        let free: Vec<usize> = (0..LENS_PARAMETERS).filter(|index| self.is_free(*index)).collect();
        let shared = LENS_PARAMETERS..LENS_PARAMETERS + self.cause.shared_extras();
        let local = S + 6..S + 6 + self.cause.local_extras();
        let corners = self.observations.view(view);
        let mut rows: Vec<Row<T>> = Vec::with_capacity(2 * corners.len());
        for corner in corners {
            let seen = self.seen(view, state, corner)?;
            let mut pair = [Row::zeros(); 2];
            let mut set = |column: usize, by: Vector2<f64>| {
                let by = corner.whitener * by;
                pair.iter_mut().zip(&by).for_each(|(row, value)| row.set(column, *value));
            };
            free.iter().for_each(|i| set(*i, seen.by_lens.column(*i).into_owned()));
            (0..6).for_each(|i| set(S + i, seen.by_pose.column(i).into_owned()));
            let extras = shared.clone().chain(local.clone());
            extras.zip(seen.by_cause).for_each(|(column, by)| set(column, by));
            set(S + LOCAL, corner.px - seen.px);
            rows.extend(pair);
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        let (cost, mut block) = Gram::of(&rows).split();
        Some((cost + self.weigh_local(view, &state.local[view], &mut block), block))
    }
}

impl<const S: usize> Problem<S, LOCAL> for ExtendedProblem<'_> {
    type State = ExtendedState;

    fn linearise(&self, state: &ExtendedState) -> Option<(f64, NormalEquations<S, LOCAL>)> {
        if state.bundle.camera.f_px.min() <= 1.0 {
            return None;
        }
        let views = self.observations.by_view(|view| match S {
            FEW => self.block::<S, 7>(view, state),
            _ => self.block::<S, 9>(view, state),
        })?;
        let (mut normal, mut cost) = NormalEquations::from_views(views);
        for index in (0..S).filter(|index| !self.is_free(*index)) {
            normal.shared[(index, index)] = 1.0;
        }
        for (index, (value, sd)) in state.shared.iter().zip(self.cause.held_to()).enumerate() {
            let index = LENS_PARAMETERS + index;
            let information = self.noise_variance / (sd * sd);
            normal.shared[(index, index)] += information;
            normal.gradient[index] -= value * information;
            cost += value * value * information;
        }
        cost.is_finite().then_some((cost, normal))
    }

    fn moved(&self, state: &ExtendedState, step: &Step<S, LOCAL>) -> ExtendedState {
        let mut lens = state.bundle.camera.lens_parameters();
        for (value, change) in lens.iter_mut().zip(step.shared.iter()) {
            *value += change;
        }
        if self.square_pixels {
            tie_focal_lengths(&mut lens);
        }
        let mut shared = state.shared;
        for (value, change) in shared.iter_mut().zip(step.shared.iter().skip(LENS_PARAMETERS)) {
            *value += change;
        }
        let moved = |(pose, step): (&Isometry3<f64>, &SVector<f64, LOCAL>)| {
            let turn_rad: Vector3<f64> = step.fixed_rows::<3>(0).into();
            let shift_m: Vector3<f64> = step.fixed_rows::<3>(3).into();
            Camera::moved(pose, &turn_rad, &shift_m)
        };
        let cam_from_board =
            state.bundle.cam_from_board.iter().zip(&step.views).map(moved).collect();
        let local = state
            .local
            .iter()
            .zip(&step.views)
            .map(|(local, step)| std::array::from_fn(|i| local[i] + step[6 + i]))
            .collect();
        let camera = state.bundle.camera.with_lens_parameters(&lens);
        ExtendedState { bundle: BundleState { camera, cam_from_board }, shared, local }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use boresight_geometry::{Corner, Distortion, LensKind, boards::Board};

    /// Every cause, acting on the second of two views.
    fn causes() -> Vec<Cause> {
        vec![
            Cause::Focus,
            Cause::FocusDrift,
            Cause::FocusJump(1),
            Cause::FocusBreathes(vec![-0.1, 0.3]),
            Cause::Mixed(vec![false, true]),
            Cause::Shifted,
            Cause::PixelAspect,
            Cause::PixelSkew,
            Cause::BoardStretched,
            Cause::BoardBent,
            Cause::BoardFlexes,
            Cause::RollingShutter,
            Cause::LensShape,
            Cause::SmoothField,
            Cause::Torn(vec![None, Some(400.0)]),
            Cause::NextRadial,
        ]
    }

    #[test]
    fn derivatives_are_what_a_small_step_changes() {
        const HALF_STEP: f64 = 1e-6;
        const VIEW: usize = 1;
        let board = Board::new(9, 6, 0.025).expect("a board");
        let board_m = board.corners_in_board_m();
        let image_size = ImageSize { width_px: 1280, height_px: 720 };
        for (kind, cause) in [LensKind::Perspective, LensKind::Fisheye]
            .into_iter()
            .flat_map(|kind| causes().into_iter().map(move |cause| (kind, cause)))
        {
            let distortion =
                Distortion { kind, k1: -0.2, k2: 0.03, p1: 1e-3, ..Distortion::default() };
            let mut camera =
                Camera { distortion, ..Camera::pinhole(700.0, Point2::new(650.0, 350.0)) };
            camera.f_px.y = 710.0;
            let poses = [Vector3::new(0.5, 0.1, 0.0), Vector3::new(-0.3, 0.4, 0.2)]
                .map(|turn| Isometry3::new(Vector3::new(0.05, -0.02, 0.4), turn));
            let see = |pose| {
                let px = |p| camera.px_from_board(pose, p).expect("in front");
                board_m.iter().map(|p| Corner::isotropic(px(p), 0.05)).collect::<Vec<Corner>>()
            };
            let views = poses.each_ref().map(see);
            let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
            let observations = Observations::new(&board_m, &slices).expect("corners");
            let problem = ExtendedProblem {
                observations: &observations,
                cause: &cause,
                image_size,
                half_board_m: 0.1,
                square_pixels: false,
                free: [true; LENS_PARAMETERS],
                local_sd: 1.0,
                noise_variance: 1.0,
            };
            let bundle = BundleState { camera, cam_from_board: poses.to_vec() };
            let mut state = ExtendedState::plain(&bundle);
            state.shared = std::array::from_fn(|i| 0.02 + 0.01 * i as f64);
            state.local[VIEW] = [0.03, -0.02, 0.04];
            // Indices: lens, pose, cause.
            let local = cause.local_extras();
            let count = LENS_PARAMETERS + 6 + if local > 0 { local } else { cause.shared_extras() };
            let moved = |place: usize, by: f64| {
                let mut step = Step::<MANY, LOCAL> {
                    shared: SVector::zeros(),
                    views: vec![SVector::zeros(); 2],
                    decrement: 0.0,
                };
                match place.checked_sub(LENS_PARAMETERS) {
                    None => step.shared[place] = by,
                    Some(place) if place < 6 || local > 0 => step.views[VIEW][place] = by,
                    Some(place) => step.shared[LENS_PARAMETERS + place - 6] = by,
                }
                problem.moved(&state, &step)
            };
            for corner in observations.view(VIEW) {
                let here = problem.seen(VIEW, &state, corner).expect("seen");
                for place in 0..count {
                    let stated = match place.checked_sub(LENS_PARAMETERS) {
                        None => here.by_lens.column(place).into_owned(),
                        Some(place) if place < 6 => here.by_pose.column(place).into_owned(),
                        Some(place) => here.by_cause[place - 6],
                    };
                    let at = |by| problem.seen(VIEW, &moved(place, by), corner).expect("seen").px;
                    let found = (at(HALF_STEP) - at(-HALF_STEP)) / (2.0 * HALF_STEP);
                    let off = (found - stated).norm() / (1.0 + stated.norm());
                    assert!(off < 1e-5, "{cause:?}, {kind:?}, {place}: {stated} but {found}");
                }
            }
        }
    }
}
