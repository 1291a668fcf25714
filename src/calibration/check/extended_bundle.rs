//! The bundle with the parameters of one [`Cause`] of a misfit added to the lens and the poses.

use nalgebra::{Isometry3, Point2, Point3, SMatrix, SVector, Vector2, Vector3};

use crate::{
    calibration::solve::{
        bundle::{BundleState, Observations, Whitened},
        schur_lm::{NormalEquations, Problem, Step, ViewBlock},
    },
    frame::ImageSize,
    geometry::{Camera, LENS_PARAMETERS},
};

/// Most parameters of a cause that all views share.
pub(super) const SHARED_EXTRAS: usize = 4;
/// Most parameters of a cause per view.
pub(super) const LOCAL_EXTRAS: usize = 2;
const SHARED: usize = LENS_PARAMETERS + SHARED_EXTRAS;
const LOCAL: usize = 6 + LOCAL_EXTRAS;
/// Prior standard deviations of the coefficients of r⁸, r¹⁰ and of thin prisms along x and y. They only keep the fit
/// bounded.
const LENS_SHAPE_SD: [f64; SHARED_EXTRAS] = [1.0, 1.0, 3e-3, 3e-3];
/// Half step of numeric derivatives.
const HALF_STEP: f64 = 1e-6;
/// A reason for which views disagree with a single lens and a flat board of squares.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cause {
    /// Every view has its own focal length.
    Focus,
    /// The marked views are of another camera, mode or size, with another focal length and principal point.
    Mixed(Vec<bool>),
    /// `fy ≠ fx`.
    PixelAspect,
    /// The squares of the board aren't square.
    BoardStretched,
    /// The board is bowed along x and y, and twisted.
    BoardBent,
    /// Each view moved while it was read out, row by row.
    RollingShutter,
    /// Radial terms of higher order, and thin prisms.
    LensShape,
    /// Views torn at a row in pixels: the corners below it are shifted.
    Torn(Vec<Option<f64>>),
}

/// Lens, poses and the parameters of a cause.
#[derive(Clone, Debug)]
pub(super) struct ExtendedState {
    pub(in crate::calibration) bundle: BundleState,
    pub(in crate::calibration) shared: [f64; SHARED_EXTRAS],
    pub(in crate::calibration) local: Vec<[f64; LOCAL_EXTRAS]>,
}

impl ExtendedState {
    /// Relative sample standard deviation of the focal lengths, for [`Cause::Focus`].
    pub(super) fn focal_relative_sd(&self) -> f64 {
        let logs: Vec<f64> = self.local.iter().map(|local| local[0]).collect();
        let mean = logs.iter().sum::<f64>() / logs.len() as f64;
        let squares: f64 = logs.iter().map(|x| (x - mean).powi(2)).sum();
        (squares / (logs.len() - 1).max(1) as f64).sqrt()
    }

    /// Root mean square movement in pixels from the top to the bottom row, for [`Cause::RollingShutter`].
    pub(super) fn shear_px(&self) -> f64 {
        let squares: f64 = self.local.iter().map(|local| local[0].powi(2) + local[1].powi(2)).sum();
        (squares / self.local.len() as f64).sqrt()
    }
}

impl Cause {
    fn shared_extras(&self) -> usize {
        match self {
            Self::BoardBent => 3,
            Self::BoardStretched => 1,
            Self::Mixed(_) | Self::LensShape => 4,
            Self::Focus | Self::PixelAspect | Self::RollingShutter | Self::Torn(_) => 0,
        }
    }

    fn local_extras(&self) -> usize {
        match self {
            Self::Focus => 1,
            Self::RollingShutter | Self::Torn(_) => 2,
            _ => 0,
        }
    }

    /// Parameters beyond those of the plain bundle.
    pub(in crate::calibration) fn parameters(&self, views: usize) -> usize {
        match self {
            // The mean is the common focal length.
            Self::Focus => views - 1,
            Self::PixelAspect => 1,
            // A row and a shift for each.
            Self::Torn(rows) => 3 * rows.iter().flatten().count(),
            _ => self.shared_extras() + self.local_extras() * views,
        }
    }
}

