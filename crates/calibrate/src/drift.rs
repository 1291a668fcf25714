//! Detects whether an installed camera has changed: new views against an old calibration.
//! `docs/method.md`, section 4.

use nalgebra::{Matrix2, Point2, Vector2, Vector3};

use super::{
    calibrate::calibrate,
    check::finding::{FindingCode, Severity},
    lens_change::{Change, F_AND_PP_LIMIT, Told, lens_shift},
    lens_flaw::LensFlaw,
    params::CalibrationParams,
    shift::{DriftVerdict, Shift, relevant_shift_px},
    solve::{
        initial_guess::distinct_views, lens_model::LensModel, schur_lm::inverse, view_scatter,
    },
};
use boresight_geometry::{
    BoardOutline, Camera, Corner, LensMatrix, LensParameter, boards::Board, frame::ImageSize,
    seen_count,
};

/// Probability of no alarm for an unchanged principal point, or an unchanged focal length, alone.
const ONE_ALONE: f64 = 0.99;
/// Fewest distinct views for a verdict: two opposed pairs. Standard deviations from fewer are
/// unreliable.
pub const DRIFT_VIEWS: usize = 4;
/// Margin around the old boards within which a corner counts as covered, as a fraction of the
/// picture's width.
const COVERED_MARGIN_FRACTION: f64 = 0.05;
/// Least number of seen corners in a view: a pose has six parameters.
pub(super) const LEAST_SEEN: usize = 6;
/// Largest fraction of a view's corners beyond the margin.
const MAX_UNCOVERED_FRACTION: f64 = 0.25;
/// Number of views beyond which more wouldn't help: then the old calibration is what isn't known.
const MOST_VIEWS: usize = 1000;

/// Calibration against which a camera is checked.
#[derive(Clone, Debug)]
pub struct OldLens<'a> {
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Covariance of the lens parameters, zero for parameters outside the lens model. Without it,
    /// there is no verdict.
    pub covariance: Option<LensMatrix>,
    /// Outlines of the old calibration's boards, in pixels; empty if the file doesn't state them.
    pub outlines: &'a [BoardOutline],
    /// Size of the calibrated pictures.
    pub image_size: ImageSize,
}

/// Difference between an installed camera and the old calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Verdict on the change.
    pub verdict: DriftVerdict,
    /// True if f and the principal point, or the distortion, changed significantly.
    pub is_significant: bool,
    /// Displacement of rays over the picture; over the views if the distortion changed.
    pub shift: Shift,
    /// Number of views like these that would show every change that matters, if it isn't known;
    /// `None` if the old calibration itself isn't known well enough.
    pub views_needed: Option<usize>,
    /// Change of `(f, cx, cy)` in pixels, if the distortion didn't change given the same one; `fy`
    /// changes in proportion to `fx`.
    pub change_px: Vector3<f64>,
    /// Standard deviations of the change in pixels, with the old calibration's included.
    pub sd_px: Vector3<f64>,
    /// `dᵀS⁻¹d` of all three parameters; Hotelling's T² with 3 dimensions if nothing changed.
    pub statistic: f64,
    /// Limit of `statistic`, exceeded by chance in 1 % of checks; larger with fewer views.
    pub limit: f64,
    /// True if the principal point alone changed significantly, at 1 %.
    pub pp_changed: bool,
    /// True if the focal length alone changed significantly, at 1 %.
    pub f_changed: bool,
    /// Least shift of the principal point, in the least visible direction, detected with a
    /// probability of 95 %, in pixels.
    pub visible_pp_px: f64,
    /// Least change of the focal length detected with a probability of 95 %, in pixels.
    pub visible_f_px: f64,
    /// Largest displacement of a ray over the picture, in pixels, by the least proportional change
    /// of the distortion detected with a probability of 95 %. `None` if the views leave the
    /// distortion open.
    pub visible_lens_px: Option<f64>,
    /// Displacement above which a change matters, in pixels.
    pub matters_px: f64,
    /// True if the distortion changed significantly, at 0.1 %.
    pub lens_changed: bool,
    /// Present lens: new focal length and principal point; old distortion, unless that changed.
    pub camera: Camera,
    /// Indices of the views used.
    pub used: Vec<usize>,
}

