//! Writes a calibration as text for other programs.
//!
//! | format | holds |
//! |---|---|
//! | [`CameraFormat`] | a camera, for each other program |
//! | [`RigFormat`] | several cameras |
//! | [`views_csv`] | each view with its numbers, for spreadsheets |
//! | [`board_csv`] | the board's points as found |
//! | [`corner_table::write`](super::corner_table::write) | corners |
//!
//! Each format's function names the models used for the lens. Numbers have 17 significant digits
//! and a decimal point in every locale, so they read back bit for bit. A lens beyond a format is
//! refused, never truncated.

mod basalt;
mod colmap;
mod csv;
mod exported_camera;
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

pub use colmap::{colmap_cameras, colmap_cameras_with_sd};
#[doc(hidden)]
pub use csv::csv_field;
pub use csv::{board_csv, views_csv};
use exported_camera::Coefficients;
pub use exported_camera::{ExportedCamera, NotExpressible};
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

use std::path::Path;

/// Declares formats with their facts by rows `Format, code, label, file, purpose, writer`.
macro_rules! formats {
    (
        $(#[$about:meta])*
        pub enum $formats:ident of $exported:ident
        $($(#[$what:meta])* $format:ident, $code:literal, $label:literal, $file:literal,
            $purpose:literal, $write:expr;)*
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $formats {
            $($(#[$what])* $format,)*
        }

        impl $formats {
            /// Every format, in the order shown to a person.
            pub const ALL: [Self; [$(Self::$format),*].len()] = [$(Self::$format),*];

            /// Stable name, for files and programs.
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$format => $code,)*
                }
            }

            /// The program's name, for a person.
            pub fn label(self) -> &'static str {
                match self {
                    $(Self::$format => $label,)*
                }
            }

            /// The usual name of the file.
            pub fn file(self) -> &'static str {
                match self {
                    $(Self::$format => $file,)*
                }
            }

            /// Purpose of the format, and unsupported lenses.
            pub fn about(self) -> &'static str {
                match self {
                    $(Self::$format => $purpose,)*
                }
            }

            fn writer(self) -> fn(&$exported<'_>) -> Result<String, NotExpressible> {
                match self {
                    $(Self::$format => $write,)*
                }
            }
        }
    };
}

use formats;

