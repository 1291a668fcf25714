//! Writes a calibration as text for other programs.
//!
//! | format | read by | holds the lens |
//! |---|---|---|
//! | [`opencv_yaml`] | OpenCV's `FileStorage` (XML and JSON, too) | every lens; a fisheye one for `cv::fisheye` |
//! | [`ros_camera_info`] | ROS `camera_info_manager`, `image_proc` | every lens: `plumb_bob`, `rational_polynomial`, `equidistant` |
//! | [`kalibr_camchain`] | Kalibr and what reads its camchain | Brown's without k3 as `radtan`, a fisheye as `equidistant` |
//! | [`colmap_cameras`] | COLMAP | every lens; pixels counted from the picture's corner |
//! | [`mrcal_cameramodel`] | mrcal | Brown's as `LENSMODEL_OPENCV5`, rational as `LENSMODEL_OPENCV8`; with views, also `optimization_inputs` |
//! | [`matlab_script`] | MATLAB, Octave | Brown's; pixels counted from 1 |
//! | `orb_slam` | ORB-SLAM3 | Brown's as `PinHole`, a fisheye as `KannalaBrandt8` |
//! | `nerf` | Nerfstudio, instant-ngp | Brown's as `OPENCV`, a fisheye as `OPENCV_FISHEYE`; pixels counted from the corner |
//! | `metashape` | Agisoft Metashape | Brown's as `frame`, a fisheye as `fisheye`; counted from the middle |
//! | `realitycapture` | RealityCapture | Brown's as `brown3` or `brown3t2`, with square pixels; counted from the middle, in longer sides |
//! | `basalt` | Basalt | every lens: `pinhole`, `pinhole-radtan8`, `kb4` |
//! | `vins` | VINS-Mono, VINS-Fusion | Brown's without k3 as `PINHOLE`, a fisheye as `KANNALA_BRANDT` |
//! | `photonvision` | PhotonVision | Brown's and rational |
//! | `gyroflow` | Gyroflow | a fisheye |
//! | `open3d` | Open3D | a pinhole without distortion |
//! | [`views_csv`] | spreadsheets | each view with its numbers |
//! | [`corner_table::write`](super::corner_table::write) | mrcal, mrgingham, this program | the corners themselves |
//!
//! [`CameraFormat`] names all those that hold a camera. Numbers have 17 significant digits and a decimal point in every locale, so that they read back bit for
//! bit. What a format can't hold is refused, never dropped.

mod basalt;
mod camera_format;
mod colmap;
mod csv;
mod gyroflow;
mod kalibr;
mod matlab;
mod metashape;
mod mrcal;
mod mrcal_inputs;
mod nerf;
pub(super) mod number;
mod open3d;
mod opencv;
mod orb_slam;
mod photonvision;
mod realitycapture;
mod ros;
mod vins;

pub use camera_format::CameraFormat;
pub use colmap::{colmap_cameras, colmap_cameras_with_sd};
pub use csv::{csv_field, views_csv};
pub use kalibr::kalibr_camchain;
pub use matlab::matlab_script;
pub use mrcal::{mrcal_cameramodel, mrcal_cameramodel_with_views};
pub use mrcal_inputs::SolvedView;
pub use opencv::opencv_yaml;
pub use ros::{RosCameraInfo, ros_camera_info};

use boresight_calibrate::{LensFamily, LensModel};
use boresight_geometry::{Camera, Distortion, LensParameter, LensValues, frame::ImageSize};

/// Contents common to every format.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExportedCamera<'a> {
    /// Name of the camera.
    pub name: &'a str,
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Size of the picture that the lens belongs to.
    pub image_size: ImageSize,
    /// Root mean square reprojection residual per coordinate; 0 if it isn't known, and then no file states it.
    pub rms_px: f64,
}

/// Why a format can't hold a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotExpressible {
    /// The format has no field for a coefficient that isn't zero.
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
}

/// The smallest family that holds a lens, with its coefficients in OpenCV's order.
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
    fn intrinsics(&self) -> [f64; 4] {
        self.camera.lens_parameters().of(LensParameter::F_THEN_PP)
    }

    fn coefficients(&self) -> Coefficients {
        let Distortion { k1, k2, p1, p2, k3, k4, k5, k6, .. } = self.camera.distortion;
        match LensModel::simplest_with(&self.camera).family() {
            LensFamily::Brown if self.camera.distortion.is_none() => Coefficients::None,
            LensFamily::Brown => Coefficients::Brown([k1, k2, p1, p2, k3]),
            LensFamily::Rational => Coefficients::Rational([k1, k2, p1, p2, k3, k4, k5, k6]),
            LensFamily::Fisheye => Coefficients::Fisheye([k1, k2, k3, k4]),
        }
    }

    /// The name in letters, digits, `_`, `-` and `.`, so that no format needs quotes around it.
    fn plain_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() || "_-.".contains(c) { c } else { '_' };
        let name: String = self.name.chars().map(plain).collect();
        // A name that starts with a letter is a word to every reader and never a number.
        if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
            name
        } else {
            format!("camera{name}")
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Vector2};

    use super::*;
    use boresight_geometry::LensKind;

    pub(super) fn exported(k3: f64) -> ExportedCamera<'static> {
        ExportedCamera {
            name: "front camera",
            camera: Camera {
                f_px: Vector2::new(1000.0 / 3.0, 1000.0 / 3.0),
                pp_px: Point2::new(652.25, 351.5),
                distortion: Distortion {
                    k1: -0.3,
                    k2: 0.125,
                    p1: 0.0,
                    p2: -7e-4,
                    k3,
                    ..Distortion::default()
                },
            },
            image_size: ImageSize { width_px: 1280, height_px: 720 },
            rms_px: 0.25,
        }
    }

    pub(super) fn fisheye() -> ExportedCamera<'static> {
        let mut exported = exported(0.01);
        let (kind, k4) = (LensKind::Fisheye, -2e-3);
        exported.camera.distortion = Distortion { kind, k4, p2: 0.0, ..exported.camera.distortion };
        exported
    }

    pub(super) fn rational() -> ExportedCamera<'static> {
        let mut exported = exported(-0.02);
        (exported.camera.distortion.k4, exported.camera.distortion.k6) = (0.2, -0.01);
        exported
    }

    #[test]
    fn names_are_words_to_every_reader() {
        let name = |name| ExportedCamera { name, ..exported(0.0) }.plain_name();
        assert_eq!(name("front camera"), "front_camera");
        assert_eq!(name("2026-11-21"), "camera2026-11-21");
        assert_eq!(name("a: b\n# c"), "a__b___c");
        assert_eq!(name(""), "camera");
    }
}
