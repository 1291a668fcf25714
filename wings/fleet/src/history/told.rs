//! A camera's history in words, and as `boresight.history/1`.

use serde::Serialize;

use super::trend::{CameraHistory, Step, Trend};
use boresight_calibrate::{DriftVerdict, LensDifference};
use boresight_present::text::of_source;

/// Name and version of [`HistoryFile`].
pub const HISTORY_SCHEMA: &str = "boresight.history/1";

/// What `history --json` prints of a camera.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct HistoryFile {
    /// [`HISTORY_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.history/1")))]
    pub schema: String,
    /// Identity of the camera.
    pub camera: String,
    /// Name that the camera itself states.
    pub model: String,
    /// Width and height of the picture.
    pub image_size: [u32; 2],
    /// Number of calibrations.
    pub count: usize,
    /// Time of the newest usable calibration, UTC.
    pub newest: Option<String>,
    /// True if the newest calibrations differ from the oldest by more than chance.
    pub changed: bool,
    /// From the oldest calibrations to the newest; null with fewer than two usable ones.
    pub change: Option<DifferenceEntry>,
    /// How many calibrations are in both means.
    pub compared: Option<ComparedEntry>,
    /// Every calibration by time, if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrations: Option<Vec<StepEntry>>,
}

/// Numbers of calibrations in two means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct ComparedEntry {
    /// In the mean of the oldest.
    pub oldest: usize,
    /// In the mean of the newest.
    pub newest: usize,
}

/// A change of the lens.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DifferenceEntry {
    /// `ok` if surely too small to matter, `recalibrate` if surely large enough, else `cannot-tell`. Earlier versions wrote `watch` for a change too small to matter.
    #[cfg_attr(feature = "schemas", schemars(extend("enum" = ["ok", "watch", "cannot-tell", "recalibrate"])))]
    pub verdict: String,
    /// Of focal length, and principal point along x and y.
    pub f_pp_px: [f64; 3],
    /// Standard deviations of these.
    pub sigma_px: [f64; 3],
    /// Squared by their covariance: chi-squared with 3 degrees of freedom without a change.
    pub statistic: f64,
    /// Largest displacement in the picture.
    pub displacement_px: f64,
}

/// One calibration of a history.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StepEntry {
    /// The session's folder.
    pub session: String,
    /// Start of the session, UTC.
    pub created: String,
    /// `good`, `care` or `untrustworthy`.
    pub verdict: String,
    /// The lens, if there is one for all views with its covariance.
    pub lens: Option<StepLens>,
    /// Change since the first usable calibration.
    pub since_first: Option<DifferenceEntry>,
    /// Change since the usable one before.
    pub since_last: Option<DifferenceEntry>,
}

/// The lens of one calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StepLens {
    /// Focal length.
    pub f_px: f64,
    /// Principal point.
    pub pp_px: [f64; 2],
    /// Standard deviations of focal length, and principal point along x and y.
    pub sigma_px: [f64; 3],
}

/// Name of a camera and the size of the pictures, marked if simulated.
pub fn name(history: &CameraHistory) -> String {
    let [width, height] = history.image_size;
    of_source(&history.camera, &format!("{} {width}x{height}", history.camera))
}

/// Trend of a camera in words.
pub fn trend(history: &CameraHistory) -> String {
    let Some(Trend { change, oldest, newest, drifts }) = history.trend else {
        return "needs two usable calibrations to compare".into();
    };
    let LensDifference { change_px, sd_px, shift, verdict, .. } = change;
    let said = match (drifts, verdict) {
        (true, _) => "changed",
        (false, DriftVerdict::Ok) => "no change",
        (false, DriftVerdict::CannotTell | DriftVerdict::Recalibrate) => "no change seen",
    };
    let newest = if newest > 1 { format!("newest {newest}") } else { "newest".into() };
    let since = match (oldest, newest.as_str()) {
        (1, _) => "since the first".to_owned(),
        (oldest, newest) => format!("from the oldest {oldest} to the {newest}"),
    };
    format!(
        "{said} {since}: f {:+.2} ± {:.2} px, pp ({:+.2} ± {:.2}, {:+.2} ± {:.2}) px, up to {:.2} px in the picture ({:.2} to {:.2} px)",
        change_px.x,
        sd_px.x,
        change_px.y,
        sd_px.y,
        change_px.z,
        sd_px.z,
        shift.px,
        shift.least_px,
        shift.most_px
    )
}

impl HistoryFile {
    /// Entry of a camera, optionally with calibrations.
    pub fn of(history: &CameraHistory, with_calibrations: bool) -> Self {
        let change = history.trend.as_ref().map(|trend| {
            // With two comparisons, chance alone exceeds a check's limit once in a while.
            let verdict = match trend.change.verdict {
                DriftVerdict::Recalibrate if !trend.drifts => DriftVerdict::CannotTell,
                verdict => verdict,
            };
            DifferenceEntry { verdict: verdict.code().into(), ..(&trend.change).into() }
        });
        Self {
            schema: HISTORY_SCHEMA.into(),
            camera: history.camera.clone(),
            model: history.model.clone(),
            image_size: history.image_size,
            count: history.entries.len(),
            newest: history.newest().map(str::to_owned),
            changed: history.drifts(),
            change,
            compared: history
                .trend
                .map(|Trend { oldest, newest, .. }| ComparedEntry { oldest, newest }),
            calibrations: with_calibrations
                .then(|| history.steps().iter().map(StepEntry::from).collect()),
        }
    }
}

impl From<&LensDifference> for DifferenceEntry {
    fn from(change: &LensDifference) -> Self {
        let array = |v: &nalgebra::Vector3<f64>| [v.x, v.y, v.z];
        Self {
            verdict: change.verdict.code().into(),
            f_pp_px: array(&change.change_px),
            sigma_px: array(&change.sd_px),
            statistic: change.statistic,
            displacement_px: change.shift.px,
        }
    }
}

impl From<&Step<'_>> for StepEntry {
    fn from(Step { entry, since_first, since_last }: &Step<'_>) -> Self {
        let lens = entry.lens.map(|lens| {
            let [f_px, x, y]: [f64; 3] = lens.f_pp_px.into();
            let sigma_px = lens.covariance_px2.diagonal().map(f64::sqrt).into();
            StepLens { f_px, pp_px: [x, y], sigma_px }
        });
        Self {
            session: entry.session.clone(),
            created: entry.created.clone(),
            verdict: entry.verdict.clone(),
            lens,
            since_first: since_first.as_ref().map(Into::into),
            since_last: since_last.as_ref().map(Into::into),
        }
    }
}
