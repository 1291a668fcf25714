use std::borrow::Cow;

use nalgebra::{Isometry3, Matrix2, Point2, SMatrix, Vector2, Vector3};

use super::bundle::{BundleState, InvalidCorners, Observations};
use super::causes::{Causes, causes};
use super::corners::{is_grid, odd_corners};
use super::excess::{excess_variance_px2, widened};
use super::finding::Verdict;
use super::free_homography::{self, DistortionCentrePrior, FreeHomographies};
use super::held_out;
use super::honesty::{self, Evidence};
use super::lens_model::{LensModel, LensPrior};
use super::model_choice::{ModelChoice, ModelSearch, fit_models};
use super::result::{
    Calibration, CalibrationParams, NotCalibrated, PrincipalPointEstimate, PrincipalPoints,
    ViewResult,
};
use super::skip;
use super::start::{AsSeen, as_seen, distinct_views, mean_px, poses, start, typical_sigma_px};
use super::uncertainty::projection_jacobian;
use super::zhang;
use crate::board::Checkerboard;
use crate::frame::ImageSize;
use crate::geometry::{
    BoardOutline, Camera, Corner, FocalLength, Homography, LENS_PARAMETERS, PrincipalLine, coverage,
};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// No corner is believed to be found better than this.
const NOISE_FLOOR_PX: f64 = 1e-3;
/// Different views from which the lens stands without weak beliefs.
const VIEWS_WITHOUT_PRIOR: usize = 4;
/// A focal length less certain than this share of itself needs a belief.
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
    let as_seen = as_seen(views, &board_m, image_size)?;
    let distinct = distinct_views(views, image_size);
    let prior = DistortionCentrePrior::of(image_size);
    let fit_free = |observations: &Observations| {
        free_homography::fit(observations, prior, &as_seen.image_from_board)
    };
    let mut free = fit_free(&observations);
    let rho = free.as_ref().map_or(0.0, |free| excess_variance_px2(&observations, free));
    let mut views = Cow::Borrowed(views);
    if rho > 0.0 {
        views = Cow::Owned(widened(&views, rho));
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
    problem.report(&solution).ok_or(undetermined)
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

/// The corners and what was derived from them before any adjustment.
struct Inputs<'a> {
    views: &'a [Vec<Corner>],
    board: &'a Checkerboard,
    board_m: &'a [Point2<f64>],
    image_size: ImageSize,
    params: &'a CalibrationParams,
    observations: Observations,
    as_seen: AsSeen,
    free: Option<FreeHomographies>,
    distinct: usize,
    /// Root of the variance that was added to what the corners claim.
    excess_px: f64,
}

struct Solution {
    choice: ModelChoice,
    prior_used: bool,
    focal_prior_used: bool,
}

