//! The calibrated rig, its findings, and reasons for having none.

use nalgebra::{DMatrix, Isometry3, Point3};

use super::{bundle::RigState, stated::Pair};
use crate::{NotCalibrated, Severity, Verdict};
use boresight_geometry::{LensMatrix, Rig, frame::ImageSize};

/// Ratio of the joint residual to a camera's own from which pictures may not be of one moment.
pub(super) const LATE: f64 = 1.5;
/// Multiple of a limit from which a rig can't be used.
pub(super) const UNUSABLE: f64 = 3.0;

/// Reason why pictures give no rig.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotARig {
    /// Fewer than two cameras.
    #[error("a rig has two cameras or more")]
    OneCamera,
    /// The views of a camera give no lens, and none is known.
    #[error("camera {camera}: {reason}")]
    NoLens {
        /// Camera, from 0.
        camera: usize,
        /// Reason.
        reason: NotCalibrated,
    },
    /// Cameras without a chain of common instants to the others.
    #[error("cameras {cameras:?} share no instant with the others")]
    Unlinked {
        /// Cameras, from 0.
        cameras: Vec<usize>,
    },
    /// The motion between two cameras differs from instant to instant.
    #[error("cameras {of:?} agree at {agreeing} of {instants} instants")]
    NotPairs {
        /// Cameras, from 0.
        of: [usize; 2],
        /// Instants with one motion.
        agreeing: usize,
        /// Compared instants.
        instants: usize,
    },
    /// The joint fit has no minimum.
    #[error("the pictures determine no rig")]
    Undetermined,
}

impl NotARig {
    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::OneCamera => "ONE-CAMERA",
            Self::NoLens { .. } => "NO-LENS",
            Self::Unlinked { .. } => "UNLINKED",
            Self::NotPairs { .. } => "NOT-PAIRS",
            Self::Undetermined => "UNDETERMINED",
        }
    }
}

/// Finding about a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigFinding {
    /// Too few instants to state an uncertainty.
    InstantsFew {
        /// Instants that at least two cameras saw.
        instants: usize,
        /// Instants from which uncertainty is stated.
        wanted: usize,
    },
    /// A camera or its lens was touched between two instants. Of two cameras, `camera` may be
    /// either.
    Touched {
        /// Camera; `None` if either of two.
        camera: Option<usize>,
        /// Number of the first instant after.
        from: u64,
    },
    /// The pictures of an instant are none of one moment. They tell of the lenses only.
    OtherInstant {
        /// Camera; `None` if either of two.
        camera: Option<usize>,
        /// Number of the instant.
        instant: u64,
    },
    /// A misfit with several explanations that fit alike.
    CauseUnclear,
    /// A camera's corners err more beside the others' than alone.
    Late {
        /// Camera.
        camera: usize,
        /// Ratio of the residuals.
        ratio: f64,
    },
    /// The weakest pair doesn't meet the goal.
    PairUncertain {
        /// The cameras.
        of: [usize; 2],
        /// 95 % bound of the typical row error in pixels, or of the length in metres.
        bound: f64,
        /// Goal in the same unit.
        goal: f64,
        /// True for a length.
        is_length: bool,
        /// True if the bound is far from the goal.
        is_unfinished: bool,
    },
    /// No board was where both cameras of a pair see it.
    PairUnseen {
        /// The cameras.
        of: [usize; 2],
    },
}

impl RigFinding {
    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::InstantsFew { .. } => "INSTANTS-FEW",
            Self::Touched { .. } => "CAMERA-TOUCHED",
            Self::OtherInstant { .. } => "OTHER-INSTANT",
            Self::CauseUnclear => "CAUSE-UNCLEAR",
            Self::Late { .. } => "CAMERA-LATE",
            Self::PairUncertain { .. } => "PAIR-UNCERTAIN",
            Self::PairUnseen { .. } => "PAIR-UNSEEN",
        }
    }

    /// Severity.
    pub fn severity(&self) -> Severity {
        match self {
            Self::InstantsFew { .. } | Self::Touched { .. } => Severity::Bad,
            Self::OtherInstant { .. } | Self::PairUnseen { .. } => Severity::Info,
            Self::Late { ratio, .. } if *ratio > UNUSABLE * LATE => Severity::Bad,
            Self::CauseUnclear | Self::Late { .. } => Severity::Care,
            Self::PairUncertain { is_unfinished, .. } => {
                if *is_unfinished {
                    Severity::Bad
                } else {
                    Severity::Care
                }
            }
        }
    }

    /// Codes of findings that more places of the board fix.
    pub const OF_TOO_FEW: [&str; 2] = ["INSTANTS-FEW", "PAIR-UNCERTAIN"];

    /// True if more places of the board help.
    pub fn is_of_too_few(&self) -> bool {
        Self::OF_TOO_FEW.contains(&self.code())
    }
}

/// Instant of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct RigInstant {
    /// Number given with the pictures.
    pub number: u64,
    /// Place of the board in the rig's frame, in metres.
    pub rig_from_board: Isometry3<f64>,
    /// Camera and root mean square residual per coordinate, in pixels, of each picture.
    pub residual_rms_px: Vec<(usize, f64)>,
}

/// Camera of a calibrated rig.
#[derive(Clone, Debug)]
pub struct RigCamera {
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// Covariance of the lens, in the order of the lens parameters; `None` with too few instants.
    pub covariance: Option<LensMatrix>,
    /// Root mean square residual per coordinate with the others, in pixels.
    pub rms_px: f64,
    /// The same for the camera alone; `None` with a known lens.
    pub alone_rms_px: Option<f64>,
    /// Number of pictures used.
    pub views: usize,
}

/// Rig with stated uncertainty.
#[derive(Clone, Debug)]
pub struct RigCalibration {
    /// Lenses and places. The frame is that of the camera with the most common instants.
    pub rig: Rig,
    /// Each camera, in the given order.
    pub cameras: Vec<RigCamera>,
    /// Points of the observed board in metres, in numbering order.
    pub board_m: Vec<Point3<f64>>,
    /// Stretch of the distances of the board's rows against those of the columns.
    pub stretch: f64,
    /// Covariance of all cameras' numbers: for each camera, the lens parameters, then a small turn
    /// (radians) and shift (metres) of its place; then four of the board. `None` with too few
    /// instants.
    pub covariance: Option<DMatrix<f64>>,
    /// Instants, by number.
    pub instants: Vec<RigInstant>,
    /// Each two cameras.
    pub pairs: Vec<Pair>,
    /// Findings, most severe first.
    pub findings: Vec<RigFinding>,
    /// Verdict by the worst finding.
    pub verdict: Verdict,
    /// What further places are weighed by; `None` if the instants leave a number open.
    pub(super) minimum: Option<Minimum>,
}

/// Minimum of the joint bundle, with its covariance even where too few instants let it be stated.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub(super) state: RigState,
    pub(super) covariance: DMatrix<f64>,
}

impl RigCalibration {
    /// True if the rig isn't wrong but unfinished: more places of the board make it better.
    pub fn is_unfinished(&self) -> bool {
        let mut bad = self.findings.iter().filter(|it| it.severity() == Severity::Bad).peekable();
        bad.peek().is_some() && bad.all(RigFinding::is_of_too_few)
    }
}
