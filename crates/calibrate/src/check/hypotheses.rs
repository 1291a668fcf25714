//! Table of hypotheses: reasons for a misfit of the views to a single lens and a flat board of
//! squares, with the prior belief in each.

use nalgebra::{DMatrix, SymmetricEigen};
use statrs::function::factorial::ln_binomial;

use crate::solve::odds::{LIKELY, UNLIKELY};

/// Most shared parameters of a cause.
pub(super) const SHARED_EXTRAS: usize = 12;
/// Most shared parameters of every cause except [`Cause::SmoothField`].
pub(super) const FEW_SHARED_EXTRAS: usize = 4;
/// Most parameters of a cause per view.
pub(super) const LOCAL_EXTRAS: usize = 3;

/// Reason for a misfit of the views to a single lens and a flat board of squares.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cause {
    /// Separate focal length in every view.
    Focus,
    /// The focal length changes at a constant rate from the first view to the last.
    FocusDrift,
    /// Jump of the focal length at the given view.
    FocusJump(usize),
    /// The focal length follows the board's distance, by the given share of the change in each
    /// view.
    FocusBreathes(Vec<f64>),
    /// The marked views come from a different camera, mode or picture size: focal length, principal
    /// point and k1 differ.
    Mixed(Vec<bool>),
    /// Every view is shifted in the picture, as by a stabiliser.
    Shifted,
    /// `fy ≠ fx`.
    PixelAspect,
    /// Rows and columns of the picture aren't at right angles.
    PixelSkew,
    /// The squares of the board aren't square.
    BoardStretched,
    /// The board is bowed along x and y, and twisted.
    BoardBent,
    /// The board bends differently in each view.
    BoardFlexes,
    /// Each view moved during readout, row by row.
    RollingShutter,
    /// Radial terms of higher order, and thin prisms.
    LensShape,
    /// Something in front of the lens shifts the picture smoothly: all terms of second and third
    /// order.
    SmoothField,
    /// Views torn at a row in pixels: the corners below it are shifted.
    Torn(Vec<Option<f64>>),
    /// A further radial term, r⁸.
    NextRadial,
}

/// Part of the setup blamed by a cause. Causes in one family call for the same action, so the cause
/// with the highest odds wins outright.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Family {
    Focus,
    Mixed,
    Shifted,
    Aspect,
    Skew,
    Board,
    Shutter,
    Lens,
    Torn,
}

/// Row of the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Code of the finding.
    pub(super) code: &'static str,
    pub(super) family: Family,
    /// Twice the logarithm of the odds against the cause.
    against: f64,
    /// Expected sizes of the shared parameters, as standard deviations.
    shared_sd: &'static [f64],
    /// Number of per-view parameters, with the first guess and the least value of the standard
    /// deviation over the views. The standard deviation is estimated; free parameters would leave f
    /// and the principal point undetermined.
    local: (usize, Option<(f64, f64)>),
    /// Least reportable shift in pixels, anywhere in the picture.
    pub(super) least_px: f64,
}

/// Relative change of the focal length of a warming or refocusing lens.
const FOCUS: &[f64] = &[6e-3];
/// Stretch of pixels or squares, and deviation of rows and columns from a right angle.
const STRETCH: &[f64] = &[1e-3];
/// Error of a good detector's corner, in pixels.
const CORNER_PX: f64 = 0.1;

impl Cause {
    /// Prior belief in the cause.
    pub(super) fn row(&self) -> Row {
        let row = |code, family, against, shared_sd, local, least_px| Row {
            code,
            family,
            against,
            shared_sd,
            local,
            least_px,
        };
        let none = (0, None);
        let of_views = |count, first: f64, least: f64| (count, Some((first, least)));
        #[rustfmt::skip]
        let row = match self {
            Self::Focus =>
                row("FOCUS-MOVED", Family::Focus, UNLIKELY, &[], of_views(1, 6e-3, 1e-5), 0.0),
            Self::FocusDrift | Self::FocusJump(_) | Self::FocusBreathes(_) =>
                row("FOCUS-MOVED", Family::Focus, LIKELY, FOCUS, none, 0.0),
            // Relative to f, and k1.
            Self::Mixed(_) =>
                row("VIEWS-MIXED", Family::Mixed, UNLIKELY, &[0.1, 0.1, 0.1, 0.1], none, 0.0),
            Self::Shifted =>
                row("PICTURE-SHIFTED", Family::Shifted, UNLIKELY, &[], of_views(2, 5.0, 0.1), 0.0),
            Self::PixelAspect =>
                row("PIXELS-NOT-SQUARE", Family::Aspect, LIKELY, STRETCH, none, CORNER_PX),
            Self::BoardStretched =>
                row("BOARD-STRETCHED", Family::Aspect, LIKELY, STRETCH, none, CORNER_PX),
            Self::PixelSkew =>
                row("PIXELS-SKEWED", Family::Skew, UNLIKELY, STRETCH, none, 0.0),
            // Relative to half the board: 1 mm of 10 cm.
            Self::BoardBent =>
                row("BOARD-BENT", Family::Board, UNLIKELY, &[1e-2, 1e-2, 1e-2], none, 0.0),
            // 2 mm of 10 cm, and 0.02 mm.
            Self::BoardFlexes =>
                row("BOARD-FLEXES", Family::Board, UNLIKELY, &[], of_views(3, 2e-2, 2e-4), 0.0),
            // A hand moving at 300 px/s during 1/30 s.
            Self::RollingShutter =>
                row("ROLLING-SHUTTER", Family::Shutter, UNLIKELY, &[], of_views(2, 10.0, 0.1), 0.0),
            // The coefficients of r⁸ and r¹⁰, and of thin prisms along x and y.
            Self::LensShape =>
                row("LENS-OTHER", Family::Lens, UNLIKELY, &[1.0, 1.0, 3e-3, 3e-3], none, 0.0),
            // Pixels at the sides of the picture.
            Self::SmoothField =>
                row("PICTURE-WARPED", Family::Lens, UNLIKELY, &[5.0; SHARED_EXTRAS], none, CORNER_PX),
            Self::NextRadial =>
                row("LENS-OTHER", Family::Lens, UNLIKELY, &[1.0], none, 0.0),
            Self::Torn(_) =>
                row("VIEW-TORN", Family::Torn, UNLIKELY, &[], (2, None), 0.0),
        };
        row
    }

