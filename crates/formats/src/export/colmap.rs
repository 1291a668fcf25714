use super::{Coefficients, ExportedCamera, number::number};
use boresight_geometry::{LensMatrix, LensParameter, LensParts};

/// The calibration as a line of COLMAP's `cameras.txt`: `PINHOLE`, `OPENCV` (`k1 k2 p1 p2`),
/// `FULL_OPENCV` with k3 or for a rational lens, `OPENCV_FISHEYE`.
///
/// COLMAP counts pixels from the top-left *corner* of the top-left one, so its principal point is
/// half a pixel larger.
pub fn colmap_cameras(exported: &ExportedCamera<'_>) -> String {
    let (model, parameters) = model(exported);
    file(exported, model, &parameters, "")
}

/// The file of [`colmap_cameras`] with the standard deviation of each parameter in a comment,
/// skipped by COLMAP: for a prior in a bundle adjustment, with weights of the inverse squares. Zero
/// means a parameter held fixed.
pub fn colmap_cameras_with_sd(exported: &ExportedCamera<'_>, covariance: &LensMatrix) -> String {
    let (model, parameters) = model(exported);
    let coefficients = match model {
        "OPENCV_FISHEYE" => &FISHEYE[..],
        _ => &LensParameter::DISTORTION[..],
    };
    let order = LensParameter::F_THEN_PP.iter().chain(coefficients);
    let sd = order.map(|parameter| number(covariance.variance_of(*parameter).max(0.0).sqrt()));
    let sd: Vec<String> = sd.take(parameters.len()).collect();
    let comment = format!("# Standard deviations of PARAMS[] of camera 1: {}\n", sd.join(" "));
    file(exported, model, &parameters, &comment)
}

/// The coefficients of COLMAP's fisheye model.
const FISHEYE: [LensParameter; 4] =
    [LensParameter::K1, LensParameter::K2, LensParameter::K3, LensParameter::K4];

/// Name of the model, and the parameters.
pub(super) fn model(exported: &ExportedCamera<'_>) -> (&'static str, Vec<f64>) {
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
    (model, parameters)
}

fn file(exported: &ExportedCamera<'_>, model: &str, parameters: &[f64], comment: &str) -> String {
    let parameters: Vec<String> = parameters.iter().copied().map(number).collect();
    let size = exported.image_size;
    format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n{comment}1 {model} {} {} {}\n",
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
    fn each_parameter_has_its_standard_deviation() {
        let mut covariance = LensMatrix::zeros();
        covariance[(LensParameter::Cy.index(), LensParameter::Cy.index())] = 4.0;
        covariance[(LensParameter::K2.index(), LensParameter::K2.index())] = 0.25;
        let text = colmap_cameras_with_sd(&exported(0.0), &covariance);
        let sd = text.lines().find(|line| line.contains("Standard deviations")).expect("a line");
        let sd: Vec<f64> = sd
            .split(' ')
            .filter_map(|word| word.parse().ok())
            .skip_while(|sd| *sd == 1.0)
            .collect();
        assert_eq!(sd.len(), 8, "{text}");
        assert_eq!((sd[3], sd[5]), (2.0, 0.5));
        // COLMAP reads the same camera.
        let plain = colmap_cameras(&exported(0.0));
        assert_eq!(text.lines().last(), plain.lines().last());
    }

    #[test]
    fn pixels_are_counted_from_the_corner() {
        let text = colmap_cameras(&exported(0.0));
        assert!(text.contains(&format!(" {} {} ", number(652.75), number(352.0))), "{text}");
    }
}
