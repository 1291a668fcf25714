use serde_json::Value;
use serde_saphyr::options::NonFiniteFloatPolicy;

use super::{literal, old_calibration::NotImported};

/// The tree behind `text`: JSON, YAML, or the Python literal of an mrcal `.cameramodel`.
///
/// Depth and size are bounded by each parser. Infinite numbers and NaN become null.
pub(super) fn parse(text: &str) -> Result<Value, NotImported> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let tree = if starts_with_brace(text) {
        braced(text)?
    } else {
        yaml(text).map_err(|reason| NotImported::Malformed { reason })?
    };
    // A text in words is YAML, too: one long string.
    if tree.is_object() { Ok(tree) } else { Err(NotImported::UnknownFormat) }
}

/// JSON, or mrcal's literal. JSON of older OpenCV has numbers such as `1.`, allowed in YAML only.
fn braced(text: &str) -> Result<Value, NotImported> {
    let as_json = serde_json::from_str(text);
    if as_json.is_err() && text.contains("lensmodel") {
        return literal::parse(text);
    }
    as_json
        .or_else(|as_json| yaml(text).map_err(|_| as_json))
        .map_err(|err| NotImported::Malformed { reason: err.to_string() })
}

fn yaml(text: &str) -> Result<Value, String> {
    // OpenCV before version 5 writes a first line invalid in every version of YAML.
    let body = match text.split_once('\n') {
        Some((first, rest)) if first.starts_with("%YAML") => rest,
        _ => text,
    };
    // `rostopic echo` closes each message with the opening mark of the next.
    let body = body.trim_end().strip_suffix("\n---").unwrap_or(body);
    // An infinite number or NaN becomes null, refused only in place of a required number.
    let options =
        serde_saphyr::options! { non_finite_float_policy: NonFiniteFloatPolicy::PassThrough };
    serde_saphyr::from_str_with_options(body, options).map_err(|err| {
        // Keep the first line of the error; the others quote the file.
        let words = err.to_string();
        words.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned()
    })
}

/// True if the text starts with a brace, after comments.
fn starts_with_brace(text: &str) -> bool {
    let mut lines = text.lines().map(str::trim_start);
    lines
        .find(|line| !line.is_empty() && !line.starts_with('#'))
        .is_some_and(|l| l.starts_with('{'))
}
