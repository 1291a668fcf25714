use std::fmt::Write;

use super::{Coefficients, ExportedCamera, number::numbers};
use boresight_geometry::frame::ImageSize;

/// A calibration as `sensor_msgs/msg/CameraInfo` of ROS 2: `plumb_bob` with `k1 k2 p1 p2 k3`,
/// `rational_polynomial` with `k1 k2 p1 p2 k3 k4 k5 k6`, or `equidistant` with `k1 k2 k3 k4`.
///
/// The rectification is the identity and the projection the camera matrix, as for a single camera.
/// ROS counts pixels from the centre of the top-left one, as we do.
#[derive(Clone, Debug, PartialEq)]
pub struct RosCameraInfo {
    image_size: ImageSize,
    model: &'static str,
    coefficients: Vec<f64>,
    /// `fx fy cx cy` in pixels.
    intrinsics: [f64; 4],
}

impl RosCameraInfo {
    /// The calibration of `exported`.
    pub fn of(exported: &ExportedCamera<'_>) -> Self {
        let (model, coefficients) = match exported.coefficients() {
            Coefficients::None => ("plumb_bob", vec![0.0; 5]),
            Coefficients::Brown(coefficients) => ("plumb_bob", coefficients.to_vec()),
            Coefficients::Rational(coefficients) => ("rational_polynomial", coefficients.to_vec()),
            Coefficients::Fisheye(coefficients) => ("equidistant", coefficients.to_vec()),
        };
        let (image_size, intrinsics) = (exported.image_size, exported.intrinsics());
        Self { image_size, model, coefficients, intrinsics }
    }

    fn camera_matrix(&self) -> [f64; 9] {
        let [fx, fy, cx, cy] = self.intrinsics;
        [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
    }

    fn projection(&self) -> [f64; 12] {
        let [fx, fy, cx, cy] = self.intrinsics;
        [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    }

    /// The message in the Common Data Representation, the lower byte first, with the stamp and the
    /// frame of the picture; without the encapsulation header [`Self::CDR_HEADER`].
    pub fn message(&self, stamp_nanos: u64, frame_id: &str) -> Vec<u8> {
        const SECOND: u64 = 1_000_000_000;
        let mut cdr = Cdr(Vec::new());
        cdr.whole((stamp_nanos / SECOND) as u32);
        cdr.whole((stamp_nanos % SECOND) as u32);
        cdr.text(frame_id);
        cdr.whole(self.image_size.height_px);
        cdr.whole(self.image_size.width_px);
        cdr.text(self.model);
        cdr.whole(self.coefficients.len() as u32);
        cdr.numbers(&self.coefficients);
        cdr.numbers(&self.camera_matrix());
        cdr.numbers(&IDENTITY);
        cdr.numbers(&self.projection());
        // Neither binning nor a region of interest: 0 means the whole picture.
        for _ in 0..6 {
            cdr.whole(0);
        }
        cdr.0.push(0);
        cdr.0
    }

    /// Encapsulation header of a message: plain bytes, the lower one first.
    pub const CDR_HEADER: [u8; 4] = [0, 1, 0, 0];
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Bytes in the Common Data Representation: numbers are aligned to multiples of their size.
struct Cdr(Vec<u8>);

impl Cdr {
    fn align(&mut self, bytes: usize) {
        self.0.resize(self.0.len().next_multiple_of(bytes), 0);
    }

    fn whole(&mut self, value: u32) {
        self.align(4);
        self.0.extend(value.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.whole(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn numbers(&mut self, values: &[f64]) {
        if !values.is_empty() {
            self.align(8);
        }
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
}

/// The calibration for ROS `camera_calibration_parsers`, see [`RosCameraInfo`].
pub fn ros_camera_info(exported: &ExportedCamera<'_>) -> String {
    let info = RosCameraInfo::of(exported);
    let mut yaml = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(yaml, "image_width: {}", exported.image_size.width_px);
    let _ = writeln!(yaml, "image_height: {}", exported.image_size.height_px);
    let _ = writeln!(yaml, "camera_name: {}", exported.plain_name());
    matrix(&mut yaml, "camera_matrix", 3, &info.camera_matrix());
    let _ = writeln!(yaml, "distortion_model: {}", info.model);
    matrix(&mut yaml, "distortion_coefficients", info.coefficients.len(), &info.coefficients);
    matrix(&mut yaml, "rectification_matrix", 3, &IDENTITY);
    matrix(&mut yaml, "projection_matrix", 4, &info.projection());
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

    /// The length is that of rclpy's message for the same lens; tests/sources reads one with
    /// rosbags.
    #[test]
    fn a_message_holds_what_the_file_holds() {
        let exported = exported(0.0);
        let message = RosCameraInfo::of(&exported).message(7_000_000_005, "optical");
        let number = |at: usize| f64::from_le_bytes(*message[at..].first_chunk().expect("there"));
        assert_eq!(&message[..8], [7, 0, 0, 0, 5, 0, 0, 0]);
        // 8 bytes of time, 12 of the name, 8 of the size, 14 of the model, 6 to the next multiple
        // of 4 and 8.
        let coefficients = 48;
        assert_eq!(number(coefficients), -0.3);
        assert_eq!(number(coefficients + 40), 1000.0 / 3.0, "fx");
        assert_eq!(message.len(), coefficients + 8 * (5 + 9 + 9 + 12) + 25);
    }

    #[test]
    fn wide_lenses_have_their_own_models() {
        assert!(ros_camera_info(&rational()).contains("distortion_model: rational_polynomial\n"));
        assert!(ros_camera_info(&fisheye()).contains("distortion_model: equidistant\n"));
    }
}
