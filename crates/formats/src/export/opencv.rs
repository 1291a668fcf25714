use std::fmt::Write;

use super::{Coefficients, ExportedCamera, number::number, number::numbers};

/// The calibration in OpenCV's `FileStorage` format: `camera_matrix`, `distortion_coefficients` and
/// the picture's size.
///
/// The coefficients are `k1 k2 p1 p2 k3`, with `k4 k5 k6` if the lens is rational. A fisheye lens
/// has `k1 k2 k3 k4` of `cv::fisheye`, marked by `fisheye_model`, as in OpenCV's own sample.
///
/// OpenCV counts pixels from the centre of the top-left one, as we do.
pub fn opencv_yaml(exported: &ExportedCamera<'_>) -> String {
    let Stored { size, camera, is_fisheye, distortion } = Stored::of(exported);
    let mut yaml = String::from("%YAML:1.0\n---\n");
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}\nimage_height: {}", size[0], size[1]);
    matrix(&mut yaml, "camera_matrix", 3, &camera);
    if is_fisheye {
        yaml.push_str("fisheye_model: 1\n");
    }
    matrix(&mut yaml, "distortion_coefficients", distortion.len(), &distortion);
    if exported.rms_px > 0.0 {
        let _ = writeln!(yaml, "avg_reprojection_error: {}", number(exported.rms_px));
    }
    yaml
}

/// The same as XML.
pub(super) fn xml(exported: &ExportedCamera<'_>) -> String {
    let Stored { size, camera, is_fisheye, distortion } = Stored::of(exported);
    let matrix = |name: &str, columns: usize, values: &[f64]| {
        let rows = values.len() / columns;
        let data: Vec<String> = values.iter().map(|value| number(*value)).collect();
        format!(
            "<{name} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{columns}</cols>\n  <dt>d</dt>\n  \
             <data>\n    {}</data></{name}>\n",
            data.join(" ")
        )
    };
    let rms = match exported.rms_px {
        0.0 => String::new(),
        rms_px => format!("<avg_reprojection_error>{}</avg_reprojection_error>\n", number(rms_px)),
    };
    format!(
        "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>{}</image_width>\n<image_height>{}</image_height>\n\
         {}{}{}{rms}</opencv_storage>\n",
        size[0],
        size[1],
        matrix("camera_matrix", 3, &camera),
        if is_fisheye { "<fisheye_model>1</fisheye_model>\n" } else { "" },
        matrix("distortion_coefficients", distortion.len(), &distortion)
    )
}

/// The same as JSON.
pub(super) fn json(exported: &ExportedCamera<'_>) -> String {
    let Stored { size, camera, is_fisheye, distortion } = Stored::of(exported);
    let rms = match exported.rms_px {
        0.0 => String::new(),
        rms_px => format!(",\n    \"avg_reprojection_error\": {}", number(rms_px)),
    };
    let matrix = |name: &str, columns: usize, values: &[f64]| {
        format!(
            "    \"{name}\": {{\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": {},\n        \
             \"cols\": {columns},\n        \"dt\": \"d\",\n        \"data\": [{}]\n    }}",
            values.len() / columns,
            numbers(values)
        )
    };
    format!(
        "{{\n    \"image_width\": {},\n    \"image_height\": {},\n{},\n{}{}{rms}\n}}\n",
        size[0],
        size[1],
        matrix("camera_matrix", 3, &camera),
        if is_fisheye { "    \"fisheye_model\": 1,\n" } else { "" },
        matrix("distortion_coefficients", distortion.len(), &distortion)
    )
}

/// Contents common to all kinds of `FileStorage`.
pub(super) struct Stored {
    /// Width and height.
    pub(super) size: [u32; 2],
    pub(super) camera: [f64; 9],
    pub(super) is_fisheye: bool,
    pub(super) distortion: Vec<f64>,
}

impl Stored {
    pub(super) fn of(exported: &ExportedCamera<'_>) -> Self {
        let [fx, fy, cx, cy] = exported.intrinsics();
        let coefficients = exported.coefficients();
        Self {
            size: [exported.image_size.width_px, exported.image_size.height_px],
            camera: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
            is_fisheye: matches!(coefficients, Coefficients::Fisheye(_)),
            distortion: match coefficients {
                Coefficients::None => vec![0.0; 5],
                Coefficients::Brown(coefficients) => coefficients.to_vec(),
                Coefficients::Rational(coefficients) => coefficients.to_vec(),
                Coefficients::Fisheye(coefficients) => coefficients.to_vec(),
            },
        }
    }
}

pub(super) fn matrix(yaml: &mut String, name: &str, columns: usize, values: &[f64]) {
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
