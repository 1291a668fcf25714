//! `boresight.calibration/1`: a calibration as JSON, for this program and any reader.
//!
//! Lengths are in pixels unless the name says otherwise; (0, 0) is the centre of the top-left pixel
//! and y points down. Fields are only ever added to the schema, so readers skip unknown ones.

use nalgebra::{
    Isometry3, Matrix2, Point2, Point3, Quaternion, Translation3, UnitQuaternion, Vector2,
};
use serde::{Deserialize, Serialize, Serializer, ser::SerializeMap};
use serde_json::Value;

use super::{
    board_entry::BoardEntry,
    named_covariance::{LensCovariance, NamedCovariance},
    nullable::nullable,
    schema::{self, NotRead},
};
use boresight_calibrate::{LensModel, Verdict, is_unfinished};
use boresight_geometry::{Camera, Corner, Distortion, LensKind, boards::Board};

/// Name and version of the format.
pub const CALIBRATION_SCHEMA: &str = "boresight.calibration/1";
/// Finding about another program's calibration.
pub(super) const IMPORTED: &str = "IMPORTED";

/// A calibration, or the reason why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct CalibrationFile {
    /// [`CALIBRATION_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.calibration/1")))]
    pub schema: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// The board.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub board: Option<BoardEntry>,
    /// `good`, `care` or `untrustworthy`; empty if an older file doesn't say.
    #[serde(default)]
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["good", "care", "untrustworthy"])))]
    pub verdict: String,
    /// What speaks for or against the calibration, with what to do.
    #[serde(default)]
    pub findings: Vec<FindingEntry>,
    /// The lens; null if there is no calibration.
    pub result: Option<LensEntry>,
    /// Every lens model that was tried, simplest first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub candidates: Option<Vec<CandidateEntry>>,
    /// The principal point by every method; null if there is no calibration.
    pub principal_point: Option<PrincipalPointEntry>,
    /// Uncertainty of projection over the picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub projection_sd_px: Option<ProjectionEntry>,
    /// 95 % bound of the root mean square error of projection.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound_px: Option<BoundEntry>,
    /// Relative change of the focal length from the first view to the last that would have been
    /// reported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_drift: Option<f64>,
    /// Whether the calibration meets the goal that was set for it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub acceptance: Option<AcceptanceEntry>,
    /// Typical error that was aimed at, one standard deviation; the usual 0.3 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub typical_goal_px: Option<f64>,
    /// The part of the picture in which the calibration holds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valid_area: Option<ValidAreaEntry>,
    /// Share of the picture covered by any board, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Every picture, used or not.
    #[serde(default)]
    pub views: Vec<ViewEntry>,
    /// Where a session's pictures came from: its `--source`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The calibration that a session compares with or replaces; null if there is none.
    #[serde(default, deserialize_with = "nullable", skip_serializing_if = "Option::is_none")]
    pub replaces: Option<Option<String>>,
    /// A session's live camera; null for every other source.
    #[serde(default, deserialize_with = "nullable", skip_serializing_if = "Option::is_none")]
    pub camera: Option<Option<CameraEntry>>,
}

/// One finding in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct FindingEntry {
    /// Stable name, such as `COVERAGE-LOW`.
    pub code: String,
    /// `info`, `care` or `bad`.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["info", "care", "bad"])))]
    pub severity: String,
    /// What was found.
    pub message: String,
    /// What to do.
    pub action: String,
}

/// Whether a goal is met. Errors are 95 % bounds in the unit named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct AcceptanceEntry {
    /// The goal, as `--accept` takes it.
    pub goal: String,
    /// Whether the bound is within the goal.
    pub met: bool,
    /// `px` or `mm`.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["px", "mm"])))]
    pub unit: String,
    /// Largest error accepted.
    pub limit: f64,
    /// Bound of the error; null if it can't be told.
    pub bound: Option<f64>,
    /// The lens's part of it.
    pub lens: Option<f64>,
    /// The part of the board's square size.
    pub scale: Option<f64>,
    /// The result in words.
    pub message: String,
    /// What to do; empty if the goal is met.
    pub action: String,
}

