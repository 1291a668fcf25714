//! Wide lenses: their initial guess, and the test against Brown's polynomial.
//!
//! Brown's model is a power series of `tan θ`, which no longer converges where the angle θ to the
//! optical axis is large. A fisheye model is a series of θ, a rational one a quotient. Both are
//! tried for wide pictures, and one is chosen if the corners clearly support it.

use nalgebra::{Isometry3, Matrix6, Point2, Vector3, Vector6};

use super::{
    bundle::{Bundle, BundleState, Observations, adjust_from},
    lens_model::{LensFamily, LensModel, LensPrior},
    model_choice::{SAME_COST, SHARED_SD_PX},
    odds::CLEAR,
    reversal::with_better_tilts,
    schur_lm::Limits,
};
use boresight_geometry::{Camera, Distortion, LensKind, frame::ImageSize, pose_from_rays};

/// Initial focal lengths of a fisheye lens, relative to the longer side of the picture: it shows
/// about `1/share` radians of the world, 48° to 215°.
const FOCAL_SHARES: [f64; 8] = [1.2, 0.95, 0.75, 0.6, 0.48, 0.38, 0.31, 0.265];
/// Number of adjusted starts.
const BEST_STARTS: usize = 2;
/// Least angle to the optical axis of a wide picture's rays, in radians: 40°. There, `tan θ` is
/// longer than θ by a fifth.
const WIDE_RAD: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// `tan θ` from which the power series of θ diverges: 45°. Beyond, Brown's polynomial is
/// undetermined outside the boards' area.
const DIVERGENT: f64 = 1.0;

/// Initial lens and poses of a family of wide lenses, under the richest model.
#[derive(Clone, Debug)]
pub(crate) struct WideLens {
    pub(crate) family: LensFamily,
    pub(crate) state: BundleState,
    /// Twice the logarithm of the odds to Brown's richest model, weighed like causes of a misfit:
    /// without errors common to all views. Infinite unless Brown's model is allowed.
    pub(crate) gain: f64,
}

/// True if the lens may be too wide for Brown's model: a corner of the picture is more than 40°
/// from the axis, by a pinhole if it has no ray.
pub(crate) fn is_wide(camera: &Camera, image_size: ImageSize) -> bool {
    let pinhole = Camera { distortion: Distortion::default(), ..*camera };
    corners_px(image_size).iter().any(|px| {
        let ray = camera.ray_from_px(px).or_else(|| pinhole.ray_from_px(px));
        ray.is_none_or(|ray| off_axis_rad(&ray) > WIDE_RAD)
    })
}

/// Angle between a ray and the optical axis.
fn off_axis_rad(ray: &Vector3<f64>) -> f64 {
    libm::atan2(ray.xy().norm(), ray.z)
}

fn corners_px(image_size: ImageSize) -> [Point2<f64>; 4] {
    let (right, bottom) =
        (f64::from(image_size.width_px) - 1.0, f64::from(image_size.height_px) - 1.0);
    [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)].map(|(x, y)| Point2::new(x, y))
}

/// Arguments of [`better_families`].
pub(crate) struct WideSearch<'a> {
    pub(crate) observations: &'a Observations,
    pub(crate) image_size: ImageSize,
    pub(crate) square_pixels: bool,
    pub(crate) prior: Option<&'a LensPrior>,
    /// Smallest credible noise factor.
    pub(crate) noise_floor: f64,
    /// Allowed models.
    pub(crate) allowed: &'a [LensModel],
}

