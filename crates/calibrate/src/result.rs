use nalgebra::{Isometry3, Matrix2, Point2, Point3, Vector2};

use super::{
    acceptance::Acceptance,
    check::{
        finding::{Finding, FindingCode, Verdict},
        projection_sd::{ProjectionSd, ValidArea},
    },
    solve::{lens_model::LensModel, model_choice::ModelFit},
};
use boresight_geometry::{
    BoardOutline, Camera, FocalLength, LENS_PARAMETERS, LensMatrix, LensParts, PrincipalLine,
    boards::Board, frame::ImageSize,
};

/// Estimate of the principal point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalPointEstimate {
    /// Position in pixels.
    pub px: Point2<f64>,
    /// Covariance in px², if given by the method.
    pub covariance_px2: Option<Matrix2<f64>>,
    /// Focal length along x and y in pixels, if given by the method.
    pub f_px: Option<Vector2<f64>>,
}

/// Principal point by every method, for comparison. The result is `bundle`, or `free_homography` if
/// the focal length varies.
///
/// The `pl_` estimates use distorted corners: distortion biases them towards the mean position of
/// the boards (`docs/method.md`, section 0, offset law).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PrincipalPoints {
    /// Intersection of the principal lines with equal weights.
    pub pl_unweighted: Option<PrincipalPointEstimate>,
    /// Intersection of the principal lines, weighted by inverse variances.
    pub pl_weighted: Option<PrincipalPointEstimate>,
    /// Estimate from principal lines and the ring of ±45° vanishing points.
    pub pl_ring: Option<PrincipalPointEstimate>,
    /// Intersection of the principal lines of corners undistorted by the free homographies, which
    /// assume no common focal length.
    pub free_homography: Option<PrincipalPointEstimate>,
    /// Estimate by bundle adjustment.
    pub bundle: Option<PrincipalPointEstimate>,
    /// Zhang's method, refined with k1, k2 and independent fx, fy.
    pub zhang: Option<PrincipalPointEstimate>,
}

/// Result for a view.
#[derive(Clone, Debug)]
pub struct ViewResult {
    /// True for each seen corner, in the board's numbering order.
    pub is_seen: Vec<bool>,
    /// Pose of the board, metres.
    pub cam_from_board: Isometry3<f64>,
    /// Root mean square residual per coordinate, in pixels.
    pub residual_rms_px: f64,
    /// Factor on the covariances of the view's corners, from the residuals; 1 overall.
    pub noise: f64,
    /// Angle between image plane and board, `[0, π/2]`.
    pub tilt_rad: f64,
    /// Direction in the image in which the board recedes, `[0, 2π)`; arbitrary at tilt 0.
    pub tilt_azimuth_rad: f64,
    /// Principal line of the distorted corners. `None` if the board faces the camera.
    pub principal_line: Option<PrincipalLine>,
    /// Signed distance of the principal line from [`PrincipalPoints::pl_weighted`], in pixels.
    pub pl_residual_px: Option<f64>,
    /// Focal length of this view alone, from undistorted corners and the resulting principal point.
    pub focal: Option<FocalLength>,
    /// Focal length of this view alone as in Chuang 2021, from distorted corners and
    /// [`PrincipalPoints::pl_unweighted`].
    pub focal_as_seen: Option<FocalLength>,
}

/// Focal length over the views: common or varying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Focal {
    /// All views have the camera's focal length.
    Common,
    /// Separate focal length in every view, [`ViewResult::focal`]; the camera has their mean.
    Varying {
        /// Sample standard deviation over the views, in pixels.
        scatter_px: f64,
    },
}