/// The lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LensEntry {
    /// Stable name of the lens model.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["none", "k1", "k1k2", "k1k2p1p2", "k1k2p1p2k3", "rational",
        "fisheye", "fisheye_k1", "fisheye_k1k2", "fisheye_k1k2k3k4"])))]
    pub model: String,
    /// Whether each view has its own focal length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focal: Option<FocalEntry>,
    /// Focal length along x and y; their mean if each view has its own.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// OpenCV's distortion coefficients.
    pub distortion: DistortionEntry,
    /// Standard deviations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma: Option<SigmaEntry>,
    /// Covariance of the free lens parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<NamedCovariance>,
    /// Covariance of all lens parameters, doubt about those that the model holds at zero included.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_all: Option<NamedCovariance>,
    /// Root mean square reprojection residual per coordinate.
    pub rms_px: Option<f64>,
    /// Typical error of a corner coordinate.
    pub noise_px: Option<f64>,
    /// The part of it beyond what the detector claims.
    pub excess_px: Option<f64>,
    /// Error of the corners as a multiple of what the detector claims.
    pub noise_factor: Option<f64>,
    /// Error of a corner coordinate as measured on a board held still.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_px: Option<f64>,
}

/// Whether the views share one focal length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct FocalEntry {
    /// True if each view has its own.
    pub varies: bool,
    /// Sample standard deviation over the views.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scatter_px: Option<f64>,
}

/// OpenCV's distortion coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[expect(missing_docs, reason = "OpenCV's names")]
pub struct DistortionEntry {
    pub k1: f64,
    pub k2: f64,
    pub p1: f64,
    pub p2: f64,
    pub k3: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k4: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k5: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k6: f64,
    /// Whether these are coefficients of OpenCV's fisheye model, `k1 k2 k3 k4`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fisheye: bool,
}

impl From<Distortion> for DistortionEntry {
    fn from(distortion: Distortion) -> Self {
        let Distortion { kind, k1, k2, p1, p2, k3, k4, k5, k6 } = distortion;
        Self { k1, k2, p1, p2, k3, k4, k5, k6, fisheye: kind.is_fisheye() }
    }
}

impl From<DistortionEntry> for Distortion {
    fn from(entry: DistortionEntry) -> Self {
        let DistortionEntry { k1, k2, p1, p2, k3, k4, k5, k6, fisheye } = entry;
        let kind = LensKind::of_fisheye(fisheye);
        Self { kind, k1, k2, p1, p2, k3, k4, k5, k6 }
    }
}

// By reference, for serde.
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Standard deviations of the lens parameters; 0 for those that the model holds fixed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[expect(missing_docs, reason = "OpenCV's names")]
pub struct SigmaEntry {
    /// Of the focal length along x and y.
    pub f_px: [f64; 2],
    /// Of the principal point.
    pub pp_px: [f64; 2],
    #[serde(default)]
    pub k1: f64,
    #[serde(default)]
    pub k2: f64,
    #[serde(default)]
    pub p1: f64,
    #[serde(default)]
    pub p2: f64,
    #[serde(default)]
    pub k3: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k4: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k5: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k6: f64,
}

/// A lens model that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct CandidateEntry {
    /// Stable name of the lens model.
    pub model: String,
    /// Weight in the average over the models, 0 to 1.
    pub weight: Option<f64>,
    /// Sum of the squared residuals, each over its variance.
    pub cost: Option<f64>,
    /// Error of the corners as a multiple of what the detector claims.
    pub noise_factor: Option<f64>,
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// OpenCV's distortion coefficients.
    pub distortion: DistortionEntry,
}

/// The principal point by every method; null where a method gives none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(default)]
#[expect(missing_docs, reason = "named as in `calibration::PrincipalPoints`")]
pub struct PrincipalPointEntry {
    pub pl_unweighted: Option<EstimateEntry>,
    pub pl_weighted: Option<EstimateEntry>,
    pub pl_ring: Option<EstimateEntry>,
    pub free_homography: Option<EstimateEntry>,
    pub bundle: Option<EstimateEntry>,
    pub zhang: Option<EstimateEntry>,
}