impl Drift {
    /// Displacement in pixels of the image of the ray shown at `px` by the old lens.
    pub fn displacement_at(&self, px: &Point2<f64>) -> Vector2<f64> {
        let old_f_px = self.camera.f_px.x - self.change_px.x;
        let old_pp_px = self.camera.pp_px - self.change_px.yz();
        (px - old_pp_px) * (self.change_px.x / old_f_px) + self.change_px.yz()
    }
}

/// Reason for a missing verdict.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoDrift {
    /// The size of the pictures differs, so crop and scale of the sensor are unknown.
    #[error("pictures of {new:?}, calibrated for {old:?}")]
    OtherSize {
        /// Size of the new pictures.
        new: ImageSize,
        /// Size in the old calibration.
        old: ImageSize,
    },
    /// Too few distinct views, or too few inside the area covered by the old calibration.
    #[error(
        "{different} different views, {outside} outside the calibrated part, {DRIFT_VIEWS} needed"
    )]
    FewViews {
        /// Number of usable distinct views.
        different: usize,
        /// Number of views too far outside the area covered by the old calibration.
        outside: usize,
    },
    /// The views are of two cameras or two modes: there's no lens to compare.
    #[error("{odd_views} of the views are from another camera or mode")]
    Mixed {
        /// Number of views of the camera with fewer views.
        odd_views: usize,
    },
    /// The focal length differs from view to view: focus or zoom moved between them.
    #[error("the focal length varies by {:.2} % between the views", 100.0 * relative_sd)]
    FocusMoved {
        /// Sample standard deviation of the views' focal lengths, relative to their mean.
        relative_sd: f64,
    },
    /// The old lens can't be right.
    #[error("the old lens can't be right: {0}")]
    Impossible(LensFlaw),
    /// The old calibration states no uncertainty: its own error can't be told from a change.
    #[error("the old calibration states no uncertainty")]
    NotJudged,
    /// The views don't determine focal length and principal point.
    #[error("the views do not determine focal length and principal point")]
    Undetermined,
}

impl NoDrift {
    /// Stable name, for files and programs.
    pub fn code(&self) -> &'static str {
        match self {
            Self::OtherSize { .. } => "OTHER-SIZE",
            Self::FewViews { outside: 0, .. } => "VIEWS-FEW",
            Self::FewViews { .. } => "OUTSIDE-OLD-COVERAGE",
            Self::Mixed { .. } => "VIEWS-MIXED",
            Self::FocusMoved { .. } => "FOCUS-MOVED",
            Self::Impossible(_) => "LENS-IMPOSSIBLE",
            Self::NotJudged => "NOT-JUDGED",
            Self::Undetermined => "UNDETERMINED",
        }
    }
}

