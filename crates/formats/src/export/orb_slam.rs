use std::fmt::Write;

use super::{Coefficients, ExportedCamera, NotExpressible, number::number};

/// Camera settings of ORB-SLAM3 1.0: `PinHole` with `k1 k2 p1 p2` and `k3` unless zero, or
/// `KannalaBrandt8` with `k1 k2 k3 k4`. Pictures per second and the order of colours are left to
/// the person: a calibration doesn't know them.
pub(super) fn write(exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
    let (model, coefficients) = match exported.coefficients() {
        Coefficients::None => ("PinHole", [0.0; 5]),
        Coefficients::Brown(coefficients) => ("PinHole", coefficients),
        Coefficients::Rational(_) => return Err(NotExpressible::Lens { lens: "rational" }),
        Coefficients::Fisheye([k1, k2, k3, k4]) => ("KannalaBrandt8", [k1, k2, k3, k4, 0.0]),
    };
    let names: &[&str] = match model {
        "PinHole" if coefficients[4] == 0.0 => &["k1", "k2", "p1", "p2"],
        "PinHole" => &["k1", "k2", "p1", "p2", "k3"],
        _ => &["k1", "k2", "k3", "k4"],
    };
    let mut yaml = format!("%YAML:1.0\n---\nFile.version: \"1.0\"\nCamera.type: \"{model}\"\n");
    let lens = ["fx", "fy", "cx", "cy"].into_iter().zip(exported.intrinsics());
    for (name, value) in lens.chain(names.iter().copied().zip(coefficients)) {
        // Writing to a string cannot fail.
        let _ = writeln!(yaml, "Camera1.{name}: {}", number(value));
    }
    let size = exported.image_size;
    let _ = writeln!(yaml, "Camera.width: {}\nCamera.height: {}", size.width_px, size.height_px);
    Ok(yaml)
}
