//! Reasons for which views disagree with a single lens and a flat board of squares.

/// Most parameters of a cause that all views share.
pub(super) const SHARED_EXTRAS: usize = 12;
/// Most shared parameters of every cause but [`Cause::SmoothField`].
pub(super) const FEW_SHARED_EXTRAS: usize = 4;
/// Most parameters of a cause per view.
pub(super) const LOCAL_EXTRAS: usize = 3;

/// A reason for which views disagree with a single lens and a flat board of squares.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Cause {
    /// Every view has its own focal length.
    Focus,
    /// The focal length changes at a constant rate from the first view to the last.
    FocusDrift,
    /// The focal length is another one from this view on.
    FocusJump(usize),
    /// The marked views come from a different camera, mode or picture size: focal length and principal point differ.
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
    /// Each view moved while it was read out, row by row.
    RollingShutter,
    /// Radial terms of higher order, and thin prisms.
    LensShape,
    /// Something in front of the lens shifts the picture smoothly: all terms of second and third order.
    SmoothField,
    /// Views torn at a row in pixels: the corners below it are shifted.
    Torn(Vec<Option<f64>>),
    /// A further radial term, r⁸.
    NextRadial,
}

/// Part of the setup that a cause blames. Causes in one family call for the same action, so the one with the highest
/// gain wins outright.
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

impl Cause {
    pub(super) fn shared_extras(&self) -> usize {
        match self {
            Self::SmoothField => 12,
            Self::Mixed(_) | Self::LensShape => 4,
            Self::BoardBent => 3,
            Self::BoardStretched
            | Self::FocusDrift
            | Self::FocusJump(_)
            | Self::PixelSkew
            | Self::NextRadial => 1,
            Self::Focus
            | Self::PixelAspect
            | Self::RollingShutter
            | Self::Shifted
            | Self::BoardFlexes
            | Self::Torn(_) => 0,
        }
    }

    pub(super) fn local_extras(&self) -> usize {
        match self {
            Self::Focus => 1,
            Self::RollingShutter | Self::Shifted | Self::Torn(_) => 2,
            Self::BoardFlexes => 3,
            _ => 0,
        }
    }

    /// Standard deviation over the views of parameters that each view has: the first guess, and the least believed one.
    /// `None` if they are free. Free ones would leave f and the principal point undetermined.
    pub(super) fn local_sd(&self) -> Option<(f64, f64)> {
        match self {
            // A hand moving at 300 px/s during 1/30 s.
            Self::RollingShutter => Some((10.0, 0.1)),
            Self::Shifted => Some((5.0, 0.1)),
            // Relative to half the board: 2 mm of 10 cm, and 0.02 mm.
            Self::BoardFlexes => Some((2e-2, 2e-4)),
            _ => None,
        }
    }

    /// Prior standard deviations of the shared parameters; infinite for free ones. The finite ones only keep the fit
    /// bounded.
    pub(super) fn shared_sd(&self) -> [f64; SHARED_EXTRAS] {
        let mut sd = [f64::INFINITY; SHARED_EXTRAS];
        match self {
            // The coefficients of r⁸ and r¹⁰, and of thin prisms along x and y.
            Self::LensShape => sd[..4].copy_from_slice(&[1.0, 1.0, 3e-3, 3e-3]),
            // Pixels at the sides of the picture.
            Self::SmoothField => sd = [5.0; SHARED_EXTRAS],
            _ => {}
        }
        sd
    }

    /// Number of parameters in addition to the plain bundle's.
    pub(crate) fn parameters(&self, views: usize) -> usize {
        match self {
            // The mean is the common focal length.
            Self::Focus => views - 1,
            Self::PixelAspect => 1,
            // k1, p1 and p2 are among its terms.
            Self::SmoothField => 9,
            // A row and a shift for each.
            Self::Torn(rows) => 3 * rows.iter().flatten().count(),
            _ => self.shared_extras() + self.local_extras() * views,
        }
    }

    pub(super) fn family(&self) -> Family {
        match self {
            Self::Focus | Self::FocusDrift | Self::FocusJump(_) => Family::Focus,
            Self::Mixed(_) => Family::Mixed,
            Self::Shifted => Family::Shifted,
            Self::PixelAspect | Self::BoardStretched => Family::Aspect,
            Self::PixelSkew => Family::Skew,
            Self::BoardBent | Self::BoardFlexes => Family::Board,
            Self::RollingShutter => Family::Shutter,
            Self::LensShape | Self::SmoothField | Self::NextRadial => Family::Lens,
            Self::Torn(_) => Family::Torn,
        }
    }
}