/// One estimate of the principal point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct EstimateEntry {
    /// The point.
    pub px: [f64; 2],
    /// Standard deviations, where the method gives some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_px: Option<[f64; 2]>,
    /// Covariance, where the method gives one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance_px2: Option<[[f64; 2]; 2]>,
    /// Focal length, where the method gives one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_px: Option<FocalLengths>,
}

/// A focal length: one number for square pixels, else along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(untagged)]
pub enum FocalLengths {
    /// For both axes.
    Common(f64),
    /// Along x and y.
    Each([f64; 2]),
}

/// Uncertainty of projection: standard deviation of a ray's image, in pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ProjectionEntry {
    /// Mean over the picture.
    pub mean: f64,
    /// Largest in the picture.
    pub max: f64,
    /// `[x, y, sd]`, row by row, without the pixels that no ray reaches.
    #[serde(default)]
    pub grid: Vec<[f64; 3]>,
}

/// 95 % bound of the root mean square error of projection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct BoundEntry {
    /// Over the whole picture; null if the lens model folds inside it.
    pub picture: Option<f64>,
    /// Over the part that boards have covered; null if that's none of it.
    pub covered: Option<f64>,
}

/// The part of the picture in which projection is known well enough.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ValidAreaEntry {
    /// Error that its points stay below, each with 95 % probability: the goal of `--accept`, or the
    /// limit of the verdict `good`, 0.2 % of the picture's longer side.
    pub goal_px: f64,
    /// Its share of the picture, 0 to 1.
    pub share: f64,
    /// 95 % bound of the root mean square error over it; null if it's empty.
    pub bound_px: Option<f64>,
}

/// One picture. One that was not used has no more than `name`, `number`, `used` and `reason`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ViewEntry {
    /// File name of the picture.
    pub name: String,
    /// What its session calls it; if it isn't there, its place in `views`, from 1.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub number: Option<usize>,
    /// Whether the calibration uses it.
    pub used: bool,
    /// Why not; null if it is used.
    pub reason: Option<String>,
    /// Pose of the board.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub cam_from_board: Option<PoseEntry>,
    /// Image of the outermost inner corners that were seen, in order around them.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub outline_px: Option<[[f64; 2]; 4]>,
    /// Angle between image plane and board, in degrees.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub tilt_deg: Option<f64>,
    /// Direction in the image in which the board recedes, in degrees from x towards y.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub slot_deg: Option<f64>,
    /// Root mean square reprojection residual per coordinate.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub rms_px: Option<f64>,
    /// Factor on the variances of its corners, from its residuals; 1 on the whole.
    #[serde(default)]
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub noise: Option<f64>,
    /// Principal line of the corners as seen; null if the board is too frontal to have one.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub pl: Option<LineEntry>,
    /// Signed distance of the line from the weighted intersection of all lines.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub pl_residual_px: Option<f64>,
    /// Focal length from this view alone, with the lens modelled.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub focal_px: Option<f64>,
    /// Its standard deviation.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub focal_sigma_px: Option<f64>,
    /// Focal length from this view alone, from the corners as seen.
    #[cfg_attr(feature = "schemas", schemars(skip_serializing_if = "Option::is_none"))]
    pub focal_as_seen_px: Option<f64>,
}

/// Pose of a board in the camera's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct PoseEntry {
    /// Unit quaternion, real part first.
    pub rotation_wxyz: [f64; 4],
    /// Translation in metres.
    pub translation_m: [f64; 3],
}

/// A principal line: the points at distance `c_px` from `x0_px` along the normal `(cos phi, sin
/// phi)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LineEntry {
    /// Direction of the normal.
    pub phi_rad: f64,
    /// Signed distance from `x0_px` along the normal.
    pub c_px: f64,
    /// Standard deviation of `phi_rad`.
    pub sigma_phi_rad: Option<f64>,
    /// Standard deviation of `c_px`.
    pub sigma_c_px: Option<f64>,
    /// The point from which the line is measured: the middle of the picture.
    pub x0_px: [f64; 2],
    /// The line's point nearest to `x0_px`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foot_px: Option<[f64; 2]>,
}

