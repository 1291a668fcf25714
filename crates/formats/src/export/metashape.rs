use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// The calibration as Agisoft Metashape's XML: `frame` with `k1 k2 k3 p1 p2`, or `fisheye` with `k1
/// k2 k3 k4`.
///
/// Metashape counts from the picture's middle, with pixels from the corner of the top-left one; its
/// `p1` and `p2` are OpenCV's `p2` and `p1`; `b1` is `fx - fy`.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let (projection, [k1, k2, k3, k4], [p1, p2]) = match exported.coefficients() {
        Coefficients::None => ("frame", [0.0; 4], [0.0; 2]),
        Coefficients::Brown([k1, k2, p1, p2, k3]) => ("frame", [k1, k2, k3, 0.0], [p1, p2]),
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(coefficients) => ("fisheye", coefficients, [0.0; 2]),
    };
    let [fx, fy, cx, cy] = exported.intrinsics();
    if (fy + (fx - fy) - fx).abs() > 1e-12 * fx {
        return Err(NotExpressible::Lens { lens: "so strongly anamorphic" });
    }
    let size = exported.image_size;
    let [half_width, half_height] =
        [size.width_px, size.height_px].map(|side| f64::from(side) / 2.0);
    let numbers = [
        ("f", fy),
        ("cx", cx + 0.5 - half_width),
        ("cy", cy + 0.5 - half_height),
        ("b1", fx - fy),
        ("b2", 0.0),
        ("k1", k1),
        ("k2", k2),
        ("k3", k3),
        ("k4", k4),
        ("p1", p2),
        ("p2", p1),
    ];
    let lines: String =
        numbers.map(|(name, value)| format!("  <{name}>{}</{name}>\n", number(value))).concat();
    Ok(format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<calibration>\n  <projection>{projection}</projection>\n  \
         <width>{}</width>\n  <height>{}</height>\n{lines}</calibration>\n",
        size.width_px, size.height_px
    ))
}
