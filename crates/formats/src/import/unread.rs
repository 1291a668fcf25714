//! Calibrations of programs whose lens models differ, known by name only.

use serde_json::Value;

use super::numbers::first;

/// The program behind a text that is no tree.
pub(super) fn by_text(text: &str) -> Option<&'static str> {
    let has = |words: &[&str]| words.iter().all(|word| text.contains(word));
    if text.starts_with('%') && !text.starts_with("%YAML") {
        Some("MATLAB (a script)")
    } else if has(&["#polynomial coefficients"]) {
        Some("OCamCalib")
    } else if has(&["PPX:", "PPY:", "Fx:", "Coeffs:"]) {
        Some("RealSense (rs-enumerate-devices)")
    } else {
        None
    }
}

/// The program behind a tree with another program's names.
pub(super) fn by_tree(tree: &Value) -> Option<&'static str> {
    let has = |names: &[&str]| names.iter().all(|name| first(tree, &[name]).is_some());
    if has(&["xi"]) {
        Some("OpenCV's cv::omnidir")
    } else if has(&["pinhole", "model"]) {
        Some("BoofCV")
    } else if has(&["ppx", "ppy", "fx"]) || has(&["rectified0"]) {
        Some("RealSense")
    } else {
        None
    }
}
