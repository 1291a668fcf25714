use boresight_geometry::frame::SceneScale;

use super::{acceptance::AcceptanceGoal, known_lens::KnownLens, solve::lens_model::LensModel};

/// Settings of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationParams {
    /// Use weak priors on the lens with fewer than four distinct views.
    pub weak_priors: bool,
    /// Constrain `fy = fx`.
    pub square_pixels: bool,
    /// Lens models to choose from.
    pub models: Vec<LensModel>,
    /// Allow a separate focal length for every view, as with a zoom or an autofocus that can't be
    /// locked.
    pub varying_focal: bool,
    /// True if the sensor or the picture is shifted by design: a principal point far from the
    /// middle is then no finding.
    pub shifted_sensor: bool,
    /// Goal for the verdict on the calibration; affects nothing else.
    pub accept: Option<AcceptanceGoal>,
    /// Relative standard deviation of the board's square size. Affects only the error of lengths:
    /// see [`ErrorBound::scale`](super::ErrorBound::scale).
    pub board_scale_sd: f64,
    /// Standard deviation of a corner coordinate in pixels, measured from the scatter of a board
    /// held still.
    pub noise_floor_px: Option<f64>,
    /// Earlier calibration of the same, untouched lens. The result is held to it as far as the two
    /// agree.
    pub known_lens: Option<KnownLens>,
    /// Focal length of each view by the scene behind the board, if known: it vetoes or confirms a
    /// focal length that differs between views. Empty without pictures.
    pub scene: Vec<Option<SceneScale>>,
    /// Number of threads for many views. Doesn't affect the result.
    pub threads: usize,
}

/// Default of [`CalibrationParams::board_scale_sd`]: the error of a ruler read to 0.2 mm on a board
/// of 200 mm.
pub const BOARD_SCALE_SD: f64 = 1e-3;

impl Default for CalibrationParams {
    fn default() -> Self {
        Self {
            weak_priors: true,
            square_pixels: true,
            models: LensModel::ALL.to_vec(),
            varying_focal: false,
            shifted_sensor: false,
            accept: None,
            board_scale_sd: BOARD_SCALE_SD,
            noise_floor_px: None,
            known_lens: None,
            scene: Vec::new(),
            threads: 1,
        }
    }
}

/// Reason for a failed calibration.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NotCalibrated {
    /// No views were given.
    #[error("no view")]
    NoViews,
    /// No lens models were given.
    #[error("no lens model")]
    NoModels,
    /// The picture has no pixels.
    #[error("picture of {width_px}x{height_px} px")]
    NoPicture {
        /// Width of the picture.
        width_px: u32,
        /// Height of the picture.
        height_px: u32,
    },
    /// A view doesn't have exactly one corner per board corner.
    #[error("view {view}: {got} corners, expected {want}")]
    CornerCount {
        /// Index of the view, from 0.
        view: usize,
        /// Number of corners in the view.
        got: usize,
        /// Number of corners on the board.
        want: usize,
    },
    /// A corner is not finite, or its covariance is not positive definite.
    #[error("view {view}: corner {corner} is not a number")]
    CornerValue {
        /// Index of the view, from 0.
        view: usize,
        /// Index of the corner in the board's numbering, from 0.
        corner: usize,
    },
    /// The corners of a view are not the image of a flat board.
    #[error("view {view}: no homography")]
    NoHomography {
        /// Index of the view, from 0.
        view: usize,
    },
    /// The corners of a view do not run row by row over the board.
    #[error("view {view}: corners do not run row by row")]
    NoGrid {
        /// Index of the view, from 0.
        view: usize,
    },
    /// The views leave the lens undetermined, or fit no lens.
    #[error("{distinct} different views do not determine the lens")]
    Undetermined {
        /// Number of distinct views, repeats of a held pose left out.
        distinct: usize,
    },
}

impl NotCalibrated {
    /// Stable name, for files and programs.
    ///
    /// ```
    /// # use boresight_calibrate::{CalibrationParams, calibrate};
    /// # use boresight_geometry::{boards::Board, frame::ImageSize};
    /// let board = Board::new(9, 6, 0.025)?;
    /// let size = ImageSize { width_px: 1280, height_px: 720 };
    /// let without_views = calibrate(&[], &board, size, &CalibrationParams::default());
    /// assert_eq!(without_views.err().map(|reason| reason.code()), Some("NO-VIEWS"));
    /// # Ok::<(), boresight_geometry::boards::InvalidBoard>(())
    /// ```
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoViews => "NO-VIEWS",
            Self::NoModels => "NO-MODELS",
            Self::NoPicture { .. } => "NO-PICTURE",
            Self::CornerCount { .. } => "CORNER-COUNT",
            Self::CornerValue { .. } => "CORNER-VALUE",
            Self::NoHomography { .. } => "NO-HOMOGRAPHY",
            Self::NoGrid { .. } => "CORNERS-WRONG",
            Self::Undetermined { .. } => "UNDETERMINED",
        }
    }
}
