//! `boresight.rig/1`: several cameras and their mutual places as JSON.
//!
//! Lengths are in metres unless the name says otherwise. A pose `a_from_b` maps coordinates in `b`
//! to coordinates in `a`; a camera's axes are x right, y down, z forward.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    board_entry::BoardEntry,
    calibration_file::{FindingEntry, LensEntry, PoseEntry},
    from_calibration::entry,
    named_covariance::NamedCovariance,
    schema::{self, NotRead},
};
use boresight_calibrate::{
    AcceptanceGoal, BOARD_SCALE_SD, CalibrationParams, DEFAULT_TYPICAL_GOAL_PX, KnownLens,
    KnownRig, NotARig, Pair, RigCalibration, RigFinding, Severity, Verdict,
};
use boresight_geometry::{LensParameter, LensParts, Rig, boards::Board};

/// Name and version of the format.
pub const RIG_SCHEMA: &str = "boresight.rig/1";

/// Cameras with fixed mutual places, or the reason why there are none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigFile {
    /// [`RIG_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.rig/1")))]
    pub schema: String,
    /// The board.
    pub board: BoardEntry,
    /// Stretch of the distances of the board's rows against those of its columns; null without a
    /// result.
    pub stretch: Option<f64>,
    /// `good`, `care` or `untrustworthy`.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["good", "care", "untrustworthy"])))]
    pub verdict: String,
    /// What was asked of every pair, and what the weakest one reaches; null without a result.
    pub goal: Option<RigGoalEntry>,
    /// Standard deviation of the size of the board's squares, as a share: it comes on top of the
    /// lengths' deviations below.
    #[serde(default = "usual_scale_sd")]
    pub board_scale_sd: f64,
    /// True if the pictures were rendered.
    #[serde(default)]
    pub simulated: bool,
    /// What speaks for or against the rig, with what to do.
    pub findings: Vec<FindingEntry>,
    /// The cameras; empty without a result.
    pub cameras: Vec<RigCameraEntry>,
    /// Each two cameras.
    pub pairs: Vec<RigPairEntry>,
    /// Places of the board.
    pub instants: Vec<RigInstantEntry>,
    /// Covariance of all cameras' numbers; null with too few instants.
    pub covariance: Option<RigCovariance>,
}

/// See [`BOARD_SCALE_SD`].
fn usual_scale_sd() -> f64 {
    BOARD_SCALE_SD
}

/// Goal of each two cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigGoalEntry {
    /// `px` for rows, `m` for a length.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["px", "m"])))]
    pub unit: String,
    /// Largest acceptable error, met 95 % of the time.
    pub goal: f64,
    /// 95 % bound of the weakest pair; null without an uncertainty.
    pub reached: Option<f64>,
}

/// A camera of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigCameraEntry {
    /// Name of the camera.
    pub name: String,
    /// Width and height of the pictures.
    pub image_size: [u32; 2],
    /// The lens.
    pub lens: LensEntry,
    /// Place of the camera: the rig's frame is that of the camera with the identity.
    pub cam_from_rig: PoseEntry,
    /// Pictures used.
    pub views: usize,
    /// Residuals of the camera alone, per coordinate; null with a known lens.
    pub alone_rms_px: Option<f64>,
}

/// Two cameras of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigPairEntry {
    /// Names of the cameras.
    pub of: [String; 2],
    /// Instants at which both saw the board.
    pub instants: usize,
    /// Rigid motion from the first camera to the second.
    pub second_from_first: PoseEntry,
    /// Distance of the cameras' centres.
    pub baseline_m: f64,
    /// Standard deviation of the distance from the pictures, without that of the board's squares.
    pub baseline_sd_m: Option<f64>,
    /// Row error of the corners that both saw, root mean square.
    pub row_rms_px: Option<f64>,
    /// Standard deviation of a row error over the boards' places, root mean square.
    pub row_sd_px: Option<f64>,
    /// Standard deviation of a point's distance, as a share of the distance.
    pub distance_sd: Option<f64>,
    /// Mean distance of the boards' places from the first camera.
    pub at_m: Option<f64>,
    /// 95 % bound of the error of the asked-for length.
    pub length_bound_m: Option<f64>,
    /// Covariance of a small turn (radians) and shift (metres) of the second camera.
    pub covariance: Option<Vec<Vec<f64>>>,
}

/// Place of the board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigInstantEntry {
    /// Number in the pictures' names.
    pub number: u64,
    /// Place of the board in the rig's frame.
    pub rig_from_board: PoseEntry,
    /// Residual of each camera's picture, root mean square per coordinate.
    pub residual_px: BTreeMap<String, f64>,
}

/// Covariance with named rows: `CAMERA.fx` to `CAMERA.k6` in pixels or without unit,
/// `CAMERA.turn_x` to `CAMERA.shift_z` in radians and metres, and the board's stretch and sag (1/m).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct RigCovariance {
    /// Name of each row and column. Numbers that aren't estimated have none.
    pub order: Vec<String>,
    /// The matrix, row by row.
    pub matrix: Vec<Vec<f64>>,
}

