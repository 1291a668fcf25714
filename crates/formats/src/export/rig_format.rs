use super::{
    NotExpressible, formats,
    rig::{self, ExportedRig},
};

formats! {
    /// File format of another program's several cameras.
    pub enum RigFormat of ExportedRig

    /// OpenCV's `FileStorage` of two cameras, with their rectification.
    OpencvStereo, "opencv-stereo", "OpenCV stereo", "stereo.yaml", "OpenCV's stereo pair, rectified", rig::opencv_stereo;
    /// Kalibr camchain: Brown's without k3, fisheye.
    KalibrRig, "kalibr-rig", "Kalibr rig", "camchain.yaml", "Kalibr camchain of a rig (no k3)", rig::kalibr;
    /// URDF of ROS 2 with a static transform for each camera.
    Urdf, "urdf", "URDF", "rig.urdf", "ROS 2 frames of a rig", |it| Ok(rig::urdf(it));
    /// Launch file of ROS 2 that publishes a static transform for each camera.
    StaticTransforms, "ros-tf", "ROS 2 transforms", "rig.launch.xml", "ROS 2 launch file: static transforms of a rig", |it| Ok(rig::static_transforms(it));
    /// Script with MATLAB's `stereoParameters`: Brown's.
    MatlabStereo, "matlab-stereo", "MATLAB stereo", "stereo.m", "Script for MATLAB and Octave, of a pair (no wide lenses)", rig::matlab_stereo;
    /// COLMAP `rig_config.json`.
    ColmapRig, "colmap-rig", "COLMAP rig", "rig_config.json", "COLMAP rig_config", |it| Ok(rig::colmap(it));
    /// Cameras of Anipose: Brown's, fisheye.
    Anipose, "anipose", "Anipose", "calibration.toml", "Anipose's cameras (no rational lens)", rig::anipose;
}

impl RigFormat {
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
        (self.writer())(exported)
    }
}
