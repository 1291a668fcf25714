use serde_json::Value;

use super::{
    numbers::{exactly, first, fisheye_lens, lens, list, sized},
    old_calibration::{NotImported, OldCalibration, OldFormat},
    own_corners,
};
use boresight_geometry::LensKind;

/// Reads files of OpenCV, Python programs and ROS: a camera matrix, coefficients and the picture's
/// size; of a stereo calibration, the first camera.
///
/// Names as in OpenCV's samples and tutorials through the years, as dumped by Python programs (`K`,
/// `dist`), and as in the ROS message. ROS files without a `distortion_model` are `plumb_bob`, as
/// for ROS itself. OpenCV's own sample marks the coefficients of `cv::fisheye` by `fisheye_model`,
/// ROS by `equidistant`.
pub(super) fn read(tree: &Value, stated: Option<[f64; 2]>) -> Result<OldCalibration, NotImported> {
    let matrix = first(tree, &["cameramatrix", "intrinsicmatrix", "k", "mtx"])
        .or_else(|| matrix_of_two(tree, &FIRST))
        .ok_or(NotImported::UnknownFormat)?;
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let is_ros =
        first(tree, &["distortionmodel", "cameraname", "projectionmatrix", "rectificationmatrix"])
            .is_some();
    let kind = lens_kind(tree, is_ros)?;
    let [fx, skew, cx, m10, fy, cy, m20, m21, m22] =
        exactly(matrix).ok_or(missing("the camera matrix", "3 x 3 finite numbers"))?;
    for (name, value, wanted) in [
        ("the camera matrix's skew", skew, 0.0),
        ("the camera matrix's second row's first number", m10, 0.0),
        ("the camera matrix's last row's first number", m20, 0.0),
        ("the camera matrix's last row's second number", m21, 0.0),
        ("the camera matrix's last number", m22, 1.0),
    ] {
        if value != wanted {
            return Err(NotImported::Nonsense { name, value: value.to_string() });
        }
    }
    let coefficients = first(
        tree,
        &[
            "distortioncoefficients",
            "distortioncoeffs",
            "distcoeffs",
            "distcoeff",
            "d",
            "dist",
            "d1",
            "distcoeffs1",
            "distortioncoefficients1",
            "dist1",
        ],
    )
    .and_then(list)
    .filter(|coefficients| matches!(coefficients.len(), 0 | 4 | 5 | 8 | 12 | 14))
    .ok_or(missing("distortion_coefficients", "4, 5 or 8 finite numbers"))?;
    let side = |names| first(tree, names).and_then(Value::as_f64);
    let size = match (side(&["imagewidth", "width"]), side(&["imageheight", "height"])) {
        (Some(width), Some(height)) => Some([width, height]),
        _ => first(tree, &["imagesize", "imgsize"]).and_then(exactly),
    };
    let size = sized(size, stated)?;
    let format = if is_ros { OldFormat::Ros } else { OldFormat::OpenCv };
    let intrinsics = [fx, fy, cx, cy];
    let lens = match kind {
        LensKind::Perspective => lens(intrinsics, &coefficients)?,
        LensKind::Fisheye => {
            let four = coefficients.try_into();
            let four = four.map_err(|_| missing("distortion_coefficients", "4 finite numbers"))?;
            fisheye_lens(intrinsics, four)
        }
    };
    let mut old = OldCalibration::new(format, kind, &lens, size)?;
    old.rms_px = first(tree, &["avgreprojectionerror"]).and_then(Value::as_f64);
    if matrix_of_two(tree, &SECOND).is_some() {
        old.camera_count = 2;
    }
    let views = first(tree, &["nrofframes", "nframes"]).and_then(Value::as_u64);
    old.views = views.and_then(|views| usize::try_from(views).ok());
    old.corners = own_corners::of_opencv(tree);
    old.views = old.views.or(old.corners.as_ref().map(|own| own.views.len()));
    if is_ros {
        old.rectification = first(tree, &["rectificationmatrix", "r"]).and_then(exactly);
        old.projection = first(tree, &["projectionmatrix", "p"]).and_then(exactly);
    }
    old.source = first(tree, &["cameraname"]).and_then(Value::as_str).map(Into::into);
    Ok(old)
}

/// Names of the camera matrices of a stereo calibration, as in OpenCV's samples and tutorials.
const FIRST: [&str; 5] = ["m1", "k1", "cameramatrix1", "mtx1", "cm1"];
const SECOND: [&str; 5] = ["m2", "k2", "cameramatrix2", "mtx2", "cm2"];

/// A camera matrix of a stereo calibration. A coefficient may have the name, too.
fn matrix_of_two<'a>(tree: &'a Value, names: &[&str]) -> Option<&'a Value> {
    let is_matrix = |matrix: &&Value| exactly::<9>(matrix).is_some();
    names.iter().find_map(|name| first(tree, &[name]).filter(is_matrix))
}

/// Kind of the named lens model. Refuses models other than OpenCV's.
fn lens_kind(tree: &Value, is_ros: bool) -> Result<LensKind, NotImported> {
    if let Some(model) = first(tree, &["distortionmodel"]) {
        return match model.as_str().filter(|_| is_ros) {
            Some("plumb_bob" | "plumb bob" | "rational_polynomial") => Ok(LensKind::Perspective),
            Some("equidistant" | "fisheye") => Ok(LensKind::Fisheye),
            _ => {
                let found = model.as_str().unwrap_or("without a name").to_owned();
                Err(NotImported::Model { found })
            }
        };
    }
    let fisheye = first(tree, &["fisheyemodel"]);
    let is_fisheye =
        fisheye.is_some_and(|fisheye| fisheye.as_f64() != Some(0.0) && *fisheye != false);
    Ok(if is_fisheye { LensKind::Fisheye } else { LensKind::Perspective })
}