/// Words for findings about the cameras of the given names, each with an action.
#[derive(Clone, Copy, Debug)]
pub struct RigWords {
    /// Words for a finding.
    pub finding: fn(&RigFinding, &[String]) -> (String, &'static str),
    /// Words for the reason of a missing result.
    pub not_a_rig: fn(&NotARig, &[String]) -> (String, String),
}

impl From<Isometry3<f64>> for PoseEntry {
    fn from(pose: Isometry3<f64>) -> Self {
        let turn = pose.rotation;
        Self {
            rotation_wxyz: [turn.w, turn.i, turn.j, turn.k],
            translation_m: pose.translation.vector.into(),
        }
    }
}

impl PoseEntry {
    /// The pose. `None` if the quaternion is zero or a number isn't finite.
    pub fn pose(&self) -> Option<Isometry3<f64>> {
        let Self { rotation_wxyz: [w, i, j, k], translation_m: [x, y, z] } = *self;
        let rotation = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-9)?;
        let pose = Isometry3::from_parts(Translation3::new(x, y, z), rotation);
        pose.to_homogeneous().iter().all(|value| value.is_finite()).then_some(pose)
    }
}

impl RigGoalEntry {
    fn of(rig: &RigCalibration, accept: Option<AcceptanceGoal>) -> Self {
        let (unit, goal) = match accept {
            None => ("px", DEFAULT_TYPICAL_GOAL_PX),
            Some(AcceptanceGoal::Projection { px }) => ("px", px),
            Some(AcceptanceGoal::Length { within_m, .. }) => ("m", within_m),
        };
        let bounds = rig.pairs.iter().filter_map(|pair| Some(pair.bound(accept)?.bound));
        Self { unit: unit.into(), goal, reached: bounds.reduce(f64::max) }
    }
}

impl RigCameraEntry {
    /// The lens with its uncertainty; `None` if the file states none.
    pub fn known_lens(&self) -> Option<KnownLens> {
        let covariance = self.lens.covariance_all.as_ref()?.full()?;
        Some(KnownLens::new(&self.lens.camera(), &covariance))
    }
}

impl RigFile {
    /// The file of a rig of cameras with the given `names`, calibrated with
    /// `params`.
    pub fn of(
        result: Result<&RigCalibration, &NotARig>,
        names: &[String],
        board: &Board,
        params: &CalibrationParams,
        words: RigWords,
    ) -> Self {
        let empty = Self {
            schema: RIG_SCHEMA.into(),
            board: BoardEntry::of(board),
            stretch: None,
            verdict: Verdict::Untrustworthy.code().into(),
            goal: None,
            board_scale_sd: params.board_scale_sd,
            simulated: false,
            findings: Vec::new(),
            cameras: Vec::new(),
            pairs: Vec::new(),
            instants: Vec::new(),
            covariance: None,
        };
        let rig = match result {
            Ok(rig) => rig,
            Err(reason) => {
                let (message, action) = (words.not_a_rig)(reason, names);
                let finding = entry(reason.code(), Severity::Bad, (message, &action));
                return Self { findings: vec![finding], ..empty };
            }
        };
        let points_mm = rig.board_m.iter().map(|p| [p.x, p.y, p.z].map(|m| 1000.0 * m)).collect();
        let finding = |finding: &RigFinding| {
            entry(finding.code(), finding.severity(), (words.finding)(finding, names))
        };
        let instants = rig.instants.iter().map(|instant| RigInstantEntry {
            number: instant.number,
            rig_from_board: instant.rig_from_board.into(),
            residual_px: instant
                .residual_rms_px
                .iter()
                .map(|(camera, px)| (names[*camera].clone(), *px))
                .collect(),
        });
        Self {
            board: BoardEntry { points_mm: Some(points_mm), ..empty.board },
            stretch: Some(rig.stretch),
            verdict: rig.verdict.code().into(),
            goal: Some(RigGoalEntry::of(rig, params.accept)),
            findings: rig.findings.iter().map(finding).collect(),
            cameras: cameras(rig, names),
            pairs: rig.pairs.iter().map(|pair| RigPairEntry::of(pair, names)).collect(),
            instants: instants.collect(),
            covariance: covariance(rig, names),
            ..empty
        }
    }

