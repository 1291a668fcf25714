use serde_json::Value;

use super::{
    numbers::{exactly, first, lens, list},
    old_calibration::{NotImported, OldCalibration, OldFormat},
};

/// Reads what OpenCV, its Python users and ROS write: a camera matrix, coefficients and the picture's size.
///
/// Names as in OpenCV's samples and tutorials through the years, as Python programs dump them (`K`, `dist`), and
/// as in the ROS message. ROS files without a `distortion_model` are `plumb_bob`, as ROS itself reads them.
pub(super) fn read(tree: &Value) -> Result<OldCalibration, NotImported> {
    let matrix = first(tree, &["cameramatrix", "intrinsicmatrix", "k", "mtx"])
        .ok_or(NotImported::UnknownFormat)?;
    let missing = |name, wanted| NotImported::Missing { name, wanted };
    let is_ros =
        first(tree, &["distortionmodel", "cameraname", "projectionmatrix", "rectificationmatrix"])
            .is_some();
    supported(tree, is_ros)?;
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
        &["distortioncoefficients", "distortioncoeffs", "distcoeffs", "distcoeff", "d", "dist"],
    )
    .and_then(list)
    .filter(|coefficients| matches!(coefficients.len(), 0 | 4 | 5 | 8 | 12 | 14))
    .ok_or(missing("distortion_coefficients", "4, 5 or 8 finite numbers"))?;
    let side = |names| first(tree, names).and_then(Value::as_f64);
    let size = match (side(&["imagewidth", "width"]), side(&["imageheight", "height"])) {
        (Some(width), Some(height)) => Some([width, height]),
        _ => first(tree, &["imagesize", "imgsize"]).and_then(exactly),
    }
    .ok_or(missing("the picture's size, image_width and image_height,", "two numbers"))?;
    let format = if is_ros { OldFormat::Ros } else { OldFormat::OpenCv };
    let mut old = OldCalibration::new(format, &lens([fx, fy, cx, cy], &coefficients)?, size)?;
    old.rms_px = first(tree, &["avgreprojectionerror"]).and_then(Value::as_f64);
    old.source = first(tree, &["cameraname"]).and_then(Value::as_str).map(Into::into);
    Ok(old)
}

/// Refuses lens models that are named and are not OpenCV's polynomial.
fn supported(tree: &Value, is_ros: bool) -> Result<(), NotImported> {
    let model = first(tree, &["distortionmodel"]);
    let known = match model {
        None => true,
        Some(model) => {
            model.as_str().is_some_and(|model| is_ros && matches!(model, "plumb_bob" | "plumb bob"))
        }
    };
    if !known {
        let found = model.and_then(Value::as_str).unwrap_or("without a name").to_owned();
        return Err(NotImported::Model { found });
    }
    let fisheye = first(tree, &["fisheyemodel"]);
    if fisheye.is_some_and(|fisheye| fisheye.as_f64() != Some(0.0) && *fisheye != false) {
        return Err(NotImported::Model { found: "fisheye".into() });
    }
    Ok(())
}
