//! Extended bundle models, one for each hypothesis about a misfit: a focus that moves, a bent board, a rolling shutter.
//!
//! Each [`Cause`] adds parameters to the lens and poses. How much better it explains the corners than the plain bundle
//! tells how probable it is.

use nalgebra::SMatrix;

use super::extended_bundle::{Cause, ExtendedProblem, ExtendedState, LOCAL_EXTRAS, SHARED_EXTRAS};
use crate::{
    calibration::solve::{
        bundle::{BundleState, Observations},
        schur_lm::{Problem, inverse, minimise_to},
    },
    frame::ImageSize,
    geometry::LENS_PARAMETERS,
};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Prior standard deviation of the movement between the readout of the top and the bottom row, for the first pass: a hand
/// moving at 300 px/s during 1/30 s.
const ROLLING_SD_PX: f64 = 10.0;
/// Floor of that standard deviation in later passes.
const LEAST_ROLLING_SD_PX: f64 = 0.1;
/// Passes; each takes the standard deviation from the movements found by the one before.
const ROLLING_PASSES: usize = 4;
/// `δᵀ g` at which a fit ends: 0.03 standard deviations don't change a BIC that must differ by 20.
const NEGLIGIBLE_STEP: f64 = 1e-3;

/// The best fit under one cause.
#[derive(Clone, Debug)]
pub(super) struct Explanation {
    pub(super) cause: Cause,
    /// Number of parameters added by the cause.
    pub(in crate::calibration) parameters: usize,
    /// Sum of squared whitened residuals.
    pub(in crate::calibration) cost: f64,
    pub(in crate::calibration) state: ExtendedState,
    /// Covariance of the lens for corners with the stated error, parameters of the cause marginalised out.
    pub(in crate::calibration) unit_covariance: LensMatrix,
    /// Distance in metres between the lowest and the highest corner of the board; zero unless it's bent.
    pub(super) depth_m: f64,
}

/// Minimises the reprojection error under `cause`, starting from the minimum of the plain bundle.
///
/// `None` if the first step predicts a cost above `worth`, or if the fit fails.
pub(super) fn explain(
    observations: &Observations,
    cause: Cause,
    image_size: ImageSize,
    start: &BundleState,
    square_pixels: bool,
    worth: f64,
) -> Option<Explanation> {
    let views = observations.view_count();
    let half_board_m =
        observations.board_m().iter().map(|p| p.coords.amax()).fold(f64::MIN_POSITIVE, f64::max);
    let square_pixels = square_pixels && cause != Cause::PixelAspect;
    let mut problem = ExtendedProblem {
        observations,
        cause: &cause,
        image_size,
        half_board_m,
        square_pixels,
        rolling_sd_px: ROLLING_SD_PX,
    };
    let start = ExtendedState {
        bundle: start.clone(),
        shared: [0.0; SHARED_EXTRAS],
        local: vec![[0.0; LOCAL_EXTRAS]; views],
    };
    let (cost, normal) = problem.linearise(&start)?;
    if cost - normal.solve(1e-9)?.decrement > worth {
        return None;
    }
    let mut minimum = minimise_to(&problem, start, NEGLIGIBLE_STEP)?;
    if cause == Cause::RollingShutter {
        // A prior wider than the actual movements would leave f and the principal point undetermined.
        for _ in 1..ROLLING_PASSES {
            let shear_px = minimum.state.shear_px() / std::f64::consts::SQRT_2;
            problem.rolling_sd_px = shear_px.max(LEAST_ROLLING_SD_PX);
            minimum = minimise_to(&problem, minimum.state, NEGLIGIBLE_STEP)?;
        }
    }
    let mut unit_covariance: LensMatrix = inverse(&minimum.normal.reduced()?)?
        .fixed_view::<LENS_PARAMETERS, LENS_PARAMETERS>(0, 0)
        .into();
    for index in (0..LENS_PARAMETERS).filter(|index| !problem.is_free(*index)) {
        unit_covariance.row_mut(index).fill(0.0);
        unit_covariance.column_mut(index).fill(0.0);
    }
    if problem.square_pixels {
        let row = unit_covariance.row(0).clone_owned();
        unit_covariance.row_mut(1).copy_from(&row);
        let column = unit_covariance.column(0).clone_owned();
        unit_covariance.column_mut(1).copy_from(&column);
    }
    let state = minimum.state;
    let cost = problem.cost(&state)?;
    let parameters = cause.parameters(views);
    let rises = observations.board_m().iter().map(|p| problem.on_board(&state.shared, p).z);
    let depth_m =
        rises.clone().fold(f64::NEG_INFINITY, f64::max) - rises.fold(f64::INFINITY, f64::min);
    Some(Explanation { depth_m, cause, parameters, cost, state, unit_covariance })
}