    /// The rig with its covariance; `None` if the file states none.
    pub fn known(&self) -> Option<KnownRig> {
        let names: Vec<String> = self.cameras.iter().map(|camera| camera.name.clone()).collect();
        let order = order(&names);
        let RigCovariance { order: kept, matrix } = self.covariance.as_ref()?;
        let row = |name: &String| order.iter().position(|other| other == name);
        let rows: Vec<usize> = kept.iter().map(row).collect::<Option<_>>()?;
        if matrix.len() != rows.len() || matrix.iter().any(|row| row.len() != rows.len()) {
            return None;
        }
        let mut covariance = DMatrix::zeros(order.len(), order.len());
        for (i, row) in rows.iter().enumerate() {
            for (j, column) in rows.iter().enumerate() {
                covariance[(*row, *column)] = matrix[i][j];
            }
        }
        let places = self.cameras.iter().map(|camera| camera.cam_from_rig.pose());
        let cam_from_rig = places.collect::<Option<Vec<_>>>()?;
        let cameras = self.cameras.iter().map(|camera| camera.lens.camera()).collect();
        let is_finite = covariance.iter().all(|value| value.is_finite());
        is_finite.then_some(KnownRig { rig: Rig { cameras, cam_from_rig }, covariance })
    }

    /// True if the rig isn't wrong but needs more places of the board.
    pub fn is_unfinished(&self) -> bool {
        let mut bad = self.findings.iter().filter(|it| it.severity == "bad").peekable();
        bad.peek().is_some() && bad.all(|it| RigFinding::OF_TOO_FEW.contains(&it.code.as_str()))
    }

    /// Reads a file of this schema.
    ///
    /// # Errors
    ///
    /// [`NotRead`] if the schema is another, or a field is missing or wrong.
    pub fn read(tree: &Value) -> Result<Self, NotRead> {
        schema::read(tree, RIG_SCHEMA)
    }

    /// True if `tree` says that it's of this schema, in any version.
    pub fn is_one(tree: &Value) -> bool {
        let name = RIG_SCHEMA.trim_end_matches(|c: char| c.is_ascii_digit());
        tree["schema"].as_str().is_some_and(|schema| schema.starts_with(name))
    }
}

fn cameras(rig: &RigCalibration, names: &[String]) -> Vec<RigCameraEntry> {
    let lenses = rig.rig.cameras.iter().zip(&rig.rig.cam_from_rig);
    let of = |((name, of), (camera, place)): (
        (&String, &boresight_calibrate::RigCamera),
        (&boresight_geometry::Camera, &Isometry3<f64>),
    )| {
        let covariance_all = of.covariance.as_ref().map(|all| {
            NamedCovariance::of(all, false, |parameter| all.variance_of(parameter) > 0.0)
        });
        let rms_px = Some(of.rms_px);
        RigCameraEntry {
            name: name.clone(),
            image_size: [of.image_size.width_px, of.image_size.height_px],
            lens: LensEntry { covariance_all, rms_px, ..LensEntry::alone(camera) },
            cam_from_rig: (*place).into(),
            views: of.views,
            alone_rms_px: of.alone_rms_px,
        }
    };
    names.iter().zip(&rig.cameras).zip(lenses).map(of).collect()
}

/// Names of all numbers of a rig, in the order of its covariance.
fn order(names: &[String]) -> Vec<String> {
    const PLACE: [&str; 6] = ["turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z"];
    const BOARD: [&str; 4] = ["board.stretch", "board.sag_xx", "board.sag_xy", "board.sag_yy"];
    let of_camera = |name: &String| {
        let numbers = LensParameter::ALL.map(LensParameter::name).into_iter().chain(PLACE);
        numbers.map(|number| format!("{name}.{number}")).collect::<Vec<_>>()
    };
    names.iter().flat_map(of_camera).chain(BOARD.map(String::from)).collect()
}

fn covariance(rig: &RigCalibration, names: &[String]) -> Option<RigCovariance> {
    let order = order(names);
    let all = rig.covariance.as_ref()?;
    let kept: Vec<usize> = (0..order.len()).filter(|row| all[(*row, *row)] > 0.0).collect();
    let row = |row: &usize| kept.iter().map(|column| all[(*row, *column)]).collect();
    Some(RigCovariance {
        order: kept.iter().map(|row| order[*row].clone()).collect(),
        matrix: kept.iter().map(row).collect(),
    })
}

impl RigPairEntry {
    fn of(pair: &Pair, names: &[String]) -> Self {
        let rows = |matrix: &Matrix6<f64>| {
            matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
        };
        Self {
            of: pair.of.map(|camera| names[camera].clone()),
            instants: pair.instants,
            second_from_first: pair.second_from_first.into(),
            baseline_m: pair.second_from_first.translation.vector.norm(),
            baseline_sd_m: pair.sd.map(|sd| sd.baseline_m),
            row_rms_px: pair.row_rms_px,
            row_sd_px: pair.sd.and_then(|sd| sd.row_px),
            distance_sd: pair.sd.map(|sd| sd.distance),
            at_m: pair.sd.map(|sd| sd.at_m),
            length_bound_m: pair.sd.and_then(|sd| sd.length_bound_m),
            covariance: pair.sd.as_ref().map(|sd| rows(&sd.motion)),
        }
    }
}
