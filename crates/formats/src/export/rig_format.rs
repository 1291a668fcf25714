use nalgebra::Isometry3;

use super::{ExportedCamera, NotExpressible, rig};
use crate::RigFile;
use boresight_geometry::frame::ImageSize;

/// File format of another program's several cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigFormat {
    /// OpenCV's `FileStorage` of two cameras, with their rectification.
    OpencvStereo,
    /// Kalibr camchain: Brown's without k3, fisheye.
    KalibrRig,
    /// URDF of ROS 2 with a static transform for each camera.
    Urdf,
    /// COLMAP `rig_config.json`.
    ColmapRig,
    /// Cameras of Anipose: Brown's, fisheye.
    Anipose,
}

/// Cameras for an export, the first in the frame of all.
#[derive(Clone, Debug)]
pub struct ExportedRig<'a> {
    pub(super) cameras: Vec<(ExportedCamera<'a>, Isometry3<f64>)>,
}

impl<'a> ExportedRig<'a> {
    /// Cameras of `file`. `None` if it has none, or a place is no pose.
    pub fn of(file: &'a RigFile) -> Option<Self> {
        let cameras = file.cameras.iter().map(|entry| {
            let [width_px, height_px] = entry.image_size;
            let camera = ExportedCamera {
                name: &entry.name,
                camera: entry.lens.camera(),
                image_size: ImageSize { width_px, height_px },
                rms_px: entry.lens.rms_px.unwrap_or(0.0),
            };
            Some((camera, entry.cam_from_rig.pose()?))
        });
        let mut cameras = cameras.collect::<Option<Vec<_>>>()?;
        let rig_from_first = cameras.first()?.1.inverse();
        cameras.iter_mut().for_each(|(_, cam_from_rig)| *cam_from_rig *= rig_from_first);
        Some(Self { cameras })
    }

    /// Two cameras by their names, the first in the frame of both. `None` if one is missing.
    pub fn pair(&self, names: [&str; 2]) -> Option<Self> {
        let of = |name: &str| self.cameras.iter().find(|(camera, _)| camera.name == name);
        let [first, second] = [of(names[0])?, of(names[1])?];
        let second_from_first = second.1 * first.1.inverse();
        Some(Self {
            cameras: vec![(first.0, Isometry3::identity()), (second.0, second_from_first)],
        })
    }

    /// Camera of this name. `None` if there's none.
    pub fn camera(&self, name: &str) -> Option<ExportedCamera<'a>> {
        self.cameras.iter().map(|(camera, _)| *camera).find(|camera| camera.name == name)
    }
}

impl RigFormat {
    /// Every format, in the order shown to a person.
    pub const ALL: [Self; 5] =
        [Self::OpencvStereo, Self::KalibrRig, Self::Urdf, Self::ColmapRig, Self::Anipose];

    /// Stable name, name for people, usual name of the file, purpose.
    fn names(self) -> [&'static str; 4] {
        match self {
            Self::OpencvStereo => {
                ["opencv-stereo", "OpenCV stereo", "stereo.yaml", "OpenCV's stereo pair, rectified"]
            }
            Self::KalibrRig => {
                ["kalibr-rig", "Kalibr rig", "camchain.yaml", "Kalibr camchain of a rig (no k3)"]
            }
            Self::Urdf => ["urdf", "URDF", "rig.urdf", "ROS 2 frames of a rig"],
            Self::ColmapRig => ["colmap-rig", "COLMAP rig", "rig_config.json", "COLMAP rig_config"],
            Self::Anipose => {
                ["anipose", "Anipose", "calibration.toml", "Anipose's cameras (no rational lens)"]
            }
        }
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        self.names()[0]
    }

    /// The program's name, for a person.
    pub fn label(self) -> &'static str {
        self.names()[1]
    }

    /// The usual name of the file.
    pub fn file(self) -> &'static str {
        self.names()[2]
    }

    /// Purpose of the format, and unsupported lenses.
    pub fn about(self) -> &'static str {
        self.names()[3]
    }

    /// Text of the format; of an OpenCV pair, the first two cameras.
    ///
    /// # Errors
    ///
    /// [`NotExpressible`] if the format can't hold a lens.
    pub fn write(self, exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
        match self {
            Self::OpencvStereo => rig::opencv_stereo(exported),
            Self::KalibrRig => rig::kalibr(exported),
            Self::Urdf => Ok(rig::urdf(exported)),
            Self::ColmapRig => Ok(rig::colmap(exported)),
            Self::Anipose => rig::anipose(exported),
        }
    }
}
