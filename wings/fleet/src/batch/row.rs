//! Result of a session in a batch.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::job::Action;
use boresight_formats::{CalibrationFile, CheckFile, DistortionEntry, LensEntry, SigmaEntry};

/// Name and version of the format.
pub const ROW_SCHEMA: &str = "boresight.batch-row/1";
/// Code of a successful row.
pub(super) const OK: &str = "OK";

/// Result of one session. Equal sessions, settings and versions give equal rows on every machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Row {
    /// [`ROW_SCHEMA`].
    #[cfg_attr(feature = "schemas", schemars(extend("const" = "boresight.batch-row/1")))]
    pub schema: String,
    /// Hash of all that determines the row.
    pub id: String,
    /// The session's folder.
    pub session: String,
    /// What was done.
    pub action: Action,
    /// `OK`, or the stable name of why the work couldn't be done.
    pub code: String,
    /// Why, in words; null if it was done.
    pub message: Option<String>,
    /// What to do about it.
    pub next: Option<String>,
    /// When the session began, UTC.
    pub created: Option<String>,
    /// The session's source.
    pub source: Option<String>,
    /// Name of a live camera, its model.
    pub model: Option<String>,
    /// USB vendor and product.
    pub usb: Option<String>,
    /// Serial number.
    pub serial: Option<String>,
    /// Width and height of the picture.
    pub image_size: Option<[u32; 2]>,
    /// `good`, `care` or `untrustworthy`; null if nothing was calibrated.
    pub verdict: Option<String>,
    /// The verdict in the session's own `calibration.json`.
    pub recorded_verdict: Option<String>,
    /// Codes of the findings.
    pub findings: Vec<String>,
    /// Views that the calibration uses.
    pub views: Option<usize>,
    /// The lens.
    pub lens: Option<LensRow>,
    /// What a change of the lens is judged by; null if each view has its own focal length.
    pub stated: Option<StatedRow>,
    /// How the decisions compare with the recorded ones.
    pub decisions: Option<DecisionsEntry>,
    /// The comparison with an older calibration.
    pub check: Option<CheckFile>,
    /// The file that was written, below the folder of results.
    pub file: Option<String>,
}

/// The lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct LensRow {
    /// Stable name of the lens model.
    pub model: String,
    /// Focal length along x and y.
    pub f_px: [f64; 2],
    /// Principal point.
    pub pp_px: [f64; 2],
    /// OpenCV's distortion coefficients.
    pub distortion: DistortionEntry,
    /// Standard deviations.
    pub sigma: Option<SigmaEntry>,
    /// Root mean square reprojection residual per coordinate.
    pub rms_px: Option<f64>,
}

/// Focal length and principal point with their covariance, doubt about what the model holds at zero included.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct StatedRow {
    /// Focal length along x.
    pub f_px: f64,
    /// Principal point.
    pub pp_px: [f64; 2],
    /// Covariance of focal length, and principal point along x and y.
    pub covariance_px2: [[f64; 3]; 3],
}

impl StatedRow {
    /// `None` for a separate focal length in each view, or an unknown covariance.
    fn of(lens: &LensEntry) -> Option<Self> {
        if lens.focal.is_some_and(|focal| focal.varies) {
            return None;
        }
        let covariance = lens.covariance_all.as_ref().or(lens.covariance.as_ref())?;
        let place = |names: &[&str]| {
            covariance.order.iter().position(|name| names.contains(&name.as_str()))
        };
        let places = [place(&["f", "fx"])?, place(&["cx"])?, place(&["cy"])?];
        let mut covariance_px2 = [[0.0; 3]; 3];
        for (row, i) in covariance_px2.iter_mut().zip(places) {
            for (value, j) in row.iter_mut().zip(places) {
                *value = (*covariance.matrix.get(i)?.get(j)?).filter(|value| value.is_finite())?;
            }
        }
        Some(Self { f_px: lens.f_px[0], pp_px: lens.pp_px, covariance_px2 })
    }
}

/// How decisions compare with the recorded ones.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct DecisionsEntry {
    /// Lines of the journal.
    pub count: usize,
    /// Lines whose decisions differ by more than rounding.
    pub different: usize,
    /// Lines whose decisions differ by rounding only.
    pub rounded: usize,
    /// The differences by kind, `before -> after`, of the first thousand.
    pub kinds: BTreeMap<String, usize>,
    /// Checksum of all decisions; null if they weren't compared by text.
    pub crc32: Option<String>,
}

impl Row {
    /// Empty row of `session`.
    pub fn new(id: String, session: &str, action: Action) -> Self {
        Self {
            schema: ROW_SCHEMA.into(),
            id,
            session: session.into(),
            action,
            code: OK.into(),
            message: None,
            next: None,
            created: None,
            source: None,
            model: None,
            usb: None,
            serial: None,
            image_size: None,
            verdict: None,
            recorded_verdict: None,
            findings: Vec::new(),
            views: None,
            lens: None,
            stated: None,
            decisions: None,
            check: None,
            file: None,
        }
    }

    /// Row of failed work.
    pub fn failed(self, code: &str, message: impl Into<String>, next: Option<String>) -> Self {
        Self { code: code.into(), message: Some(message.into()), next, ..self }
    }

    /// True if the work was done.
    pub fn is_ok(&self) -> bool {
        self.code == OK
    }

    /// Copies the results of a calibration.
    pub(super) fn calibrated(&mut self, file: &CalibrationFile) {
        self.verdict = Some(file.verdict.clone()).filter(|verdict| !verdict.is_empty());
        self.findings = file.findings.iter().map(|finding| finding.code.clone()).collect();
        self.views = Some(file.used().count());
        self.stated = file.result.as_ref().and_then(StatedRow::of);
        self.lens = file.result.as_ref().map(|lens| LensRow {
            model: lens.model.clone(),
            f_px: lens.f_px,
            pp_px: lens.pp_px,
            distortion: lens.distortion,
            sigma: lens.sigma,
            rms_px: lens.rms_px,
        });
    }
}
