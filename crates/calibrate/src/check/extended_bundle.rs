//! The bundle with the parameters of one [`Cause`] of a misfit added to the lens and the poses.

use nalgebra::{Isometry3, Point2, Point3, SVector, Vector2, Vector3};

use super::hypotheses::{Cause, FEW_SHARED_EXTRAS, LOCAL_EXTRAS, SHARED_EXTRAS};
use crate::solve::{
    bundle::{BundleState, Observations},
    gram::{Gram, Row},
    lens_model::tie_focal_lengths,
    schur_lm::{NormalEquations, Problem, Step, ViewBlock},
    whitened::Whitened,
};
use boresight_geometry::{Camera, LENS_PARAMETERS, LensKind, LensParameter, frame::ImageSize};

pub(super) const LOCAL: usize = 6 + LOCAL_EXTRAS;
/// Number of shared parameters of lens and cause: `FEW` for every cause but [`Cause::SmoothField`], `MANY` for that.
pub(super) const FEW: usize = LENS_PARAMETERS + FEW_SHARED_EXTRAS;
pub(super) const MANY: usize = LENS_PARAMETERS + SHARED_EXTRAS;
/// Half step of numeric derivatives.
const HALF_STEP: f64 = 1e-6;
/// Half step of numeric derivatives by parameters in pixels.
const HALF_STEP_PX: f64 = 1e-3;

/// Lens, poses and the parameters of a cause.
#[derive(Clone, Debug)]
pub(super) struct ExtendedState {
    pub(crate) bundle: BundleState,
    pub(crate) shared: [f64; SHARED_EXTRAS],
    pub(crate) local: Vec<[f64; LOCAL_EXTRAS]>,
}

impl ExtendedState {
    /// The state of `bundle`, without any cause.
    pub(super) fn plain(bundle: &BundleState) -> Self {
        Self {
            bundle: bundle.clone(),
            shared: [0.0; SHARED_EXTRAS],
            local: vec![[0.0; LOCAL_EXTRAS]; bundle.cam_from_board.len()],
        }
    }

    /// Root mean square over the views of the first `count` local parameters.
    pub(super) fn local_rms(&self, count: usize) -> f64 {
        let squares: f64 = self.local.iter().flat_map(|l| &l[..count]).map(|x| x * x).sum();
        (squares / (count * self.local.len()).max(1) as f64).sqrt()
    }

    /// Root mean square over the views of the length of the first two local parameters.
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
    /// Kind of the lens, and which of its parameters are estimated.
    pub(super) kind: LensKind,
    pub(super) free: [bool; LENS_PARAMETERS],
    /// Prior standard deviation of the local parameters, where [`Cause::local_sd`] gives one.
    pub(super) local_sd: f64,
    /// Variance of the corners as a multiple of the stated covariances, against which priors are weighed.
    pub(super) noise_variance: f64,
}

