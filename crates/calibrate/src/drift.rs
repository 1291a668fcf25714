//! Detects whether an installed camera has changed: new views against an old calibration. `docs/method.md`, section 4.

use nalgebra::{DVector, Matrix2, Matrix3, Matrix3xX, Point2, Vector2, Vector3};

use super::{
    lens_change::{DistortionPull, LensChange},
    solve::{
        bundle::{Bundle, BundleState, Observations, adjust, information_at},
        initial_guess::noise_floor,
        lens_model::LensModel,
        schur_lm::inverse,
    },
};
use boresight_geometry::{
    BoardOutline, Camera, Corner, LensMatrix, LensParameter, LensParts, board::Checkerboard,
    cell_centres_px, fit_pose, frame::ImageSize, seen_count,
};

/// χ² quantile at 0.991 with 3 degrees of freedom, and the noncentrality for 95 % power at that limit. One check in a
/// hundred gives a false alarm; the test of the lens has the rest of that share.
pub(super) const LIMIT: f64 = 11.573;
const NONCENTRALITY_95: f64 = 23.017;
/// χ² quantiles at 0.99 with 2 and 1 degrees of freedom.
const PP_LIMIT: f64 = 9.210;
const F_LIMIT: f64 = 6.635;
/// Fewest views for a verdict: two opposed pairs.
pub const DRIFT_VIEWS: usize = 4;
/// Distance outside the old boards up to which a corner still counts as covered, as a fraction of the picture's width.
const COVERED_MARGIN_FRACTION: f64 = 0.05;
/// Least number of seen corners in a view: a pose has six parameters.
const LEAST_SEEN: usize = 6;
/// Largest fraction of a view's corners that may lie further out.
const MAX_UNCOVERED_FRACTION: f64 = 0.25;
/// Ratio of the residual with the old distortion to the residual with a free one, above which the distortion has
/// changed. By chance, the coefficients change it by about 1 %: four views have some four hundred degrees of freedom.
const MAX_RESIDUAL_RATIO: f64 = 1.5;
/// Displacement of a ray, as a fraction of the picture's width, below which a significant change is watched rather than
/// acted on: 1 px at 1280.
pub(super) const RELEVANT_SHIFT_FRACTION: f64 = 0.0008;
/// Standard deviations assumed for a calibration file without covariance: f relative to itself, PP relative to the
/// width, then the coefficients. Pessimistic on purpose: the PP's is
/// about nine times as large as after eight frame-filling views (`docs/method.md`, section 0).
const UNSTATED_F: f64 = 1.5e-3;
const UNSTATED_PP: f64 = 1.5e-3;
const UNSTATED_K1: f64 = 5e-3;
const UNSTATED_TANGENTIAL: f64 = 2e-4;
const UNSTATED_RADIAL: f64 = 1e-2;

/// The calibration against which a camera is checked.
#[derive(Clone, Debug)]
pub struct OldLens<'a> {
    /// Focal lengths and principal point in pixels, and distortion.
    pub camera: Camera,
    /// Covariance of the lens parameters, if the file states it; zero for parameters outside its lens model.
    pub covariance: Option<LensMatrix>,
    /// Outlines of the old calibration's boards, in pixels; empty if the file doesn't state them.
    pub outlines: &'a [BoardOutline],
    /// Size of its pictures.
    pub image_size: ImageSize,
}

/// The verdict of a drift check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriftVerdict {
    /// No significant change.
    Ok,
    /// A significant change, too small to matter yet.
    Watch,
    /// A change that matters.
    Recalibrate,
}