impl Inputs<'_> {
    fn noise_floor(&self) -> f64 {
        NOISE_FLOOR_PX / typical_sigma_px(self.views)
    }

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

    /// Adjusts, first as asked, then with a belief about the focal length if the views leave it open.
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

    fn report(&self, solution: &Solution) -> Option<Calibration> {
        let choice = &solution.choice;
        let (bundle, model) = (choice.bundle(), choice.fit().model);
        let camera = bundle.state.camera;
        let noise_factor = bundle.noise_factor();
        let noise_floor = self.noise_floor();
        let noise_px = noise_factor * typical_sigma_px(self.views);
        let plain = choice.averaged_covariance(noise_floor)?;
        let causes = self.causes(choice);
        let covariance_all = plain + causes.doubt;
        let covariance = restricted(&covariance_all, model, self.params.square_pixels);
        let projection_sd = projection_jacobian(&camera, self.image_size)?.sd(&covariance_all);
        let free = self.free.as_ref();
        let residuals = self.observations.residual_rms_px(&camera, &bundle.state.cam_from_board);
        let pp_covariance_px2: Matrix2<f64> = covariance.fixed_view::<2, 2>(2, 2).into();
        let views: Vec<ViewResult> = (0..self.views.len())
            .map(|view| {
                self.view(view, &bundle.state, residuals[view], &pp_covariance_px2, noise_factor)
            })
            .collect();
        let widening = covariance_all.fixed_view::<2, 2>(2, 2).trace()
            / plain.fixed_view::<2, 2>(2, 2).trace();
        let skip_one_ratio = (self.distinct >= 4)
            .then(|| skip::leave_one_out(bundle, noise_factor.max(noise_floor)))
            .flatten()
            .map(|left_out| left_out.ratio / widening.sqrt());
        let coverage = coverage(&self.outlines(), self.image_size);
        let mirrored: Vec<bool> = self
            .as_seen
            .image_from_board
            .iter()
            .map(|h| h.determinant() * h[(2, 2)] < 0.0)
            .collect();
        let odd_corners = odd_corners(&self.observations, &bundle.state);
        let held_out = (self.distinct > held_out::VIEWS_NEEDED)
            .then(|| held_out::check(&self.observations, bundle, self.views))
            .flatten();
        let findings = honesty::check(&Evidence {
            image_size: self.image_size,
            choice,
            free,
            views: &views,
            mirrored: &mirrored,
            seen: self.views,
            causes: &causes,
            odd_corners: &odd_corners,
            held_out,
            pp_doubt_px2: causes.doubt.fixed_view::<2, 2>(2, 2).into(),
            projection_sd: &projection_sd,
            pp_covariance_px2,
            f_sd_px: covariance[(0, 0)].sqrt(),
            skip_one_ratio,
            coverage,
            distinct: self.distinct,
            noise_px,
            noise_floor,
            prior_used: solution.prior_used,
            focal_prior_used: solution.focal_prior_used,
        });
        let squares: f64 = residuals.iter().map(|rms_px| rms_px * rms_px).sum();
        Some(Calibration {
            image_size: self.image_size,
            model,
            camera,
            covariance,
            covariance_all,
            rms_px: (squares / residuals.len() as f64).sqrt(),
            noise_factor,
            noise_px,
            excess_px: noise_factor * self.excess_px,
            candidates: choice.fits.clone(),
            principal_point: self.principal_points(choice, free, &pp_covariance_px2),
            views,
            projection_sd,
            skip_one_ratio,
            coverage,
            verdict: Verdict::of(&findings),
            findings,
        })
    }

    /// What else may be wrong with the views, weighed against the richest lens.
    fn causes(&self, choice: &ModelChoice) -> Causes {
        let richest = choice.bundles.last();
        match richest {
            Some(richest) if self.distinct >= VIEWS_WITHOUT_PRIOR => {
                causes(&self.observations, richest, self.image_size, self.noise_floor())
            }
            _ => Causes::none(),
        }
    }

    fn outlines(&self) -> Vec<BoardOutline> {
        let outline = |corners: &Vec<Corner>| {
            let px: Vec<_> = corners.iter().map(|corner| corner.px).collect();
            BoardOutline::of(&px, self.board.columns())
        };
        self.views.iter().filter_map(outline).collect()
    }

    fn view(
        &self,
        view: usize,
        state: &BundleState,
        residual_rms_px: f64,
        pp_covariance_px2: &Matrix2<f64>,
        noise_factor: f64,
    ) -> ViewResult {
        let cam_from_board = state.cam_from_board[view];
        let (tilt_rad, slot_rad) = tilt_and_slot_rad(&cam_from_board);
        let principal_line = self.as_seen.lines[view].clone();
        let pl_residual_px = principal_line
            .as_ref()
            .zip(self.as_seen.weighted.as_ref())
            .map(|(line, pp)| line.distance_px(&pp.px));
        ViewResult {
            cam_from_board,
            residual_rms_px,
            tilt_rad,
            slot_rad,
            principal_line,
            pl_residual_px,
            focal: self.focal_length(view, &state.camera, pp_covariance_px2, noise_factor),
            focal_as_seen: self.focal_length_as_seen(view),
        }
    }

    /// This view's own focal length, its corners undistorted.
    fn focal_length(
        &self,
        view: usize,
        camera: &Camera,
        pp_covariance_px2: &Matrix2<f64>,
        noise_factor: f64,
    ) -> Option<FocalLength> {
        let corners: Vec<Corner> = self.views[view]
            .iter()
            .map(|corner| {
                let px = camera.undistort_px(&corner.px)?;
                let covariance_px2 =
                    corner.covariance_px2 * noise_factor.max(self.noise_floor()).powi(2);
                Some(Corner { px, covariance_px2 })
            })
            .collect::<Option<_>>()?;
        let homography = Homography::fit(self.board_m, &corners).ok()?;
        let line =
            PrincipalLine::of(&homography, self.image_size.centre_px(), mean_px(&corners)).ok()?;
        line.focal_length(&camera.pp_px, pp_covariance_px2).ok()
    }

    /// This view's own focal length as the paper has it: corners as seen, and the principal point where
    /// their principal lines meet.
    fn focal_length_as_seen(&self, view: usize) -> Option<FocalLength> {
        let pp = self.as_seen.unweighted.as_ref()?;
        self.as_seen.lines[view].as_ref()?.focal_length(&pp.px, &pp.covariance_px2).ok()
    }

    fn principal_points(
        &self,
        choice: &ModelChoice,
        free: Option<&FreeHomographies>,
        pp_covariance_px2: &Matrix2<f64>,
    ) -> PrincipalPoints {
        let variance = choice.fit().noise_factor.max(self.noise_floor()).powi(2);
        let camera = choice.fit().camera;
        let estimate =
            |px, covariance_px2, f_px| PrincipalPointEstimate { px, covariance_px2, f_px };
        let lines = |pp: &crate::geometry::PrincipalPoint| {
            estimate(pp.px, Some(pp.covariance_px2 * variance), None)
        };
        let zhang = poses(&self.as_seen.image_from_board, &camera)
            .filter(|_| self.distinct >= 2)
            .and_then(|poses| zhang::refined(&self.observations, LensModel::K1K2, camera, poses))
            .map(|bundle| {
                let noise_factor = bundle.noise_factor().max(self.noise_floor());
                let covariance = bundle
                    .covariance(noise_factor)
                    .map(|covariance| covariance.fixed_view::<2, 2>(2, 2).into());
                let camera = bundle.state.camera;
                estimate(camera.pp_px, covariance, Some(camera.f_px))
            });
        PrincipalPoints {
            pl_unweighted: self.as_seen.unweighted.as_ref().map(lines),
            pl_weighted: self.as_seen.weighted.as_ref().map(lines),
            pl_ring: self.as_seen.ring.as_ref().map(|ring| {
                let covariance: Matrix2<f64> = ring.covariance.fixed_view::<2, 2>(1, 1).into();
                let f_px = Vector2::new(ring.f_px, ring.f_px);
                estimate(ring.pp_px, Some(covariance * variance), Some(f_px))
            }),
            free_homography: free.map(|free| {
                let variance = free.noise_factor().max(self.noise_floor()).powi(2);
                estimate(free.pp_px, Some(free.pp_unit_covariance_px2 * variance), None)
            }),
            bundle: Some(estimate(camera.pp_px, Some(*pp_covariance_px2), Some(camera.f_px))),
            zhang,
        }
    }
}

/// Angle between board and image plane, and image direction in which the board recedes.
///
/// On the plane `n·X = e`, `1/Z = n·(x, y, 1)/e`: depth grows fastest along `−(n_x, n_y)/e`.
fn tilt_and_slot_rad(cam_from_board: &Isometry3<f64>) -> (f64, f64) {
    let normal = cam_from_board.rotation * Vector3::z();
    let distance = normal.dot(&cam_from_board.translation.vector);
    let receding = -normal.xy() * distance.signum();
    let slot_rad = receding.y.atan2(receding.x).rem_euclid(std::f64::consts::TAU);
    (receding.norm().atan2(normal.z.abs()), slot_rad)
}

/// `covariance` with zeros for parameters that `model` does not estimate.
fn restricted(covariance: &LensMatrix, model: LensModel, square_pixels: bool) -> LensMatrix {
    let mut free = model.freedom(square_pixels).free;
    free[1] = true;
    LensMatrix::from_fn(|i, j| if free[i] && free[j] { covariance[(i, j)] } else { 0.0 })
}
