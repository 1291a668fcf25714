//! A calibration as its JSON says it: the page shows the same numbers as the file.

use nalgebra::{
    Isometry3, Matrix2, Matrix4, Point2, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector2,
};
use serde::Deserialize;

use crate::{
    board::Checkerboard,
    calibration::{LensModel, import::named_covariance},
    geometry::{Camera, Corner, LENS_PARAMETERS, PrincipalLine},
};

/// `boresight.calibration/1`, as far as the page shows it. What an older file does not have is `None`.
#[derive(Clone, Debug, Deserialize)]
pub struct CalibrationFile {
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// The board.
    pub board: Option<BoardFacts>,
    /// Stable name of the verdict.
    pub verdict: String,
    /// What speaks for or against it, with what to do.
    #[serde(default)]
    pub findings: Vec<FindingFacts>,
    /// The lens; `None` if there is no calibration.
    pub result: Option<LensFacts>,
    /// By every method.
    pub principal_point: Option<PrincipalPointFacts>,
    /// Uncertainty of projection over the picture.
    pub projection_sd_px: Option<ProjectionFacts>,
    /// Share of the picture covered by any board.
    pub coverage: Option<f64>,
    /// Every picture, used or not.
    #[serde(default)]
    pub views: Vec<ViewFacts>,
}

/// The board that was held up.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct BoardFacts {
    /// Inner corners in a row.
    pub columns: u32,
    /// Inner corners in a column.
    pub rows: u32,
    /// Side of a square in millimetres.
    pub square_mm: f64,
}

/// One finding in words.
#[derive(Clone, Debug, Deserialize)]
pub struct FindingFacts {
    /// Stable name.
    pub code: String,
    /// `info`, `care` or `bad`.
    pub severity: String,
    /// What was seen.
    pub message: String,
    /// What to do.
    pub action: String,
}

/// The lens.
#[derive(Clone, Debug, Deserialize)]
pub struct LensFacts {
    /// Name of the lens model.
    pub model: String,
    /// Whether every view has its own focal length.
    pub focal: Option<FocalFacts>,
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// Distortion.
    pub distortion: Coefficients,
    /// Standard deviations.
    pub sigma: SigmaFacts,
    /// Covariance of the named lens parameters, doubt about those that the model holds at zero included.
    pub covariance_all: Option<serde_json::Value>,
    /// Root mean square reprojection residual per coordinate.
    pub rms_px: Option<f64>,
    /// Typical error of a corner coordinate.
    pub noise_px: Option<f64>,
    /// The part of it beyond what the detector claims.
    pub excess_px: Option<f64>,
    /// Error of the corners as a multiple of what is claimed, that part included.
    pub noise_factor: Option<f64>,
}

/// How the views' focal lengths go together.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct FocalFacts {
    /// Whether each view has its own.
    pub varies: bool,
    /// Their standard deviation.
    pub scatter_px: Option<f64>,
}

/// Distortion coefficients, or their standard deviations.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
#[expect(missing_docs, reason = "OpenCV's names")]
pub struct Coefficients {
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
}

/// Standard deviations of the lens.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct SigmaFacts {
    /// Of the focal length along x and y.
    pub f_px: [f64; 2],
    /// Of the principal point.
    pub pp_px: [f64; 2],
    /// Of the distortion.
    #[serde(flatten)]
    pub distortion: Coefficients,
}

/// The principal point by every method.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
#[expect(missing_docs, reason = "named as in `calibration::PrincipalPoints`")]
pub struct PrincipalPointFacts {
    pub pl_unweighted: Option<EstimateFacts>,
    pub pl_weighted: Option<EstimateFacts>,
    pub pl_ring: Option<EstimateFacts>,
    pub free_homography: Option<EstimateFacts>,
    pub bundle: Option<EstimateFacts>,
    pub zhang: Option<EstimateFacts>,
}

/// One estimate of the principal point.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct EstimateFacts {
    /// The point.
    pub px: [f64; 2],
    /// Standard deviations.
    pub sigma_px: Option<[f64; 2]>,
    /// Covariance.
    pub covariance_px2: Option<[[f64; 2]; 2]>,
}

/// Uncertainty of projection.
#[derive(Clone, Debug, Deserialize)]
pub struct ProjectionFacts {
    /// Mean over the picture.
    pub mean: f64,
    /// Largest.
    pub max: f64,
    /// `[x, y, sd]`, row by row; places without a ray are left out.
    #[serde(default)]
    pub grid: Vec<[f64; 3]>,
}

/// What became of one picture.
#[derive(Clone, Debug, Deserialize)]
pub struct ViewFacts {
    /// Its name.
    pub name: String,
    /// Whether it is part of the result.
    pub used: bool,
    /// Why not.
    pub reason: Option<String>,
    /// Where the board was.
    pub cam_from_board: Option<PoseFacts>,
    /// Where the board's outermost inner corners are.
    pub outline_px: Option<[[f64; 2]; 4]>,
    /// Angle between image plane and board, degrees.
    pub tilt_deg: Option<f64>,
    /// Direction in which the board recedes, degrees.
    pub slot_deg: Option<f64>,
    /// Root mean square residual per coordinate.
    pub rms_px: Option<f64>,
    /// Its principal line.
    pub pl: Option<LineFacts>,
    /// Signed distance of the line from the weighted intersection.
    pub pl_residual_px: Option<f64>,
    /// Focal length from this view alone.
    pub focal_px: Option<f64>,
    /// Its standard deviation.
    pub focal_sigma_px: Option<f64>,
}

