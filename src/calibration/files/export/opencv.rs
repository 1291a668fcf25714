use std::fmt::Write;

use super::{ExportedCamera, number::number, number::numbers};

/// The calibration as OpenCV's `FileStorage` writes it: `camera_matrix`, `distortion_coefficients`
/// (`k1 k2 p1 p2 k3`) and the picture's size.
///
/// OpenCV counts pixels from the centre of the top-left one, as we do.
pub fn opencv_yaml(exported: &ExportedCamera<'_>) -> String {
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = exported.camera.lens_parameters();
    let mut yaml = String::from("%YAML:1.0\n---\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}", exported.image_size.width_px);
    let _ = writeln!(yaml, "image_height: {}", exported.image_size.height_px);
    matrix(&mut yaml, "camera_matrix", 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    matrix(&mut yaml, "distortion_coefficients", 5, &[k1, k2, p1, p2, k3]);
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
    use super::{super::tests::exported, *};

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
    }
}
