//! `boresight.check/1`: new views of an installed camera against its old calibration, as JSON.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::schema::{self, NotRead};
use boresight_calibrate::Drift;
use boresight_geometry::frame::ImageSize;

/// Name and version of the format.
pub const CHECK_SCHEMA: &str = "boresight.check/1";

/// What a check found, or why it has no verdict. Without a verdict the file has no numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct CheckFile {
    /// [`CHECK_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.check/1")))]
    pub schema: String,
    /// Path of the old calibration.
    pub against: String,
    /// Where the new pictures came from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Width and height of the old calibration's picture, in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image_size: Option<[u32; 2]>,
    /// `ok`, `cannot-tell` or `recalibrate`; null if there is no verdict. Earlier versions wrote
    /// `watch` for a change too small to matter.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["ok", "watch", "cannot-tell", "recalibrate", null])))]
    pub verdict: Option<String>,
    /// Stable name of why there is no verdict, such as `OTHER-SIZE`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The verdict in words, or why there is none.
    pub message: String,
    /// What to do.
    pub action: String,
    /// New less old.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub change: Option<ChangeEntry>,
    /// `dᵀS⁻¹d` of the change d of f and principal point with covariance S: Hotelling's T² if nothing changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistic: Option<f64>,
    /// What chance allows `statistic` 99 times of 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<f64>,
    /// Whether the principal point by itself changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pp_changed: Option<bool>,
    /// Whether the focal length by itself changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub f_changed: Option<bool>,
    /// Whether the distortion changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_changed: Option<bool>,
    /// The smallest change that the check would have found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible: Option<VisibleEntry>,
    /// How far the change moves the image of a ray, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_px: Option<f64>,
    /// Where `displacement_px` lies 95 times of 100: least and most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement_interval_px: Option<[f64; 2]>,
    /// Whether f and principal point, or the distortion, changed by more than chance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed: Option<bool>,
    /// With `cannot-tell`: how many views like these would show every change that matters; missing
    /// if no number would.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub views_needed: Option<usize>,
    /// The displacement from which a change matters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub matters_px: Option<f64>,
    /// `stated`; earlier versions wrote `assumed` for an old file without uncertainty.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["stated", "assumed"])))]
    pub uncertainty_of_old: Option<String>,
    /// The lens as it is now; with the old distortion, unless that changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub now: Option<LensNow>,
    /// Views that were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub views_used: Option<usize>,
}

/// New less old calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ChangeEntry {
    /// Of the focal length.
    pub f_px: f64,
    /// Of the principal point.
    pub pp_px: [f64; 2],
    /// Standard deviations.
    pub sigma: ChangeSigma,
}

/// Standard deviations of a [`ChangeEntry`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ChangeSigma {
    /// Of the focal length.
    pub f_px: f64,
    /// Of the principal point.
    pub pp_px: [f64; 2],
}

/// The smallest changes that a check finds 95 times of 100.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct VisibleEntry {
    /// Of the principal point, in its worst direction.
    pub pp_px: f64,
    /// Of the focal length.
    pub f_px: f64,
    /// Displacement of a ray by a change of the distortion in proportion, if the views don't leave
    /// it open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_px: Option<f64>,
    /// Displacement anywhere in the picture: every larger one would have been found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement_px: Option<f64>,
}

/// Focal length and principal point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LensNow {
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
}

impl CheckFile {
    /// Builds the file of a check of `source` against the calibration `against`: the drift, or the
    /// stable name of the reason without a verdict; `message` and `action` in words.
    pub fn of(
        found: Result<&Drift, &str>,
        (against, source): (&str, &str),
        image_size: ImageSize,
        (message, action): (&str, &str),
    ) -> Self {
        Self {
            schema: CHECK_SCHEMA.into(),
            against: against.into(),
            source: Some(source.into()),
            image_size: Some([image_size.width_px, image_size.height_px]),
            verdict: found.ok().map(|drift| drift.verdict.code().into()),
            reason: found.err().map(Into::into),
            message: message.into(),
            action: action.into(),
            ..found.map_or_else(|_| Self::default(), Self::numbers)
        }
    }

    /// Reads the tree of a JSON file. Unknown fields are skipped.
    ///
    /// # Errors
    ///
    /// [`NotRead`] if it is of another schema, or a field is missing or of another type.
    pub fn read(tree: &Value) -> Result<Self, NotRead> {
        schema::read(tree, CHECK_SCHEMA)
    }

    /// Builds the tree to write, with fields sorted by name.
    ///
    /// # Errors
    ///
    /// Never for a value of this type: all of its fields have a form in JSON.
    pub fn to_json(&self) -> Result<Value, serde_json::Error> {
        serde_json::to_value(self)
    }

    fn numbers(drift: &Drift) -> Self {
        let [f_px, x, y]: [f64; 3] = drift.change_px.into();
        let [sd_f, sd_x, sd_y]: [f64; 3] = drift.sd_px.into();
        let camera = &drift.camera;
        Self {
            change: Some(ChangeEntry {
                f_px,
                pp_px: [x, y],
                sigma: ChangeSigma { f_px: sd_f, pp_px: [sd_x, sd_y] },
            }),
            statistic: Some(drift.statistic),
            limit: Some(drift.limit),
            pp_changed: Some(drift.pp_changed),
            f_changed: Some(drift.f_changed),
            lens_changed: Some(drift.lens_changed),
            visible: Some(VisibleEntry {
                pp_px: drift.visible_pp_px,
                f_px: drift.visible_f_px,
                lens_px: drift.visible_lens_px,
                displacement_px: Some(drift.shift.visible_px),
            }),
            displacement_px: Some(drift.shift.px),
            displacement_interval_px: Some([drift.shift.least_px, drift.shift.most_px]),
            changed: Some(drift.is_significant),
            views_needed: drift.views_needed,
            matters_px: Some(drift.matters_px),
            uncertainty_of_old: Some("stated".into()),
            now: Some(LensNow {
                f_px: [camera.f_px.x, camera.f_px.y],
                pp_px: [camera.pp_px.x, camera.pp_px.y],
            }),
            views_used: Some(drift.used.len()),
            ..Self::default()
        }
    }
}
