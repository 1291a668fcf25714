use std::fmt::Write;

use super::number::number;
use crate::calibration_file::ViewEntry;

/// The views as comma-separated values, RFC 4180: a header, then a line per view, angles in
/// degrees. Missing numbers are empty fields.
pub fn views_csv(views: &[ViewEntry]) -> String {
    let mut csv = String::from(
        "name,used,reason,tilt_deg,slot_deg,rms_px,pl_residual_px,focal_px,focal_sigma_px\r\n",
    );
    for view in views {
        let numbers = [
            view.tilt_deg,
            view.slot_deg,
            view.rms_px,
            view.pl_residual_px,
            view.focal_px,
            view.focal_sigma_px,
        ];
        let numbers = numbers.map(|value| value.map_or(String::new(), number));
        // Writing to a string cannot fail.
        let _ = write!(
            csv,
            "{},{},{},{}\r\n",
            csv_field(&no_formula(&view.name)),
            view.used,
            csv_field(view.reason.as_deref().unwrap_or_default()),
            numbers.join(",")
        );
    }
    csv
}

/// The points of a board as found, in millimetres, row by row, as comma-separated values.
///
/// ```
/// # use boresight_formats::export::board_csv;
/// let lines = board_csv(&[[0.0, 0.0, 0.0], [25.0, 0.0, 0.1]]);
/// assert_eq!(lines.lines().count(), 3);
/// ```
pub fn board_csv(points_mm: &[[f64; 3]]) -> String {
    let mut csv = String::from("x_mm,y_mm,z_mm\r\n");
    for point_mm in points_mm {
        csv += &point_mm.map(number).join(",");
        csv += "\r\n";
    }
    csv
}

/// Protects `text` from being a formula in a spreadsheet.
fn no_formula(text: &str) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t']);
    if is_formula { format!("'{text}") } else { text.to_owned() }
}

/// `text` as a field of comma-separated values: quoted if necessary.
pub fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\r', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_a_point_a_line() {
        let csv = board_csv(&[[-12.5, 0.0, 0.25], [12.5, 0.0, -0.25]]);
        assert_eq!(csv.lines().count(), 3);
        let line = csv.lines().nth(1).expect("a point");
        let back: Vec<f64> = line.split(',').map(|mm| mm.parse().expect("a number")).collect();
        assert_eq!(back, [-12.5, 0.0, 0.25]);
    }

    #[test]
    fn names_with_commas_and_quotes_stay_one_field() {
        let used = ViewEntry {
            name: "a, \"b\".png".into(),
            used: true,
            tilt_deg: Some(42.0),
            ..ViewEntry::default()
        };
        let unused = ViewEntry {
            name: "c.png".into(),
            reason: Some("blurred".into()),
            ..ViewEntry::default()
        };
        let csv = views_csv(&[used, unused]);
        let lines: Vec<&str> = csv.split("\r\n").collect();
        assert_eq!(lines[1], "\"a, \"\"b\"\".png\",true,,4.2000000000000000e+1,,,,,");
        assert_eq!(lines[2], "c.png,false,blurred,,,,,,");
        assert_eq!(lines.len(), 4);
    }
}
