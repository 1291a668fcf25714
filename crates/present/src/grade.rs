//! Grade of a result, in a person's terms.

use boresight_calibrate::{Calibration, Severity, Verdict, is_unfinished};
use boresight_formats::{CalibrationFile, RigFile};

/// Grade of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// Ready to use.
    Good,
    /// Usable, with the limits that are named.
    Care,
    /// More views would make it usable.
    Unfinished,
    /// Not to be used.
    NotTrustworthy,
}

impl Grade {
    /// Grade of `calibration`.
    pub fn of(calibration: &Calibration) -> Self {
        let bad = calibration.findings.iter().filter(|finding| finding.severity == Severity::Bad);
        let unfinished = is_unfinished(bad.map(|finding| finding.code.code()));
        Self::by(calibration.verdict, unfinished)
    }

    /// Grade of a calibration in a file; one with an unknown verdict isn't to be trusted.
    pub fn of_file(file: &CalibrationFile) -> Self {
        Self::by(file.known_verdict().unwrap_or(Verdict::Untrustworthy), file.is_unfinished())
    }

    /// Grade of several cameras in a file.
    pub fn of_rig(file: &RigFile) -> Self {
        match file.verdict.as_str() {
            "good" => Self::Good,
            "care" => Self::Care,
            _ if file.is_unfinished() => Self::Unfinished,
            _ => Self::NotTrustworthy,
        }
    }

    /// Grade of a verdict; `unfinished` if more views would fix a bad result.
    pub fn by(verdict: Verdict, unfinished: bool) -> Self {
        match verdict {
            Verdict::Good => Self::Good,
            Verdict::Care => Self::Care,
            Verdict::Untrustworthy if unfinished => Self::Unfinished,
            Verdict::Untrustworthy => Self::NotTrustworthy,
        }
    }

    /// Name for programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Care => "care",
            Self::Unfinished => "unfinished",
            Self::NotTrustworthy => "untrustworthy",
        }
    }
}
