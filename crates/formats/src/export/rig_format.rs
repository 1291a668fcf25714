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
    write: fn(&ExportedRig<'_>) -> Result<String, NotExpressible>,
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

    #[rustfmt::skip]
    fn row(self) -> Row {
        let row = |code, label, file, about, write| Row { code, label, file, about, write };
        match self {
            Self::OpencvStereo => row("opencv-stereo", "OpenCV stereo", "stereo.yaml", "OpenCV's stereo pair, rectified", rig::opencv_stereo),
            Self::KalibrRig => row("kalibr-rig", "Kalibr rig", "camchain.yaml", "Kalibr camchain of a rig (no k3)", rig::kalibr),
            Self::Urdf => row("urdf", "URDF", "rig.urdf", "ROS 2 frames of a rig", |it| Ok(rig::urdf(it))),
            Self::StaticTransforms => row("ros-tf", "ROS 2 transforms", "rig.launch.xml", "ROS 2 launch file: static transforms of a rig", |it| Ok(rig::static_transforms(it))),
            Self::MatlabStereo => row("matlab-stereo", "MATLAB stereo", "stereo.m", "Script for MATLAB and Octave, of a pair (no wide lenses)", rig::matlab_stereo),
            Self::ColmapRig => row("colmap-rig", "COLMAP rig", "rig_config.json", "COLMAP rig_config", |it| Ok(rig::colmap(it))),
            Self::Anipose => row("anipose", "Anipose", "calibration.toml", "Anipose's cameras (no rational lens)", rig::anipose),
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
        (self.row().write)(exported)
    }
}
