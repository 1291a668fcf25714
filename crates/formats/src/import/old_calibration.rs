//! A calibration read from a file of any format, and reasons for refusing a file.

use crate::{corner_table::TableView, named_covariance::LensCovariance};
use boresight_calibrate::Verdict;
use boresight_geometry::{
    BoardOutline, Camera, LENS_PARAMETERS, LensKind, LensParameter, boards::Board, frame::ImageSize,
};

/// A calibration read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct OldCalibration {
    /// Format of the file.
    pub format: OldFormat,
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Size of the picture behind the lens.
    pub image_size: ImageSize,
    /// Covariance of the lens parameters, zero for parameters held fixed. Only boresight's files
    /// state it.
    pub covariance: Option<LensCovariance>,
    /// Outlines of the boards, in pixels; empty if the file holds none.
    pub outlines: Vec<BoardOutline>,
    /// Root mean square reprojection residual, if stated.
    pub rms_px: Option<f64>,
    /// The verdict, if stated.
    pub verdict: Option<Verdict>,
    /// The board, if stated.
    pub board: Option<Board>,
    /// Name of the camera, if stated: boresight's `source`, ROS's `camera_name`, Kalibr's topic.
    pub source: Option<String>,
    /// Locked values of focus and zoom, if stated.
    pub locked: LockedLens,
    /// True if each view has an individual focal length and the camera's is their mean.
    pub focal_varies: bool,
    /// Number of cameras in the file; the first was read.
    pub camera_count: usize,
    /// Corners of the calibration's own views, if the file brings them.
    pub corners: Option<OwnCorners>,
    /// Number of views behind the lens, if stated.
    pub views: Option<usize>,
    /// Rectifying rotation of a ROS file, row by row.
    pub rectification: Option<[f64; 9]>,
    /// Projection of the rectified pictures of a ROS file, row by row.
    pub projection: Option<[f64; 12]>,
}

/// Corners of a calibration's own views.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnCorners {
    /// The board. A length of 1 or more counts as millimetres, a shorter one as metres.
    pub board: Board,
    /// Its corners in each view.
    pub views: Vec<TableView>,
}

/// Locked controls with an effect on the calibration, in the driver's units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LockedLens {
    /// Distance at which the lens is sharp.
    pub focus: Option<i64>,
    /// Focal length of the zoom, in the driver's unit.
    pub zoom: Option<i64>,
}

/// Readable formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OldFormat {
    /// boresight's own `boresight.calibration/1`.
    Own,
    /// Output of OpenCV's `FileStorage`: YAML, XML or JSON.
    OpenCv,
    /// Output of ROS's `camera_calibration`.
    Ros,
    /// A Kalibr camchain.
    Kalibr,
    /// An mrcal `.cameramodel`.
    Mrcal,
    /// COLMAP's `cameras.txt`.
    Colmap,
    /// ORB-SLAM3's settings.
    OrbSlam3,
    /// A `transforms.json` of Nerfstudio or instant-ngp.
    Nerf,
    /// A calibration of Agisoft Metashape.
    Metashape,
    /// An XMP sidecar of RealityCapture.
    Realitycapture,
    /// A calibration of Basalt.
    Basalt,
    /// A camera file of VINS-Mono or VINS-Fusion.
    Vins,
    /// A calibration of PhotonVision.
    Photonvision,
    /// A lens profile of Gyroflow.
    Gyroflow,
    /// Intrinsics of Open3D.
    Open3d,
}

