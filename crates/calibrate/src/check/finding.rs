use crate::{known_lens::NotHeld, solve::lens_model::LensModel};

/// Result of the trust checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Code of the finding, with the measured values and limits.
    pub code: FindingCode,
    /// Severity of the finding.
    pub severity: Severity,
}

/// Severity of a [`Finding`], from harmless to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// For information; limits nothing.
    Info,
    /// Limits the use of the calibration.
    Care,
    /// Rules out using the calibration.
    Bad,
}

/// Verdict on a calibration: the worst [`Severity`] found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Verdict {
    /// No limitation found.
    Good,
    /// Usable within the limits that the findings state.
    Care,
    /// Should not be used.
    Untrustworthy,
}

/// True if a calibration isn't wrong but unfinished: fewer than four views or a bound far from the
/// goal, and nothing else bad. `bad` are the codes of its bad findings.
pub fn is_unfinished<'a>(bad: impl IntoIterator<Item = &'a str>) -> bool {
    let mut has_few = false;
    for code in bad {
        if more_views(code) != MoreViews::Always {
            return false;
        }
        has_few |= matches!(code, "VIEWS-FEW" | "PROJECTION-UNCERTAIN");
    }
    has_few
}

/// Most causes in a [`FindingCode::CauseUnclear`].
pub const CANDIDATES: usize = 5;

/// Kind of motion of focus or zoom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FocusMotion {
    /// Separate focal length in every view.
    Scattered,
    /// Motion at a constant rate.
    Drift {
        /// Relative change of the focal length from the first view to the last.
        change: f64,
    },
    /// A jump between two views.
    Jump {
        /// First view with the new focal length.
        view: usize,
        /// Relative change of the focal length.
        change: f64,
    },
    /// Change of focus with the board's distance.
    Breathes {
        /// Relative change of the focal length from the farthest board to the nearest.
        change: f64,
    },
}

/// Help of further views against a finding that limits the result.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MoreViews {
    /// The finding is of too few views or too little information.
    Always,
    /// With more views, a bad finding can end: a richer lens model gains enough to be chosen, or
    /// the minimum becomes clear.
    IfBad,
    /// The finding comes back in more views: a fault of the camera, the board, the lens model, the
    /// pictures or single views.
    Never,
}

/// Arbitrary value of a field, for [`FindingCode::one_of_each`].
trait Any {
    const ANY: Self;
}

