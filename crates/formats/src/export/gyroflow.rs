use super::{Coefficients, ExportedCamera, NotExpressible, number::number, number::numbers};

/// A lens profile of Gyroflow with the `opencv_fisheye` model, for the camera's picture without
/// stabilisation or crop.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let coefficients = match exported.coefficients() {
        Coefficients::Fisheye(coefficients) => coefficients,
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::None | Coefficients::Brown(_) => {
            return Err(NotExpressible::Lens { lens: "perspective" });
        }
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    let size = exported.image_size;
    let size = format!("{{\"w\": {}, \"h\": {}}}", size.width_px, size.height_px);
    let rms = match exported.rms_px {
        0.0 => String::new(),
        rms_px => format!(",\n    \"RMS_error\": {}", number(rms_px)),
    };
    Ok(format!(
        "{{\n  \"name\": \"{}\",\n  \"calibrated_by\": \"boresight\",\n  \"calib_dimension\": {size},\n  \
         \"orig_dimension\": {size},\n  \"distortion_model\": \"opencv_fisheye\",\n  \"fisheye_params\": {{\n    \
         \"camera_matrix\": [\n      [{}],\n      [{}],\n      [0.0, 0.0, 1.0]\n    ],\n    \
         \"distortion_coeffs\": [{}]{rms}\n  }}\n}}\n",
        exported.plain_name(),
        numbers(&[fx, 0.0, cx]),
        numbers(&[0.0, fy, cy]),
        numbers(&coefficients)
    ))
}
