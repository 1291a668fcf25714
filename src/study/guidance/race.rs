//! One run: a strategy asks, a person shows, the lens is adjusted and compared with the truth.

use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector2, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, UnitSphere};
use serde::{Deserialize, Serialize};

use super::strategy::{Situation, Strategy};
use crate::{
    board::Checkerboard,
    calibration::{
        Bundle, BundleState, LensModel, LensPrior, Observations, adjust, projection_jacobian,
    },
    frame::{CaptureTime, FrameId, ImageSize},
    geometry::{Camera, Corner, Distortion, cell_centres_px, fit_pose},
    guidance::{GuidanceParams, LensEstimate, Role, View, gate, measure, role_of},
    simulation::technician::Person,
    study::{
        params::Params,
        setup::{board, chance},
    },
};

const IMAGE_SIZE: ImageSize = ImageSize { width_px: 1920, height_px: 1080 };
/// How long a view is held until it is taken.
const HOLD_SECS: f64 = 1.0;
/// Attempts at one pose before the person gives up on it.
const ATTEMPTS: i32 = 6;

/// A camera whose truth is known, and what it is fitted with.
#[derive(Clone, Debug)]
pub struct Course {
    /// The truth.
    pub camera: Camera,
    /// What is fitted.
    pub model: LensModel,
    /// What is held up.
    pub board: Checkerboard,
}

impl Course {
    /// Lens model right, and wrong.
    pub const COUNT: usize = 2;

    /// Stable name.
    pub fn code_of(course: usize) -> &'static str {
        if course == 0 { "right_model" } else { "wrong_model" }
    }

    /// A camera with its principal point up to 60 px off the picture's centre.
    pub fn random(course: usize, params: &Params, index: u64) -> Self {
        let mut rng = chance(params.seed, 1_000_000 + index);
        let (angle, off_px): (f64, f64) =
            (rng.random_range(0.0..std::f64::consts::TAU), rng.random_range(0.0..60.0));
        let pp_px = IMAGE_SIZE.centre_px() + Vector2::new(angle.cos(), angle.sin()) * off_px;
        let (distortion, model) = if course == 0 {
            (Distortion { k1: -0.1, k2: -0.02, ..Distortion::default() }, LensModel::K1K2)
        } else {
            (Distortion { k1: -0.2, k2: 0.08, k3: -0.03, ..Distortion::default() }, LensModel::K1)
        };
        let camera = Camera { distortion, ..Camera::pinhole(1400.0, pp_px) };
        Self { camera, model, board: board([9, 6], 0.04) }
    }
}

/// Where a run stands after a view that counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Number of the view, from 1.
    pub view: usize,
    /// Time since the start.
    pub secs: f64,
    /// Distance of the principal point from the truth.
    pub pp_error_px: f64,
    /// Error of the focal length.
    pub f_error_px: f64,
    /// Mean error of projection over the picture, a turn of the camera set aside.
    pub projection_error_px: f64,
    /// Stated standard deviation of the principal point along its worst axis.
    pub pp_sd_px: f64,
    /// Stated mean standard deviation of projection.
    pub projection_sd_px: f64,
}

/// Runs `strategy` on `course`; one mark a view that counts.
pub fn run(course: &Course, strategy: &Strategy, params: &Params, index: u64) -> Vec<Mark> {
    let mut rng = chance(params.seed, 2_000_000 + index);
    let mut chance_of_strategy = chance(params.seed, 3_000_000 + index);
    let guidance = GuidanceParams { plan: strategy.plan, ..GuidanceParams::default() };
    let mut lens_estimate = LensEstimate::guess(IMAGE_SIZE);
    let mut hand = Hand { at: Isometry3::translation(0.0, 0.0, 0.8), secs: 0.0 };
    let (mut views, mut shown, mut poses, mut marks) =
        (Vec::<View>::new(), Vec::<Vec<Corner>>::new(), Vec::new(), Vec::new());
    let mut asked = 0;
    while shown.len() < params.guidance_views && asked < 3 * params.guidance_views {
        let situation = Situation {
            lens_estimate: &lens_estimate,
            views: &views,
            shown: &shown,
            poses: &poses,
            board: &course.board,
            params: &guidance,
            asked,
            model: course.model,
            noise_px: params.noise_px,
        };
        let Some(wish) = (strategy.wish)(&situation, &mut chance_of_strategy) else { break };
        asked += 1;
        let taken = (0..ATTEMPTS).find_map(|attempt| {
            let care = 0.6_f64.powi(attempt);
            hand.bring(&wish, &lens_estimate.camera, care, &mut rng);
            let corners = seen(course, &hand.at, params.noise_px, &mut rng)?;
            let time = CaptureTime { nanos: (hand.secs * 1e9) as u64 };
            let frame = (FrameId(shown.len() as u64), time);
            let mut view = measure(frame, &corners, 0.8, &course.board, &lens_estimate);
            if strategy.picky {
                let measured = view.as_mut().ok()?;
                gate(measured, &guidance).ok()?;
                if let Role::Partner { of } =
                    role_of(measured, &views, &lens_estimate, &guidance).ok()?
                {
                    measured.partner_frame = Some(views[of].frame_id);
                }
            }
            Some((corners, view.ok()))
        });
        let Some((corners, view)) = taken else { continue };
        // A board that faces the camera has no principal line, but its corners count all the same.
        views.extend(view);
        shown.push(corners);
        let estimated = estimate(course, &shown, &lens_estimate, hand.secs);
        let Some((bundle, mark)) = estimated else { continue };
        lens_estimate.camera = bundle.state.camera;
        lens_estimate.covariance = bundle.covariance(1.0);
        poses = bundle.state.cam_from_board;
        marks.push(mark);
    }
    marks
}

