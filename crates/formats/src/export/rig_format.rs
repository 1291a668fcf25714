use super::{
    NotExpressible,
    rig::{self, ExportedRig},
};

/// File format of another program's several cameras.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigFormat {
    /// OpenCV's `FileStorage` of two cameras, with their rectification.
    OpencvStereo,
    /// Kalibr camchain: Brown's without k3, fisheye.
    KalibrRig,
    /// URDF of ROS 2 with a static transform for each camera.
    Urdf,
    /// Launch file of ROS 2 that publishes a static transform for each camera.
    StaticTransforms,
    /// Script with MATLAB's `stereoParameters`: Brown's.
    MatlabStereo,
    /// COLMAP `rig_config.json`.
    ColmapRig,
    /// Cameras of Anipose: Brown's, fisheye.
    Anipose,
}

impl RigFormat {
    /// Every format, in the order shown to a person.
    pub const ALL: [Self; 7] = [
        Self::OpencvStereo,
        Self::KalibrRig,
        Self::Urdf,
        Self::StaticTransforms,
        Self::MatlabStereo,
        Self::ColmapRig,
        Self::Anipose,
    ];

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
            Self::StaticTransforms => [
                "ros-tf",
                "ROS 2 transforms",
                "rig.launch.xml",
                "ROS 2 launch file: static transforms of a rig",
            ],
            Self::MatlabStereo => [
                "matlab-stereo",
                "MATLAB stereo",
                "stereo.m",
                "Script for MATLAB and Octave, of a pair (no wide lenses)",
            ],
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

    /// True if the format holds two cameras.
    pub fn is_of_two(self) -> bool {
        matches!(self, Self::OpencvStereo | Self::MatlabStereo)
    }

    /// Text of the format; of a pair, the first two cameras.
    ///
    /// # Errors
    ///
    /// [`NotExpressible`] if the format can't hold a lens.
    pub fn write(self, exported: &ExportedRig<'_>) -> Result<String, NotExpressible> {
        match self {
            Self::OpencvStereo => rig::opencv_stereo(exported),
            Self::KalibrRig => rig::kalibr(exported),
            Self::Urdf => Ok(rig::urdf(exported)),
            Self::StaticTransforms => Ok(rig::static_transforms(exported)),
            Self::MatlabStereo => rig::matlab_stereo(exported),
            Self::ColmapRig => Ok(rig::colmap(exported)),
            Self::Anipose => rig::anipose(exported),
        }
    }
}
