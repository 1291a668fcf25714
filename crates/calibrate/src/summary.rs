//! Builds the [`Calibration`] from the solver's minimum: every view, every method, every check.

use nalgebra::{Isometry3, Matrix2, Point2, Point3, Vector2, Vector3};

use super::{
    acceptance::{AcceptanceGoal, acceptance},
    check::{
        disagreement::Disagreement,
        finding::Verdict,
        held_out, leave_out,
        limits::Limits,
        odd_corners::odd_corners,
        projection_sd::{ProjectionSd, projection_jacobian},
        trust_checks::{self, Evidence, ViewEvidence},
    },
    examined::Examined,
    inputs::{Inputs, Solution},
    known_lens::{Combined, NotHeld},
    result::{Calibration, Focal, PrincipalPointEstimate, PrincipalPoints, ViewResult},
    solve::{
        bundle::BundleState,
        free_homography::{DistortionCentrePrior, FreeHomographies},
        initial_guess::{poses, typical_sigma_px},
        lens_model::{LensFamily, LensModel},
        model_choice::ModelChoice,
        varying::{self, VaryingFocal, varying_focal},
        zhang,
    },
};
use boresight_geometry::{
    BoardOutline, Camera, Corner, FocalLength, Homography, LensMatrix, LensParts, PrincipalLine,
    PrincipalPoint, coverage, fit_pose, mean_px, seen_count,
};

/// Resulting lens and covariance.
struct Lens {
    model: LensModel,
    camera: Camera,
    focal: Focal,
    covariance: LensMatrix,
    covariance_all: LensMatrix,
    noise_factor: f64,
}