/// The terms of a [`Cause::SmoothField`] at `px`: those of second order, without the ones that p1 and p2 give, and of third
/// order, 1 px at the sides of the picture.
pub(super) fn field_terms(
    image_size: ImageSize,
    px: &Point2<f64>,
) -> [Vector2<f64>; SHARED_EXTRAS] {
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

/// All parameters on which the image of a board point depends.
#[derive(Clone, Copy)]
struct Parameters {
    lens: [f64; LENS_PARAMETERS],
    shared: [f64; SHARED_EXTRAS],
    pose: Isometry3<f64>,
    local: [f64; LOCAL_EXTRAS],
}

impl ExtendedProblem<'_> {
    fn parameters(&self, state: &ExtendedState, view: usize) -> Parameters {
        Parameters {
            lens: state.bundle.camera.lens_parameters(),
            shared: state.shared,
            pose: state.bundle.cam_from_board[view],
            local: state.local[view],
        }
    }

    /// A board point in metres, with the board as it is under the cause.
    pub(super) fn on_board(
        &self,
        shared: &[f64; SHARED_EXTRAS],
        local: &[f64; LOCAL_EXTRAS],
        point_m: &Point2<f64>,
    ) -> Point3<f64> {
        let (x, y) = (point_m.x / self.half_board_m, point_m.y / self.half_board_m);
        let bent = |by: &[f64]| {
            let rise = by[0] * (1.0 - x * x) + by[1] * (1.0 - y * y) + by[2] * x * y;
            Point3::new(point_m.x, point_m.y, rise * self.half_board_m)
        };
        match self.cause {
            Cause::BoardStretched => Point3::new(point_m.x, point_m.y * (1.0 + shared[0]), 0.0),
            Cause::BoardBent => bent(&shared[..3]),
            Cause::BoardFlexes => bent(local),
            _ => Point3::new(point_m.x, point_m.y, 0.0),
        }
    }

    fn predict(&self, view: usize, at: &Parameters, corner: &Whitened) -> Option<Point2<f64>> {
        let camera = Camera::from_lens_parameters(self.kind, &at.lens);
        let [first, second, third, fourth, ..] = at.shared;
        let on_board = self.on_board(&at.shared, &at.local, &corner.board_m);
        let flat = self.kind.flat(&(at.pose * on_board).coords)?;
        let px = camera.px_from_flat(&flat);
        let off = px - camera.pp_px;
        let r2 = flat.coords.norm_squared();
        let power = self.kind.next_radial_power();
        Some(match self.cause {
            Cause::LensShape => {
                let more = flat.coords * (r2.powi(power) * (first + second * r2))
                    + Vector2::new(third, fourth) * r2;
                px + more.component_mul(&camera.f_px)
            }
            Cause::NextRadial => {
                px + (flat.coords * (r2.powi(power) * first)).component_mul(&camera.f_px)
            }
            Cause::SmoothField => px + self.field_px(&at.shared, &px),
            Cause::Focus => camera.pp_px + off * libm::exp(at.local[0]),
            Cause::FocusDrift | Cause::FocusJump(_) | Cause::FocusBreathes(_) => {
                let times = self.cause.times(view, self.observations.view_count());
                camera.pp_px + off * libm::exp(first * times)
            }
            Cause::Mixed(other) if other[view] => {
                let f_px = camera.f_px.x;
                let bend = 1.0 + fourth * r2;
                camera.pp_px + Vector2::new(second, third) * f_px + off * (libm::exp(first) * bend)
            }
            Cause::PixelSkew => px + Vector2::new(first * off.y, 0.0),
            Cause::Shifted => px + Vector2::new(at.local[0], at.local[1]),
            Cause::RollingShutter => {
                let row = px.y / f64::from(self.image_size.height_px) - 0.5;
                px + Vector2::new(at.local[0], at.local[1]) * row
            }
            // Compare the corner's seen place, so that the fit can't move it over the tear.
            Cause::Torn(rows) if rows[view].is_some_and(|row_px| corner.px.y > row_px) => {
                px + Vector2::new(at.local[0], at.local[1])
            }
            _ => px,
        })
    }

    /// The field of [`Cause::SmoothField`] at `px`.
    fn field_px(&self, by: &[f64; SHARED_EXTRAS], px: &Point2<f64>) -> Vector2<f64> {
        field_terms(self.image_size, px).iter().zip(by).map(|(term, by)| term * *by).sum()
    }

    /// Shift of each corner in pixels by the cause, view by view, lens and poses being the same. `None` if a corner is
    /// behind the camera.
    pub(super) fn shifts_px(&self, state: &ExtendedState) -> Option<Vec<Vec<Vector2<f64>>>> {
        let shift_px = |view: usize, corner: &Whitened| {
            let at = self.parameters(state, view);
            let plain = state.bundle.camera.px_from_board(&at.pose, &corner.board_m)?;
            Some(self.predict(view, &at, corner)? - plain)
        };
        (0..self.observations.view_count())
            .map(|view| self.observations.view(view).iter().map(|c| shift_px(view, c)).collect())
            .collect()
    }

    pub(super) fn cost(&self, state: &ExtendedState) -> Option<f64> {
        let at: Vec<Parameters> =
            (0..self.observations.view_count()).map(|view| self.parameters(state, view)).collect();
        self.observations.cost_of(|view, corner| self.predict(view, &at[view], corner))
    }

    pub(super) fn view_cost(&self, state: &ExtendedState, view: usize) -> Option<f64> {
        let at = self.parameters(state, view);
        self.observations.view_cost_of(view, |corner| self.predict(view, &at, corner))
    }

    /// True if a shared parameter, lens or extra, is estimated.
    pub(super) fn is_free(&self, index: usize) -> bool {
        match LensParameter::ALL.get(index) {
            Some(LensParameter::Fy) => !self.square_pixels,
            Some(_) => self.free[index],
            None => index < LENS_PARAMETERS + self.cause.shared_extras(),
        }
    }

    /// Half step by which a shared parameter is moved for its derivative.
    fn shared_half_step(&self, index: usize) -> f64 {
        match LensParameter::ALL.get(index) {
            Some(parameter) if !parameter.is_distortion() => HALF_STEP_PX,
            None if *self.cause == Cause::SmoothField => HALF_STEP_PX,
            Some(_) | None => HALF_STEP,
        }
    }

    /// Half step by which a parameter of one view is moved for its derivative.
    fn local_half_step(&self, index: usize, depth_m: f64) -> f64 {
        match index {
            3..6 => HALF_STEP * depth_m,
            6.. if !matches!(self.cause, Cause::Focus | Cause::BoardFlexes) => HALF_STEP_PX,
            _ => HALF_STEP,
        }
    }

    fn with_shared(&self, at: &Parameters, index: usize, change: f64) -> Parameters {
        let mut moved = *at;
        if index < LENS_PARAMETERS {
            moved.lens[index] += change;
            if index == LensParameter::Fx.index() && self.square_pixels {
                tie_focal_lengths(&mut moved.lens);
            }
        } else {
            moved.shared[index - LENS_PARAMETERS] += change;
        }
        moved
    }

    fn with_local(at: &Parameters, index: usize, change: f64) -> Parameters {
        let mut moved = *at;
        if index < 6 {
            let mut step = [Vector3::zeros(), Vector3::zeros()];
            step[index / 3][index % 3] = change;
            moved.pose = Camera::moved(&at.pose, &step[0], &step[1]);
        } else {
            moved.local[index - 6] += change;
        }
        moved
    }
}