/// The person's hands: where the board is, and the time.
struct Hand {
    at: Isometry3<f64>,
    secs: f64,
}

impl Hand {
    /// Moves the board to where it looks like `wish` through the camera that is believed; errors shrink
    /// with `care`.
    fn bring(&mut self, wish: &Isometry3<f64>, believed: &Camera, care: f64, rng: &mut ChaCha8Rng) {
        let person = Person::Tripod.params();
        let axis: [f64; 3] = UnitSphere.sample(rng);
        let mut even = |size: f64| rng.random_range(-1.0..1.0) * size * care;
        let turn = Vector3::from(axis) * even(person.rotation_error_rad);
        let depth_m = wish.translation.z;
        let lateral_m = person.lateral_error_px / believed.f_px.x * depth_m;
        let shift =
            Vector3::new(even(lateral_m), even(lateral_m), even(person.distance_error * depth_m));
        let target = Isometry3::from_parts(
            (wish.translation.vector + shift).into(),
            UnitQuaternion::from_scaled_axis(turn) * wish.rotation,
        );
        let way_m = (target.translation.vector - self.at.translation.vector).norm();
        // A board looks the same from both ends, so that half a turn about its normal is the most.
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let turn_rad = target
            .rotation
            .angle_to(&self.at.rotation)
            .min(target.rotation.angle_to(&(self.at.rotation * half_turn)));
        let moving = (way_m / person.max_speed_m_per_s).max(turn_rad / person.max_turn_rad_per_s);
        self.secs += person.reaction_secs + moving + HOLD_SECS;
        self.at = target;
    }
}

/// Corners with noise; `None` if one lies outside the picture.
fn seen(
    course: &Course,
    pose: &Isometry3<f64>,
    noise_px: f64,
    rng: &mut ChaCha8Rng,
) -> Option<Vec<Corner>> {
    let (right, bottom) =
        (f64::from(IMAGE_SIZE.width_px) - 1.0, f64::from(IMAGE_SIZE.height_px) - 1.0);
    course
        .board
        .corners_in_board_m()
        .iter()
        .map(|m| {
            let px = course.camera.px_from_board(pose, m)?;
            let mut normal = || -> f64 {
                let value: f64 = StandardNormal.sample(rng);
                noise_px * value
            };
            let px = px + Vector2::new(normal(), normal());
            let inside = px.x.min(px.y).min(right - px.x).min(bottom - px.y) >= 4.0;
            inside.then(|| Corner::isotropic(px, noise_px))
        })
        .collect()
}

/// The lens from all views so far, and where that leaves the run.
fn estimate(
    course: &Course,
    shown: &[Vec<Corner>],
    lens_estimate: &LensEstimate,
    secs: f64,
) -> Option<(Bundle, Mark)> {
    let board_m = course.board.corners_in_board_m();
    let corners: Vec<&[Corner]> = shown.iter().map(Vec::as_slice).collect();
    let observations = Observations::new(&board_m, &corners).ok()?;
    let poses: Option<Vec<Isometry3<f64>>> = shown
        .iter()
        .map(|corners| {
            Some(fit_pose(&lens_estimate.camera, &board_m, corners).ok()?.cam_from_board)
        })
        .collect();
    let f_px = LensEstimate::guess(IMAGE_SIZE).camera.f_px.x;
    let prior = LensPrior::weak(IMAGE_SIZE).with_focal_length(f_px, 0.5 * f_px);
    let start = BundleState { camera: lens_estimate.camera, cam_from_board: poses? };
    let bundle = adjust(&observations, &course.model.freedom(true), Some(&prior), start)?;
    // The corners' noise is known; a misfit of the lens must not hide behind it.
    let covariance = bundle.covariance(1.0)?;
    let camera = &bundle.state.camera;
    let pp = covariance.fixed_view::<2, 2>(2, 2).symmetric_eigenvalues().max().max(0.0);
    let mark = Mark {
        view: shown.len(),
        secs,
        pp_error_px: (camera.pp_px - course.camera.pp_px).norm(),
        f_error_px: (camera.f_px.x - course.camera.f_px.x).abs(),
        projection_error_px: projection_error_px(camera, &course.camera)?,
        pp_sd_px: pp.sqrt(),
        projection_sd_px: projection_jacobian(camera, IMAGE_SIZE)?.sd(&covariance).mean_px,
    };
    Some((bundle, mark))
}

/// Mean distance over the picture between where two cameras see the same rays, after the turn of the one
/// that brings them together best.
fn projection_error_px(estimate: &Camera, truth: &Camera) -> Option<f64> {
    let mut off: Vec<(Vector2<f64>, SMatrix<f64, 2, 3>)> = Vec::new();
    for px in cell_centres_px(IMAGE_SIZE) {
        let Some(ray) = truth.normalized_from_px(&px) else { continue };
        let at = estimate.project_ray(&ray);
        off.push((at.px - px, at.jac_rotation));
    }
    let mut normal = nalgebra::Matrix3::zeros();
    let mut gradient = Vector3::zeros();
    for (off, jac_rotation) in &off {
        normal += jac_rotation.transpose() * jac_rotation;
        gradient += jac_rotation.transpose() * off;
    }
    let turn = normal.try_inverse()? * gradient;
    let sum: f64 = off.iter().map(|(off, jac_rotation)| (off - jac_rotation * turn).norm()).sum();
    (!off.is_empty()).then(|| sum / off.len() as f64)
}