/// Declares the findings with their codes and the help of further views.
macro_rules! findings {
    ($($(#[$about:meta])+ $finding:ident $({ $($(#[$what:meta])+ $field:ident: $type:ty,)+ })?
        = $code:literal, $more:ident;)*) => {
        /// Possible findings. Measured values come with the limit they exceed.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum FindingCode {
            $($(#[$about])+ $finding $({ $($(#[$what])+ $field: $type,)+ })?,)*
        }

        impl FindingCode {
            /// Every finding once, with arbitrary numbers, for pages and tests that must be
            /// complete.
            ///
            /// ```
            /// # use boresight_calibrate::FindingCode;
            /// let all = FindingCode::one_of_each();
            /// let codes: Vec<&str> = all.iter().map(FindingCode::code).collect();
            /// assert!(codes.contains(&"FOCUS-MOVED"));
            /// ```
            pub fn one_of_each() -> Vec<Self> {
                vec![$(Self::$finding $({ $($field: <$type>::ANY),+ })?),*]
            }

            /// Stable name, for files and programs.
            pub fn code(&self) -> &'static str {
                match self {
                    $(Self::$finding $({ $($field: _),+ })? => $code,)*
                }
            }
        }

        /// Help of further views against the finding `code`.
        fn more_views(code: &str) -> MoreViews {
            match code {
                $($code => MoreViews::$more,)*
                // Codes in files of earlier versions.
                "COVERAGE-LOW" | "PP-UNCERTAIN" | "F-UNCERTAIN" => MoreViews::Always,
                _ => MoreViews::Never,
            }
        }
    };
}

findings! {
    /// Too few distinct views.
    FewViews {
        /// Number of distinct views, repeats of a held pose left out.
        distinct: usize,
        /// Least number of distinct views.
        wanted: usize,
    } = "VIEWS-FEW", Always;
    /// Some views repeat others and add no information.
    ViewsAlike {
        /// Number of views, repeats included.
        views: usize,
        /// Number of distinct views, repeats of a held pose left out.
        distinct: usize,
    } = "VIEWS-ALIKE", Always;
    /// Too few views are tilted enough to separate focal length from distance.
    TiltLow {
        /// Views tilted by at least `wanted_tilt_rad`.
        tilted_views: usize,
        /// Least number of such views.
        wanted_views: usize,
        /// Largest tilt seen.
        max_tilt_rad: f64,
        /// Least useful tilt.
        wanted_tilt_rad: f64,
    } = "TILT-LOW", Always;
    /// All tilted views recede in about the same direction.
    DirectionsFew {
        /// Smallest singular value of the stacked principal line normals.
        spread: f64,
        /// Least acceptable spread.
        wanted: f64,
    } = "DIRECTIONS-FEW", Always;
    /// Weak priors on the lens were needed to reach a result.
    PriorUsed {
        /// True if the focal length needed a prior, too.
        focal_length: bool,
    } = "PRIOR-USED", Always;
    /// A richer lens model shifts the principal point by more than chance explains (Hausman test).
    LensSimple {
        /// The lens model chosen.
        model: LensModel,
        /// Test statistic, χ² with 2 degrees of freedom.
        statistic: f64,
        /// Largest unreported value.
        limit: f64,
    } = "LENS-SIMPLE", IfBad;
    /// The lens model folds over inside the picture: some pixels have no ray.
    LensFolds {
        /// Grid points without a ray.
        unmapped: usize,
        /// Grid points in all.
        of: usize,
    } = "LENS-FOLDS", Never;
    /// Bundle adjustment and the free homographies disagree about the principal point.
    CheckDisagrees {
        /// Distance, in pixels.
        distance_px: f64,
        /// Distance in standard deviations.
        sigmas: f64,
        /// Largest unreported value.
        limit: f64,
    } = "CHECK-DISAGREES", Never;
    /// The lens contradicts the earlier calibration meant to hold the lens.
    LensContradicts {
        /// Test statistic of the difference between the two lenses.
        statistic: f64,
        /// Largest unreported value.
        limit: f64,
    } = "LENS-CONTRADICTS", Never;
    /// The lens couldn't be held to the earlier calibration.
    LensNotHeld {
        /// Reason for the failure.
        reason: NotHeld,
    } = "LENS-NOT-HELD", Never;
    /// The independent check is missing: the free homographies couldn't be fitted.
    CheckMissing = "CHECK-MISSING", Always;
    /// Leaving out single views shifts the principal point by more than expected.
    ViewsDisagree {
        /// Observed shift over expected shift.
        ratio: f64,
        /// Largest unreported value.
        limit: f64,
    } = "VIEWS-DISAGREE", Never;
    /// A view fits far worse than the others.
    ViewOdd {
        /// Index of the view, from 0.
        view: usize,
        /// Root mean square residual of the view per coordinate, in pixels.
        rms_px: f64,
        /// Median over all views, in pixels.
        typical_px: f64,
    } = "VIEW-ODD", Never;
    /// The principal line of a view misses the intersection of the others.
    PlOutlier {
        /// Index of the view, from 0.
        view: usize,
        /// Distance of the line from the intersection, in pixels.
        distance_px: f64,
        /// Distance in standard deviations.
        sigmas: f64,
    } = "PL-OUTLIER", Never;
    /// Focus or zoom moved: a separate focal length for every view explains the corners.
    FocusMoved {
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
        /// Relative standard deviation of the focal lengths.
        relative_sd: f64,
        /// Kind of motion.
        motion: FocusMotion,
        /// True if the scene behind the board changed its scale as well.
        in_scene: bool,
    } = "FOCUS-MOVED", Never;
    /// A focal length that seemed to change between views, and a scene behind the board that kept
    /// its scale.
    SceneStill {
        /// Relative change that the views suggest.
        change: f64,
        /// Largest relative change that the scene allows.
        allowed: f64,
    } = "SCENE-STILL", Never;
    /// Separate focal lengths of the views, as requested.
    FocalVaries {
        /// Mean focal length, in pixels.
        f_px: f64,
        /// Sample standard deviation, in pixels.
        scatter_px: f64,
    } = "FOCAL-VARIES", Never;
    /// Some views are from another camera, mode, size or orientation.
    ViewsMixed {
        /// Number of odd views.
        odd_views: usize,
        /// The first odd view.
        view: usize,
        /// Ratio of the odd views' focal length to the others'.
        f_ratio: f64,
        /// Distance between the principal points of the two groups, in pixels.
        shift_px: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "VIEWS-MIXED", Never;
    /// `fy` differs from `fx`: pixels aren't square, or the picture was stretched.
    PixelsNotSquare {
        /// fy over fx; 1 for square pixels.
        aspect: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "PIXELS-NOT-SQUARE", Never;
    /// The squares of the board aren't square.
    BoardStretched {
        /// Height over width of a square.
        aspect: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "BOARD-STRETCHED", Never;
    /// The board isn't flat.
    BoardBent {
        /// Distance between the lowest and the highest corner, in metres.
        depth_m: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "BOARD-BENT", Never;
    /// Every view is sheared differently, as with a rolling shutter and a moving board or camera.
    RollingShutter {
        /// Root mean square movement from the top to the bottom row, in pixels.
        shear_px: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "ROLLING-SHUTTER", Never;
    /// The board bends differently in each view.
    BoardFlexes {
        /// Root mean square distance between the lowest and the highest corner of a view, in
        /// metres.
        depth_m: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "BOARD-FLEXES", Never;
    /// Every view is shifted in the picture, as by a stabiliser.
    PictureShifted {
        /// Root mean square shift, in pixels.
        shift_px: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "PICTURE-SHIFTED", Never;
    /// Rows and columns of the picture aren't at right angles.
    PixelsSkewed {
        /// Deviation from a right angle.
        skew_rad: f64,
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "PIXELS-SKEWED", Never;
    /// The views disagree, and several causes are about equally likely.
    CauseUnclear {
        /// Codes of the findings for the likeliest causes, likeliest first.
        candidates: [Option<&'static str>; CANDIDATES],
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "CAUSE-UNCLEAR", Never;
    /// No lens model describes the shape of the lens.
    LensOther {
        /// Standard deviations by which the cause stands out over the views.
        sigmas: f64,
    } = "LENS-OTHER", Never;
    /// Corners lie outside the stated picture.
    CornersOutside {
        /// First such view.
        view: usize,
        /// Number of such views.
        views: usize,
    } = "CORNERS-OUTSIDE", Never;
    /// A corner lies far from the predicted position.
    CornerOdd {
        /// Index of the view, from 0.
        view: usize,
        /// Index of the corner in the board's numbering.
        corner: usize,
        /// Distance from the predicted position, in pixels.
        off_px: f64,
        /// Ratio of the distance to a corner's median distance.
        times: f64,
        /// Number of odd corners in all views.
        count: usize,
    } = "CORNER-ODD", Never;
    /// The principal point lies far from the centre of the picture.
    PrincipalPointFar {
        /// Distance, in pixels.
        distance_px: f64,
        /// Distance as a fraction of the picture's width.
        share: f64,
    } = "PP-FAR", Never;
    /// A view isn't predicted by the lens of the other views.
    HeldOut {
        /// Index of the view, from 0.
        view: usize,
        /// Root mean square residual per coordinate under the lens of the other views, in pixels.
        rms_px: f64,
        /// Expected residual, in pixels.
        expected_px: f64,
    } = "HELD-OUT", Never;
    /// A view is a mirror image of the board.
    Mirrored {
        /// Index of the view, from 0.
        view: usize,
    } = "VIEW-MIRRORED", Never;
    /// Residuals are larger than corners should be.
    NoiseHigh {
        /// Typical standard deviation of a corner coordinate, in pixels.
        noise_px: f64,
        /// Largest unreported value, in pixels.
        limit_px: f64,
    } = "NOISE-HIGH", Never;
    /// Errors of neighbouring corners are correlated; the stated uncertainty allows for it.
    NoiseCorrelated {
        /// Share of the variance common to neighbours.
        share: f64,
        /// Correlation length in pixels.
        length_px: f64,
        /// Standard deviation of a corner coordinate including the correlation, in pixels.
        noise_px: f64,
        /// Root mean square of the residuals, in pixels.
        residual_px: f64,
    } = "NOISE-CORRELATED", Never;
    /// The fit leaves smaller residuals than the scatter of a board held still.
    NoiseUnderstated {
        /// Standard deviation of a corner coordinate by the fit, in pixels.
        noise_px: f64,
        /// Measured standard deviation of a corner coordinate, in pixels.
        measured_px: f64,
    } = "NOISE-UNDERSTATED", Never;
    /// The fit leaves larger residuals than the scatter of a board held still.
    NoiseExceeded {
        /// Standard deviation of a corner coordinate by the fit, in pixels.
        noise_px: f64,
        /// Measured standard deviation of a corner coordinate, in pixels.
        measured_px: f64,
    } = "NOISE-EXCEEDED", Never;
    /// Projection is too uncertain over too much of the picture.
    ProjectionUncertain {
        /// 95 % bound of the error where boards were, in pixels.
        bound_px: f64,
        /// Largest acceptable error, in pixels.
        goal_px: f64,
        /// Share of the picture with errors below the goal.
        share: f64,
        /// Least acceptable share.
        wanted_share: f64,
    } = "PROJECTION-UNCERTAIN", Always;
    /// Bundle adjustment did not converge.
    NotConverged = "NOT-CONVERGED", IfBad;
}

impl Any for usize {
    const ANY: Self = 1;
}

impl Any for f64 {
    const ANY: Self = 1.0;
}

impl Any for bool {
    const ANY: Self = true;
}

impl Any for LensModel {
    const ANY: Self = Self::K1;
}

impl Any for NotHeld {
    const ANY: Self = Self::NoCovariance;
}

impl Any for FocusMotion {
    const ANY: Self = Self::Scattered;
}

impl Any for [Option<&'static str>; CANDIDATES] {
    const ANY: Self = [None; CANDIDATES];
}

impl Finding {
    /// True if more views fix the finding, except for information only.
    pub fn calls_for_views(&self) -> bool {
        match self.severity {
            Severity::Info => false,
            Severity::Care => more_views(self.code.code()) == MoreViews::Always,
            Severity::Bad => more_views(self.code.code()) != MoreViews::Never,
        }
    }
}

impl FindingCode {
    /// Maps the index of a named view by `number`.
    pub(crate) fn renumber(&mut self, number: &dyn Fn(usize) -> usize) {
        match self {
            Self::ViewOdd { view, .. }
            | Self::PlOutlier { view, .. }
            | Self::ViewsMixed { view, .. }
            | Self::CornersOutside { view, .. }
            | Self::CornerOdd { view, .. }
            | Self::HeldOut { view, .. }
            | Self::Mirrored { view }
            | Self::FocusMoved { motion: FocusMotion::Jump { view, .. }, .. } => {
                *view = number(*view);
            }
            _ => {}
        }
    }
}

impl Severity {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Care => "care",
            Self::Bad => "bad",
        }
    }
}

impl Verdict {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Care => "care",
            Self::Untrustworthy => "untrustworthy",
        }
    }

    /// Verdict for `findings`: the worst severity.
    ///
    /// ```
    /// # use boresight_calibrate::{Finding, FindingCode, Severity, Verdict};
    /// let finding = |severity| Finding { code: FindingCode::CheckMissing, severity };
    /// assert_eq!(Verdict::of(&[]), Verdict::Good);
    /// assert_eq!(Verdict::of(&[finding(Severity::Info), finding(Severity::Care)]), Verdict::Care);
    /// assert_eq!(Verdict::of(&[finding(Severity::Bad)]).code(), "untrustworthy");
    /// ```
    pub fn of(findings: &[Finding]) -> Self {
        match findings.iter().map(|finding| finding.severity).max() {
            None | Some(Severity::Info) => Self::Good,
            Some(Severity::Care) => Self::Care,
            Some(Severity::Bad) => Self::Untrustworthy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_more_views_put_right_is_unfinished() {
        assert!(is_unfinished(["VIEWS-FEW"]));
        assert!(is_unfinished(["TILT-LOW", "PROJECTION-UNCERTAIN"]));
        assert!(!is_unfinished(["VIEWS-FEW", "FOCUS-MOVED"]));
        assert!(!is_unfinished(["PP-UNCERTAIN"]));
        assert!(!is_unfinished([]));
        let few = FindingCode::FewViews { distinct: 2, wanted: 4 };
        let one_axis = FindingCode::DirectionsFew { spread: 0.1, wanted: 0.7 };
        assert!(is_unfinished([few.code(), one_axis.code()]));
    }

    #[test]
    fn views_are_asked_for_only_where_they_mend_something() {
        const OF_TOO_FEW_VIEWS: [&str; 7] = [
            "VIEWS-FEW",
            "VIEWS-ALIKE",
            "TILT-LOW",
            "DIRECTIONS-FEW",
            "PRIOR-USED",
            "CHECK-MISSING",
            "PROJECTION-UNCERTAIN",
        ];
        for code in FindingCode::one_of_each() {
            let calls = |severity| Finding { code, severity }.calls_for_views();
            let name = code.code();
            let of_few = OF_TOO_FEW_VIEWS.contains(&name);
            assert!(!calls(Severity::Info), "{name}");
            assert_eq!(calls(Severity::Care), of_few, "{name}");
            let mended = of_few || ["LENS-SIMPLE", "NOT-CONVERGED"].contains(&name);
            assert_eq!(calls(Severity::Bad), mended, "{name}");
        }
    }
}
