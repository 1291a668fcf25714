use super::{acceptance::AcceptanceGoal, known_lens::KnownLens, solve::lens_model::LensModel};

/// Settings of a calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationParams {
    /// Use weak priors on the lens while there are fewer than four different views.
    pub weak_priors: bool,
    /// Constrain `fy = fx`.
    pub square_pixels: bool,
    /// Lens models to choose from.
    pub models: Vec<LensModel>,
    /// Let every view have its own focal length, as with a zoom or an autofocus that can't be locked.
    pub varying_focal: bool,
    /// True if the sensor or the picture is shifted by design: a principal point far from the middle is then no reason
    /// for care.
    pub shifted_sensor: bool,
    /// Goal that the calibration must meet. It's judged against it; nothing else depends on it.
    pub accept: Option<AcceptanceGoal>,
    /// Relative standard deviation of the board's square size. Only the error of lengths depends on it: see
    /// [`ErrorBound::scale`](super::ErrorBound::scale).
    pub board_scale_sd: f64,
    /// Standard deviation of a corner coordinate in pixels as measured from the scatter of a board held still.
    pub noise_floor_px: Option<f64>,
    /// An earlier calibration of the same lens, untouched since. The result is held to it as far as the two agree.
    pub known_lens: Option<KnownLens>,
    /// Threads to use where views are many. The result doesn't depend on their number.
    pub threads: usize,
}

/// Default of [`CalibrationParams::board_scale_sd`]: the error of a ruler that is read to 0.2 mm on a board of 200 mm.
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
            threads: 1,
        }
    }
}

/// Why the views give no calibration at all.
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
    /// A view without exactly one corner per board corner.
    #[error("view {view}: {got} corners, expected {want}")]
    CornerCount {
        /// Index of the view, from 0.
        view: usize,
        /// Corners it has.
        got: usize,
        /// Corners of the board.
        want: usize,
    },
    /// A corner that is not finite or whose covariance is not positive definite.
    #[error("view {view}: corner {corner} is not a number")]
    CornerValue {
        /// Index of the view, from 0.
        view: usize,
        /// Index of the corner in the board's numbering, from 0.
        corner: usize,
    },
    /// A view whose corners are not the image of a flat board.
    #[error("view {view}: no homography")]
    NoHomography {
        /// Index of the view, from 0.
        view: usize,
    },
    /// A view whose corners do not run row by row over the board.
    #[error("view {view}: corners do not run row by row")]
    NoGrid {
        /// Index of the view, from 0.
        view: usize,
    },
    /// The views leave the lens undetermined, or fit no lens.
    #[error("{distinct} different views do not determine the lens")]
    Undetermined {
        /// Number of views that differ, repeats of a held pose left out.
        distinct: usize,
    },
}

impl NotCalibrated {
    /// Stable name, for files and programs.
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