/// Families of wide lenses that fit the corners clearly better than `brown`, the fit of the richest
/// of Brown's models, best first. If no Brown model is allowed, all allowed families.
pub(crate) fn better_families(
    search: &WideSearch<'_>,
    brown: Option<&BundleState>,
) -> Vec<WideLens> {
    let brown = brown.and_then(|state| search.adjusted(LensFamily::Brown.richest(), state.clone()));
    let may_be_brown = search.allowed.iter().any(|model| model.family() == LensFamily::Brown);
    let wanted = brown.as_ref().filter(|it| may_be_brown && reaches(it, search.image_size));
    let fisheye = search.fisheye();
    let is_allowed =
        |family: &LensFamily| search.allowed.iter().any(|model| model.family() == *family);
    let known = Known { brown: brown.as_ref(), fisheye: fisheye.as_ref() };
    let bic = |(family, bundle): &(LensFamily, Bundle)| search.bic(*family, bundle, 0.0);
    let best_of = |family: LensFamily| {
        let lenses = search.lenses(family, known).into_iter().map(|bundle| (family, bundle));
        lenses.min_by(|a, b| bic(a).total_cmp(&bic(b)))
    };
    let mut found: Vec<(LensFamily, Bundle)> =
        LensFamily::ALL.into_iter().filter(is_allowed).filter_map(best_of).collect();
    found.sort_by(|a, b| bic(a).total_cmp(&bic(b)));
    let gain = |(family, bundle): &(LensFamily, Bundle), shared: f64| {
        wanted.map_or(f64::INFINITY, |brown| {
            search.bic(LensFamily::Brown, brown, shared) - search.bic(*family, bundle, shared)
        })
    };
    // Errors shared by all views look like a lens: Brown's stays unless the gain exceeds them.
    let shared = search.shared_variance();
    found.retain(|lens| gain(lens, shared) > CLEAR);
    let wide = |lens: (LensFamily, Bundle)| {
        let gain = gain(&lens, 0.0);
        let (family, Bundle { state, .. }) = lens;
        WideLens { family, state, gain }
    };
    found.into_iter().map(wide).collect()
}

/// False if `brown` folds where the series diverges, so that `brown` can't be the lens of the
/// picture.
fn reaches(brown: &Bundle, image_size: ImageSize) -> bool {
    let camera = &brown.state.camera;
    corners_px(image_size).iter().all(|px| {
        let flat = (px - camera.pp_px).component_div(&camera.f_px);
        flat.norm() <= DIVERGENT || camera.ray_from_px(px).is_some()
    })
}

/// Adjusted lenses used as starts for other families.
#[derive(Clone, Copy)]
struct Known<'a> {
    /// Fit under the richest of Brown's models.
    brown: Option<&'a Bundle>,
    /// Fit under the richest fisheye model.
    fisheye: Option<&'a Bundle>,
}