formats! {
    /// File format of another program's camera.
    pub enum CameraFormat of ExportedCamera

    /// OpenCV's `FileStorage` as YAML: every lens.
    OpencvYaml, "opencv-yaml", "OpenCV", "opencv.yaml", "OpenCV's FileStorage", |it| Ok(opencv_yaml(it));
    /// OpenCV's `FileStorage` as XML: every lens.
    OpencvXml, "opencv-xml", "OpenCV XML", "opencv.xml", "OpenCV's FileStorage as XML", |it| Ok(opencv::xml(it));
    /// OpenCV's `FileStorage` as JSON: every lens.
    OpencvJson, "opencv-json", "OpenCV JSON", "opencv.json", "OpenCV's FileStorage as JSON", |it| Ok(opencv::json(it));
    /// ROS `camera_info`: every lens.
    RosYaml, "ros-yaml", "ROS", "ros.yaml", "ROS camera_info", |it| Ok(ros_camera_info(it));
    /// Kalibr camchain, also for OpenVINS: Brown's without k3, fisheye.
    Kalibr, "kalibr", "Kalibr", "kalibr.yaml", "Kalibr camchain, for OpenVINS too (no k3)", kalibr_camchain;
    /// COLMAP `cameras.txt`: every lens; pixels from the corner.
    Colmap, "colmap", "COLMAP", "cameras.txt", "COLMAP cameras.txt", |it| Ok(colmap_cameras(it));
    /// mrcal `.cameramodel`: Brown's and rational; also with views.
    Mrcal, "mrcal", "mrcal", "camera.cameramodel", "mrcal .cameramodel (no fisheye)", mrcal_cameramodel;
    /// Script for MATLAB and Octave: Brown's; pixels from 1.
    Matlab, "matlab", "MATLAB", "camera.m", "Script for MATLAB and Octave (no wide lenses)", matlab_script;
    /// ORB-SLAM3's settings: Brown's, fisheye.
    OrbSlam3, "orb-slam3", "ORB-SLAM3", "orb_slam3.yaml", "ORB-SLAM3's camera settings (no rational lens)", orb_slam::write;
    /// `transforms.json` of Nerfstudio: Brown's, fisheye; pixels from the corner.
    Nerf, "nerf", "Nerfstudio", "transforms.json", "Nerfstudio's transforms.json (no rational lens)", nerf::nerfstudio;
    /// `transforms.json` of instant-ngp: Brown's without k3, fisheye; pixels from the corner.
    InstantNgp, "instant-ngp", "instant-ngp", "instant-ngp.json", "instant-ngp's transforms.json (no k3)", nerf::instant_ngp;
    /// Calibration of Agisoft Metashape: Brown's, fisheye; from the middle.
    Metashape, "metashape", "Metashape", "metashape.xml", "Agisoft Metashape's calibration (no rational lens)", metashape::write;
    /// XMP sidecar of RealityCapture: Brown's, with square pixels; from the middle.
    Realitycapture, "realitycapture", "RealityCapture", "realitycapture.xmp", "RealityCapture's XMP sidecar (no wide lenses)", realitycapture::write;
    /// Basalt's calibration: every lens, as `pinhole`, `pinhole-radtan8`, `kb4`.
    Basalt, "basalt", "Basalt", "basalt.json", "Basalt's calibration", |it| Ok(basalt::write(it));
    /// Camera file of VINS-Fusion: Brown's without k3, fisheye.
    Vins, "vins", "VINS", "vins.yaml", "VINS-Mono and VINS-Fusion (no k3)", vins::write;
    /// Calibration of PhotonVision: Brown's and rational.
    Photonvision, "photonvision", "PhotonVision", "photonvision.json", "PhotonVision's calibration (no fisheye)", photonvision::write;
    /// Lens profile of Gyroflow: fisheye.
    Gyroflow, "gyroflow", "Gyroflow", "gyroflow.json", "Gyroflow's lens profile (fisheye only)", gyroflow::write;
    /// Intrinsics of Open3D: no distortion.
    Open3d, "open3d", "Open3D", "open3d.json", "Open3D's pinhole intrinsics (no distortion)", open3d::write;
}

impl CameraFormat {
    /// `text`, a file of the format, with lines for a person. `None` if the format has no comments.
    pub fn with_comment(self, text: &str, lines: &[String]) -> Option<String> {
        let commented = |mark: &str| -> String {
            lines.iter().map(|line| format!("{mark} {line}\n")).collect()
        };
        match Path::new(self.file()).extension()?.to_str()? {
            // OpenCV's YAML must begin with its directive.
            "yaml" => Some(format!("{}\n{}", text.trim_end(), commented("#"))),
            "txt" | "cameramodel" => Some(commented("#") + text),
            "m" => Some(commented("%") + text),
            "xml" | "xmp" => {
                let (inside, end) = text.split_at(text.rfind("</").unwrap_or(text.len()));
                let lines = lines.join("\n").replace("--", "- -");
                Some(format!("{inside}<!-- {lines} -->\n{end}"))
            }
            _ => None,
        }
    }

    /// True if [`import`](crate::import) reads the format.
    #[doc(hidden)]
    pub fn is_read(self) -> bool {
        self != Self::Matlab
    }

