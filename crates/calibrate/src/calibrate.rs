use std::borrow::Cow;

use nalgebra::Point2;

use super::{
    causes::{Correction, with_square_pixels},
    check::{heavy_tails::TailWeights, noise_inflation::CornerNoise, odd_corners::is_grid},
    examined::{Examined, shared_causes},
    inputs::{Inputs, Solution, VIEWS_WITHOUT_PRIOR},
    params::{CalibrationParams, NotCalibrated},
    pinhole_views::PinholeViews,
    repeats::Repeats,
    result::Calibration,
    solve::{
        bundle::{Bundle, BundleState, InvalidCorners, Observations},
        initial_guess::{NotPlanar, as_seen, distinct_views, noise_floor, starts},
        lens_model::{LensFamily, LensModel, LensPrior},
        model_choice::{ModelChoice, ModelSearch, Reversals, SAME_COST, fit_models},
        wide_lens::{WideLens, WideSearch, better_families, is_wide},
    },
    summary::assemble,
};
use boresight_geometry::{Corner, LensParts, boards::Board, frame::ImageSize};

/// Relative standard deviation of the focal length from which a prior is needed. Deliberately
/// loose: separates only views with an open focal length from the rest.
const F_UNDETERMINED: f64 = 0.2;

/// Ratio of the bundle's noise factor to the free homographies' from which other starts are tried.
const SUSPICIOUS: f64 = 1.5;

/// Estimates the lens and all poses from the corners of `views`, and checks the result.
///
/// Each view has one corner per board corner, in the board's order and in distorted pixels of a
/// picture of `image_size`. Four different views determine the lens without priors, and eight are
/// advised; with fewer, [`CalibrationParams::weak_priors`] must be on. Deterministic.
///
/// Views that repeat others, such as copies of a picture, count once.
///
/// Bundle adjustment from closed-form starts, for nested lens models chosen by BIC; corner
/// covariances are inflated to the scatter of the residuals. See `docs/method.md`, section 2.
///
/// # Errors
///
/// [`NotCalibrated`] if corners are missing or not finite, if a view isn't the image of a flat
/// board, or if the views fit no lens. Views that determine the lens poorly give a
/// [`Verdict`](crate::Verdict), not an error.
///
/// # Examples
///
/// Eight views of a simulated board, tilted by 40° in eight directions:
///
/// ```
/// use boresight_calibrate::{CalibrationParams, LensModel, calibrate};
/// use boresight_geometry::{Camera, Corner, Distortion, boards::Board, frame::ImageSize};
/// use nalgebra::{Isometry3, Point2, Vector3};
///
/// let distortion = Distortion { k1: -0.1, ..Distortion::default() };
/// let truth = Camera { distortion, ..Camera::pinhole(950.0, Point2::new(648.0, 353.0)) };
/// let board = Board::new(9, 6, 0.025)?;
/// let views: Vec<Vec<Corner>> = (0..8)
///     .map(|view| {
///         let (sin, cos) = (f64::from(view) * std::f64::consts::FRAC_PI_4).sin_cos();
///         let tilt = Vector3::new(sin, -cos, 0.0) * 40_f64.to_radians();
///         let cam_from_board = Isometry3::new(Vector3::new(0.0, 0.0, 0.3), tilt);
///         board
///             .corners_in_board_m()
///             .iter()
///             .filter_map(|point_m| truth.px_from_board(&cam_from_board, point_m))
///             .map(|px| Corner::isotropic(px, 0.05))
///             .collect()
///     })
///     .collect();
///
/// let image_size = ImageSize { width_px: 1280, height_px: 720 };
/// let found = calibrate(&views, &board, image_size, &CalibrationParams::default())?;
///
/// assert_eq!(found.model, LensModel::K1);
/// assert!((found.camera.f_px.x - 950.0).abs() < 0.01);
/// assert!((found.camera.pp_px - truth.pp_px).norm() < 0.01);
/// assert!((found.camera.distortion.k1 - -0.1).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn calibrate(
    views: &[Vec<Corner>],
    board: &Board,
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
    let observations = observations(views, &board_m, params.threads)?;
    if let Some(view) = views.iter().position(|corners| !is_grid(corners, board)) {
        return Err(NotCalibrated::NoGrid { view });
    }
    let given = Given {
        count: views.len(),
        board,
        board_m: &board_m,
        image_size,
        params,
        correction: None,
        plain: None,
    };
    let Some(repeats) = Repeats::among(views, board, image_size) else {
        return Ok(given.calibrate(views, &observations)?.0);
    };
    let kept = repeats.without(views);
    let params = &CalibrationParams { scene: repeats.scene(&params.scene), ..params.clone() };
    let given = Given { params, ..given };
    let (found, correction) = self::observations(&kept, &board_m, params.threads)
        .and_then(|observations| given.calibrate(&kept, &observations))
        .map_err(|reason| match reason {
            NotCalibrated::NoHomography { view } => {
                NotCalibrated::NoHomography { view: repeats.number(view) }
            }
            other => other,
        })?;
    Ok(repeats.restored(found, correction.as_ref(), views, &board_m))
}