/// Summarises `solution`. `None` if its covariance isn't finite or too little of the picture has
/// rays.
pub(super) fn assemble(
    inputs: &Inputs<'_>,
    solution: &Solution,
    examined: &Examined,
) -> Option<Calibration> {
    let choice = &solution.choice;
    let bundle = choice.bundle();
    let noise_floor = inputs.noise_floor;
    let Examined { correlation, causes, .. } = examined;
    let sampling = examined.sampling_covariance(inputs, choice)?;
    let doubt = examined.doubt(inputs, choice);
    let free = inputs.free.as_ref();
    // Effect of the corners' errors, as a multiple of that of independent ones.
    let independent = bundle.covariance(bundle.noise_factor().max(noise_floor))?;
    let overdispersion = sampling.pp().trace() / independent.pp().trace();
    let disagreement = free
        .map(|free| Disagreement::between(choice, free, noise_floor, overdispersion, &doubt.pp()));
    let varying = free
        .filter(|_| inputs.family == LensFamily::Brown)
        .filter(|_| inputs.params.varying_focal)
        .and_then(|free| {
            let prior = DistortionCentrePrior::of(inputs.image_size);
            varying_focal(&inputs.observations, free, prior, noise_floor)
        });
    let alone = match &varying {
        Some(varying) => Lens::varying(varying),
        None => inputs.common_lens(choice, sampling + doubt),
    };
    let combined = inputs.params.known_lens.map(|known| match alone.focal {
        Focal::Common => known.combined_with(&alone.camera, &alone.covariance_all),
        Focal::Varying { .. } => Err(NotHeld::FocalVaries),
    });
    let lens = match &combined {
        Some(Ok(combined)) if combined.agrees() => alone.held_to(combined),
        _ => alone,
    };
    let Lens { model, camera, focal, covariance, covariance_all, noise_factor } = lens;
    let noise_px = noise_factor * typical_sigma_px(&inputs.views);
    let outlines = inputs.outlines();
    let is_covered = |px: &Point2<f64>| outlines.iter().any(|outline| outline.covers(px));
    let whole = projection_jacobian(&camera, inputs.image_size)?;
    let where_seen = whole.turned_over(is_covered);
    let jacobian = where_seen.as_ref().unwrap_or(&whole);
    let projection_sd =
        ProjectionSd { bound_px: whole.bound_px(&covariance_all), ..jacobian.sd(&covariance_all) };
    let covered_bound_px = jacobian.bound_px_inside(&covariance_all, is_covered);
    let goal = inputs.params.accept.map(|goal| {
        let scale_sd = inputs.params.board_scale_sd;
        acceptance(goal, &camera, &covariance_all, inputs.image_size, scale_sd)
    });
    let goal_px = match inputs.params.accept {
        Some(AcceptanceGoal::Projection { px }) => px,
        _ => Limits::of(inputs.image_size).goal_px,
    };
    let valid_area = jacobian.valid_area(&covariance_all, goal_px);
    let pp_covariance_px2 = covariance.pp();
    let views: Vec<ViewResult> = match &varying {
        Some(varying) => inputs.views_of_varying(varying, &bundle.state),
        None => inputs.views_of_bundle(&bundle.state, &pp_covariance_px2, noise_factor),
    };
    let of_bundle = (sampling + doubt).pp();
    let inflation = of_bundle.trace() / independent.pp().trace();
    let skip_one_ratio = (inputs.distinct >= 4)
        .then(|| leave_out::leave_one_out(bundle, bundle.noise_factor().max(noise_floor)))
        .flatten()
        .map(|left_out| left_out.ratio / inflation.sqrt());
    let coverage = coverage(&outlines, inputs.image_size);
    let view_evidence: Vec<ViewEvidence> = views
        .iter()
        .zip(&inputs.as_seen.image_from_board)
        .map(|(view, h)| ViewEvidence {
            tilt_rad: view.tilt_rad,
            tilt_azimuth_rad: view.tilt_azimuth_rad,
            residual_rms_px: view.residual_rms_px,
            mirrored: h.determinant() * h[(2, 2)] < 0.0,
        })
        .collect();
    let odd_corners = odd_corners(&inputs.observations, &bundle.state);
    let held_out = (inputs.distinct > held_out::VIEWS_NEEDED)
        .then(|| held_out::check(&inputs.observations, bundle, &inputs.views, inflation))
        .flatten();
    let findings = trust_checks::check(&Evidence {
        image_size: inputs.image_size,
        camera: &camera,
        choice,
        varying_px: match focal {
            Focal::Varying { scatter_px } => Some(scatter_px),
            Focal::Common => None,
        },
        free,
        views: &view_evidence,
        seen: &inputs.views,
        causes: causes.as_ref(),
        correction: inputs.correction,
        odd_corners: &odd_corners,
        held_out,
        known_lens: combined.as_ref(),
        disagreement,
        projection_sd: &projection_sd,
        pp_covariance_px2,
        valid_area: &valid_area,
        bound_px: covered_bound_px.unwrap_or(projection_sd.bound_px),
        // A goal missed by the board's size alone isn't the lens's fault.
        of_goal: goal.map(|goal| goal.excess()),
        skip_one_ratio,
        distinct: inputs.distinct,
        given: inputs.given,
        noise_px,
        noise_correlation: correlation.as_ref(),
        noise_floor_px: inputs.params.noise_floor_px,
        noise_floor,
        shifted_sensor: inputs.params.shifted_sensor,
        prior_used: solution.prior_used,
        focal_prior_used: solution.focal_prior_used,
    });
    // A part of a board has fewer coordinates.
    let counts = inputs.views.iter().map(|view| seen_count(view) as f64 / view.len() as f64);
    let (squares, count) =
        views.iter().zip(counts).fold((0.0, 0.0), |(squares, all), (view, count)| {
            (squares + count * view.residual_rms_px.powi(2), all + count)
        });
    let flat_m = || inputs.board_m.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    let points_m = inputs.correction.map(|correction| correction.points_m(inputs.board_m));
    Some(Calibration {
        image_size: inputs.image_size,
        board_m: points_m.unwrap_or_else(flat_m),
        model,
        camera,
        focal,
        covariance,
        covariance_all,
        rms_px: (squares / count).sqrt(),
        noise_factor,
        noise_px,
        excess_px: noise_factor * inputs.excess_px,
        candidates: choice.fits.clone(),
        principal_point: inputs.principal_points(choice, free, of_bundle, overdispersion),
        views,
        projection_sd,
        covered_bound_px,
        visible_drift: causes.as_ref().and_then(|causes| causes.visible_drift),
        skip_one_ratio,
        noise_floor_px: inputs.params.noise_floor_px,
        valid_area,
        acceptance: goal,
        coverage,
        verdict: Verdict::of(&findings),
        findings,
    })
}

