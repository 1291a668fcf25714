use super::{Coefficients, ExportedCamera, NotExpressible, number::numbers};

/// The calibration in PhotonVision's import format: `LENSMODEL_OPENCV8`, with absent coefficients
/// at zero.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let [k1, k2, p1, p2, k3, k4, k5, k6] = match exported.coefficients() {
        Coefficients::None => [0.0; 8],
        Coefficients::Brown([k1, k2, p1, p2, k3]) => [k1, k2, p1, p2, k3, 0.0, 0.0, 0.0],
        Coefficients::Rational(coefficients) => coefficients,
        Coefficients::Fisheye(_) => return Err(NotExpressible::Lens { lens: "fisheye" }),
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    let matrix = numbers(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    let coefficients = numbers(&[k1, k2, p1, p2, k3, k4, k5, k6]);
    let size = exported.image_size;
    Ok(format!(
        "{{\n  \"resolution\": {{\"width\": {}, \"height\": {}}},\n  \
         \"cameraIntrinsics\": {{\"rows\": 3, \"cols\": 3, \"type\": 6, \"data\": [{matrix}]}},\n  \
         \"distCoeffs\": {{\"rows\": 1, \"cols\": 8, \"type\": 6, \"data\": [{coefficients}]}},\n  \
         \"calobjectWarp\": [0.0, 0.0],\n  \"observations\": [],\n  \
         \"calobjectSize\": {{\"width\": 0.0, \"height\": 0.0}},\n  \"calobjectSpacing\": 0.0,\n  \
         \"lensmodel\": \"LENSMODEL_OPENCV8\"\n}}\n",
        size.width_px, size.height_px
    ))
}