/// Difference between an installed camera and its old calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct Drift {
    /// Verdict on the change.
    pub verdict: DriftVerdict,
    /// Change of `(f, cx, cy)` in pixels; `fy` changes in proportion to `fx`.
    pub change_px: Vector3<f64>,
    /// Standard deviations of the change in pixels, with the old calibration's included.
    pub sd_px: Vector3<f64>,
    /// `dᵀS⁻¹d` of all three, χ² with 3 degrees of freedom if nothing changed.
    pub statistic: f64,
    /// Limit of `statistic`, exceeded by chance in 1 % of checks.
    pub limit: f64,
    /// True if the principal point alone changed significantly, at 1 %.
    pub pp_changed: bool,
    /// True if the focal length alone changed significantly, at 1 %.
    pub f_changed: bool,
    /// Shift of the principal point, in the direction in which it is least visible, that would be detected with a
    /// probability of 95 %, in pixels.
    pub visible_pp_px: f64,
    /// Change of the focal length that would be detected with a probability of 95 %, in pixels.
    pub visible_f_px: f64,
    /// Largest displacement of a ray over the picture, in pixels, by a proportional change of the distortion that would be
    /// detected with a probability of 95 %. `None` if the views leave the distortion open.
    pub visible_lens_px: Option<f64>,
    /// Largest displacement of a ray's image over the picture, in pixels.
    pub displacement_px: f64,
    /// Displacement above which a change matters, in pixels.
    pub matters_px: f64,
    /// Ratio of the residual with the old distortion to the residual with a free one; far above 1 if the distortion
    /// itself changed.
    pub residual_ratio: f64,
    /// True if the distortion changed: significantly, at 0.1 %, or so that `residual_ratio` is too large.
    pub lens_changed: bool,
    /// True if a typical covariance was assumed because the old calibration states none.
    pub assumed: bool,
    /// The lens now: new focal length and principal point, old distortion.
    pub camera: Camera,
    /// Indices of the views used.
    pub used: Vec<usize>,
}

impl Drift {
    /// Displacement in pixels of the image of the ray that the old lens showed at `px`.
    pub fn displacement_at(&self, px: &Point2<f64>) -> Vector2<f64> {
        let old_f_px = self.camera.f_px.x - self.change_px.x;
        let old_pp_px = self.camera.pp_px - self.change_px.yz();
        (px - old_pp_px) * (self.change_px.x / old_f_px) + self.change_px.yz()
    }
}

/// Why there is no verdict.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoDrift {
    /// The size of the pictures differs: how the sensor was cropped or scaled is unknown.
    #[error("pictures of {new:?}, calibrated for {old:?}")]
    OtherSize {
        /// Size of the new pictures.
        new: ImageSize,
        /// Size in the old calibration.
        old: ImageSize,
    },
    /// Too few views, or too few in the part of the picture that the old calibration covers.
    #[error("{usable} usable views, {outside} outside the calibrated part, {DRIFT_VIEWS} needed")]
    FewViews {
        /// Views that can be used.
        usable: usize,
        /// Views that extend too far outside the part that the old calibration covers.
        outside: usize,
    },
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
            Self::Undetermined => "UNDETERMINED",
        }
    }
}

impl DriftVerdict {
    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Watch => "watch",
            Self::Recalibrate => "recalibrate",
        }
    }
}