/// Inputs of a calibration besides the views.
#[derive(Clone, Copy)]
struct Given<'a> {
    /// Number of views, repeats of a held pose included.
    count: usize,
    board: &'a Board,
    board_m: &'a [Point2<f64>],
    image_size: ImageSize,
    params: &'a CalibrationParams,
    /// Correction for the cause of a misfit, if applied.
    correction: Option<&'a Correction>,
    /// Inputs and views without the correction.
    plain: Option<(&'a Given<'a>, &'a [Vec<Corner>])>,
}

impl Given<'_> {
    /// Calibrates from `views` without repeats, and returns the correction in the result, if any.
    fn calibrate(
        &self,
        views: &[Vec<Corner>],
        observations: &Observations,
    ) -> Result<(Calibration, Option<Correction>), NotCalibrated> {
        let problem = self.inputs(views, observations.clone(), None)?;
        let solved = problem.solve();
        let wide = problem.wide_lenses(observations, solved.as_ref().ok());
        // A bent board or a moved focus can look like another lens.
        let other_cause = || {
            let (_, causes) = shared_causes(&problem, &solved.as_ref().ok()?.choice)?;
            causes.gain()
        };
        let other_cause = if wide.is_empty() { None } else { other_cause() };
        let is_other_cause = |wide: &WideLens| {
            wide.gain.is_finite() && other_cause.is_some_and(|gain| gain > wide.gain)
        };
        // A lens from an unconverged fit is used only if no other fit converged.
        let mut unfinished = None;
        for wide in wide.into_iter().filter(|wide| !is_other_cause(wide)) {
            let problem = self.inputs(views, observations.clone(), Some(&wide))?;
            let found =
                problem.solve_from(std::slice::from_ref(&wide.state)).and_then(|solution| {
                    let converged = solution.choice.bundle().converged;
                    Ok((converged, self.result(views, &problem, &solution, Some(&wide))?))
                });
            match found {
                Ok((true, found)) => return Ok(found),
                Ok((false, found)) => unfinished = unfinished.or(Some(found)),
                Err(_) => {}
            }
        }
        if let Some(found) = unfinished {
            return Ok(found);
        }
        if self.params.models.iter().all(|model| model.family() != LensFamily::Brown) {
            return Err(NotCalibrated::Undetermined { distinct: problem.distinct });
        }
        self.result(views, &problem, &solved?, None)
    }

    /// Calibration of `solution`, a fit of the lens `wide` or Brown's; corrected for what all
    /// views share, if that's clear.
    fn result(
        &self,
        views: &[Vec<Corner>],
        problem: &Inputs<'_>,
        solution: &Solution,
        wide: Option<&WideLens>,
    ) -> Result<(Calibration, Option<Correction>), NotCalibrated> {
        let shared = shared_causes(problem, &solution.choice);
        let correction = shared.as_ref().and_then(|(_, causes)| causes.correction.as_ref());
        if let Some(correction) = correction
            && let Some(bundle) = solution.choice.bundles.last()
            && let Ok(found) = self.corrected(views, correction, &bundle.state, wide)
        {
            return Ok(found);
        }
        let examined = Examined::of(problem, &solution.choice, shared);
        let undetermined = NotCalibrated::Undetermined { distinct: problem.distinct };
        let found = assemble(problem, solution, &examined).ok_or(undetermined)?;
        Ok((found, self.correction.cloned()))
    }

    /// Calibration under `correction`, from the minimum without it.
    fn corrected(
        &self,
        views: &[Vec<Corner>],
        correction: &Correction,
        start: &BundleState,
        wide: Option<&WideLens>,
    ) -> Result<(Calibration, Option<Correction>), NotCalibrated> {
        let (plain, seen) = self.plain.unwrap_or((self, views));
        let views = correction.views(seen);
        let board_m = correction.board_m(plain.board_m);
        let params = correction.params(plain.params);
        let observations = observations(&views, &board_m, params.threads)?;
        let (correction, plain) = (Some(correction), Some((plain, seen)));
        let given = Given { board_m: &board_m, params: &params, correction, plain, ..*self };
        let problem = given.inputs(&views, observations, wide)?;
        let mut all = if wide.is_some() {
            Vec::new()
        } else {
            starts(&problem.observations, &problem.as_seen, self.image_size)
        };
        all.push(start.clone());
        let solution = problem.solve_from(&all)?;
        given.result(&views, &problem, &solution, wide)
    }

    /// Inputs that follow from the corners without an adjustment of the lens.
    fn inputs<'b>(
        &'b self,
        views: &'b [Vec<Corner>],
        mut observations: Observations,
        wide: Option<&WideLens>,
    ) -> Result<Inputs<'b>, NotCalibrated> {
        let Self { count: given, board, board_m, image_size, params, correction, .. } = *self;
        let as_seen = as_seen(views, board_m, image_size)
            .map_err(|NotPlanar { view }| NotCalibrated::NoHomography { view })?;
        let distinct = distinct_views(views, board, image_size);
        let aspect = correction.map_or(1.0, Correction::pixel_aspect);
        let pinhole = |views: &[Vec<Corner>], observations: &Observations| match wide {
            Some(wide) => {
                PinholeViews::straightened(views, board_m, image_size, &wide.state.camera)
            }
            None if aspect == 1.0 => Some(PinholeViews::observed(observations.clone(), image_size)),
            None => {
                let square = with_square_pixels(views, aspect);
                let square = self::observations(&square, board_m, params.threads).ok()?;
                Some(PinholeViews::squared(square, image_size, aspect))
            }
        };
        let mut shown = pinhole(views, &observations);
        let rough = shown.as_ref().and_then(PinholeViews::rough);
        let noise = shown.as_ref().zip(rough.as_ref());
        let noise = noise.map(|(shown, rough)| CornerNoise::of(&shown.residuals_px(rough, views)));
        let mut views = Cow::Borrowed(views);
        if let Some(noisy) = noise.as_ref().and_then(|noise| noise.applied(&views)) {
            views = Cow::Owned(noisy);
            observations = self::observations(&views, board_m, params.threads)?;
            shown = pinhole(&views, &observations);
        }
        let whole = shown.as_ref().filter(|shown| shown.is_whole());
        let tails = whole
            .zip(rough.as_ref())
            .and_then(|(shown, rough)| TailWeights::of(&shown.observations, rough, board));
        if let Some(tails) = &tails {
            let weighted = tails.applied(&views);
            observations = self::observations(&weighted, board_m, params.threads)?;
            shown = pinhole(&weighted, &observations);
        }
        Ok(Inputs {
            noise_floor: noise_floor(&views),
            views,
            board,
            board_m,
            image_size,
            params,
            observations,
            free: shown.zip(rough).and_then(|(shown, rough)| shown.fit_near(&rough)),
            as_seen,
            distinct,
            given,
            excess_px: noise.as_ref().map_or(0.0, |noise| noise.excess_px2.sqrt()),
            view_noise: noise.map_or_else(Vec::new, |noise| noise.of_views),
            tails,
            family: wide.map_or(LensFamily::Brown, |wide| wide.family),
            correction,
        })
    }
}

