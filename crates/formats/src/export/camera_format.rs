use super::{
    ExportedCamera, NotExpressible, basalt, colmap_cameras, gyroflow, kalibr_camchain,
    matlab_script, metashape, mrcal_cameramodel, nerf, open3d, opencv, opencv_yaml, orb_slam,
    photonvision, realitycapture, ros_camera_info, vins,
};

/// File format of another program's camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraFormat {
    /// OpenCV's `FileStorage` as YAML: every lens.
    OpencvYaml,
    /// OpenCV's `FileStorage` as XML: every lens.
    OpencvXml,
    /// OpenCV's `FileStorage` as JSON: every lens.
    OpencvJson,
    /// ROS `camera_info`: every lens.
    RosYaml,
    /// Kalibr camchain, also for OpenVINS: Brown's without k3, fisheye.
    Kalibr,
    /// COLMAP `cameras.txt`: every lens.
    Colmap,
    /// mrcal `.cameramodel`: Brown's and rational.
    Mrcal,
    /// Script for MATLAB and Octave: Brown's.
    Matlab,
    /// ORB-SLAM3's settings: Brown's, fisheye.
    OrbSlam3,
    /// `transforms.json` of Nerfstudio: Brown's, fisheye.
    Nerf,
    /// `transforms.json` of instant-ngp: Brown's without k3, fisheye.
    InstantNgp,
    /// Calibration of Agisoft Metashape: Brown's, fisheye.
    Metashape,
    /// XMP sidecar of RealityCapture: Brown's, with square pixels.
    Realitycapture,
    /// Basalt's calibration: every lens.
    Basalt,
    /// Camera file of VINS-Fusion: Brown's without k3, fisheye.
    Vins,
    /// Calibration of PhotonVision: Brown's and rational.
    Photonvision,
    /// Lens profile of Gyroflow: fisheye.
    Gyroflow,
    /// Intrinsics of Open3D: no distortion.
    Open3d,
}

/// Row of a format.
struct Row {
    /// Stable name, for files and programs.
    code: &'static str,
    /// Short name, for people.
    label: &'static str,
    /// Usual name of the file.
    file: &'static str,
    /// Purpose, and unsupported lenses.
    about: &'static str,
    comments: Comments,
    write: fn(&ExportedCamera<'_>) -> Result<String, NotExpressible>,
}

/// Place of comments in a format, with the mark of a line.
enum Comments {
    Before(&'static str),
    /// OpenCV's YAML must begin with its directive.
    After(&'static str),
    /// Inside the last element.
    Xml,
    None,
}

impl CameraFormat {
    /// Every format, in the order shown to a person.
    pub const ALL: [Self; 18] = [
        Self::OpencvYaml,
        Self::OpencvXml,
        Self::OpencvJson,
        Self::RosYaml,
        Self::Kalibr,
        Self::Colmap,
        Self::Mrcal,
        Self::Matlab,
        Self::OrbSlam3,
        Self::Nerf,
        Self::InstantNgp,
        Self::Metashape,
        Self::Realitycapture,
        Self::Basalt,
        Self::Vins,
        Self::Photonvision,
        Self::Gyroflow,
        Self::Open3d,
    ];

    #[rustfmt::skip]
    fn row(self) -> Row {
        use Comments as C;
        let row = |code, label, file, about, comments, write| Row { code, label, file, about, comments, write };
        match self {
            Self::OpencvYaml => row("opencv-yaml", "OpenCV", "opencv.yaml", "OpenCV's FileStorage", C::After("#"), |it| Ok(opencv_yaml(it))),
            Self::OpencvXml => row("opencv-xml", "OpenCV XML", "opencv.xml", "OpenCV's FileStorage as XML", C::Xml, |it| Ok(opencv::xml(it))),
            Self::OpencvJson => row("opencv-json", "OpenCV JSON", "opencv.json", "OpenCV's FileStorage as JSON", C::None, |it| Ok(opencv::json(it))),
            Self::RosYaml => row("ros-yaml", "ROS", "ros.yaml", "ROS camera_info", C::After("#"), |it| Ok(ros_camera_info(it))),
            Self::Kalibr => row("kalibr", "Kalibr", "kalibr.yaml", "Kalibr camchain, for OpenVINS too (no k3)", C::After("#"), kalibr_camchain),
            Self::Colmap => row("colmap", "COLMAP", "cameras.txt", "COLMAP cameras.txt", C::Before("#"), |it| Ok(colmap_cameras(it))),
            Self::Mrcal => row("mrcal", "mrcal", "camera.cameramodel", "mrcal .cameramodel (no fisheye)", C::Before("#"), mrcal_cameramodel),
            Self::Matlab => row("matlab", "MATLAB", "camera.m", "Script for MATLAB and Octave (no wide lenses)", C::Before("%"), matlab_script),
            Self::OrbSlam3 => row("orb-slam3", "ORB-SLAM3", "orb_slam3.yaml", "ORB-SLAM3's camera settings (no rational lens)", C::After("#"), orb_slam::write),
            Self::Nerf => row("nerf", "Nerfstudio", "transforms.json", "Nerfstudio's transforms.json (no rational lens)", C::None, nerf::nerfstudio),
            Self::InstantNgp => row("instant-ngp", "instant-ngp", "instant-ngp.json", "instant-ngp's transforms.json (no k3)", C::None, nerf::instant_ngp),
            Self::Metashape => row("metashape", "Metashape", "metashape.xml", "Agisoft Metashape's calibration (no rational lens)", C::Xml, metashape::write),
            Self::Realitycapture => row("realitycapture", "RealityCapture", "realitycapture.xmp", "RealityCapture's XMP sidecar (no wide lenses)", C::Xml, realitycapture::write),
            Self::Basalt => row("basalt", "Basalt", "basalt.json", "Basalt's calibration", C::None, |it| Ok(basalt::write(it))),
            Self::Vins => row("vins", "VINS", "vins.yaml", "VINS-Mono and VINS-Fusion (no k3)", C::After("#"), vins::write),
            Self::Photonvision => row("photonvision", "PhotonVision", "photonvision.json", "PhotonVision's calibration (no fisheye)", C::None, photonvision::write),
            Self::Gyroflow => row("gyroflow", "Gyroflow", "gyroflow.json", "Gyroflow's lens profile (fisheye only)", C::None, gyroflow::write),
            Self::Open3d => row("open3d", "Open3D", "open3d.json", "Open3D's pinhole intrinsics (no distortion)", C::None, open3d::write),
        }
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        self.row().code
    }

    /// The program's name, for a person.
    pub fn label(self) -> &'static str {
        self.row().label
    }

    /// The usual name of the file.
    pub fn file(self) -> &'static str {
        self.row().file
    }

