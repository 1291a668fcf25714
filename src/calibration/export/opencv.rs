use std::fmt::Write;

use crate::{frame::ImageSize, geometry::Camera};

/// The calibration as OpenCV's `FileStorage` writes it: `camera_matrix`, `distortion_coefficients`
/// (`k1 k2 p1 p2 k3`) and the picture's size, with 17 significant digits.
///
/// OpenCV counts pixels from the centre of the top-left one, as we do.
pub fn opencv_yaml(camera: &Camera, image_size: ImageSize, rms_px: f64) -> String {
    let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = camera.lens_parameters();
    let mut yaml = String::from("%YAML:1.0\n---\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}", image_size.width_px);
    let _ = writeln!(yaml, "image_height: {}", image_size.height_px);
    matrix(&mut yaml, "camera_matrix", 3, &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
    matrix(&mut yaml, "distortion_coefficients", 5, &[k1, k2, p1, p2, k3]);
    let _ = writeln!(yaml, "avg_reprojection_error: {}", number(rms_px));
    yaml
}

fn matrix(yaml: &mut String, name: &str, columns: usize, values: &[f64]) {
    let numbers: Vec<String> = values.iter().map(|value| number(*value)).collect();
    let _ = writeln!(
        yaml,
        "{name}: !!opencv-matrix\n   rows: {}\n   cols: {columns}\n   dt: d\n   data: [ {} ]",
        values.len() / columns,
        numbers.join(", ")
    );
}

/// 17 significant digits; always with a point, so that no reader takes it for an integer.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0.".into();
    }
    format!("{value:.16e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_bit_for_bit() {
        for value in [1.0 / 3.0, -1234.567891, 1e-300, 640.0, f64::MAX] {
            assert_eq!(number(value).parse::<f64>().expect("a number").to_bits(), value.to_bits());
        }
    }
}