/// Column of a parameter, half a step of it, and the parameters after and before that.
type Perturbed = (usize, f64, Parameters, Parameters);

impl ExtendedProblem<'_> {
    /// Adds the priors of the local parameters to `block`, and holds parameters that the view doesn't have at zero.
    /// Returns the cost of the priors.
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
        let at = self.parameters(state, view);
        let depth_m = at.pose.translation.z.abs().max(1e-3);
        // Perturbed parameters are built once per view rather than per corner.
        let shared = (0..S).filter(|index| self.is_free(*index)).map(|i| {
            let h = self.shared_half_step(i);
            (i, h, self.with_shared(&at, i, h), self.with_shared(&at, i, -h))
        });
        let local = (0..6 + self.cause.local_extras()).map(|i| {
            let h = self.local_half_step(i, depth_m);
            (S + i, h, Self::with_local(&at, i, h), Self::with_local(&at, i, -h))
        });
        let perturbed: Vec<Perturbed> = shared.chain(local).collect();
        let corners = self.observations.view(view);
        let mut rows: Vec<Row<T>> = Vec::with_capacity(2 * corners.len());
        for corner in corners {
            let mut pair = [Row::zeros(); 2];
            let mut set = |column: usize, values: Vector2<f64>| {
                pair.iter_mut().zip(&values).for_each(|(row, value)| row.set(column, *value));
            };
            for (column, h, up, down) in &perturbed {
                let up = self.predict(view, up, corner)?;
                let down = self.predict(view, down, corner)?;
                set(*column, corner.whitener * (up - down) / (2.0 * h));
            }
            let predicted = self.predict(view, &at, corner)?;
            set(S + LOCAL, corner.whitener * (corner.px - predicted));
            rows.extend(pair);
        }
        if let Some(common) = self.observations.common(view) {
            common.take_out(&mut rows);
        }
        let (cost, mut block) = Gram::of(&rows).split();
        Some((cost + self.weigh_local(view, &at.local, &mut block), block))
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
