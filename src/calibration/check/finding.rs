use crate::calibration::solve::lens_model::LensModel;

/// Something a person should know about a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// What was found, with its numbers.
    pub code: FindingCode,
    /// How much it matters.
    pub severity: Severity,
}

/// How much a [`Finding`] matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// Good to know.
    Info,
    /// The result is usable with care.
    Care,
    /// The result should not be used.
    Bad,
}

/// Whether a calibration can be used: the worst [`Severity`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// Nothing speaks against it.
    Good,
    /// Usable, knowing the findings.
    Care,
    /// Should not be used.
    Untrustworthy,
}

/// What the honesty checks can find. Limits are stated with what was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FindingCode {
    /// Too few views that differ.
    FewViews {
        /// Different views.
        distinct: usize,
        /// Views needed for this severity to go away.
        wanted: usize,
    },
    /// Some views repeat others: they add no information.
    ViewsAlike {
        /// All views.
        views: usize,
        /// Different views.
        distinct: usize,
    },
    /// No, or too few, views are tilted enough to tell focal length from distance.
    TiltLow {
        /// Views tilted by at least `wanted_tilt_rad`.
        tilted_views: usize,
        /// Number wanted.
        wanted_views: usize,
        /// Largest tilt seen.
        max_tilt_rad: f64,
        /// Tilt wanted.
        wanted_tilt_rad: f64,
    },
    /// The tilted views all recede in about the same direction.
    DirectionsFew {
        /// Smallest singular value of the stacked principal line normals.
        spread: f64,
        /// Wanted at least.
        wanted: f64,
    },
    /// The boards covered little of the picture.
    CoverageLow {
        /// Share of the picture covered by any board.
        share: f64,
        /// Wanted at least.
        wanted: f64,
    },
    /// Weak beliefs about the lens were needed to reach a result.
    PriorUsed {
        /// Whether the focal length needed one, too.
        focal_length: bool,
    },
    /// A richer lens moves the principal point more than chance explains (Hausman test).
    LensSimple {
        /// The lens chosen.
        model: LensModel,
        /// Test statistic, χ² with 2 degrees of freedom.
        statistic: f64,
        /// Allowed.
        limit: f64,
    },
    /// The lens model folds over inside the picture.
    LensFolds {
        /// Grid points without a ray.
        unmapped: usize,
        /// Grid points.
        of: usize,
    },
    /// Bundle adjustment and the free homographies disagree about the principal point.
    CheckDisagrees {
        /// Distance.
        distance_px: f64,
        /// Distance in standard deviations.
        sigmas: f64,
        /// Allowed.
        limit: f64,
    },
    /// There is no independent check: the free homographies could not be fitted.
    CheckMissing,
    /// Leaving single views out moves the principal point too much.
    ViewsDisagree {
        /// Observed shift over expected shift.
        ratio: f64,
        /// Allowed.
        limit: f64,
    },
    /// One view fits far worse than the others.
    ViewOdd {
        /// The view.
        view: usize,
        /// Its residual.
        rms_px: f64,
        /// Median residual of all views.
        typical_px: f64,
    },
    /// One view's principal line does not pass where those of the other views meet.
    PlOutlier {
        /// The view.
        view: usize,
        /// Distance of its line from that point.
        distance_px: f64,
        /// The same in standard deviations.
        sigmas: f64,
    },
    /// A focal length of its own for every view explains the corners: focus or zoom moved.
    FocusMoved {
        /// Gain in BIC over one focal length.
        gain: f64,
        /// Observed standard deviation over the mean, relative.
        relative_sd: f64,
    },
    /// Each view has its own focal length, as was asked for.
    FocalVaries {
        /// Mean.
        f_px: f64,
        /// Sample standard deviation.
        scatter_px: f64,
    },
    /// Some views are of another camera, mode, size or orientation.
    ViewsMixed {
        /// How many are.
        odd_views: usize,
        /// The first of them.
        view: usize,
        /// Their focal length over the others'.
        f_ratio: f64,
        /// Distance of their principal point from the others'.
        shift_px: f64,
        /// Gain in BIC over one camera.
        gain: f64,
    },
    /// `fy` differs from `fx`: pixels are not square, or the picture was stretched.
    PixelsNotSquare {
        /// fy/fx.
        aspect: f64,
        /// Gain in BIC over square pixels.
        gain: f64,
    },
    /// The board's squares are not square.
    BoardStretched {
        /// Height over width of a square.
        aspect: f64,
        /// Gain in BIC over square squares.
        gain: f64,
    },
    /// The board is not flat.
    BoardBent {
        /// From its lowest to its highest corner.
        depth_m: f64,
        /// Gain in BIC over a flat board.
        gain: f64,
    },
    /// Each view is sheared its own way, as when board or camera moves while the shutter rolls.
    RollingShutter {
        /// Root mean square movement from the top to the bottom row.
        shear_px: f64,
        /// Gain in BIC over views at rest.
        gain: f64,
    },
    /// The lens has a shape that none of the models describes.
    LensOther {
        /// Gain in BIC of radial terms of higher order and thin prisms.
        gain: f64,
    },
    /// Corners lie outside of the stated picture.
    CornersOutside {
        /// The first view that has some.
        view: usize,
        /// Views that have some.
        views: usize,
    },
    /// One corner lies far from where its view puts it.
    CornerOdd {
        /// The view.
        view: usize,
        /// The corner, in the board's order.
        corner: usize,
        /// Its distance.
        off_px: f64,
        /// The same over the typical distance of a corner.
        times: f64,
        /// Corners like this in all views.
        count: usize,
    },
    /// The principal point lies far from the middle of the picture.
    PrincipalPointFar {
        /// Distance.
        distance_px: f64,
        /// The same as share of the picture's width.
        share: f64,
    },
    /// The lens found without a view does not predict it.
    HeldOut {
        /// The view.
        view: usize,
        /// Residual of the view under the lens of the others.
        rms_px: f64,
        /// Expected.
        expected_px: f64,
    },
    /// A view is a mirror image of the board.
    Mirrored {
        /// The view.
        view: usize,
    },
    /// Residuals are larger than corners should be.
    NoiseHigh {
        /// Typical error of a corner coordinate.
        noise_px: f64,
        /// Allowed.
        limit_px: f64,
    },
    /// The principal point is uncertain.
    PrincipalPointUncertain {
        /// Standard deviation along the worse axis.
        sd_px: f64,
        /// Wanted at most.
        wanted_px: f64,
    },
    /// The focal length is uncertain.
    FocalLengthUncertain {
        /// Standard deviation.
        sd_px: f64,
        /// Wanted at most.
        wanted_px: f64,
    },
    /// Rays' images are uncertain.
    ProjectionUncertain {
        /// Mean standard deviation over the picture.
        mean_px: f64,
        /// Largest.
        max_px: f64,
        /// Wanted mean at most.
        wanted_px: f64,
    },
    /// The minimum was not reached.
    NotConverged,
}