/// Mode and locked controls of a live camera; controls are in the driver's units, null if not
/// locked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct CameraEntry {
    /// Pixel format.
    pub format: String,
    /// Frames per second; null if the driver doesn't say.
    pub rate_hz: Option<f64>,
    /// Distance at which the lens is sharp.
    pub focus: Option<i64>,
    /// Focal length.
    pub zoom: Option<i64>,
    /// Exposure time.
    pub exposure: Option<i64>,
    /// Gain.
    pub gain: Option<i64>,
    /// White balance.
    pub white_balance: Option<i64>,
}

impl CalibrationFile {
    /// True if the calibration isn't wrong but needs more views: see [`is_unfinished`].
    pub fn is_unfinished(&self) -> bool {
        let bad = self.findings.iter().filter(|finding| finding.severity == "bad");
        is_unfinished(bad.map(|finding| finding.code.as_str()))
    }

    /// True if the lens comes from another program's file, and was never judged.
    pub fn is_imported(&self) -> bool {
        self.findings.iter().any(|finding| finding.code == IMPORTED)
    }

    /// True if the lens was judged and may be used: neither untrustworthy nor unfinished.
    pub fn is_usable(&self) -> bool {
        let is_good_enough = matches!(self.known_verdict(), Some(Verdict::Good | Verdict::Care));
        is_good_enough && !self.is_unfinished() && !self.is_imported()
    }

    /// Reads the tree of a JSON file. Unknown fields are skipped.
    ///
    /// # Errors
    ///
    /// [`NotRead`] if it is of another schema, or a field is missing or of another type.
    pub fn read(tree: &Value) -> Result<Self, NotRead> {
        let file: Self = schema::read(tree, CALIBRATION_SCHEMA)?;
        if !has_sane_numbers(tree) {
            return Err(NotRead::Field { reason: "a number is far too large".into() });
        }
        match file.nonsense() {
            None => Ok(file),
            Some(reason) => Err(NotRead::Field { reason: reason.into() }),
        }
    }

