use super::{Coefficients, ExportedCamera, NotExpressible, number::numbers};

/// The intrinsics as Open3D's `PinholeCameraIntrinsic`: the camera matrix, column by column,
/// without distortion.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let lens = match exported.coefficients() {
        Coefficients::None => {
            let [fx, fy, cx, cy] = exported.intrinsics();
            let matrix = numbers(&[fx, 0.0, 0.0, 0.0, fy, 0.0, cx, cy, 1.0]);
            let size = exported.image_size;
            return Ok(format!(
                "{{\n  \"width\": {},\n  \"height\": {},\n  \"intrinsic_matrix\": [{matrix}]\n}}\n",
                size.width_px, size.height_px
            ));
        }
        Coefficients::Brown(_) => "distorting",
        Coefficients::Rational(_) => "rational",
        Coefficients::Fisheye(_) => "fisheye",
    };
    Err(NotExpressible::Lens { lens })
}