    /// The camera as a file of the format.
    ///
    /// # Errors
    ///
    /// [`NotExpressible`] if the format can't hold the lens.
    ///
    /// ```
    /// # use boresight_formats::export::{CameraFormat, ExportedCamera};
    /// # use boresight_geometry::{Camera, frame::ImageSize};
    /// # use nalgebra::Point2;
    /// let exported = ExportedCamera {
    ///     name: "left",
    ///     camera: Camera::pinhole(900.0, Point2::new(640.0, 360.0)),
    ///     image_size: ImageSize { width_px: 1280, height_px: 720 },
    ///     rms_px: 0.1,
    /// };
    /// let yaml = CameraFormat::OpencvYaml.write(&exported)?;
    /// assert!(yaml.contains("camera_matrix"));
    /// # Ok::<(), boresight_formats::export::NotExpressible>(())
    /// ```
    pub fn write(self, exported: &ExportedCamera<'_>) -> Result<String, NotExpressible> {
        (self.writer())(exported)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Vector2};

    use super::*;
    use crate::import;
    use boresight_geometry::{Camera, Distortion, LensKind, frame::ImageSize};

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
    fn a_comment_changes_no_number() {
        let lines = ["It was bent -- by <2 mm>.".to_owned(), "See \"points_mm\".".to_owned()];
        for format in CameraFormat::ALL {
            let lenses = [exported(0.0), fisheye()];
            let Some(text) = lenses.iter().find_map(|lens| format.write(lens).ok()) else {
                continue;
            };
            let Some(commented) = format.with_comment(&text, &lines) else { continue };
            assert!(commented.contains("See \"points_mm\"."), "{format:?}");
            if format.is_read() {
                let read = |text: &str| import::read(text).expect("a calibration");
                assert_eq!(read(&commented).camera, read(&text).camera, "{format:?}");
            }
        }
    }

    #[test]
    fn each_format_reads_back_or_refuses() {
        let mut pinhole = exported(0.0);
        pinhole.camera.distortion = Distortion::default();
        let lenses = [pinhole, exported(0.0), exported(-0.02), rational(), fisheye()];
        // Pinhole, Brown's, with k3, rational, fisheye.
        let expected: [&str; CameraFormat::ALL.len()] = [
            ".....", // opencv-yaml
            ".....", // opencv-xml
            ".....", // opencv-json
            ".....", // ros-yaml
            "..xx.", // kalibr
            ".....", // colmap
            "....x", // mrcal
            "...xx", // matlab
            "...x.", // orb-slam3
            "...x.", // nerf
            "..xx.", // instant-ngp
            "...x.", // metashape
            "...xx", // realitycapture
            ".....", // basalt
            "..xx.", // vins
            "....x", // photonvision
            "xxxx.", // gyroflow
            ".xxxx", // open3d
        ];
        for (format, expected) in CameraFormat::ALL.into_iter().zip(expected) {
            let held = lenses.map(|lens| {
                let Ok(text) = format.write(&lens) else { return 'x' };
                if !format.is_read() {
                    return '.';
                }
                let read =
                    import::read(&text).unwrap_or_else(|err| panic!("{format:?}: {err}\n{text}"));
                assert_eq!(read.image_size, lens.image_size, "{format:?}");
                let pairs =
                    read.camera.lens_parameters().into_iter().zip(lens.camera.lens_parameters());
                // Formats with another origin round once.
                for (read, written) in pairs {
                    assert!(
                        (read - written).abs() <= 1e-15 * 2.0 * 1280.0,
                        "{format:?}: {read} {written}"
                    );
                }
                assert_eq!(read.camera.distortion, lens.camera.distortion, "{format:?}");
                '.'
            });
            assert_eq!(held.iter().collect::<String>(), expected, "{format:?}");
        }
    }

    #[test]
    fn names_are_told_apart() {
        for names in [CameraFormat::code, CameraFormat::label, CameraFormat::file] {
            let mut all: Vec<_> = CameraFormat::ALL.into_iter().map(names).collect();
            all.sort_unstable();
            all.dedup();
            assert_eq!(all.len(), CameraFormat::ALL.len());
        }
    }
}
