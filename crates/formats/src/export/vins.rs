use std::fmt::Write;

use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// The camera file of VINS-Mono and VINS-Fusion (camodocal): `PINHOLE` with `k1 k2 p1 p2`, or
/// `KANNALA_BRANDT`, whose `k2 k3 k4 k5` are OpenCV's fisheye `k1 k2 k3 k4`.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let pinhole = |[k1, k2, p1, p2]: [f64; 4]| {
        let [fx, fy, cx, cy] = exported.intrinsics();
        let distortion = [("k1", k1), ("k2", k2), ("p1", p1), ("p2", p2)];
        let projection = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
        ("PINHOLE", distortion.to_vec(), projection.to_vec())
    };
    let (model, distortion, projection) = match exported.coefficients() {
        Coefficients::None => pinhole([0.0; 4]),
        Coefficients::Brown([k1, k2, p1, p2, 0.0]) => pinhole([k1, k2, p1, p2]),
        Coefficients::Brown(_) => return Err(NotExpressible::Coefficient { coefficient: "k3" }),
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye(coefficients) => {
            let names = ["k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"];
            let values = coefficients.into_iter().chain(exported.intrinsics());
            ("KANNALA_BRANDT", Vec::new(), names.into_iter().zip(values).collect())
        }
    };
    let size = exported.image_size;
    let mut yaml = format!(
        "%YAML:1.0\n---\nmodel_type: {model}\ncamera_name: {}\nimage_width: {}\nimage_height: {}\n",
        exported.plain_name(),
        size.width_px,
        size.height_px
    );
    for (table, numbers) in
        [("distortion_parameters", distortion), ("projection_parameters", projection)]
    {
        if numbers.is_empty() {
            continue;
        }
        // Writing to a string cannot fail.
        let _ = writeln!(yaml, "{table}:");
        for (name, value) in numbers {
            let _ = writeln!(yaml, "   {name}: {}", number(value));
        }
    }
    Ok(yaml)
}