impl WideSearch<'_> {
    /// Lenses of the richest model of `family`, adjusted from different starts.
    fn lenses(&self, family: LensFamily, known: Known<'_>) -> Vec<Bundle> {
        match family {
            // Reference for the other families.
            LensFamily::Brown => Vec::new(),
            LensFamily::Rational => {
                let starts = [
                    known.brown.map(|bundle| bundle.state.clone()),
                    known.fisheye.and_then(|bundle| as_rational(&bundle.state, self.image_size)),
                ];
                let starts = starts.into_iter().flatten();
                starts.filter_map(|start| self.adjusted(family.richest(), start)).collect()
            }
            LensFamily::Fisheye => known.fisheye.into_iter().cloned().collect(),
        }
    }

    fn adjusted(&self, model: LensModel, mut start: BundleState) -> Option<Bundle> {
        start.camera = model.without_others(&start.camera);
        let freedom = model.freedom(self.square_pixels);
        let own_prior = model.own_prior();
        let prior = self.prior.or(own_prior.as_ref());
        let adjust = |start| adjust_from(self.observations, &freedom, prior, start, Limits::TRIAL);
        let bundle = adjust(start)?;
        let Some(state) = with_better_tilts(self.observations, &bundle.state, 1.5) else {
            return Some(bundle);
        };
        let again = adjust(state);
        Some(again.filter(|again| again.cost < bundle.cost).unwrap_or(bundle))
    }

    /// Variance added to a coordinate's noise by errors shared by all views, as a multiple of the
    /// stated variance.
    ///
    /// Like the lens, those errors are shared by all views. The mean of `N` views distinguishes
    /// them only as far as it would if each view had an independent error `√N` times as large.
    fn shared_variance(&self) -> f64 {
        let views = self.observations.view_count() as f64;
        views * self.observations.whitened_square(SHARED_SD_PX)
    }

    /// BIC of the richest lens of `family`, with `shared` added to the variance of the corners, as
    /// a multiple of the stated variance. A lens kept from its minimum by a pole is used only if no
    /// other is allowed.
    fn bic(&self, family: LensFamily, bundle: &Bundle, shared: f64) -> f64 {
        let n = self.observations.coordinate_count() as f64;
        let variance = (bundle.cost / n).max(self.noise_floor * self.noise_floor) + shared;
        let may_be = bundle.converged || family == LensFamily::Brown;
        let against = if may_be { family.against() } else { f64::MAX };
        n * libm::log(variance) + bundle.freedom.count() as f64 * libm::log(n) + against
    }

    /// Richest fisheye lens, from the best of several focal lengths.
    fn fisheye(&self) -> Option<Bundle> {
        let width_px = f64::from(self.image_size.width_px.max(self.image_size.height_px));
        let mut starts: Vec<(f64, BundleState)> = FOCAL_SHARES
            .into_iter()
            .filter_map(|share| {
                let camera = Camera {
                    distortion: Distortion { kind: LensKind::Fisheye, ..Distortion::default() },
                    ..Camera::pinhole(share * width_px, self.image_size.centre_px())
                };
                let cam_from_board = self.poses(&camera)?;
                let cost = self.observations.cost(&camera, &cam_from_board)?;
                Some((cost, BundleState { camera, cam_from_board }))
            })
            .collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        // The focal length settles before the coefficients are free.
        let mut settled: Vec<Bundle> = starts
            .into_iter()
            .take(BEST_STARTS)
            .filter_map(|(_, start)| self.adjusted(LensModel::Fisheye, start))
            .collect();
        settled.dedup_by(|a, b| (a.cost - b.cost).abs() <= SAME_COST * b.cost);
        settled
            .into_iter()
            .filter_map(|settled| {
                let bent = self.adjusted(LensModel::FisheyeK1K2, settled.state)?;
                self.adjusted(LensFamily::Fisheye.richest(), bent.state)
            })
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
    }

    fn poses(&self, camera: &Camera) -> Option<Vec<Isometry3<f64>>> {
        (0..self.observations.view_count())
            .map(|view| {
                let corners = self.observations.view(view);
                let rays: Vec<Vector3<f64>> = corners
                    .iter()
                    .map(|corner| camera.ray_from_px(&corner.px))
                    .collect::<Option<_>>()?;
                let board_m: Vec<Point2<f64>> =
                    corners.iter().map(|corner| corner.board_m).collect();
                pose_from_rays(&board_m, &rays)
            })
            .collect()
    }
}

/// Rational lens nearest to a fisheye lens over the picture, with the same poses. Its coefficients
/// solve the linear equations `m (1 + k4 r² + k5 r⁴ + k6 r⁶) = 1 + k1 r² + k2 r⁴ + k3 r⁶`. `None`
/// if none is near.
fn as_rational(fisheye: &BundleState, image_size: ImageSize) -> Option<BundleState> {
    /// Number of angles at which both lenses are compared, and the largest, in radians.
    const STEPS: u32 = 40;
    const WIDEST_RAD: f64 = 1.3;
    let camera = &fisheye.camera;
    let widest_rad = corners_px(image_size)
        .map(|px| camera.ray_from_px(&px).map_or(WIDEST_RAD, |ray| off_axis_rad(&ray)))
        .into_iter()
        .fold(0.0, f64::max)
        .min(WIDEST_RAD);
    // Regularised slightly: numerator and denominator may share a factor.
    let mut normal = Matrix6::identity() * 1e-9;
    let mut right = Vector6::zeros();
    for step in 1..=STEPS {
        let angle_rad = widest_rad * f64::from(step) / f64::from(STEPS);
        let seen = camera.distortion.apply(&Point2::new(angle_rad, 0.0)).x;
        let r = libm::tan(angle_rad);
        let m = seen / r;
        let (r2, r4, r6) = (r * r, r.powi(4), r.powi(6));
        // In proportion to the height in the picture.
        let row = Vector6::from([r2, r4, r6, -m * r2, -m * r4, -m * r6]);
        let weight = (r / (1.0 + r6)).powi(2);
        normal += row * row.transpose() * weight;
        right += row * ((m - 1.0) * weight);
    }
    let [k1, k2, k3, k4, k5, k6] = normal.cholesky()?.solve(&right).into();
    let distortion = Distortion { k1, k2, k3, k4, k5, k6, ..Distortion::default() };
    let camera = Camera { distortion, ..*camera };
    Some(BundleState { camera, cam_from_board: fisheye.cam_from_board.clone() })
}
