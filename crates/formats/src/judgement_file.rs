//! `boresight.judgement/1`: a calibration held to a fresh one, as JSON.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use boresight_calibrate::{Calibration, Judgement, WrongPart};

/// Name and version of the format.
pub const JUDGEMENT_SCHEMA: &str = "boresight.judgement/1";

/// Whether a calibration is true. Without pictures, or without an answer, the file has no numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct JudgementFile {
    /// [`JUDGEMENT_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.judgement/1")))]
    pub schema: String,
    /// Path of the calibration.
    pub file: String,
    /// Format of the calibration.
    pub format: String,
    /// Width and height of the calibration's pictures, in pixels.
    pub image_size: [u32; 2],
    /// `true`, `off` or `cannot-tell`.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["true", "off", "cannot-tell"])))]
    pub answer: String,
    /// Stable name of why there are no numbers, such as `OTHER-SIZE` or `NO-PICTURES`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The answer in words.
    pub message: String,
    /// What to do.
    pub action: String,
    /// What the file and the pictures show, in words.
    pub doubts: Vec<String>,
    /// Stable names of what the file alone shows, such as `PP-ASSUMED`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shown: Vec<String>,
    /// Error of projection: root mean square per coordinate where the boards were, after the best
    /// turn of the camera. Null without an answer in numbers, for which `reason` says why.
    pub off_px: Option<f64>,
    /// Where the true error lies: least and most.
    pub off_interval_px: Option<[f64; 2]>,
    /// Largest displacement of a ray where the boards were.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_px: Option<f64>,
    /// Largest error that doesn't matter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal_px: Option<f64>,
    /// Error of the length in `--accept`, decisive for the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<LengthFile>,
    /// Stable name of the part of the lens that explains the error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrong: Option<String>,
    /// Residuals by the calibration, per coordinate. They are no evidence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rms_px: Option<f64>,
    /// Lens of the same pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fresh: Option<FreshLens>,
    /// Displacements over the picture, from the fresh lens: x, y, and the displacement along both.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displaced_px: Vec<[f64; 4]>,
}

/// Error of a length by a calibration, at most this at 95 % of the places with boards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LengthFile {
    /// The goal, as `--accept` reads it.
    pub accept: String,
    /// The error.
    pub off_m: f64,
    /// Where the true error lies: least and most.
    pub off_interval_m: [f64; 2],
}

/// The lens that a calibration is held to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct FreshLens {
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// Residuals, per coordinate.
    pub rms_px: f64,
    /// Views behind it.
    pub views: usize,
}

impl JudgementFile {
    /// Numbers of a judgement by the lens `fresh`.
    pub fn numbers(found: &Judgement, fresh: &Calibration) -> Self {
        let displaced_px = found.displaced_px.iter();
        Self {
            off_px: Some(found.off_px),
            off_interval_px: Some([found.least_px, found.most_px]),
            worst_px: Some(found.worst_px),
            goal_px: Some(found.goal_px),
            length: found.length.map(|length| LengthFile {
                accept: length.goal.to_string(),
                off_m: length.off_m,
                off_interval_m: [length.least_m, length.most_m],
            }),
            wrong: found.wrong.as_ref().map(WrongPart::code).map(Into::into),
            rms_px: found.rms_px,
            fresh: Some(FreshLens {
                f_px: fresh.camera.f_px.into(),
                pp_px: fresh.camera.pp_px.into(),
                rms_px: fresh.rms_px,
                views: fresh.views.len(),
            }),
            displaced_px: displaced_px.map(|(at, by)| [at.x, at.y, by.x, by.y]).collect(),
            ..Self::default()
        }
    }

    /// Builds the tree to write, with fields sorted by name.
    ///
    /// # Errors
    ///
    /// Never for a value of this type: all of its fields have a form in JSON.
    pub fn to_json(&self) -> Result<Value, serde_json::Error> {
        serde_json::to_value(self)
    }
}
