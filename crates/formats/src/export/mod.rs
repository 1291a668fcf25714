//! Writes a calibration as text for other programs.
//!
//! | format | read by | holds the lens |
//! |---|---|---|
//! | [`opencv_yaml`] | OpenCV's `FileStorage` | every lens |
//! | [`ros_camera_info`] | ROS `camera_info_manager`, `image_proc` | every lens |
//! | [`kalibr_camchain`] | Kalibr, OpenVINS | Brown's without k3, fisheye |
//! | [`colmap_cameras`] | COLMAP | every lens; pixels from the corner |
//! | [`mrcal_cameramodel`] | mrcal | Brown's, rational; also with views |
//! | [`matlab_script`] | MATLAB, Octave | Brown's; pixels from 1 |
//! | `orb_slam` | ORB-SLAM3 | Brown's, fisheye |
//! | `nerf` | Nerfstudio | Brown's, fisheye; pixels from the corner |
//! | `nerf` | instant-ngp | Brown's without k3, fisheye; pixels from the corner |
//! | `metashape` | Agisoft Metashape | Brown's, fisheye; from the middle |
//! | `realitycapture` | RealityCapture | Brown's, square pixels; from the middle |
//! | `basalt` | Basalt | every lens: `pinhole`, `pinhole-radtan8`, `kb4` |
//! | `vins` | VINS-Mono, VINS-Fusion | Brown's without k3, fisheye |
//! | `photonvision` | PhotonVision | Brown's and rational |
//! | `gyroflow` | Gyroflow | a fisheye |
//! | `open3d` | Open3D | a pinhole without distortion |
//! | [`RigFormat`] | OpenCV stereo, Kalibr, ROS 2, MATLAB, COLMAP, Anipose | several cameras |
//! | [`views_csv`] | spreadsheets | each view with its numbers |
//! | [`board_csv`] | programs of one's own | the board's points as found |
//! | [`corner_table::write`](super::corner_table::write) | mrcal, mrgingham, boresight | corners |
//!
//! Each format's function names the models used for the lens. [`CameraFormat`] lists all formats
//! for a camera. Numbers have 17 significant digits and a decimal point in every locale, so they
//! read back bit for bit. A lens beyond a format is refused, never truncated.

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
mod rig;
mod rig_format;
mod ros;
mod vins;

pub use camera_format::CameraFormat;
pub use colmap::{colmap_cameras, colmap_cameras_with_sd};
#[doc(hidden)]
pub use csv::csv_field;
pub use csv::{board_csv, views_csv};
pub use kalibr::kalibr_camchain;
pub use matlab::matlab_script;
pub use mrcal::{mrcal_cameramodel, mrcal_cameramodel_with_views};
#[doc(hidden)]
pub use mrcal_inputs::SolvedView;
pub use opencv::opencv_yaml;
#[doc(hidden)]
pub use rig::ExportedRig;
#[doc(hidden)]
pub use rig_format::RigFormat;
#[doc(hidden)]
pub use ros::RosCameraInfo;
pub use ros::ros_camera_info;

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

    /// The name in letters, digits, `_`, `-` and `.`, to need no quotes in any format.
    fn plain_name(&self) -> String {
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