    /// Purpose of the format, and unsupported lenses.
    pub fn about(self) -> &'static str {
        self.row().about
    }

    /// `text`, a file of the format, with lines for a person. `None` if the format has no comments.
    pub fn with_comment(self, text: &str, lines: &[String]) -> Option<String> {
        let commented = |mark: &str| -> String {
            lines.iter().map(|line| format!("{mark} {line}\n")).collect()
        };
        match self.row().comments {
            Comments::After(mark) => Some(format!("{}\n{}", text.trim_end(), commented(mark))),
            Comments::Before(mark) => Some(commented(mark) + text),
            Comments::Xml => {
                let (inside, end) = text.split_at(text.rfind("</").unwrap_or(text.len()));
                let lines = lines.join("\n").replace("--", "- -");
                Some(format!("{inside}<!-- {lines} -->\n{end}"))
            }
            Comments::None => None,
        }
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
        (self.row().write)(exported)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::tests::{exported, fisheye, rational},
        *,
    };
    use crate::import;
    use boresight_geometry::Distortion;

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
            if format != CameraFormat::Matlab {
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
        let refusals = CameraFormat::ALL.map(|format| {
            let refused = lenses.map(|lens| {
                let Ok(text) = format.write(&lens) else { return 'x' };
                if format == CameraFormat::Matlab {
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
            (format.code(), refused.iter().collect::<String>())
        });
        // Pinhole, Brown's, with k3, rational, fisheye.
        let expected = [
            ("opencv-yaml", "....."),
            ("opencv-xml", "....."),
            ("opencv-json", "....."),
            ("ros-yaml", "....."),
            ("kalibr", "..xx."),
            ("colmap", "....."),
            ("mrcal", "....x"),
            ("matlab", "...xx"),
            ("orb-slam3", "...x."),
            ("nerf", "...x."),
            ("instant-ngp", "..xx."),
            ("metashape", "...x."),
            ("realitycapture", "...xx"),
            ("basalt", "....."),
            ("vins", "..xx."),
            ("photonvision", "....x"),
            ("gyroflow", "xxxx."),
            ("open3d", ".xxxx"),
        ];
        for (found, expected) in refusals.iter().zip(expected) {
            assert_eq!((found.0, found.1.as_str()), expected);
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
