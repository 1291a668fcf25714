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

/// What limits the use of the result, and further warnings; each empty without any.
pub(super) fn told(calibration: &CalibrationFile) -> [String; 2] {
    let mut found: Vec<&FindingEntry> =
        calibration.findings.iter().filter(|finding| finding.severity != "info").collect();
    found.sort_by_key(|finding| (finding.severity != "bad", finding.code != LIMITS_USE));
    let messages: Vec<&str> = found.iter().map(|finding| finding.message.as_str()).collect();
    let (first, others) = match messages.split_first() {
        Some((first, others)) if calibration.verdict != "good" => (format!("{first}."), others),
        _ => (String::new(), messages.as_slice()),
    };
    let shown = others[..others.len().min(WARNINGS)].join(". ");
    let rest = if others.len() > WARNINGS { " …" } else { "" };
    let others = if others.is_empty() { String::new() } else { format!("{shown}.{rest}") };
    [first, others]
}

/// As [`told`], as paragraphs.
pub(super) fn warnings(calibration: &CalibrationFile) -> String {
    let [first, others] = told(calibration).map(|text| escaped(&text));
    let mut body = String::new();
    if !first.is_empty() {
        push(&mut body, format_args!("<p class=\"limit\"><b>{first}</b></p>\n"));
    }
    if !others.is_empty() {
        push(&mut body, format_args!("<p><b>{}</b> {others}</p>\n", words::WARNINGS));
    }
    body
}