/// Lens with stated and checked uncertainty.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// Size of the calibrated pictures.
    pub image_size: ImageSize,
    /// Points of the observed board in metres, in numbering order: the stated ones, unless the
    /// board is bent or stretched by more than chance. Residuals are from these.
    pub board_m: Vec<Point3<f64>>,
    /// Chosen lens model.
    pub model: LensModel,
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// [`Focal::Common`] if every view has the camera's focal length.
    pub focal: Focal,
    /// Covariance of the lens parameters in the order of [`LENS_PARAMETERS`], with model
    /// uncertainty included; zero for parameters outside `model`. With square pixels, fx and fy are
    /// one parameter and fully correlated. If the focal length varies, its variance is a single
    /// view's, not the scatter.
    pub covariance: LensMatrix,
    /// Covariance as [`Self::covariance`], including the uncertainty of parameters fixed at zero by
    /// `model`.
    pub covariance_all: LensMatrix,
    /// Root mean square reprojection residual per coordinate, in pixels.
    pub rms_px: f64,
    /// σ₀ of the adjustment, see [`Bundle::noise_factor`](crate::Bundle::noise_factor).
    pub noise_factor: f64,
    /// Typical standard deviation of a corner coordinate in pixels: `noise_factor` times the root
    /// mean square of the stated ones.
    pub noise_px: f64,
    /// Standard deviation in pixels of errors beyond the detector: in the print, the flatness of
    /// the board or the fine shape of the lens. Zero if the residuals show none.
    pub excess_px: f64,
    /// Fitted models, simplest first.
    pub candidates: Vec<ModelFit>,
    /// Principal point by every method.
    pub principal_point: PrincipalPoints,
    /// Results of the given views, in order.
    pub views: Vec<ViewResult>,
    /// Standard deviation of projection over the picture.
    pub projection_sd: ProjectionSd,
    /// 95 % quantile of the root mean square error of projection over the area covered by boards,
    /// in pixels; [`ProjectionSd::bound_px`] covers the whole picture. `None` if no cell of the
    /// grid is covered.
    pub covered_bound_px: Option<f64>,
    /// Part of the picture with sufficiently certain projection.
    pub valid_area: ValidArea,
    /// Least relative change of the focal length from the first view to the last that would have
    /// been reported. `None` if there are too few views.
    pub visible_drift: Option<f64>,
    /// Ratio of the observed to the expected shift of the principal point when each view is left
    /// out in turn; near 1 if the views agree. `None` below four distinct views.
    pub skip_one_ratio: Option<f64>,
    /// Standard deviation of a corner coordinate in pixels, measured from the scatter of a board
    /// held still; `None` if unmeasured.
    pub noise_floor_px: Option<f64>,
    /// Verdict on the goal; `None` without one.
    pub acceptance: Option<Acceptance>,
    /// Fraction of the picture covered by boards, 0 to 1.
    pub coverage: f64,
    /// Results of the trust checks.
    pub findings: Vec<Finding>,
    /// Verdict by the worst finding.
    pub verdict: Verdict,
}

impl Calibration {
    /// True if a focal length seems to differ between views, alone or as one of several causes: the
    /// scene behind the board can tell, see [`CalibrationParams::scene`](crate::CalibrationParams).
    #[doc(hidden)]
    pub fn asks_for_scene(&self) -> bool {
        let codes = ["FOCUS-MOVED", "VIEWS-MIXED"];
        self.findings.iter().any(|finding| match &finding.code {
            FindingCode::CauseUnclear { candidates, .. } => {
                candidates.iter().flatten().any(|code| codes.contains(code))
            }
            code => codes.contains(&code.code()),
        })
    }

    /// Longer side of the pictures, in pixels: a ray displaced by more is in none of them.
    pub(crate) fn longer_side_px(&self) -> f64 {
        f64::from(self.image_size.width_px.max(self.image_size.height_px))
    }

    /// True if a ray may be anywhere in the picture: the views don't determine the lens.
    pub(crate) fn is_undetermined(&self) -> bool {
        self.covered_bound_px.is_some_and(|px| px >= self.longer_side_px())
    }

    /// Camera of a view: with the view's own focal length if it varies.
    pub fn camera_of(&self, view: usize) -> Camera {
        let of_view = self.views.get(view).and_then(|view| view.focal);
        match (self.focal, of_view) {
            (Focal::Varying { .. }, Some(of_view)) => {
                Camera { f_px: Vector2::repeat(of_view.f_px), ..self.camera }
            }
            _ => self.camera,
        }
    }

    /// Image of the outline of each view's seen part of `board`; `None` where the lens model
    /// doesn't reach it.
    pub fn outlines(&self, board: &Board) -> Vec<Option<BoardOutline>> {
        let board_m = board.corners_in_board_m();
        let outline = |(index, view): (usize, &ViewResult)| {
            let camera = self.camera_of(index);
            let image = |point_m: &Point2<f64>| {
                let image = camera.project_board_point(&view.cam_from_board, point_m);
                image.map_or(Point2::new(f64::NAN, f64::NAN), |image| image.px)
            };
            let px: Vec<_> = board_m.iter().map(image).collect();
            board.target().outline(&px, &|index| view.is_seen.get(index) == Some(&true))
        };
        self.views.iter().enumerate().map(outline).collect()
    }

    /// 95 % quantile of the root mean square error of projection over the picture, in pixels.
    /// `None` if the lens model folds inside the picture, so that the error is unbounded.
    pub fn picture_bound_px(&self) -> Option<f64> {
        let sd = &self.projection_sd;
        (sd.unmapped == 0).then_some(sd.bound_px)
    }

    /// Standard deviation of each lens parameter, in the order of [`LENS_PARAMETERS`].
    pub fn sd(&self) -> [f64; LENS_PARAMETERS] {
        std::array::from_fn(|i| self.covariance[(i, i)].max(0.0).sqrt())
    }

    /// 2×2 covariance of the principal point, px².
    pub fn pp_covariance_px2(&self) -> Matrix2<f64> {
        self.covariance.pp()
    }
}
