use std::borrow::Cow;

use nalgebra::Point2;

use super::{
    check::{
        noise_inflation::{excess_variance_px2, inflated},
        odd_corners::is_grid,
    },
    inputs::{Inputs, Solution, VIEWS_WITHOUT_PRIOR},
    params::{CalibrationParams, NotCalibrated},
    result::Calibration,
    solve::{
        bundle::{InvalidCorners, Observations},
        free_homography::{self, DistortionCentrePrior},
        initial_guess::{NotPlanar, as_seen, distinct_views, start},
        lens_model::{LensModel, LensPrior},
        model_choice::{ModelChoice, ModelSearch, fit_models},
    },
    summary::assemble,
};
use crate::{board::Checkerboard, frame::ImageSize, geometry::Corner};

/// A focal length less certain than this share of itself needs a lens_estimate.
const F_UNDETERMINED: f64 = 0.2;

/// Estimates the lens and all poses from the corners of `views`, and checks the result.
///
/// Each view has one corner per board corner, in the board's order. Deterministic.
///
/// # Errors
///
/// [`NotCalibrated`] if corners are missing or not numbers, a view is not the image of a flat board,
/// or the views fit no lens. Views that determine the lens badly are no error but a verdict.
pub fn calibrate(
    views: &[Vec<Corner>],
    board: &Checkerboard,
    image_size: ImageSize,
    params: &CalibrationParams,
) -> Result<Calibration, NotCalibrated> {
    let ImageSize { width_px, height_px } = image_size;
    if params.models.is_empty() {
        return Err(NotCalibrated::NoModels);
    }
    if views.is_empty() {
        return Err(NotCalibrated::NoViews);
    }
    if width_px == 0 || height_px == 0 {
        return Err(NotCalibrated::NoPicture { width_px, height_px });
    }
    let board_m = board.corners_in_board_m();
    let mut observations = observations(views, &board_m)?;
    if let Some(view) = views.iter().position(|corners| !is_grid(corners, board)) {
        return Err(NotCalibrated::NoGrid { view });
    }
    let as_seen = as_seen(views, &board_m, image_size)
        .map_err(|NotPlanar { view }| NotCalibrated::NoHomography { view })?;
    let distinct = distinct_views(views, image_size);
    let prior = DistortionCentrePrior::of(image_size);
    let fit_free = |observations: &Observations| {
        free_homography::fit(observations, prior, &as_seen.image_from_board)
    };
    let mut free = fit_free(&observations);
    let rho = free.as_ref().map_or(0.0, |free| excess_variance_px2(&observations, free));
    let mut views = Cow::Borrowed(views);
    if rho > 0.0 {
        views = Cow::Owned(inflated(&views, rho));
        observations = self::observations(&views, &board_m)?;
        free = fit_free(&observations);
    }
    let problem = Inputs {
        views: &views,
        board,
        board_m: &board_m,
        image_size,
        params,
        observations,
        as_seen,
        free,
        distinct,
        excess_px: rho.sqrt(),
    };
    let undetermined = NotCalibrated::Undetermined { distinct };
    let solution = problem.solve()?;
    assemble(&problem, &solution).ok_or(undetermined)
}

fn observations(
    views: &[Vec<Corner>],
    board_m: &[Point2<f64>],
) -> Result<Observations, NotCalibrated> {
    let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
    Observations::new(board_m, &slices).map_err(|invalid| match invalid {
        InvalidCorners::Count { view, got, want } => NotCalibrated::CornerCount { view, got, want },
        InvalidCorners::Value { view, corner } => NotCalibrated::CornerValue { view, corner },
    })
}

impl Inputs<'_> {
    /// Lens models that this many different views may be asked about.
    fn models(&self) -> Vec<LensModel> {
        let richest = match self.distinct {
            0 | 1 => LensModel::K1,
            2 => LensModel::K1K2,
            _ => LensModel::K1K2P1P2K3,
        };
        // A lens that was asked for is never withheld.
        let wanted = self.params.models.iter().min().copied();
        LensModel::ALL
            .into_iter()
            .filter(|model| *model <= richest || Some(*model) <= wanted)
            .collect()
    }

    /// Adjusts, first as asked, then with a lens_estimate about the focal length if the views leave it open.
    fn solve(&self) -> Result<Solution, NotCalibrated> {
        let undetermined = NotCalibrated::Undetermined { distinct: self.distinct };
        let start =
            start(&self.observations, &self.as_seen, self.image_size).ok_or(undetermined)?;
        let models = self.models();
        let weak = LensPrior::weak(self.image_size);
        let prior_used = self.params.weak_priors && self.distinct < VIEWS_WITHOUT_PRIOR;
        let search = |prior: Option<&LensPrior>| {
            let search = ModelSearch {
                observations: &self.observations,
                models: &models,
                allowed: &self.params.models,
                square_pixels: self.params.square_pixels,
                prior,
                noise_floor: self.noise_floor(),
            };
            fit_models(&search, start.clone())
        };
        if let Some(choice) = search(prior_used.then_some(&weak))
            && self.is_determined(&choice)
        {
            return Ok(Solution { choice, prior_used, focal_prior_used: false });
        }
        if !self.params.weak_priors {
            return Err(undetermined);
        }
        let f_px = start.camera.f_px.x;
        let believed = weak.with_focal_length(f_px, 0.5 * f_px);
        let choice = search(Some(&believed)).ok_or(undetermined)?;
        Ok(Solution { choice, prior_used: true, focal_prior_used: true })
    }

    fn is_determined(&self, choice: &ModelChoice) -> bool {
        let noise_factor = choice.fit().noise_factor.max(self.noise_floor());
        choice.bundle().covariance(noise_factor).is_some_and(|covariance| {
            let f_px = choice.fit().camera.f_px.x;
            covariance[(0, 0)].sqrt() < F_UNDETERMINED * f_px
                && covariance[(2, 2)].max(covariance[(3, 3)]).sqrt()
                    < f64::from(self.image_size.width_px)
        })
    }
}
