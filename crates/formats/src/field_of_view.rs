use nalgebra::{Point2, Vector3};

use super::CalibrationFile;

impl CalibrationFile {
    /// Angles between the rays of opposite borders: across and down through the middle of the
    /// picture, and from the top-left to the bottom-right corner, in degrees. `None` without a
    /// lens, with a focal length for each view, or if the lens model doesn't reach the borders.
    pub fn field_of_view_deg(&self) -> Option<[f64; 3]> {
        let lens = self.result.as_ref().filter(|lens| !lens.focal_varies())?;
        let camera = lens.camera();
        // (0, 0) is the centre of the first pixel.
        let (width_px, height_px) = self.size_px();
        let (left, right, top, bottom) = (-0.5, width_px - 0.5, -0.5, height_px - 0.5);
        let (x, y) = ((width_px - 1.0) / 2.0, (height_px - 1.0) / 2.0);
        let ray =
            |x: f64, y: f64| -> Option<Vector3<f64>> { camera.ray_from_px(&Point2::new(x, y)) };
        let angle_deg = |from: (f64, f64), to: (f64, f64)| {
            Some(ray(from.0, from.1)?.angle(&ray(to.0, to.1)?).to_degrees())
        };
        let angles = [
            angle_deg((left, y), (right, y))?,
            angle_deg((x, top), (x, bottom))?,
            angle_deg((left, top), (right, bottom))?,
        ];
        angles.iter().all(|angle| angle.is_finite()).then_some(angles)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_pinhole_sees_what_trigonometry_says() {
        let file = |k1: f64| {
            let value = json!({
                "schema": "boresight.calibration/1", "image_size": [1000, 600], "views": [],
                "result": { "model": "k1", "f_px": [500.0, 500.0], "pp_px": [499.5, 299.5],
                    "distortion": { "k1": k1, "k2": 0, "p1": 0, "p2": 0, "k3": 0 } },
            });
            CalibrationFile::read(&value).expect("whole")
        };
        let [across, down, diagonal] = file(0.0).field_of_view_deg().expect("all borders");
        assert!((across - 90.0).abs() < 1e-9, "{across}");
        assert!((down - 2.0 * 0.6_f64.atan().to_degrees()).abs() < 1e-9, "{down}");
        assert!(diagonal > across);
        // A barrel sees more, until the model folds.
        assert!(file(-0.05).field_of_view_deg().expect("all borders")[0] > 90.0);
        assert_eq!(file(-0.3).field_of_view_deg(), None);
    }
}