/// Compares `views` of `board` with an old calibration.
///
/// Each view has one corner per board corner, in distorted pixels; others are ignored. Views outside the part of the
/// picture that the old calibration covers are ignored, too: its distortion is not known there.
///
/// Focal length and principal point are adjusted, the old distortion held. With `I` the information of the
/// new views, `d = θ' − θ_old`, `A = [−I, −I₃₃⁻¹ I₃ₖ]` and `S = I₃₃⁻¹ + A C_old Aᵀ`, `dᵀS⁻¹d` is χ² with 3
/// degrees of freedom if nothing changed; `k` are all coefficients of the old lens's family. See `docs/method.md`, section 4.
///
/// # Errors
///
/// [`NoDrift`] if the picture size differs, if fewer than [`DRIFT_VIEWS`] views can be used, or if they don't determine
/// the three parameters.
pub fn drift(
    views: &[Vec<Corner>],
    board: &Checkerboard,
    image_size: ImageSize,
    old: &OldLens<'_>,
) -> Result<Drift, NoDrift> {
    if image_size != old.image_size {
        return Err(NoDrift::OtherSize { new: image_size, old: old.image_size });
    }
    let usable =
        |view: &Vec<Corner>| view.len() == board.corner_count() && seen_count(view) >= LEAST_SEEN;
    let used: Vec<usize> = (0..views.len())
        .filter(|view| usable(&views[*view]) && is_covered(&views[*view], old))
        .collect();
    if used.len() < DRIFT_VIEWS {
        let outside = views.iter().filter(|view| usable(view) && !is_covered(view, old)).count();
        return Err(NoDrift::FewViews { usable: used.len(), outside });
    }
    // Rows are scaled so that the old pixels are square, and the result back again.
    let aspect = old.camera.f_px.x / old.camera.f_px.y;
    let scaled: Vec<Vec<Corner>> = used
        .iter()
        .map(|view| views[*view].iter().map(|c| c.with_rows_scaled(aspect)).collect())
        .collect();
    let mut camera = old.camera;
    camera.f_px.y = camera.f_px.x;
    camera.pp_px.y *= aspect;
    let board_m = board.corners_in_board_m();
    let model = LensModel::simplest_with(&camera).family().richest();
    let change = Change::of(&scaled, &board_m, camera, model).ok_or(NoDrift::Undetermined)?;
    let assumed = old.covariance.is_none();
    let old_covariance = old.covariance.unwrap_or_else(|| unstated(&camera, model, image_size));
    let old_covariance = scaled_covariance(&old_covariance, aspect);
    let covariance = change.covariance(&old_covariance).ok_or(NoDrift::Undetermined)?;
    let d = change.d_px;
    let information = inverse(&covariance).ok_or(NoDrift::Undetermined)?;
    let statistic = (d.transpose() * information * d).x;
    let pp_covariance: Matrix2<f64> = covariance.fixed_view::<2, 2>(1, 1).into();
    let of_pp = inverse(&pp_covariance).ok_or(NoDrift::Undetermined)?;
    let pp_statistic = (d.yz().transpose() * of_pp * d.yz()).x;
    let weakest: Matrix2<f64> = information.fixed_view::<2, 2>(1, 1).into();
    let back = Vector3::new(1.0, 1.0, 1.0 / aspect);
    let change_px = d.component_mul(&back);
    let matters_px = RELEVANT_SHIFT_FRACTION * f64::from(image_size.width_px);
    let residual_ratio = change.residual_ratio;
    let lens = LensChange::of(&change.distortion, &camera, &old_covariance, image_size);
    let lens_changed =
        residual_ratio > MAX_RESIDUAL_RATIO || lens.is_some_and(|lens| lens.is_significant);
    let mut now = old.camera;
    now.f_px *= 1.0 + change_px.x / now.f_px.x;
    now.pp_px += change_px.yz();
    let mut found = Drift {
        verdict: DriftVerdict::Ok,
        change_px,
        sd_px: covariance.diagonal().map(f64::sqrt).component_mul(&back),
        statistic,
        limit: LIMIT,
        pp_changed: pp_statistic > PP_LIMIT,
        f_changed: d.x * d.x / covariance[(0, 0)] > F_LIMIT,
        visible_pp_px: (NONCENTRALITY_95 / weakest.symmetric_eigenvalues().min()).sqrt(),
        visible_f_px: (NONCENTRALITY_95 / information[(0, 0)]).sqrt(),
        visible_lens_px: lens.map(|lens| lens.visible_px),
        displacement_px: 0.0,
        matters_px,
        residual_ratio,
        lens_changed,
        assumed,
        camera: now,
        used,
    };
    found.displacement_px =
        cell_centres_px(image_size).map(|px| found.displacement_at(&px).norm()).fold(0.0, f64::max);
    if let Some(lens) = lens.filter(|lens| lens.is_significant) {
        found.displacement_px = found.displacement_px.max(lens.displacement_px);
    }
    let is_significant = lens_changed || statistic > LIMIT;
    let is_other_lens = residual_ratio > MAX_RESIDUAL_RATIO;
    let verdict = if is_other_lens || (is_significant && found.displacement_px > matters_px) {
        DriftVerdict::Recalibrate
    } else if is_significant {
        DriftVerdict::Watch
    } else {
        DriftVerdict::Ok
    };
    Ok(Drift { verdict, ..found })
}

/// True if most of a view lies where the old calibration had boards; true if that isn't known.
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

/// The covariance after rows are scaled by `aspect`.
fn scaled_covariance(covariance: &LensMatrix, aspect: f64) -> LensMatrix {
    let scale = LensParameter::ALL.map(|parameter| match parameter {
        LensParameter::Fy | LensParameter::Cy => aspect,
        _ => 1.0,
    });
    LensMatrix::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j])
}

