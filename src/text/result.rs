//! The words of the result page.

use std::path::Path;

use super::{acceptance, percent};
use crate::calibration::{Calibration, PrincipalPoints};

/// Before the buttons that export.
pub const EXPORT: &str = "Export:";
/// On the result page before there is one.
pub const NO_RESULT: &str =
    "There is no calibration yet: it needs two views that are tipped in different directions.";
/// If nothing was found.
pub const NO_FINDINGS: &str = "Every check passed.";
/// Heading of the principal point by every method.
pub const METHODS: &str = "Principal point by every method";
/// What it means.
pub const METHODS_TIP: &str = "The result is the bundle adjustment. Lines from corners as seen are pulled towards the middle of the boards by the lens.";

/// What the button for a format does.
pub fn export_tip(format: &str) -> String {
    format!("Write the result as {format} into the session's folder.")
}

/// A file that was written.
pub fn written(file: &Path) -> String {
    format!("Written: {}", file.display())
}

/// What the button for a file does.
pub fn show_tip(file: &Path) -> String {
    format!("Show {}", file.display())
}

/// Before the field for an older calibration.
pub const COMPARE: &str = "Compare with an older calibration:";
/// See [`COMPARE`].
pub const COMPARE_TIP: &str = "What has changed since: principal point, focal length and projection, each with its uncertainty. Type the path of a calibration.json, or a file of OpenCV, ROS, Kalibr or mrcal, choose one, or drop the file onto the window. The older file is left as it is; what is found goes into this session's report.";
/// In the empty field.
pub const COMPARE_HINT: &str = "path of its file";
/// The button that begins.
pub const COMPARE_BUTTON: &str = "Compare";
/// Meanwhile.
pub const COMPARING: &str = "Comparing";

/// The desktop does not say how to show a file.
pub const NO_VIEWER: &str = "There is no program to show files with (xdg-open)";

/// Where the session is stored.
pub fn stored_in(folder: &Path) -> String {
    format!("Session: {}", folder.display())
}

/// The result: names and values.
pub fn result_lines(calibration: &Calibration) -> Vec<(&'static str, String)> {
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = calibration.camera.lens_parameters();
    let [sd_fx, sd_fy, sd_cx, sd_cy, sd_k1, sd_k2, sd_p1, sd_p2, sd_k3] = calibration.sd();
    let mut lines =
        vec![("Principal point", format!("({cx:.2} ± {sd_cx:.2}, {cy:.2} ± {sd_cy:.2}) px"))];
    lines.push(if (fx - fy).abs() < 1e-9 {
        ("Focal length", format!("{fx:.2} ± {sd_fx:.2} px"))
    } else {
        ("Focal lengths", format!("{fx:.2} ± {sd_fx:.2}, {fy:.2} ± {sd_fy:.2} px"))
    });
    lines.push(("Lens model", calibration.model.code().into()));
    let distortion = [
        ("k1", k1, sd_k1),
        ("k2", k2, sd_k2),
        ("p1", p1, sd_p1),
        ("p2", p2, sd_p2),
        ("k3", k3, sd_k3),
    ];
    for (name, value, sd) in distortion {
        if sd > 0.0 {
            lines.push((name, format!("{value:.5} ± {sd:.5}")));
        }
    }
    if let Some(judged) = &calibration.acceptance {
        lines.push(("Goal", acceptance::acceptance(judged).0));
    }
    let sd = &calibration.projection_sd;
    lines.push((
        "Projection",
        format!("± {:.3} px on average, {:.3} px at worst", sd.mean_px, sd.max_px),
    ));
    lines.push((
        "Corners",
        format!("{:.3} px RMS in {} views", calibration.rms_px, calibration.views.len()),
    ));
    if let Some(measured_px) = calibration.noise_floor_px {
        lines.push(("Corner noise", noise(calibration.noise_px, measured_px)));
    }
    lines.push(("Covered", percent(calibration.coverage)));
    lines
}

/// Noise of a corner by the fit, beside the measured one.
pub fn noise(fit_px: f64, measured_px: f64) -> String {
    format!("{fit_px:.3} px by the fit, {measured_px:.3} px measured on a board held still")
}

/// The principal point by every method: name, value, what it is.
pub fn method_lines(points: &PrincipalPoints) -> Vec<(&'static str, String, &'static str)> {
    let all = [
        (
            "Bundle adjustment",
            points.bundle,
            "The result: all corners, the lens model that they support.",
        ),
        (
            "Free homographies",
            points.free_homography,
            "The independent check: no common focal length.",
        ),
        ("Principal lines, weighted", points.pl_weighted, "Of the corners as seen."),
        (
            "Principal lines",
            points.pl_unweighted,
            "Of the corners as seen, as in the source paper.",
        ),
        (
            "Principal lines and ring",
            points.pl_ring,
            "Of the corners as seen, with a common focal length.",
        ),
        ("Zhang", points.zhang, "Zhang's method with k1, k2 and two focal lengths."),
    ];
    all.into_iter()
        .filter_map(|(name, point, tip)| {
            let point = point?;
            let value = match point.covariance_px2 {
                Some(c) => format!(
                    "({:.2} ± {:.2}, {:.2} ± {:.2}) px",
                    point.px.x,
                    c[(0, 0)].max(0.0).sqrt(),
                    point.px.y,
                    c[(1, 1)].max(0.0).sqrt()
                ),
                None => format!("({:.2}, {:.2}) px", point.px.x, point.px.y),
            };
            Some((name, value, tip))
        })
        .collect()
}