fn observations(
    views: &[Vec<Corner>],
    board_m: &[Point2<f64>],
    threads: usize,
) -> Result<Observations, NotCalibrated> {
    let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
    let prepared = Observations::new(board_m, &slices);
    prepared.map(|all| all.with_threads(threads)).map_err(|invalid| match invalid {
        InvalidCorners::Count { view, got, want } => NotCalibrated::CornerCount { view, got, want },
        InvalidCorners::Value { view, corner } => NotCalibrated::CornerValue { view, corner },
    })
}

impl Inputs<'_> {
    /// Lens models to choose from. If only models of other families are allowed, Brown's models
    /// serve as their start.
    fn allowed(&self) -> Vec<LensModel> {
        let models = self.family.models();
        let wanted = |model: &LensModel| self.params.models.contains(model);
        let allowed: Vec<LensModel> = models.iter().copied().filter(wanted).collect();
        if allowed.is_empty() { models } else { allowed }
    }

    /// Lens models to fit: fewer views determine fewer coefficients.
    fn models(&self) -> Vec<LensModel> {
        let richest = self.family.richest_of(self.distinct);
        // The simplest requested model is always fitted, regardless of the number of views.
        let wanted = self.allowed().into_iter().min();
        let models = self.family.models().into_iter();
        models.filter(|model| *model <= richest || Some(*model) <= wanted).collect()
    }

    /// Fits the models, with a prior on an undetermined focal length.
    fn solve(&self) -> Result<Solution, NotCalibrated> {
        let starts = starts(&self.observations, &self.as_seen, self.image_size);
        self.solve_from(&starts)
    }

    fn solve_from(&self, starts: &[BundleState]) -> Result<Solution, NotCalibrated> {
        let undetermined = NotCalibrated::Undetermined { distinct: self.distinct };
        let f_px = starts.first().ok_or(undetermined)?.camera.f_px.x;
        let models = self.models();
        let allowed = self.allowed();
        let weak = LensPrior::weak(self.image_size);
        let prior_used = self.params.weak_priors && self.distinct < VIEWS_WITHOUT_PRIOR;
        let search = |prior: Option<&LensPrior>| {
            let search = ModelSearch {
                observations: &self.observations,
                models: &models,
                allowed: &allowed,
                square_pixels: self.params.square_pixels,
                prior,
                noise_floor: self.noise_floor,
            };
            self.lowest(&search, starts)
        };
        if let Some(choice) = search(prior_used.then_some(&weak))
            && self.is_determined(&choice)
        {
            return Ok(Solution { choice, prior_used, focal_prior_used: false });
        }
        if !self.params.weak_priors {
            return Err(undetermined);
        }
        let with_focal_prior = weak.with_focal_length(f_px, 0.5 * f_px);
        let choice = search(Some(&with_focal_prior)).ok_or(undetermined)?;
        Ok(Solution { choice, prior_used: true, focal_prior_used: true })
    }

    /// Allowed lenses of families other than Brown's with clear support by the corners, best first.
    /// `observations` have the stated covariances; `brown` is the result for Brown's models, if
    /// any.
    fn wide_lenses(&self, observations: &Observations, brown: Option<&Solution>) -> Vec<WideLens> {
        let has = |brown: bool| {
            self.params.models.iter().any(|model| (model.family() == LensFamily::Brown) == brown)
        };
        if self.params.varying_focal {
            return Vec::new();
        }
        let is_few = self.distinct < VIEWS_WITHOUT_PRIOR;
        let richest = brown.and_then(|solution| solution.choice.bundles.last());
        let is_narrow =
            || richest.is_some_and(|bundle| !is_wide(&bundle.state.camera, self.image_size));
        if !has(false) || (has(true) && (is_few || is_narrow())) {
            return Vec::new();
        }
        let weak = LensPrior::weak(self.image_size);
        let search = WideSearch {
            observations,
            image_size: self.image_size,
            square_pixels: self.params.square_pixels,
            prior: (is_few && self.params.weak_priors).then_some(&weak),
            noise_floor: self.noise_floor,
            allowed: &self.params.models,
        };
        better_families(&search, richest.map(|bundle| &bundle.state))
    }

    /// Fit from the first start, or the lowest fit of all starts if the first is suspect. A fit
    /// with larger residuals than views without a common focal length may be a wrong minimum; all
    /// starts are then tried, with tilts reversed early or late.
    fn lowest(&self, search: &ModelSearch<'_>, starts: &[BundleState]) -> Option<ModelChoice> {
        let floor = self.free.as_ref().map(|free| free.noise_factor().max(self.noise_floor));
        let noise_factor = |choice: &ModelChoice| {
            choice.bundles.last().map_or(f64::INFINITY, Bundle::noise_factor)
        };
        let mut best: Option<ModelChoice> = None;
        // Costs of the simplest model: many starts lead to the same minimum.
        let mut seen: Vec<(Reversals, f64)> = Vec::new();
        for start in starts {
            for reversals in [Reversals::Early, Reversals::Late] {
                let least = best.as_ref().map_or(f64::INFINITY, &noise_factor);
                let is_enough = floor.is_none_or(|floor| least <= SUSPICIOUS * floor);
                if best.is_some() && is_enough {
                    return best;
                }
                let is_known = |bundle: &Bundle| {
                    let is_same = |cost: f64| (cost - bundle.cost).abs() <= SAME_COST * cost;
                    seen.iter().any(|(how, cost)| *how == reversals && is_same(*cost))
                };
                let choice = fit_models(search, start.clone(), reversals, is_known);
                let Some(choice) = choice else { break };
                seen.push((reversals, choice.bundles[0].cost));
                // Without reversals, late and early fits are the same.
                let is_all = !choice.reversed;
                if noise_factor(&choice) < least {
                    best = Some(choice);
                }
                if is_all {
                    break;
                }
            }
        }
        best
    }

    fn is_determined(&self, choice: &ModelChoice) -> bool {
        let noise_factor = choice.fit().noise_factor.max(self.noise_floor);
        choice.bundle().covariance(noise_factor).is_some_and(|covariance| {
            let f_px = choice.fit().camera.f_px.x;
            let (f, pp) = (covariance.f(), covariance.pp());
            f.m11.sqrt() < F_UNDETERMINED * f_px
                && pp.m11.max(pp.m22).sqrt() < f64::from(self.image_size.width_px)
        })
    }
}
