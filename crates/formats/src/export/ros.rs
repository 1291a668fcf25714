use std::fmt::Write;

use super::{Coefficients, ExportedCamera, number::numbers};

/// The calibration as ROS `camera_calibration_parsers` reads it: `plumb_bob` with `k1 k2 p1 p2 k3`, `rational_polynomial` with
/// `k1 k2 p1 p2 k3 k4 k5 k6`, or `equidistant` with `k1 k2 k3 k4`.
///
/// `rectification_matrix` is the identity and `projection_matrix` the camera matrix, as for a camera on
/// its own. ROS counts pixels from the centre of the top-left one, as we do.
pub fn ros_camera_info(exported: &ExportedCamera<'_>) -> String {
    let [fx, fy, cx, cy] = exported.intrinsics();
    let (model, coefficients) = match exported.coefficients() {
        Coefficients::None => ("plumb_bob", vec![0.0; 5]),
        Coefficients::Brown(coefficients) => ("plumb_bob", coefficients.to_vec()),
        Coefficients::Rational(coefficients) => ("rational_polynomial", coefficients.to_vec()),
        Coefficients::Fisheye(coefficients) => ("equidistant", coefficients.to_vec()),
    };
    let mut yaml = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}", exported.image_size.width_px);
    let _ = writeln!(yaml, "image_height: {}", exported.image_size.height_px);
    let _ = writeln!(yaml, "camera_name: {}", exported.plain_name());
    matrix(&mut yaml, "camera_matrix", 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    let _ = writeln!(yaml, "distortion_model: {model}");
    matrix(&mut yaml, "distortion_coefficients", coefficients.len(), &coefficients);
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    matrix(&mut yaml, "rectification_matrix", 3, &identity);
    let projection = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    matrix(&mut yaml, "projection_matrix", 4, &projection);
    yaml
}

fn matrix(yaml: &mut String, name: &str, columns: usize, values: &[f64]) {
    let rows = values.len() / columns;
    let _ =
        writeln!(yaml, "{name}:\n  rows: {rows}\n  cols: {columns}\n  data: [{}]", numbers(values));
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };

    #[test]
    fn camera_info_has_every_key_that_ros_asks_for() {
        let yaml = ros_camera_info(&exported(0.0));
        for key in [
            "image_width: 1280\n",
            "image_height: 720\n",
            "camera_name: front_camera\n",
            "camera_matrix:\n  rows: 3\n  cols: 3\n",
            "distortion_model: plumb_bob\n",
            "distortion_coefficients:\n  rows: 1\n  cols: 5\n",
            "rectification_matrix:\n  rows: 3\n  cols: 3\n",
            "projection_matrix:\n  rows: 3\n  cols: 4\n",
        ] {
            assert!(yaml.contains(key), "{key}");
        }
    }

    #[test]
    fn wide_lenses_have_their_own_models() {
        assert!(ros_camera_info(&rational()).contains("distortion_model: rational_polynomial\n"));
        assert!(ros_camera_info(&fisheye()).contains("distortion_model: equidistant\n"));
    }
}
