//! Output of `detect --json`.

use serde_json::{Value, json};

use boresight_detect::{Detection, Miss, Quality};
use boresight_geometry::board::Checkerboard;
use boresight_present::text;

/// A line of `detect --json`.
pub fn detection(
    file: &str,
    board: &Checkerboard,
    seen: &Result<Detection, Miss>,
    millis: f64,
) -> Value {
    let corners: Option<Vec<Value>> = seen.as_ref().ok().map(|detection| {
        detection
            .corners
            .iter()
            .enumerate()
            .filter(|(_, corner)| corner.is_seen())
            .map(|(i, corner)| {
                let [column, row] = board.target().place(i);
                json!([column, row, corner.px.x, corner.px.y, corner.sigma_px()])
            })
            .collect()
    });
    let quality = seen.as_ref().ok().map(|detection| {
        let Quality { blur_px, contrast, glare, motion_px } = detection.quality;
        json!({ "blur_px": blur_px, "contrast": contrast, "glare": glare, "motion_px": motion_px })
    });
    json!({
        "file": file, "found": seen.is_ok(), "reason": seen.as_ref().err().map(text::miss),
        "board": [board.columns(), board.rows()], "corners": corners, "quality": quality,
        "millis": millis,
    })
}