/// Reason for a text not to be usable as a calibration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NotImported {
    /// More than [`MAX_BYTES`](super::MAX_BYTES).
    #[error("it has {bytes} bytes, which no calibration has")]
    TooLong {
        /// Length in bytes.
        bytes: usize,
    },
    /// The text is in none of the formats.
    #[error("it is in none of the formats that can be read: {FORMATS}")]
    UnknownFormat,
    /// The text breaks the format's rules.
    #[error("not well formed: {reason}")]
    Malformed {
        /// The mistake in the file.
        reason: String,
    },
    /// The schema is a later version of boresight's own.
    #[error("its schema is {found:?}, this version reads \"boresight.calibration/1\"")]
    Schema {
        /// Schema in the file.
        found: String,
    },
    /// The session ended without a calibration.
    #[error("it holds no result")]
    NoResult,
    /// A value is missing, no number, or of the wrong count of numbers.
    #[error("{name} is missing or not {wanted}")]
    Missing {
        /// Name in the file.
        name: &'static str,
        /// The expected value.
        wanted: &'static str,
    },
    /// The file doesn't say how large the pictures are, and no size was stated.
    #[error("it doesn't say how large the pictures are")]
    NoSize,
    /// The stated size of the pictures is another than the file's.
    #[error("it's for pictures of {found}, not of the stated {stated}")]
    OtherSize {
        /// Size in the file.
        found: ImageSize,
        /// Size stated by a person.
        stated: ImageSize,
    },
    /// The file is of a program whose calibrations can't be read.
    #[error("it's a calibration of {program}, which can't be read; {KNOWN_LENS}")]
    Unread {
        /// Name of the program.
        program: &'static str,
    },
    /// The lens model is none of OpenCV's.
    #[error("its lens model is {found:?}; {KNOWN_LENS}")]
    Model {
        /// Lens model in the file.
        found: String,
    },
    /// A coefficient beyond k1, k2, p1, p2, k3, k4, k5, k6 is not zero.
    #[error("its lens has {coefficient} = {value}; {KNOWN_LENS}")]
    Coefficient {
        /// Name of the coefficient.
        coefficient: &'static str,
        /// Value of the coefficient, as text.
        value: String,
    },
    /// A number is impossible for a camera.
    #[error("{name} is {value}, which no camera has")]
    Nonsense {
        /// Name of the number.
        name: &'static str,
        /// The number, as text.
        value: String,
    },
}

const FORMATS: &str = "boresight's calibration.json, OpenCV's YAML, XML or JSON, ROS camera_info, Kalibr camchain, mrcal .cameramodel, COLMAP cameras.txt, ORB-SLAM3, transforms.json, Metashape, RealityCapture XMP, Basalt, VINS, PhotonVision, Gyroflow, Open3D";
const KNOWN_LENS: &str =
    "only pinholes with k1, k2, p1, p2, k3, k4, k5, k6 and OpenCV's fisheye model can be read";

impl OldFormat {
    /// Name of the format for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "boresight",
            Self::OpenCv => "OpenCV",
            Self::Ros => "ROS camera_info",
            Self::Kalibr => "Kalibr camchain",
            Self::Mrcal => "mrcal cameramodel",
            Self::Colmap => "COLMAP cameras.txt",
            Self::OrbSlam3 => "ORB-SLAM3",
            Self::Nerf => "transforms.json",
            Self::Metashape => "Metashape",
            Self::Realitycapture => "RealityCapture",
            Self::Basalt => "Basalt",
            Self::Vins => "VINS",
            Self::Photonvision => "PhotonVision",
            Self::Gyroflow => "Gyroflow",
            Self::Open3d => "Open3D",
        }
    }
}

impl OldCalibration {
    /// Checks the contents common to all formats.
    pub(super) fn new(
        format: OldFormat,
        kind: LensKind,
        lens: &[f64; LENS_PARAMETERS],
        size: [f64; 2],
    ) -> Result<Self, NotImported> {
        let nonsense = |name, value: f64| NotImported::Nonsense { name, value: value.to_string() };
        for (of, value) in LensParameter::ALL.into_iter().zip(lens) {
            if !value.is_finite() || (LensParameter::F.contains(&of) && *value <= 1.0) {
                return Err(nonsense(of.name(), *value));
            }
        }
        let [width_px, height_px] = size.map(|side| {
            let whole = side.fract() == 0.0 && (1.0..=1e5).contains(&side);
            // A whole number up to 100 000 fits.
            if whole { Ok(side as u32) } else { Err(nonsense("the picture's size", side)) }
        });
        Ok(Self {
            format,
            camera: Camera::from_lens_parameters(kind, lens),
            image_size: ImageSize { width_px: width_px?, height_px: height_px? },
            covariance: None,
            outlines: Vec::new(),
            rms_px: None,
            verdict: None,
            board: None,
            source: None,
            locked: LockedLens::default(),
            focal_varies: false,
            camera_count: 1,
            corners: None,
            views: None,
            rectification: None,
            projection: None,
        })
    }
}
