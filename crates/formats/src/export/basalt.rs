use super::{Coefficients, ExportedCamera, number::number};

/// The camera in Basalt's calibration file: `pinhole`, `pinhole-radtan8` or `kb4`. The pose on the
/// rig is the identity, and there is no inertial unit: a camera's calibration knows neither.
pub(super) fn write(exported: &ExportedCamera<'_>) -> String {
    let browns = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "rpmax"];
    let (model, names, coefficients): (_, &[&str], Vec<f64>) = match exported.coefficients() {
        Coefficients::None => ("pinhole", &[], Vec::new()),
        Coefficients::Brown([k1, k2, p1, p2, k3]) => {
            ("pinhole-radtan8", &browns, vec![k1, k2, p1, p2, k3, 0.0, 0.0, 0.0, 0.0])
        }
        Coefficients::Rational(coefficients) => {
            ("pinhole-radtan8", &browns, [&coefficients[..], &[0.0]].concat())
        }
        Coefficients::Fisheye(coefficients) => {
            ("kb4", &["k1", "k2", "k3", "k4"], coefficients.to_vec())
        }
    };
    let lens = ["fx", "fy", "cx", "cy"].into_iter().zip(exported.intrinsics());
    let numbers: Vec<String> = lens
        .chain(names.iter().copied().zip(coefficients))
        .map(|(name, value)| format!("          \"{name}\": {}", number(value)))
        .collect();
    let size = exported.image_size;
    format!(
        "{{\n  \"value0\": {{\n    \"T_imu_cam\": [\n      {{\"px\": 0.0, \"py\": 0.0, \"pz\": 0.0, \"qx\": 0.0, \"qy\": 0.0, \"qz\": 0.0, \"qw\": 1.0}}\n    ],\n    \
         \"intrinsics\": [\n      {{\n        \"camera_type\": \"{model}\",\n        \"intrinsics\": {{\n{}\n        }}\n      }}\n    ],\n    \
         \"resolution\": [[{}, {}]]\n  }}\n}}\n",
        numbers.join(",\n"),
        size.width_px,
        size.height_px
    )
}
