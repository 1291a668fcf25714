//! The findings on the first sheet.

use crate::{
    chart::{escaped, push},
    text::certificate as words,
};
use boresight_formats::{CalibrationFile, FindingEntry};

/// Maximum number of warnings on the sheet; further warnings go to the next sheet.
const WARNINGS: usize = 3;

/// Finding about the bound of the projection: what limits the use of a result, first.
const LIMITS_USE: &str = "PROJECTION-UNCERTAIN";

/// What limits the use, and further warnings.
pub(super) fn warnings(calibration: &CalibrationFile) -> String {
    let mut found: Vec<&FindingEntry> =
        calibration.findings.iter().filter(|finding| finding.severity != "info").collect();
    found.sort_by_key(|finding| (finding.severity != "bad", finding.code != LIMITS_USE));
    let messages: Vec<&str> = found.iter().map(|finding| finding.message.as_str()).collect();
    let (first, others) = match messages.split_first() {
        Some((first, others)) if calibration.verdict != "good" => (Some(first), others),
        _ => (None, messages.as_slice()),
    };
    let mut body = first.map_or(String::new(), |first| {
        format!("<p class=\"limit\"><b>{}.</b></p>\n", escaped(first))
    });
    if !others.is_empty() {
        let shown = others[..others.len().min(WARNINGS)].join(". ");
        let rest = if others.len() > WARNINGS { " …" } else { "" };
        push(
            &mut body,
            format_args!("<p><b>{}</b> {}.{rest}</p>\n", words::WARNINGS, escaped(&shown)),
        );
    }
    body
}