/// Compares `views` of `board` with an old calibration.
///
/// Each view has one corner per board corner, in distorted pixels; other views are ignored. Views
/// outside the area covered by the old calibration are ignored, too: its distortion is not known
/// there.
///
/// The new views are calibrated as usual, with the models of the old lens's family. The difference
/// of the two calibrations, by their stated covariances, shows the change: f and the principal
/// point given the same distortion, and the distortion. A displacement above `limit_px` matters; by
/// default 0.08 % of the picture's width. See `docs/method.md`, section 4.
///
/// # Errors
///
/// [`NoDrift`] if the old lens can't be right or states no covariance, if the picture size differs,
/// if fewer than [`DRIFT_VIEWS`] usable views differ, if they are of two cameras or focal lengths,
/// or if they don't determine the three parameters.
pub fn drift(
    views: &[Vec<Corner>],
    board: &Board,
    image_size: ImageSize,
    old: &OldLens<'_>,
    limit_px: Option<f64>,
) -> Result<Drift, NoDrift> {
    if let Some(flaw) = LensFlaw::of(&old.camera, old.image_size, old.outlines) {
        return Err(NoDrift::Impossible(flaw));
    }
    let of_old = old.covariance.ok_or(NoDrift::NotJudged)?;
    if image_size != old.image_size {
        return Err(NoDrift::OtherSize { new: image_size, old: old.image_size });
    }
    let usable =
        |view: &Vec<Corner>| view.len() == board.corner_count() && seen_count(view) >= LEAST_SEEN;
    let used: Vec<usize> = (0..views.len())
        .filter(|view| usable(&views[*view]) && is_covered(&views[*view], old))
        .collect();
    // Scale rows so that the old pixels are square; the result is scaled back.
    let aspect = old.camera.f_px.x / old.camera.f_px.y;
    let scaled: Vec<Vec<Corner>> = used
        .iter()
        .map(|view| views[*view].iter().map(|c| c.with_rows_scaled(aspect)).collect())
        .collect();
    let different = distinct_views(&scaled, board, image_size);
    if different < DRIFT_VIEWS {
        let outside = views.iter().filter(|view| usable(view) && !is_covered(view, old)).count();
        return Err(NoDrift::FewViews { different, outside });
    }
    let family = LensModel::simplest_with(&old.camera).family();
    let params = CalibrationParams { models: family.models(), ..CalibrationParams::default() };
    let new = calibrate(&scaled, board, image_size, &params).map_err(|_| NoDrift::Undetermined)?;
    for finding in new.findings.iter().filter(|finding| finding.severity == Severity::Bad) {
        match finding.code {
            FindingCode::FocusMoved { relative_sd, .. } => {
                return Err(NoDrift::FocusMoved { relative_sd });
            }
            FindingCode::ViewsMixed { odd_views, .. } => return Err(NoDrift::Mixed { odd_views }),
            _ => {}
        }
    }
    if new.is_undetermined() {
        return Err(NoDrift::Undetermined);
    }
    let mut camera = new.camera;
    camera.f_px.y /= aspect;
    camera.pp_px.y /= aspect;
    let of_new = scaled_covariance(&new.covariance_all, aspect.recip());
    let lenses = Lenses { old: (old.camera, of_old), new: (camera, of_new), image_size };
    let told = Told::by(view_scatter::freedom(different));
    let matters_px = limit_px.unwrap_or_else(|| relevant_shift_px(image_size));
    let seen = used.iter().flat_map(|view| &views[*view]).filter(|corner| corner.is_seen());
    let found = lenses.compared(&told, seen.map(|corner| corner.px), matters_px);
    let found = found.ok_or(NoDrift::Undetermined)?;
    let views_needed = match found.verdict {
        DriftVerdict::CannotTell => lenses.views_needed(different, matters_px),
        DriftVerdict::Ok | DriftVerdict::Recalibrate => None,
    };
    Ok(Drift { views_needed, used, ..found })
}

/// Old and new lens of a camera, each with covariance.
struct Lenses {
    old: (Camera, LensMatrix),
    new: (Camera, LensMatrix),
    image_size: ImageSize,
}

impl Lenses {
    fn change(&self) -> Option<Change> {
        Change::between((&self.old.0, &self.old.1), (&self.new.0, &self.new.1))
    }

