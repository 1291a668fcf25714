use std::fmt::Write;

use super::{Coefficients, ExportedCamera, number::number, number::numbers};

/// The calibration as OpenCV's `FileStorage` writes it: `camera_matrix`, `distortion_coefficients` and the picture's size.
///
/// The coefficients are `k1 k2 p1 p2 k3`, with `k4 k5 k6` if the lens is rational. A fisheye lens has `k1 k2 k3 k4` of
/// `cv::fisheye`, and `fisheye_model` says so, as in OpenCV's own sample.
///
/// OpenCV counts pixels from the centre of the top-left one, as we do.
pub fn opencv_yaml(exported: &ExportedCamera<'_>) -> String {
    let [fx, fy, cx, cy] = exported.intrinsics();
    let coefficients = match exported.coefficients() {
        Coefficients::None => vec![0.0; 5],
        Coefficients::Brown(coefficients) => coefficients.to_vec(),
        Coefficients::Rational(coefficients) => coefficients.to_vec(),
        Coefficients::Fisheye(coefficients) => coefficients.to_vec(),
    };
    let is_fisheye = matches!(exported.coefficients(), Coefficients::Fisheye(_));
    let mut yaml = String::from("%YAML:1.0\n---\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}", exported.image_size.width_px);
    let _ = writeln!(yaml, "image_height: {}", exported.image_size.height_px);
    matrix(&mut yaml, "camera_matrix", 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    if is_fisheye {
        yaml.push_str("fisheye_model: 1\n");
    }
    matrix(&mut yaml, "distortion_coefficients", coefficients.len(), &coefficients);
    let _ = writeln!(yaml, "avg_reprojection_error: {}", number(exported.rms_px));
    yaml
}

fn matrix(yaml: &mut String, name: &str, columns: usize, values: &[f64]) {
    let _ = writeln!(
        yaml,
        "{name}: !!opencv-matrix\n   rows: {}\n   cols: {columns}\n   dt: d\n   data: [ {} ]",
        values.len() / columns,
        numbers(values)
    );
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };

    #[test]
    fn file_storage_finds_its_keys() {
        let yaml = opencv_yaml(&exported(0.0));
        assert!(yaml.starts_with("%YAML:1.0\n---\nimage_width: 1280\nimage_height: 720\n"));
        assert!(
            yaml.contains("camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n")
        );
        assert!(
            yaml.contains("distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n")
        );
        assert!(yaml.contains("3.3333333333333331e+2"));
        assert!(!yaml.contains("fisheye"));
    }

    #[test]
    fn wide_lenses_have_as_many_coefficients_as_opencv_wants() {
        assert!(opencv_yaml(&rational()).contains("rows: 1\n   cols: 8\n"));
        let yaml = opencv_yaml(&fisheye());
        assert!(yaml.contains("fisheye_model: 1\n") && yaml.contains("rows: 1\n   cols: 4\n"));
    }
}
