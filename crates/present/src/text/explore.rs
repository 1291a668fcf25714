//! The words of the explore page.

/// Introduction to the page.
pub const INTRODUCTION: &str = "Drag the board or change its direction. Lens distortion bends its principal line away from the principal point, most when the board is off to the side of the line. Add the opposed partner, and the offsets cancel.";
/// Description of the drawing.
pub const PICTURE: &str = "Boards, principal lines and principal point. Drag to move the board";
/// Heading of the enlarged part.
pub const ENLARGED: &str = "Principal point, enlarged 8×";
/// Names of the choices of boards, with what they show.
pub const BOARDS: [(&str, &str); 4] = [
    ("One board", "Distortion makes its line miss the principal point."),
    (
        "With its partner",
        "With the opposed board the offsets cancel; the angle between the lines stays.",
    ),
    ("Two pairs", "At right angles: their lines meet in the principal point."),
    ("Eight slots", "Every 45°. Leave some out and watch the estimate drift."),
];
/// Names of the sliders, with what they are.
pub const SLIDERS: [(&str, &str); 7] = [
    ("Direction", "Turns the board about the optical axis, with its shift."),
    ("Across", "Shift across the principal line: bends it."),
    ("Along", "Shift along the principal line: no effect."),
    ("k1", "Radial distortion. Negative is barrel."),
    ("k2", "Second coefficient of radial distortion."),
    ("Tilt", "Angle between board and picture."),
    ("Distance", "From the camera to the board's middle."),
];
/// Name of the slider of slots left out.
pub const SKIPPED: (&str, &str) = (
    "Slots left out",
    "n neighbouring slots removed, starting at each slot in turn. Each gives a separate estimate.",
);
/// Back to the start.
pub const RESET: (&str, &str) = (
    "As in the paper",
    "Camera, board, distance and tilt of the paper's figures, shifted by 50 mm.",
);

/// Heading of the numbers.
pub const NUMBERS: &str = "Numbers";
/// Heading of the sliders.
pub const CAMERA_AND_BOARD: &str = "Camera and board";

/// A number beside the picture: name, value, explanation.
pub type Line = (&'static str, String, &'static str);

/// Effect of the shift on the first board's line.
pub fn deflection(offset_px: f64, angle_rad: f64) -> [Line; 2] {
    [
        (
            "Offset of its line",
            format!("{:.2} px", offset_px.abs()),
            "Distance from the board's principal line to the true principal point.",
        ),
        (
            "Turn of its line",
            format!("{:.3}°", angle_rad.abs().to_degrees()),
            "Relative to the line of the same board without shift.",
        ),
    ]
}

/// A board without a line.
pub fn no_line() -> Line {
    (
        "Its line",
        "none: it faces the camera".into(),
        "A board that isn't tilted has no principal line.",
    )
}

/// Remainder of a pair after cancellation.
pub fn pair(sum_px: f64, angle_rad: f64) -> [Line; 2] {
    [
        (
            "Sum of the pair's offsets",
            if sum_px.abs() < 1e-6 { "0 px".into() } else { format!("{sum_px:.2} px") },
            "The position cancels.",
        ),
        (
            "Angle between the pair's lines",
            format!("{:.3}°", angle_rad.to_degrees()),
            "The direction doesn't cancel: both turn the same way.",
        ),
    ]
}

/// Intersection of the lines.
pub fn meet(error_px: f64) -> Line {
    (
        "The lines meet",
        if error_px < 1e-6 {
            "in the principal point".into()
        } else {
            format!("{error_px:.2} px off")
        },
        "Distance from the best common point of all lines to the true principal point.",
    )
}

/// The estimates with slots left out.
pub fn skipped(count: usize, rms_px: f64) -> Line {
    (
        "With slots left out",
        format!("{count} estimates, {rms_px:.2} px off (RMS)"),
        "A small scatter says nothing about accuracy: all may be off in the same way.",
    )
}

/// Degrees of an angle, for a slider.
pub fn degrees(angle_rad: f64) -> String {
    format!("{:.0}°", angle_rad.to_degrees())
}

/// Millimetres of a length, for a slider.
pub fn millimetres(length_m: f64) -> String {
    format!("{:.0} mm", 1e3 * length_m)
}

/// The angle that a person wrote in degrees.
pub fn parsed_degrees(text: &str) -> Option<f64> {
    text.trim().trim_end_matches('°').trim().parse::<f64>().ok().map(f64::to_radians)
}

/// The length that a person wrote in millimetres.
pub fn parsed_millimetres(text: &str) -> Option<f64> {
    text.trim().trim_end_matches("mm").trim().parse::<f64>().ok().map(|length| 1e-3 * length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_is_read_back() {
        assert_eq!(parsed_millimetres(&millimetres(0.05)), Some(0.05));
        let angle = parsed_degrees(&degrees(0.698_132)).expect("a number");
        assert!((angle - 0.698_132).abs() < 1e-3);
        assert_eq!(parsed_degrees("north"), None);
    }
}