    /// Change with its verdict, if displacements above `matters_px` matter. `places` are the
    /// corners seen by the new lens. `None` if the covariances don't determine f and the principal
    /// point.
    fn compared(
        &self,
        told: &Told,
        places: impl Iterator<Item = Point2<f64>>,
        matters_px: f64,
    ) -> Option<Drift> {
        let Self { old: (old, of_old), new: (new, of_new), image_size } = self;
        let change = self.change()?;
        let (d, covariance) = (change.f_and_pp_px, change.f_and_pp_covariance);
        let information = inverse(&covariance)?;
        let statistic = (d.transpose() * information * d).x;
        let limit = told.limit(3, F_AND_PP_LIMIT)?;
        let pp_covariance: Matrix2<f64> = covariance.fixed_view::<2, 2>(1, 1).into();
        let pp_statistic = (d.yz().transpose() * inverse(&pp_covariance)? * d.yz()).x;
        let f_statistic = d.x * d.x / covariance[(0, 0)];
        let weakest: Matrix2<f64> = information.fixed_view::<2, 2>(1, 1).into();
        let noncentrality = told.noncentrality(3, limit);
        let above = |statistic: f64, dimensions| {
            told.limit(dimensions, ONE_ALONE).is_some_and(|limit| statistic > limit)
        };
        let of_f_and_pp = change.of_f_and_pp(old, *image_size, told)?;
        let lens = change.of_distortion(old, *image_size, told);
        let bounds = lens.map_or(of_f_and_pp, |lens| of_f_and_pp.or(&lens.shift));
        let mut found = Drift {
            verdict: DriftVerdict::CannotTell,
            is_significant: statistic > limit,
            shift: Shift { px: of_f_and_pp.px, ..bounds },
            views_needed: None,
            change_px: d,
            sd_px: covariance.diagonal().map(f64::sqrt),
            statistic,
            limit,
            pp_changed: above(pp_statistic, 2),
            f_changed: above(f_statistic, 1),
            visible_pp_px: (noncentrality / weakest.symmetric_eigenvalues().min()).sqrt(),
            visible_f_px: (noncentrality / information[(0, 0)]).sqrt(),
            visible_lens_px: lens.map(|lens| lens.shift.visible_px),
            matters_px,
            lens_changed: lens.is_some_and(|lens| lens.is_significant),
            camera: *old,
            used: Vec::new(),
        };
        if found.lens_changed {
            // f and the principal point given the same distortion would mean nothing.
            let whole = lens_shift((old, of_old), (new, of_new), places, told)?;
            found.is_significant = true;
            found.shift = Shift { visible_px: bounds.visible_px, ..whole };
            found.change_px = f_and_pp(new) - f_and_pp(old);
            let covariance = (of_old + of_new).diagonal();
            found.sd_px = LensParameter::F_AND_PP
                .map(|parameter| covariance[parameter.index()].sqrt())
                .into();
            found.camera.distortion = new.distortion;
        }
        found.camera.f_px *= 1.0 + found.change_px.x / old.f_px.x;
        found.camera.pp_px += found.change_px.yz();
        found.verdict = found.shift.verdict(found.is_significant, matters_px);
        Some(found)
    }

    /// Number of views like the `views` new ones that would show every change of more than
    /// `matters_px`; `None` if the old lens itself isn't known well enough.
    fn views_needed(&self, views: usize, matters_px: f64) -> Option<usize> {
        let shows = |count: usize| {
            let of_new = self.new.1 * (views as f64 / count as f64);
            let more = Self { new: (self.new.0, of_new), ..*self };
            let told = Told::by(view_scatter::freedom(count));
            let visible_px = more.change().and_then(|change| {
                let f_and_pp = change.of_f_and_pp(&self.old.0, self.image_size, &told)?;
                let lens = change.of_distortion(&self.old.0, self.image_size, &told);
                Some(lens.map_or(f_and_pp, |lens| f_and_pp.or(&lens.shift)).visible_px)
            });
            visible_px.is_some_and(|visible_px| visible_px <= matters_px)
        };
        let (mut few, mut enough) = (views, MOST_VIEWS);
        if !shows(enough) {
            return None;
        }
        while enough - few > 1 {
            let count = few.midpoint(enough);
            if shows(count) {
                enough = count;
            } else {
                few = count;
            }
        }
        Some(enough)
    }
}

fn f_and_pp(camera: &Camera) -> Vector3<f64> {
    Vector3::new(camera.f_px.x, camera.pp_px.x, camera.pp_px.y)
}

/// True if most of a view lies in the area covered by the old calibration, or if that area is
/// unknown.
fn is_covered(view: &[Corner], old: &OldLens<'_>) -> bool {
    if old.outlines.is_empty() {
        return true;
    }
    let reach_px = COVERED_MARGIN_FRACTION * f64::from(old.image_size.width_px);
    let outside = view
        .iter()
        .filter(|corner| corner.is_seen())
        .filter(|corner| !old.outlines.iter().any(|outline| outline.reaches(&corner.px, reach_px)))
        .count();
    outside as f64 <= MAX_UNCOVERED_FRACTION * seen_count(view) as f64
}

/// Covariance after scaling rows by `aspect`.
fn scaled_covariance(covariance: &LensMatrix, aspect: f64) -> LensMatrix {
    let scale = LensParameter::ALL.map(|parameter| match parameter {
        LensParameter::Fy | LensParameter::Cy => aspect,
        _ => 1.0,
    });
    LensMatrix::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j])
}
