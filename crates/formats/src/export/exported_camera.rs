use boresight_calibrate::{LensFamily, LensModel};
use boresight_geometry::{Camera, Distortion, LensParameter, LensValues, frame::ImageSize};

/// Contents common to every format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExportedCamera<'a> {
    /// Name of the camera.
    pub name: &'a str,
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Size of the picture behind the lens.
    pub image_size: ImageSize,
    /// Root mean square reprojection residual per coordinate; 0 if unknown, and then left out of
    /// all files.
    pub rms_px: f64,
}

/// Reason for a calibration not to fit a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotExpressible {
    /// The format has no field for a nonzero coefficient.
    #[error("the format has no {coefficient}, which this lens model needs")]
    Coefficient {
        /// Name of the coefficient.
        coefficient: &'static str,
    },
    /// The format has no such lens model.
    #[error("the format has no {lens} lens model")]
    Lens {
        /// Name of the family of lens models.
        lens: &'static str,
    },
    /// A number of the file would be infinite.
    #[error("a number would be infinite: focal lengths or distances are no camera's")]
    NoNumber,
}

/// Smallest family for a lens, with coefficients in OpenCV's order.
pub(super) enum Coefficients {
    /// No distortion: a pinhole.
    None,
    /// `k1 k2 p1 p2 k3`.
    Brown([f64; 5]),
    /// `k1 k2 p1 p2 k3 k4 k5 k6`.
    Rational([f64; 8]),
    /// `k1 k2 k3 k4` of OpenCV's fisheye model.
    Fisheye([f64; 4]),
}

impl ExportedCamera<'_> {
    /// `fx fy cx cy`.
    pub(super) fn intrinsics(&self) -> [f64; 4] {
        self.camera.lens_parameters().of(LensParameter::F_THEN_PP)
    }

    pub(super) fn coefficients(&self) -> Coefficients {
        let Distortion { k1, k2, p1, p2, k3, k4, k5, k6, .. } = self.camera.distortion;
        match LensModel::simplest_with(&self.camera).family() {
            LensFamily::Brown if self.camera.distortion.is_none() => Coefficients::None,
            LensFamily::Brown => Coefficients::Brown([k1, k2, p1, p2, k3]),
            LensFamily::Rational => Coefficients::Rational([k1, k2, p1, p2, k3, k4, k5, k6]),
            LensFamily::Fisheye => Coefficients::Fisheye([k1, k2, k3, k4]),
        }
    }

    /// The name in letters, digits, `_`, `-` and `.`, to need no quotes in any format.
    pub(super) fn plain_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' };
        let name: String = self.name.chars().map(plain).collect();
        // A name with a letter first is a word to every reader and never a number.
        if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            name
        } else {
            format!("camera{name}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::tests::exported, *};

    #[test]
    fn names_are_words_to_every_reader() {
        let name = |name| ExportedCamera { name, ..exported(0.0) }.plain_name();
        assert_eq!(name("front camera"), "front_camera");
        assert_eq!(name("2026-11-21"), "camera2026-11-21");
        assert_eq!(name("a: b\n# c"), "a__b___c");
        assert_eq!(name(""), "camera");
    }
}
