//! Table of the causes: one row a kind.

use super::columns::{
    ASPECT, BEND, FIELD, FIELDS, PRISM, RADIAL, SCALE, SCALE_R2, SHIFT, SHUTTER, SKEW, STRETCH,
};
use crate::solve::odds::{LIKELY, UNLIKELY};
use boresight_geometry::frame::ImageSize;

/// Kind of a cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `fy ≠ fx`.
    PixelAspect,
    /// The squares of the board aren't square.
    BoardStretched,
    /// Rows and columns of the picture aren't at right angles.
    PixelSkew,
    /// The board is bowed along x and y, and twisted.
    BoardBent,
    /// A further radial term, and thin prisms.
    LensShape,
    /// The focal length changes at a constant rate from the first view to the last.
    FocusDrift,
    /// The focal length follows the board's distance.
    FocusBreathes,
    /// The focal length jumps at a view.
    FocusJump,
    /// Some views come from a different camera, mode or picture size.
    Mixed,
    /// Every view has its own focal length.
    FocusScatters,
    /// Every view is shifted in the picture, as by a stabiliser.
    Shifted,
    /// Each view moved during readout, row by row.
    RollingShutter,
    /// The board bends differently in each view.
    BoardFlexes,
}

/// How a cause acts on the views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scope {
    /// Alike on all views.
    Shared,
    /// By one course of the focal length over the views.
    Course,
    /// On one of two groups of views.
    Groups,
    /// Independently on each view.
    Own,
}

/// Part of the setup blamed by a cause: causes of one family call for one action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Aspect,
    Skew,
    Board,
    Lens,
    Focus,
    Mixed,
    Shifted,
    Shutter,
}

/// Row of the table.
pub(super) struct Row {
    /// Code of the finding.
    pub(super) code: &'static str,
    pub(super) family: Family,
    pub(super) scope: Scope,
    /// Columns of derivatives, see [`super::columns`].
    pub(super) columns: &'static [usize],
    /// Prior standard deviations of the parameters; those of a view's own are estimated.
    sd: &'static [f64],
    /// Twice the logarithm of the prior odds against the cause.
    pub(super) against: f64,
}

/// Change of the camera between views above which one lens is no result, relative to half the
/// picture: 3 px at 1000 px from the principal point.
pub(super) const MAX_CHANGE: f64 = 0.003;

/// Prior size of stretched or skewed pixels or squares.
const STRETCH_SD: f64 = 1e-3;
/// Prior sizes of a bend, relative to half the board: 1 mm of 10 cm.
const BEND_SD: f64 = 1e-2;
/// Prior relative size of a warming or refocusing lens.
const FOCUS_SD: f64 = 6e-3;

impl Kind {
    /// Kinds that all views share, each fitted beside the lens.
    pub(super) const FITTED: [Self; 4] =
        [Self::PixelAspect, Self::BoardStretched, Self::PixelSkew, Self::BoardBent];
    pub(super) const OWN: [Self; 4] =
        [Self::FocusScatters, Self::Shifted, Self::RollingShutter, Self::BoardFlexes];

    #[rustfmt::skip]
    pub(super) fn row(self) -> Row {
        use {Family as F, Scope as S};
        let row = |code, family, scope, columns, sd, against| Row { code, family, scope, columns, sd, against };
        match self {
            Self::PixelAspect => row("PIXELS-NOT-SQUARE", F::Aspect, S::Shared, &[ASPECT], &[STRETCH_SD], LIKELY),
            Self::BoardStretched => row("BOARD-STRETCHED", F::Aspect, S::Shared, &[STRETCH], &[STRETCH_SD], LIKELY),
            Self::PixelSkew => row("PIXELS-SKEWED", F::Skew, S::Shared, &[SKEW], &[STRETCH_SD], UNLIKELY),
            Self::BoardBent => row("BOARD-BENT", F::Board, S::Shared, &[BEND, BEND + 1, BEND + 2], &[BEND_SD; 3], UNLIKELY),
            Self::LensShape => row("LENS-OTHER", F::Lens, S::Shared, &[RADIAL, PRISM, PRISM + 1], &[0.3, 3e-3, 3e-3], UNLIKELY),
            Self::FocusDrift => row("FOCUS-MOVED", F::Focus, S::Course, &[SCALE], &[FOCUS_SD], LIKELY),
            Self::FocusBreathes => row("FOCUS-MOVED", F::Focus, S::Course, &[SCALE], &[FOCUS_SD], LIKELY),
            Self::FocusJump => row("FOCUS-MOVED", F::Focus, S::Course, &[SCALE], &[FOCUS_SD], LIKELY),
            // Relative to f, shares of the picture's width, and k1.
            Self::Mixed => row("VIEWS-MIXED", F::Mixed, S::Groups, &[SCALE, SHIFT, SHIFT + 1, SCALE_R2], &[0.1, 0.05, 0.05, 0.1], UNLIKELY),
            Self::FocusScatters => row("FOCUS-MOVED", F::Focus, S::Own, &[SCALE], &[], UNLIKELY),
            Self::Shifted => row("PICTURE-SHIFTED", F::Shifted, S::Own, &[SHIFT, SHIFT + 1], &[], UNLIKELY),
            Self::RollingShutter => row("ROLLING-SHUTTER", F::Shutter, S::Own, &[SHUTTER, SHUTTER + 1], &[], UNLIKELY),
            Self::BoardFlexes => row("BOARD-FLEXES", F::Board, S::Own, &[BEND, BEND + 1, BEND + 2], &[], UNLIKELY),
        }
    }

    /// Prior standard deviations of the parameters, in the units of the columns.
    pub(super) fn sd(self, image_size: ImageSize) -> Vec<f64> {
        let Row { columns, sd, .. } = self.row();
        let unit = |column: &usize| {
            let is_shift = (SHIFT..SHIFT + 2).contains(column);
            if is_shift { f64::from(image_size.width_px) } else { 1.0 }
        };
        sd.iter().zip(columns).map(|(sd, column)| sd * unit(column)).collect()
    }

    /// True for a camera that changes between views, and so may after them.
    pub(super) fn is_of_camera(self) -> bool {
        matches!(self.row().family, Family::Focus | Family::Mixed | Family::Shifted)
    }

    pub(super) fn columns(self) -> &'static [usize] {
        self.row().columns
    }

    /// Number of parameters beside the lens's; `fy` is one of those.
    pub(super) fn extras(self) -> usize {
        if self == Self::PixelAspect { 0 } else { self.columns().len() }
    }
}

/// Columns of the smooth errors that each view has by itself.
pub(super) const SMOOTH: [usize; FIELDS] = {
    let mut columns = [FIELD; FIELDS];
    let mut i = 0;
    while i < FIELDS {
        columns[i] += i;
        i += 1;
    }
    columns
};