    /// Description of an impossible value; `None` if everything makes sense.
    fn nonsense(&self) -> Option<&'static str> {
        const LARGEST_SIDE_PX: u32 = 1 << 24;
        const LARGEST_PX: f64 = 1e9;
        let is_size = |value: f64| (0.0..LARGEST_PX).contains(&value);
        if self.image_size.iter().any(|side| !(1..=LARGEST_SIDE_PX).contains(side)) {
            return Some("image_size is no size of a picture");
        }
        let lens = self.result.as_ref()?;
        if ![lens.f_px[0], lens.f_px[1]].into_iter().all(|f_px| f_px > 0.0 && is_size(f_px)) {
            return Some("f_px is no focal length");
        }
        if !lens.pp_px.into_iter().all(|px| is_size(px.abs())) {
            return Some("pp_px is no place in a picture");
        }
        let errors = [lens.rms_px, lens.noise_px, lens.excess_px, lens.noise_factor];
        if !errors.into_iter().flatten().all(is_size) {
            return Some("rms_px, noise_px, excess_px and noise_factor must not be negative");
        }
        let SigmaEntry { f_px, pp_px, k1, k2, p1, p2, k3, k4, k5, k6 } = lens.sigma?;
        let sds = [&f_px[..], &pp_px, &[k1, k2, p1, p2, k3, k4, k5, k6]].concat();
        if !sds.into_iter().all(is_size) {
            return Some("sigma is no standard deviation");
        }
        None
    }

    /// Builds the tree to write, with fields sorted by name.
    ///
    /// # Errors
    ///
    /// Never for a value of this type: all of its fields have a form in JSON.
    pub fn to_json(&self) -> Result<Value, serde_json::Error> {
        serde_json::to_value(self)
    }

    /// Width and height of the picture in pixels, at least 1.
    pub fn size_px(&self) -> (f64, f64) {
        (f64::from(self.image_size[0].max(1)), f64::from(self.image_size[1].max(1)))
    }

    /// The verdict; `None` if missing, or unknown to this version.
    pub fn known_verdict(&self) -> Option<Verdict> {
        [Verdict::Good, Verdict::Care, Verdict::Untrustworthy]
            .into_iter()
            .find(|verdict| verdict.code() == self.verdict)
    }

    /// The board; `None` if missing or impossible, see [`BoardEntry::board`].
    pub fn checkerboard(&self) -> Option<Board> {
        self.board.as_ref()?.board()
    }

    /// Points of the board in metres as shown by the views, for residuals. `None` without a board.
    pub fn board_m(&self) -> Option<Vec<Point3<f64>>> {
        let flat_m = self.checkerboard()?.corners_in_board_m();
        let found_mm = self.board.as_ref().and_then(|board| board.points_mm.as_ref());
        Some(match found_mm.filter(|points_mm| points_mm.len() == flat_m.len()) {
            Some(points_mm) => {
                points_mm.iter().map(|p| Point3::from(p.map(|mm| mm / 1000.0))).collect()
            }
            None => flat_m.iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect(),
        })
    }

    /// Largest distance of the board's points as found from those of a flat board with even
    /// squares, in millimetres. `None` for such a board: a calibration that corrected nothing.
    pub fn board_off_mm(&self) -> Option<f64> {
        self.board.as_ref()?.points_mm.as_ref()?;
        let flat_m = self.checkerboard()?.corners_in_board_m();
        let found_m = self.board_m()?;
        let off_m = found_m
            .iter()
            .zip(&flat_m)
            .map(|(found, flat)| (found - Point3::new(flat.x, flat.y, 0.0)).norm());
        Some(1000.0 * off_m.fold(0.0, f64::max)).filter(|off_mm| *off_mm > 0.0)
    }

    /// `corners` of `view` as if on a flat board. `None` without a board, or without the view's
    /// pose.
    pub fn as_flat(
        &self,
        lens: &LensEntry,
        view: &ViewEntry,
        mut corners: Vec<Corner>,
    ) -> Option<Vec<Corner>> {
        let (camera, pose) = (view.camera(lens), view.pose()?);
        for (corner, point_m) in corners.iter_mut().zip(self.board_m()?) {
            let bent_px = camera.project(&(pose * point_m));
            let flat_px = camera.px_from_board(&pose, &point_m.xy());
            if let (Some(bent_px), Some(flat_px)) = (bent_px, flat_px) {
                corner.px -= bent_px - flat_px;
            }
        }
        Some(corners)
    }

    /// The used views, each with a number: the session's, or else the index in [`Self::views`],
    /// from 1. The words of findings use the same numbers.
    pub fn used(&self) -> impl Iterator<Item = (usize, &ViewEntry)> {
        let used = (1..).zip(&self.views).filter(|(_, view)| view.used);
        used.map(|(place, view)| (view.number.unwrap_or(place), view))
    }
}

/// True if no number is too large to draw.
fn has_sane_numbers(tree: &Value) -> bool {
    const LARGEST: f64 = 1e15;
    match tree {
        Value::Number(number) => number.as_f64().is_some_and(|number| number.abs() <= LARGEST),
        Value::Array(items) => items.iter().all(has_sane_numbers),
        Value::Object(fields) => fields.values().all(has_sane_numbers),
        Value::Null | Value::Bool(_) | Value::String(_) => true,
    }
}

impl LensEntry {
    /// The lens. With [`focal_varies`](Self::focal_varies), the focal length is the views' mean.
    pub fn camera(&self) -> Camera {
        Camera {
            f_px: self.f_px.into(),
            pp_px: self.pp_px.into(),
            distortion: self.distortion.into(),
        }
    }