pub(super) struct ExtendedProblem<'a> {
    pub(super) observations: &'a Observations,
    pub(super) cause: &'a Cause,
    pub(super) image_size: ImageSize,
    pub(super) half_board_m: f64,
    pub(super) square_pixels: bool,
    pub(super) rolling_sd_px: f64,
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

    pub(super) fn on_board(
        &self,
        shared: &[f64; SHARED_EXTRAS],
        point_m: &Point2<f64>,
    ) -> Point3<f64> {
        let [first, second, third, _] = *shared;
        let (x, y) = (point_m.x / self.half_board_m, point_m.y / self.half_board_m);
        match self.cause {
            Cause::BoardStretched => Point3::new(point_m.x, point_m.y * (1.0 + first), 0.0),
            Cause::BoardBent => {
                let rise = first * (1.0 - x * x) + second * (1.0 - y * y) + third * x * y;
                Point3::new(point_m.x, point_m.y, rise * self.half_board_m)
            }
            _ => Point3::new(point_m.x, point_m.y, 0.0),
        }
    }

    fn predict(&self, view: usize, at: &Parameters, corner: &Whitened) -> Option<Point2<f64>> {
        let camera = Camera::from_lens_parameters(&at.lens);
        let [first, second, third, fourth] = at.shared;
        let on_board = self.on_board(&at.shared, &corner.board_m);
        let in_cam = at.pose * on_board;
        if in_cam.z <= 1e-9 {
            return None;
        }
        let normalized = Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z);
        if let Cause::LensShape = self.cause {
            let r2 = normalized.coords.norm_squared();
            let r8 = r2.powi(4);
            let more =
                normalized.coords * (r8 * (first + second * r2)) + Vector2::new(third, fourth) * r2;
            return Some(camera.px_from_normalized(&normalized) + more.component_mul(&camera.f_px));
        }
        let px = camera.px_from_normalized(&normalized);
        let off = px - camera.pp_px;
        Some(match self.cause {
            Cause::Focus => camera.pp_px + off * at.local[0].exp(),
            Cause::Mixed(other) if other[view] => {
                let f_px = camera.f_px.x;
                let bend = 1.0 + fourth * normalized.coords.norm_squared();
                camera.pp_px + Vector2::new(second, third) * f_px + off * (first.exp() * bend)
            }
            Cause::RollingShutter => {
                let row = px.y / f64::from(self.image_size.height_px) - 0.5;
                px + Vector2::from(at.local) * row
            }
            // By where the corner was seen, so that the fit can't move it over the tear.
            Cause::Torn(rows) if rows[view].is_some_and(|row_px| corner.px.y > row_px) => {
                px + Vector2::from(at.local)
            }
            _ => px,
        })
    }

    pub(super) fn cost(&self, state: &ExtendedState) -> Option<f64> {
        let mut cost = 0.0;
        for view in 0..self.observations.view_count() {
            let at = self.parameters(state, view);
            for corner in self.observations.view(view) {
                let predicted = self.predict(view, &at, corner)?;
                cost += (corner.whitener * (corner.px - predicted)).norm_squared();
            }
        }
        cost.is_finite().then_some(cost)
    }

    /// Whether a shared parameter, lens or extra, is estimated.
    pub(super) fn is_free(&self, index: usize) -> bool {
        match index {
            0 => *self.cause != Cause::Focus,
            1 => !self.square_pixels,
            _ => index < LENS_PARAMETERS + self.cause.shared_extras(),
        }
    }

    fn with_shared(&self, at: &Parameters, index: usize, change: f64) -> Parameters {
        let mut moved = *at;
        if index < LENS_PARAMETERS {
            moved.lens[index] += change;
            if index == 0 && self.square_pixels {
                moved.lens[1] = moved.lens[0];
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

impl Problem<SHARED, LOCAL> for ExtendedProblem<'_> {
    type State = ExtendedState;

    fn linearise(&self, state: &ExtendedState) -> Option<(f64, NormalEquations<SHARED, LOCAL>)> {
        if state.bundle.camera.f_px.min() <= 1.0 {
            return None;
        }
        let mut cost = 0.0;
        let mut blocks = Vec::with_capacity(state.local.len());
        let local_count = 6 + self.cause.local_extras();
        for view in 0..self.observations.view_count() {
            let at = self.parameters(state, view);
            let depth_m = at.pose.translation.z.abs().max(1e-3);
            // Perturbed parameters are built once per view rather than per corner.
            let half = |index: usize| if index < 4 { 1e-3 } else { HALF_STEP };
            let shared: Vec<(usize, f64, Parameters, Parameters)> = (0..SHARED)
                .filter(|index| self.is_free(*index))
                .map(|i| {
                    let h = half(i);
                    (i, h, self.with_shared(&at, i, h), self.with_shared(&at, i, -h))
                })
                .collect();
            let local: Vec<(usize, f64, Parameters, Parameters)> = (0..local_count)
                .map(|i| {
                    let h = match i {
                        3..6 => HALF_STEP * depth_m,
                        6.. if *self.cause != Cause::Focus => 1e-3,
                        _ => HALF_STEP,
                    };
                    (i, h, Self::with_local(&at, i, h), Self::with_local(&at, i, -h))
                })
                .collect();
            let mut block = ViewBlock::zeros();
            for corner in self.observations.view(view) {
                let predicted = self.predict(view, &at, corner)?;
                let residual = corner.whitener * (corner.px - predicted);
                cost += residual.norm_squared();
                let slope = |(_, h, up, down): &(usize, f64, Parameters, Parameters)| {
                    let up = self.predict(view, up, corner)?;
                    let down = self.predict(view, down, corner)?;
                    Some(corner.whitener * (up - down) / (2.0 * h))
                };
                let mut by_shared = SMatrix::<f64, 2, SHARED>::zeros();
                for world in &shared {
                    by_shared.set_column(world.0, &slope(world)?);
                }
                let mut by_local = SMatrix::<f64, 2, LOCAL>::zeros();
                for world in &local {
                    by_local.set_column(world.0, &slope(world)?);
                }
                block.add(&by_shared, &by_local, &residual);
            }
            let is_whole = matches!(&self.cause, Cause::Torn(rows) if rows[view].is_none());
            for index in if is_whole { 6 } else { local_count }..LOCAL {
                block.local[(index, index)] = 1.0;
            }
            if *self.cause == Cause::RollingShutter {
                for (index, value) in at.local.iter().enumerate() {
                    let information = 1.0 / (self.rolling_sd_px * self.rolling_sd_px);
                    block.local[(6 + index, 6 + index)] += information;
                    block.gradient[6 + index] -= value * information;
                    cost += value * value * information;
                }
            }
            blocks.push(block);
        }
        let mut normal = NormalEquations::from_views(blocks);
        for index in (0..SHARED).filter(|index| !self.is_free(*index)) {
            normal.shared[(index, index)] = 1.0;
        }
        if *self.cause == Cause::LensShape {
            for (index, (value, sd)) in state.shared.iter().zip(LENS_SHAPE_SD).enumerate() {
                let index = LENS_PARAMETERS + index;
                normal.shared[(index, index)] += 1.0 / (sd * sd);
                normal.gradient[index] -= value / (sd * sd);
                cost += (value / sd).powi(2);
            }
        }
        cost.is_finite().then_some((cost, normal))
    }

    fn moved(&self, state: &ExtendedState, step: &Step<SHARED, LOCAL>) -> ExtendedState {
        let mut lens = state.bundle.camera.lens_parameters();
        for (value, change) in lens.iter_mut().zip(step.shared.iter()) {
            *value += change;
        }
        if self.square_pixels {
            lens[1] = lens[0];
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
        let camera = Camera::from_lens_parameters(&lens);
        ExtendedState { bundle: BundleState { camera, cam_from_board }, shared, local }
    }
}
