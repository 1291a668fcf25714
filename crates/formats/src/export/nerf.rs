use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// The intrinsics of a `transforms.json`, with no frames yet: `OPENCV` or `OPENCV_FISHEYE`, for
/// Nerfstudio and instant-ngp. They count pixels from the corner of the top-left one.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let (model, [k1, k2, k3, k4], [p1, p2]) = match exported.coefficients() {
        Coefficients::None => ("OPENCV", [0.0; 4], [0.0; 2]),
        Coefficients::Brown([k1, k2, p1, p2, k3]) => ("OPENCV", [k1, k2, k3, 0.0], [p1, p2]),
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(coefficients) => ("OPENCV_FISHEYE", coefficients, [0.0; 2]),
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    let numbers = [
        ("fl_x", fx),
        ("fl_y", fy),
        ("cx", cx + 0.5),
        ("cy", cy + 0.5),
        ("k1", k1),
        ("k2", k2),
        ("k3", k3),
        ("k4", k4),
        ("p1", p1),
        ("p2", p2),
    ];
    let lines: String =
        numbers.map(|(name, value)| format!("  \"{name}\": {},\n", number(value))).concat();
    let size = exported.image_size;
    Ok(format!(
        "{{\n  \"camera_model\": \"{model}\",\n{lines}  \"w\": {},\n  \"h\": {},\n  \"frames\": []\n}}\n",
        size.width_px, size.height_px
    ))
}