    /// Twice the logarithm of the prior odds against the cause: the table's, and those of one among
    /// the equally simple alternatives of `views` views. A split into consecutive views is one of
    /// `N`; any other split is one of `N` sizes and of all splits with its size.
    ///
    /// Noise alone gains about 0.64 `N` by the best of 2ᴺ splits.
    pub(super) fn against(&self, views: usize) -> f64 {
        let searched = match self {
            Self::Mixed(odd) => {
                let (views, marked) = (views as u64, odd.iter().filter(|odd| **odd).count() as u64);
                let changes = odd.windows(2).filter(|pair| pair[0] != pair[1]).count();
                let of_this_size = if changes == 1 { 0.0 } else { ln_binomial(views, marked) };
                libm::log(views as f64) + of_this_size
            }
            Self::FocusJump(_) => libm::log((views - 1) as f64),
            _ => 0.0,
        };
        self.row().against + 2.0 * searched
    }

    /// Number of shared parameters in addition to the lens's.
    pub(super) fn shared_extras(&self) -> usize {
        // `fy` is a lens parameter.
        if *self == Self::PixelAspect { 0 } else { self.row().shared_sd.len() }
    }

    pub(super) fn local_extras(&self) -> usize {
        self.row().local.0
    }

    /// Parameters acting on a view: shared, or its own.
    pub(super) fn of_view<'a>(
        &self,
        shared: &'a [f64; SHARED_EXTRAS],
        local: &'a [f64; LOCAL_EXTRAS],
    ) -> &'a [f64] {
        if self.local_extras() > 0 { local } else { shared }
    }

    /// True if the cause changes the board rather than the picture.
    pub(super) fn is_of_board(&self) -> bool {
        matches!(self, Self::BoardStretched | Self::BoardBent | Self::BoardFlexes)
    }

    /// See [`Row::local`].
    pub(super) fn local_sd(&self) -> Option<(f64, f64)> {
        self.row().local.1
    }

    /// Prior standard deviations of shared parameters that resemble the lens's own.
    pub(super) fn held_to(&self) -> &'static [f64] {
        if self.is_free() { self.row().shared_sd } else { &[] }
    }

    /// True if the sizes of the parameters are unknown, so that each costs `ln n`, as in BIC.
    pub(super) fn is_free(&self) -> bool {
        matches!(self.row().family, Family::Lens | Family::Torn)
    }

    /// True if the cause acts alike on all views. What differs from view to view pulls them apart
    /// instead.
    pub(super) fn is_shared(&self) -> bool {
        matches!(self.row().family, Family::Aspect | Family::Skew | Family::Board | Family::Lens)
            && self.local_extras() == 0
    }

    /// True if the bound includes the effect on the lens. Either a calibration corrects the cause,
    /// or it lies in the board or the hand in single views, whose scatter includes it. A cause in
    /// the camera in single views may differ in use.
    pub(super) fn is_in_bound(&self) -> bool {
        self.is_correctable() || matches!(self, Self::BoardFlexes | Self::RollingShutter)
    }

    /// True if a calibration corrects the cause.
    pub(super) fn is_correctable(&self) -> bool {
        matches!(self, Self::PixelAspect | Self::BoardStretched | Self::BoardBent)
    }

    /// Number of parameters in addition to the plain bundle's.
    pub(crate) fn parameters(&self, views: usize) -> usize {
        match self {
            // One row and one shift (2 parameters) each.
            Self::Torn(rows) => 3 * rows.iter().flatten().count(),
            _ => self.row().shared_sd.len() + self.local_extras() * views,
        }
    }

    /// Factor by which the shared parameters act on a view of `count`.
    pub(super) fn times(&self, view: usize, count: usize) -> f64 {
        match self {
            Self::FocusDrift => view as f64 / (count - 1).max(1) as f64 - 0.5,
            Self::FocusJump(from) if view < *from => 0.0,
            Self::FocusBreathes(course) => course[view],
            Self::Mixed(other) if !other[view] => 0.0,
            _ => 1.0,
        }
    }

    /// Evidence cost of the shared parameters, as twice a logarithm: `ln |1 + T² A|` with their
    /// information `A` and the table's sizes `T` (the Occam factor of Bayesian model comparison,
    /// MacKay 1992).
    pub(super) fn occam(&self, information: &DMatrix<f64>) -> f64 {
        let sd = self.row().shared_sd;
        let scaled =
            DMatrix::from_fn(sd.len(), sd.len(), |i, j| information[(i, j)] * sd[i] * sd[j]);
        let eigenvalues = SymmetricEigen::new(scaled).eigenvalues;
        eigenvalues.iter().map(|it| libm::log1p(it.max(0.0))).sum()
    }
}