impl Lens {
    fn varying(varying: &VaryingFocal) -> Self {
        Self {
            model: varying::MODEL,
            camera: varying.camera,
            focal: Focal::Varying { scatter_px: varying.scatter_px },
            covariance: varying.covariance,
            covariance_all: varying.covariance,
            noise_factor: varying.noise_factor,
        }
    }

    /// Lens supported by this and an earlier calibration together.
    fn held_to(self, combined: &Combined) -> Self {
        let model = self.model.max(combined.model());
        Self {
            model,
            camera: combined.camera,
            covariance: restricted(&combined.covariance, model),
            covariance_all: combined.covariance,
            ..self
        }
    }
}

impl Inputs<'_> {
    fn common_lens(&self, choice: &ModelChoice, covariance_all: LensMatrix) -> Lens {
        let (bundle, model) = (choice.bundle(), choice.fit().model);
        Lens {
            model,
            camera: bundle.state.camera,
            focal: Focal::Common,
            covariance: restricted(&covariance_all, model),
            covariance_all,
            noise_factor: bundle.noise_factor(),
        }
    }

    fn outlines(&self) -> Vec<BoardOutline> {
        let outline = |corners: &Vec<Corner>| {
            let px: Vec<_> = corners.iter().map(|corner| corner.px).collect();
            self.board.target().outline(&px, &|index| corners[index].is_seen())
        };
        self.views.iter().filter_map(outline).collect()
    }

    fn views_of_bundle(
        &self,
        state: &BundleState,
        pp_covariance_px2: &Matrix2<f64>,
        noise_factor: f64,
    ) -> Vec<ViewResult> {
        let residuals = self.observations.residual_rms_px(&state.camera, &state.cam_from_board);
        residuals
            .into_iter()
            .enumerate()
            .map(|(view, rms_px)| {
                let focal = self.focal_length(view, &state.camera, pp_covariance_px2, noise_factor);
                self.view(view, state.cam_from_board[view], rms_px, focal)
            })
            .collect()
    }

    /// Views under separate focal lengths; with the pose of the bundle if no pose fits.
    fn views_of_varying(&self, varying: &VaryingFocal, state: &BundleState) -> Vec<ViewResult> {
        (0..self.views.len())
            .map(|view| {
                let camera = varying.camera_of(view);
                let pose = fit_pose(&camera, self.board_m, &self.views[view])
                    .map_or(state.cam_from_board[view], |fit| fit.cam_from_board);
                let rms_px = self.observations.view_residual_rms_px(view, &camera, &pose);
                self.view(view, pose, rms_px, varying.focal[view])
            })
            .collect()
    }

    fn view(
        &self,
        view: usize,
        cam_from_board: Isometry3<f64>,
        residual_rms_px: f64,
        focal: Option<FocalLength>,
    ) -> ViewResult {
        let (tilt_rad, tilt_azimuth_rad) = tilt_and_azimuth_rad(&cam_from_board);
        let principal_line = self.as_seen.lines[view].clone();
        let pl_residual_px = principal_line
            .as_ref()
            .zip(self.as_seen.weighted.as_ref())
            .map(|(line, pp)| line.distance_px(&pp.px));
        ViewResult {
            is_seen: self.views[view].iter().map(Corner::is_seen).collect(),
            cam_from_board,
            residual_rms_px,
            noise: self.view_noise.get(view).copied().unwrap_or(1.0),
            tilt_rad,
            tilt_azimuth_rad,
            principal_line,
            pl_residual_px,
            focal,
            focal_as_seen: self.focal_length_as_seen(view),
        }
    }

    /// Focal length of a single view, from undistorted corners.
    fn focal_length(
        &self,
        view: usize,
        camera: &Camera,
        pp_covariance_px2: &Matrix2<f64>,
        noise_factor: f64,
    ) -> Option<FocalLength> {
        let variance = noise_factor.max(self.noise_floor).powi(2);
        let corners: Vec<Corner> = self.views[view]
            .iter()
            .map(|corner| {
                let covariance_px2 = corner.covariance_px2 * variance;
                camera.undistort_corner(&Corner { covariance_px2, ..*corner })
            })
            .collect::<Option<_>>()?;
        let homography = Homography::fit(self.board_m, &corners).ok()?;
        let line =
            PrincipalLine::of(&homography, self.image_size.centre_px(), mean_px(&corners)).ok()?;
        line.focal_length(&camera.pp_px, pp_covariance_px2).ok()
    }

    /// Focal length of a single view as in Chuang 2021: from distorted corners, with the principal
    /// point at the intersection of the principal lines.
    fn focal_length_as_seen(&self, view: usize) -> Option<FocalLength> {
        let pp = self.as_seen.unweighted.as_ref()?;
        self.as_seen.lines[view].as_ref()?.focal_length(&pp.px, &pp.covariance_px2).ok()
    }

    fn principal_points(
        &self,
        choice: &ModelChoice,
        free: Option<&FreeHomographies>,
        of_bundle_px2: Matrix2<f64>,
        overdispersion: f64,
    ) -> PrincipalPoints {
        let variance = choice.fit().noise_factor.max(self.noise_floor).powi(2) * overdispersion;
        let camera = choice.fit().camera;
        let estimate =
            |px, covariance_px2, f_px| PrincipalPointEstimate { px, covariance_px2, f_px };
        let lines = |pp: &PrincipalPoint| estimate(pp.px, Some(pp.covariance_px2 * variance), None);
        // The same model with square pixels and other starts ends nearby.
        let fitted = choice.fits.iter().position(|fit| fit.model == LensModel::K1K2);
        let refined = || match fitted {
            Some(fitted) => {
                let state = choice.bundles[fitted].state.clone();
                zhang::refined_near(&self.observations, LensModel::K1K2, state)
            }
            None => poses(&self.as_seen.image_from_board, &camera).and_then(|poses| {
                zhang::refined(&self.observations, LensModel::K1K2, camera, poses)
            }),
        };
        let zhang = (self.distinct >= 2).then(refined).flatten().map(|bundle| {
            let noise_factor = bundle.noise_factor().max(self.noise_floor);
            let covariance = bundle.covariance(noise_factor).map(|it| it.pp() * overdispersion);
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
                let variance = free.noise_factor().max(self.noise_floor).powi(2) * overdispersion;
                estimate(free.pp_px, Some(free.pp_unit_covariance_px2 * variance), None)
            }),
            bundle: Some(estimate(camera.pp_px, Some(of_bundle_px2), Some(camera.f_px))),
            zhang,
        }
    }
}

/// Tilt (angle between board and image plane) and azimuth (image direction in which the board
/// recedes).
///
/// On the plane `n·X = e`, `1/Z = n·(x, y, 1)/e`: depth grows fastest along `−(n_x, n_y)/e`.
fn tilt_and_azimuth_rad(cam_from_board: &Isometry3<f64>) -> (f64, f64) {
    let normal = cam_from_board.rotation * Vector3::z();
    let distance = normal.dot(&cam_from_board.translation.vector);
    let receding = -normal.xy() * distance.signum();
    let tilt_azimuth_rad = libm::atan2(receding.y, receding.x).rem_euclid(std::f64::consts::TAU);
    (libm::atan2(receding.norm(), normal.z.abs()), tilt_azimuth_rad)
}

/// `covariance` with zeros for parameters that `model` does not estimate.
fn restricted(covariance: &LensMatrix, model: LensModel) -> LensMatrix {
    // With square pixels, fy has the covariance of fx.
    let free = model.freedom(false).free;
    LensMatrix::from_fn(|i, j| if free[i] && free[j] { covariance[(i, j)] } else { 0.0 })
}