    /// Covariance of all lens parameters, including doubt about parameters held at zero; `None`
    /// without a usable covariance in the file.
    pub fn full_covariance(&self) -> Option<LensCovariance> {
        self.covariance_all.as_ref()?.full()
    }

    /// The lens model; `None` if unknown to this version.
    pub fn lens_model(&self) -> Option<LensModel> {
        LensModel::ALL.into_iter().find(|model| model.code() == self.model)
    }

    /// True if both focal lengths are a common parameter.
    pub fn square_pixels(&self) -> bool {
        (self.f_px[0] - self.f_px[1]).abs() <= 1e-9 * self.f_px[0].abs()
    }

    /// True if each view has an individual focal length.
    pub fn focal_varies(&self) -> bool {
        self.focal.is_some_and(|focal| focal.varies)
    }

    /// `corners` of `view` with the covariances used by the adjustment: the detector's, the excess
    /// noise, and the view's.
    pub fn weighted(&self, corners: &[Corner], view: &ViewEntry) -> Vec<Corner> {
        let excess_px = match (self.excess_px, self.noise_factor) {
            (Some(excess_px), Some(noise_factor)) if noise_factor > 0.0 => excess_px / noise_factor,
            _ => 0.0,
        };
        let more = Matrix2::from_diagonal_element(excess_px * excess_px);
        let noise = view.noise.unwrap_or(1.0);
        let weighted =
            |c: &Corner| Corner { covariance_px2: (c.covariance_px2 + more) * noise, ..*c };
        corners.iter().map(weighted).collect()
    }
}

impl EstimateEntry {
    /// Covariance; from the standard deviations alone if the file has no more.
    pub fn covariance_px2(&self) -> Option<Matrix2<f64>> {
        match (self.covariance_px2, self.sigma_px) {
            (Some([[xx, xy], [yx, yy]]), _) => Some(Matrix2::new(xx, xy, yx, yy)),
            (None, Some([x, y])) => Some(Matrix2::new(x * x, 0.0, 0.0, y * y)),
            (None, None) => None,
        }
    }
}

impl ViewEntry {
    /// Pose of the board; `None` if missing, or if the quaternion is zero.
    pub fn pose(&self) -> Option<Isometry3<f64>> {
        let PoseEntry { rotation_wxyz: [w, i, j, k], translation_m: [x, y, z] } =
            self.cam_from_board?;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-9)?;
        Some(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }

    /// The lens at the time of the view: with the view's own focal length, if any.
    pub fn camera(&self, lens: &LensEntry) -> Camera {
        match self.focal_px {
            Some(f_px) if lens.focal_varies() => {
                Camera { f_px: Vector2::repeat(f_px), ..lens.camera() }
            }
            _ => lens.camera(),
        }
    }

    /// Image of the outermost seen inner corners, in order.
    pub fn outline(&self) -> Option<[Point2<f64>; 4]> {
        self.outline_px.map(|corners| corners.map(Point2::from))
    }
}

impl Serialize for ViewEntry {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("name", &self.name)?;
        if let Some(number) = self.number {
            map.serialize_entry("number", &number)?;
        }
        map.serialize_entry("used", &self.used)?;
        map.serialize_entry("reason", &self.reason)?;
        if self.used {
            map.serialize_entry("cam_from_board", &self.cam_from_board)?;
            map.serialize_entry("outline_px", &self.outline_px)?;
            map.serialize_entry("tilt_deg", &self.tilt_deg)?;
            map.serialize_entry("slot_deg", &self.slot_deg)?;
            map.serialize_entry("rms_px", &self.rms_px)?;
            // Absent from earlier versions.
            if let Some(noise) = self.noise {
                map.serialize_entry("noise", &noise)?;
            }
            map.serialize_entry("pl", &self.pl)?;
            map.serialize_entry("pl_residual_px", &self.pl_residual_px)?;
            map.serialize_entry("focal_px", &self.focal_px)?;
            map.serialize_entry("focal_sigma_px", &self.focal_sigma_px)?;
            map.serialize_entry("focal_as_seen_px", &self.focal_as_seen_px)?;
        }
        map.end()
    }
}