impl FindingCode {
    /// Stable name.
    pub fn code(&self) -> &'static str {
        match self {
            Self::FewViews { .. } => "VIEWS-FEW",
            Self::ViewsAlike { .. } => "VIEWS-ALIKE",
            Self::TiltLow { .. } => "TILT-LOW",
            Self::DirectionsFew { .. } => "DIRECTIONS-FEW",
            Self::CoverageLow { .. } => "COVERAGE-LOW",
            Self::PriorUsed { .. } => "PRIOR-USED",
            Self::LensSimple { .. } => "LENS-SIMPLE",
            Self::LensFolds { .. } => "LENS-FOLDS",
            Self::CheckDisagrees { .. } => "CHECK-DISAGREES",
            Self::CheckMissing => "CHECK-MISSING",
            Self::ViewsDisagree { .. } => "VIEWS-DISAGREE",
            Self::ViewOdd { .. } => "VIEW-ODD",
            Self::PlOutlier { .. } => "PL-OUTLIER",
            Self::FocusMoved { .. } => "FOCUS-MOVED",
            Self::FocalVaries { .. } => "FOCAL-VARIES",
            Self::ViewsMixed { .. } => "VIEWS-MIXED",
            Self::PixelsNotSquare { .. } => "PIXELS-NOT-SQUARE",
            Self::BoardStretched { .. } => "BOARD-STRETCHED",
            Self::BoardBent { .. } => "BOARD-BENT",
            Self::RollingShutter { .. } => "ROLLING-SHUTTER",
            Self::LensOther { .. } => "LENS-OTHER",
            Self::CornersOutside { .. } => "CORNERS-OUTSIDE",
            Self::CornerOdd { .. } => "CORNER-ODD",
            Self::PrincipalPointFar { .. } => "PP-FAR",
            Self::HeldOut { .. } => "HELD-OUT",
            Self::Mirrored { .. } => "VIEW-MIRRORED",
            Self::NoiseHigh { .. } => "NOISE-HIGH",
            Self::PrincipalPointUncertain { .. } => "PP-UNCERTAIN",
            Self::FocalLengthUncertain { .. } => "F-UNCERTAIN",
            Self::ProjectionUncertain { .. } => "PROJECTION-UNCERTAIN",
            Self::NotConverged => "NOT-CONVERGED",
        }
    }
}

impl Severity {
    /// Stable name.
    pub fn code(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Care => "care",
            Self::Bad => "bad",
        }
    }
}

impl Verdict {
    /// Stable name.
    pub fn code(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Care => "care",
            Self::Untrustworthy => "untrustworthy",
        }
    }

    /// The verdict that these findings amount to.
    pub fn of(findings: &[Finding]) -> Self {
        match findings.iter().map(|finding| finding.severity).max() {
            None | Some(Severity::Info) => Self::Good,
            Some(Severity::Care) => Self::Care,
            Some(Severity::Bad) => Self::Untrustworthy,
        }
    }
}