/// A typical covariance of `camera`, a lens of `model` with square pixels.
fn unstated(camera: &Camera, model: LensModel, image_size: ImageSize) -> LensMatrix {
    let mut covariance = LensMatrix::zeros();
    for parameter in model.freedom(true).parameters() {
        let sd = match parameter {
            LensParameter::Fx | LensParameter::Fy => UNSTATED_F * camera.f_px.x,
            LensParameter::Cx | LensParameter::Cy => UNSTATED_PP * f64::from(image_size.width_px),
            LensParameter::K1 => UNSTATED_K1,
            LensParameter::P1 | LensParameter::P2 => UNSTATED_TANGENTIAL,
            _ => UNSTATED_RADIAL,
        };
        covariance[(parameter.index(), parameter.index())] = sd * sd;
    }
    covariance
}

/// The new views adjusted with the old distortion.
struct Change {
    d_px: Vector3<f64>,
    /// `I₃₃⁻¹`: covariance of `(f, cx, cy)` from the new views, per unit of noise.
    unit_covariance: Matrix3<f64>,
    /// `I₃₃⁻¹ I₃ₖ`: derivative of `(f, cx, cy)` by the held distortion.
    by_distortion: Matrix3xX<f64>,
    distortion: DistortionPull,
    noise_factor: f64,
    residual_ratio: f64,
}

impl Change {
    /// `model` has the coefficients that `old` may have.
    fn of(
        views: &[Vec<Corner>],
        board_m: &[Point2<f64>],
        old: Camera,
        model: LensModel,
    ) -> Option<Self> {
        let slices: Vec<&[Corner]> = views.iter().map(Vec::as_slice).collect();
        let observations = Observations::new(board_m, &slices).ok()?;
        let cam_from_board = views
            .iter()
            .map(|view| Some(fit_pose(&old, board_m, view).ok()?.cam_from_board))
            .collect::<Option<_>>()?;
        let start = BundleState { camera: old, cam_from_board };
        let fixed = LensModel::Pinhole.freedom(true);
        let bundle = adjust(&observations, &fixed, None, start)?;
        let (richest, prior) = (model.freedom(true), model.own_prior());
        let free = adjust(&observations, &richest, prior.as_ref(), bundle.state.clone());
        let (information, gradient) = information_at(&observations, &richest, &bundle.state)?;
        let of = |bundle: &Bundle| bundle.noise_factor().max(noise_floor(views));
        let noise_factor = of(&bundle);
        let now = bundle.state.camera;
        let off = now.pp_px - old.pp_px;
        let unit_covariance =
            inverse(&information.block(LensParameter::F_AND_PP, LensParameter::F_AND_PP))?;
        let coefficients = model.distortion();
        let cross = information.part(&LensParameter::F_AND_PP, coefficients);
        let by_distortion = unit_covariance * &cross;
        let free_noise_factor = free.as_ref().map_or(noise_factor, of);
        Some(Self {
            d_px: Vector3::new(now.f_px.x - old.f_px.x, off.x, off.y),
            unit_covariance,
            distortion: DistortionPull {
                coefficients,
                information: information.part(coefficients, coefficients)
                    - cross.transpose() * &by_distortion,
                // f and the principal point have no gradient at the minimum.
                gradient: DVector::from_fn(coefficients.len(), |i, _| {
                    gradient[coefficients[i].index()]
                }),
                noise_factor: free_noise_factor,
            },
            by_distortion,
            noise_factor,
            residual_ratio: noise_factor / free_noise_factor,
        })
    }

    /// `S`.
    fn covariance(&self, old: &LensMatrix) -> Option<Matrix3<f64>> {
        let coefficients = self.distortion.coefficients;
        let parameters = [&LensParameter::F_AND_PP, coefficients].concat();
        let mut a = Matrix3xX::zeros(parameters.len());
        a.fixed_columns_mut::<3>(0).copy_from(&-Matrix3::identity());
        a.columns_mut(3, coefficients.len()).copy_from(&-&self.by_distortion);
        let of_old = &a * old.part(&parameters, &parameters) * a.transpose();
        let covariance = self.unit_covariance * self.noise_factor.powi(2) + of_old;
        let usable = covariance.iter().all(|x| x.is_finite())
            && covariance.diagonal().iter().all(|variance| *variance > 0.0);
        usable.then_some(covariance)
    }
}