/// Pose of the board.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct PoseFacts {
    /// Quaternion, real part first.
    pub rotation_wxyz: [f64; 4],
    /// Translation.
    pub translation_m: [f64; 3],
}

/// A principal line.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct LineFacts {
    /// Direction of the normal.
    pub phi_rad: f64,
    /// Signed distance from the origin along the normal.
    pub c_px: f64,
    /// The origin.
    pub x0_px: [f64; 2],
}

/// A line in the picture: a point on it and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    pub(super) through_px: Point2<f64>,
    pub(super) along: Vector2<f64>,
}

impl LineFacts {
    pub(super) fn line(&self) -> Line {
        let (sin, cos) = self.phi_rad.sin_cos();
        let [x, y] = self.x0_px;
        Line {
            through_px: Point2::new(x + self.c_px * cos, y + self.c_px * sin),
            along: Vector2::new(-sin, cos),
        }
    }

    /// The line for intersecting it with others without weights.
    pub(super) fn principal_line(&self, slot_rad: f64) -> PrincipalLine {
        PrincipalLine {
            phi_rad: self.phi_rad,
            c_px: self.c_px,
            v_px: 0.0,
            d_px: 0.0,
            vanishing_point_px: self.line().through_px,
            origin_px: self.x0_px.into(),
            tilt_azimuth_rad: slot_rad,
            covariance: Matrix4::zeros(),
        }
    }
}

impl ViewFacts {
    pub(super) fn pose(&self) -> Option<Isometry3<f64>> {
        let PoseFacts { rotation_wxyz: [w, i, j, k], translation_m: [x, y, z] } =
            self.cam_from_board?;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-9)?;
        Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }

    /// The lens as it was for this view: with its own focal length if that varies.
    pub(super) fn camera(&self, lens: &LensFacts) -> Camera {
        match self.focal_px {
            Some(f_px) if lens.focal_varies() => {
                Camera { f_px: Vector2::repeat(f_px), ..lens.camera() }
            }
            _ => lens.camera(),
        }
    }

    pub(super) fn outline(&self) -> Option<[Point2<f64>; 4]> {
        self.outline_px.map(|corners| corners.map(Point2::from))
    }
}

impl EstimateFacts {
    pub(super) fn point_px(&self) -> Point2<f64> {
        self.px.into()
    }

    /// Covariance; from the standard deviations alone if there is no better.
    pub(super) fn covariance_px2(&self) -> Option<Matrix2<f64>> {
        match (self.covariance_px2, self.sigma_px) {
            (Some([[xx, xy], [yx, yy]]), _) => Some(Matrix2::new(xx, xy, yx, yy)),
            (None, Some([x, y])) => Some(Matrix2::new(x * x, 0.0, 0.0, y * y)),
            (None, None) => None,
        }
    }
}

impl LensFacts {
    pub(super) fn camera(&self) -> Camera {
        let Coefficients { k1, k2, p1, p2, k3 } = self.distortion;
        let [fx, fy] = self.f_px;
        let [cx, cy] = self.pp_px;
        Camera::from_lens_parameters(&[fx, fy, cx, cy, k1, k2, p1, p2, k3])
    }

    pub(super) fn covariance_all(&self) -> Option<SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>> {
        named_covariance(self.covariance_all.as_ref()?)
    }

    pub(super) fn lens_model(&self) -> Option<LensModel> {
        LensModel::ALL.into_iter().find(|model| model.code() == self.model)
    }

    /// Whether both focal lengths are one parameter.
    pub(super) fn square_pixels(&self) -> bool {
        (self.f_px[0] - self.f_px[1]).abs() <= 1e-9 * self.f_px[0].abs()
    }

    /// The corners as the adjustment weighed them: with the error beyond what the detector claims.
    pub(super) fn weighed(&self, corners: &[Corner]) -> Vec<Corner> {
        let excess_px = match (self.excess_px, self.noise_factor) {
            (Some(excess_px), Some(noise_factor)) if noise_factor > 0.0 => excess_px / noise_factor,
            _ => 0.0,
        };
        let more = Matrix2::from_diagonal_element(excess_px * excess_px);
        let weighed = |c: &Corner| Corner { px: c.px, covariance_px2: c.covariance_px2 + more };
        corners.iter().map(weighed).collect()
    }

    /// Whether the views have a focal length each.
    pub(super) fn focal_varies(&self) -> bool {
        self.focal.is_some_and(|focal| focal.varies)
    }
}

impl CalibrationFile {
    /// Reads them from JSON.
    ///
    /// # Errors
    ///
    /// If fields are missing or of another type.
    pub fn read(report: &serde_json::Value) -> Result<Self, serde_json::Error> {
        Self::deserialize(report)
    }

    /// Width and height.
    pub(super) fn size_px(&self) -> (f64, f64) {
        (f64::from(self.image_size[0].max(1)), f64::from(self.image_size[1].max(1)))
    }

    /// The board, if it is one.
    pub(super) fn checkerboard(&self) -> Option<Checkerboard> {
        let BoardFacts { columns, rows, square_mm } = self.board?;
        let count = |count: u32| u16::try_from(count).ok();
        Checkerboard::new(count(columns)?, count(rows)?, square_mm / 1000.0).ok()
    }

    /// The views that are part of the result, with their numbers from 1.
    pub(super) fn used(&self) -> impl Iterator<Item = (usize, &ViewFacts)> {
        self.views.iter().filter(|view| view.used).enumerate().map(|(i, view)| (i + 1, view))
    }
}
