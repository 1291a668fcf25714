use nalgebra::{Isometry3, Matrix2, Point2, SMatrix, Vector2};

use super::{
    check::{
        finding::{Finding, Verdict},
        projection_sd::ProjectionSd,
    },
    solve::{lens_model::LensModel, model_choice::ModelFit},
};
use crate::{
    frame::ImageSize,
    geometry::{Camera, FocalLength, LENS_PARAMETERS, PrincipalLine},
};

/// One estimate of the principal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalPointEstimate {
    /// The point.
    pub px: Point2<f64>,
    /// Its covariance, where the method gives one.
    pub covariance_px2: Option<Matrix2<f64>>,
    /// Focal length along x and y, where the method gives one.
    pub f_px: Option<Vector2<f64>>,
}

/// The principal point by every method, for comparison. The result is `bundle`, or `free_homography` if
/// the focal length varies.
///
/// The `pl_` estimates are from the corners as seen: distortion pulls them towards the boards' centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrincipalPoints {
    /// Principal lines, all with the same weight.
    pub pl_unweighted: Option<PrincipalPointEstimate>,
    /// Principal lines, weighted by their variance at the point.
    pub pl_weighted: Option<PrincipalPointEstimate>,
    /// Principal lines and the ring of 45° vanishing points.
    pub pl_ring: Option<PrincipalPointEstimate>,
    /// Principal lines of views undistorted without assuming a common focal length.
    pub free_homography: Option<PrincipalPointEstimate>,
    /// Bundle adjustment.
    pub bundle: Option<PrincipalPointEstimate>,
    /// Zhang's method, refined with k1 and k2, fx and fy apart.
    pub zhang: Option<PrincipalPointEstimate>,
}

/// What became of one view.
#[derive(Clone, Debug)]
pub struct ViewResult {
    /// Pose of the board.
    pub cam_from_board: Isometry3<f64>,
    /// Root mean square residual per coordinate.
    pub residual_rms_px: f64,
    /// Angle between image plane and board.
    pub tilt_rad: f64,
    /// Direction in the image towards which the board recedes; without meaning at tilt 0.
    pub slot_rad: f64,
    /// Of the corners as seen. `None` if the board is too frontal to have one.
    pub principal_line: Option<PrincipalLine>,
    /// Signed distance of this line from `pl_weighted`.
    pub pl_residual_px: Option<f64>,
    /// From this view alone, corners undistorted, principal point given.
    pub focal: Option<FocalLength>,
    /// The same from the corners as seen and `pl_unweighted`, as the source paper has it.
    pub focal_as_seen: Option<FocalLength>,
}

/// How the views' focal lengths go together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Focal {
    /// All views have the camera's.
    Common,
    /// Each view has its own, [`ViewResult::focal`]; the camera's is their mean.
    Varying {
        /// Sample standard deviation over the views.
        scatter_px: f64,
    },
}

/// A lens with stated and checked uncertainty.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The picture this holds for.
    pub image_size: ImageSize,
    /// Lens model chosen.
    pub model: LensModel,
    /// The lens.
    pub camera: Camera,
    /// Whether the camera's focal length is that of every view.
    pub focal: Focal,
    /// Covariance of the lens parameters, doubt about the model included; zero for those not in
    /// `model`. If the focal length varies, its variance is that of one view's own, not the scatter. With square pixels fx and fy are one parameter and fully correlated.
    pub covariance: SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>,
    /// The same with the doubt about parameters that `model` holds at zero.
    pub covariance_all: SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>,
    /// Root mean square reprojection residual per coordinate.
    pub rms_px: f64,
    /// `√(cost/dof)`: the corners' error as a multiple of what their covariances claim.
    pub noise_factor: f64,
    /// Typical error of a corner coordinate: `noise_factor` times the root mean square of its claimed sd.
    pub noise_px: f64,
    /// Error of the corners beyond what the detector claims, from the print, the board's flatness or the
    /// finest shape of the lens; zero if nothing speaks for one.
    pub excess_px: f64,
    /// All models tried, simplest first.
    pub candidates: Vec<ModelFit>,
    /// By every method.
    pub principal_point: PrincipalPoints,
    /// One per view given, in order.
    pub views: Vec<ViewResult>,
    /// Uncertainty of projection over the picture.
    pub projection_sd: ProjectionSd,
    /// Leaving each view out: observed over expected shift of the principal point.
    pub skip_one_ratio: Option<f64>,
    /// Share of the picture covered by any board.
    pub coverage: f64,
    /// Honesty checks.
    pub findings: Vec<Finding>,
    /// What the findings amount to.
    pub verdict: Verdict,
}

impl Calibration {
    /// The camera as it was for one view: with that view's own focal length if it varies.
    pub fn camera_of(&self, view: usize) -> Camera {
        let own = self.views.get(view).and_then(|view| view.focal);
        match (self.focal, own) {
            (Focal::Varying { .. }, Some(own)) => {
                Camera { f_px: Vector2::repeat(own.f_px), ..self.camera }
            }
            _ => self.camera,
        }
    }

    /// Standard deviation of each lens parameter.
    pub fn sd(&self) -> [f64; LENS_PARAMETERS] {
        std::array::from_fn(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }

    /// Covariance of the principal point.
    pub fn pp_covariance_px2(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(2, 2).into()
    }
}
