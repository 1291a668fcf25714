use super::{Coefficients, ExportedCamera, number::number};

/// The calibration as a line of COLMAP's `cameras.txt`: `PINHOLE`, `OPENCV` (`k1 k2 p1 p2`), `FULL_OPENCV` with k3 or for a
/// rational lens, `OPENCV_FISHEYE`.
///
/// COLMAP counts pixels from the top-left *corner* of the top-left one, so its principal point is half a
/// pixel larger.
pub fn colmap_cameras(exported: &ExportedCamera<'_>) -> String {
    let [fx, fy, cx, cy] = exported.intrinsics();
    let mut parameters = vec![fx, fy, cx + 0.5, cy + 0.5];
    let model = match exported.coefficients() {
        Coefficients::None => "PINHOLE",
        Coefficients::Brown([k1, k2, p1, p2, 0.0]) => {
            parameters.extend([k1, k2, p1, p2]);
            "OPENCV"
        }
        Coefficients::Brown(coefficients) => {
            parameters.extend(coefficients);
            parameters.extend([0.0; 3]);
            "FULL_OPENCV"
        }
        Coefficients::Rational(coefficients) => {
            parameters.extend(coefficients);
            "FULL_OPENCV"
        }
        Coefficients::Fisheye(coefficients) => {
            parameters.extend(coefficients);
            "OPENCV_FISHEYE"
        }
    };
    let parameters: Vec<String> = parameters.into_iter().map(number).collect();
    let size = exported.image_size;
    format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n1 {model} {} {} {}\n",
        size.width_px,
        size.height_px,
        parameters.join(" ")
    )
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };
    use boresight_geometry::Distortion;

    #[test]
    fn the_model_is_the_smallest_that_holds_the_lens() {
        let line = |k3| colmap_cameras(&exported(k3)).lines().last().expect("a line").to_owned();
        assert!(line(0.0).starts_with("1 OPENCV 1280 720 3.3333333333333331e+2 "), "{}", line(0.0));
        assert_eq!(line(0.0).split(' ').count(), 4 + 8);
        assert!(line(-0.02).starts_with("1 FULL_OPENCV 1280 720 "));
        assert_eq!(line(-0.02).split(' ').count(), 4 + 12);
        let wide = |exported| colmap_cameras(&exported).lines().last().expect("a line").to_owned();
        assert!(wide(rational()).starts_with("1 FULL_OPENCV 1280 720 "));
        assert!(wide(fisheye()).starts_with("1 OPENCV_FISHEYE 1280 720 "));
        assert_eq!(wide(fisheye()).split(' ').count(), 4 + 8);
        let mut pinhole = exported(0.0);
        pinhole.camera.distortion = Distortion::default();
        assert!(colmap_cameras(&pinhole).contains("1 PINHOLE 1280 720 "));
    }

    #[test]
    fn pixels_are_counted_from_the_corner() {
        let text = colmap_cameras(&exported(0.0));
        assert!(text.contains(&format!(" {} {} ", number(652.75), number(352.0))), "{text}");
    }
}
