//! Change between two calibrations of a camera, by the stated covariances, `docs/method.md`,
//! section 4.

use nalgebra::{DMatrix, DVector, Matrix2x3, Matrix2xX, Matrix3, Point2, Vector2, Vector3};
use statrs::function::beta::beta_reg;

use super::shift::{CONFIDENCE, Shift};
use boresight_geometry::{
    Camera, LENS_PARAMETERS, LensMatrix, LensParameter, LensParts, cell_centres_px,
    frame::ImageSize,
};

/// Probabilities of no alarm for an unchanged f and principal point, and for an unchanged
/// distortion in either of two tests, of any change and of a change in proportion. One check in a
/// hundred gives a false alarm.
pub(super) const F_AND_PP_LIMIT: f64 = 0.991;
const UNCHANGED: f64 = 0.9995;
/// Probability of detecting a change called visible.
const POWER: f64 = 0.95;
/// Displacement of a ray by the old distortion, in pixels, below which no change in proportion is
/// possible. A change of k1 replaces it.
const LEAST_DISTORTION_PX: f64 = 0.5;
/// Least variance of a tested direction of change, as a share of the largest, with coefficients
/// scaled alike: numerator and denominator of a rational lens may cancel.
const UNTOLD: f64 = 1e-12;

/// Degrees of freedom of a change's covariance, for the distribution of test statistics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    freedom: f64,
}

impl Told {
    /// Exactly known covariance.
    pub(super) const EXACTLY: Self = Self { freedom: 1e6 };

    pub(super) fn by(freedom: f64) -> Self {
        Self { freedom }
    }

    /// Quantile of `dᵀS⁻¹d` in `dimensions`, for the given probability: Hotelling's T² (Hotelling
    /// 1931). `None` below `dimensions` degrees of freedom.
    pub(super) fn limit(&self, dimensions: usize, probability: f64) -> Option<f64> {
        let is_told = self.freedom >= dimensions as f64;
        is_told.then(|| rising(|limit| self.below(dimensions, 0.0, limit) < probability))
    }

    /// `dᵀS⁻¹d` of a change, without chance, that exceeds `limit` with the probability [`POWER`]:
    /// the noncentrality of T².
    pub(super) fn noncentrality(&self, dimensions: usize, limit: f64) -> f64 {
        rising(|noncentrality| self.below(dimensions, noncentrality, limit) > 1.0 - POWER)
    }

    /// Probability of a noncentral T² below `limit`: a mean of central ones over Poisson weights.
    fn below(&self, dimensions: usize, noncentrality: f64, limit: f64) -> f64 {
        let half = noncentrality / 2.0;
        let left = self.freedom - dimensions as f64 + 1.0;
        let share_below = limit / (limit + self.freedom);
        let (mut log_weight, mut sum, mut total) = (-half, 0.0, 0.0);
        for term in 0.. {
            let weight = libm::exp(log_weight);
            if term as f64 > half && weight < f64::EPSILON {
                break;
            }
            let count = (dimensions + 2 * term) as f64;
            sum += weight * beta_reg(count / 2.0, left / 2.0, share_below);
            total += weight;
            log_weight += libm::log(half.max(f64::MIN_POSITIVE)) - libm::log(term as f64 + 1.0);
        }
        sum / total
    }
}

/// Value up to which `is_less` holds, above 0.
fn rising(is_less: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while is_less(high) && high < 1e9 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if is_less(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Difference of two calibrations, with the part not explained by the uncertainty of the
/// distortion.
#[derive(Clone, Debug)]
pub(super) struct Change {
    /// Change of `(f, cx, cy)` if the distortion is the same.
    pub(super) f_and_pp_px: Vector3<f64>,
    pub(super) f_and_pp_covariance: Matrix3<f64>,
    /// Coefficients of either lens.
    coefficients: Vec<LensParameter>,
    /// Map from changes of the coefficients to changes along independent directions with a standard
    /// deviation of 1; and the change along them.
    whitened: DMatrix<f64>,
    along: DVector<f64>,
}

/// Outcome of the tests of the distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LensChange {
    /// True if either test finds a change.
    pub(super) is_significant: bool,
    /// Shift by the proportional change.
    pub(super) shift: Shift,
}

/// Shift of the picture by a change of `(f, cx, cy)` from `f_pp_px`, with covariance; the
/// distortion is the same. `None` with too few degrees of freedom.
pub(super) fn f_and_pp_shift(
    f_pp_px: &Vector3<f64>,
    (change_px, covariance): (&Vector3<f64>, &Matrix3<f64>),
    image_size: ImageSize,
    told: &Told,
) -> Option<Shift> {
    let seen = told.noncentrality(3, told.limit(3, F_AND_PP_LIMIT)?);
    let places = cell_centres_px(image_size).map(|px| {
        let off = (px.coords - f_pp_px.yz()) / f_pp_px.x;
        let by = Matrix2x3::new(off.x, 1.0, 0.0, off.y, 0.0, 1.0);
        (by * change_px, by * covariance * by.transpose())
    });
    Some(Shift::over(places, (told.limit(2, CONFIDENCE)?, seen)))
}

/// Shift of `places` in the new picture by all differences between two lenses, each with a
/// covariance. `None` if no ray of the places reaches the old picture.
pub(super) fn lens_shift(
    (old, of_old): (&Camera, &LensMatrix),
    (new, of_new): (&Camera, &LensMatrix),
    places: impl Iterator<Item = Point2<f64>>,
    told: &Told,
) -> Option<Shift> {
    let covariance = of_old + of_new;
    let mut places = places
        .filter_map(|px| {
            let now = new.project_ray(&new.ray_from_px(&px)?)?.jac_lens;
            let before = old.project_ray(&new.ray_from_px(&px)?)?.px;
            Some((px - before, now * covariance * now.transpose()))
        })
        .peekable();
    places.peek()?;
    Some(Shift::over(places, (told.limit(2, CONFIDENCE)?, 0.0)))
}

impl Change {
    /// Change from the old lens to the new lens, each with a covariance; `fy/fx` is the same.
    /// `None` if a covariance isn't finite or doesn't determine f and the principal point.
    pub(super) fn between(
        (old, of_old): (&Camera, &LensMatrix),
        (new, of_new): (&Camera, &LensMatrix),
    ) -> Option<Self> {
        let covariance = of_old + of_new;
        let (before, after) = (old.lens_parameters(), new.lens_parameters());
        let change: [f64; LENS_PARAMETERS] = std::array::from_fn(|i| after[i] - before[i]);
        let coefficients: Vec<LensParameter> = LensParameter::DISTORTION
            .into_iter()
            .filter(|coefficient| covariance[(coefficient.index(), coefficient.index())] > 0.0)
            .collect();
        let of = |parameters: &[LensParameter]| {
            DVector::from_fn(parameters.len(), |i, _| change[parameters[i].index()])
        };
        let sd = DVector::from_fn(coefficients.len(), |i, _| {
            covariance[(coefficients[i].index(), coefficients[i].index())].sqrt()
        });
        let unit = DMatrix::from_diagonal(&sd.map(f64::recip));
        let scaled = &unit * covariance.part(&coefficients, &coefficients) * &unit;
        if !covariance.iter().chain(&change).all(|x| x.is_finite()) {
            return None;
        }
        let eigen = scaled.symmetric_eigen();
        let least = UNTOLD * eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
        let told: Vec<usize> =
            (0..coefficients.len()).filter(|i| eigen.eigenvalues[*i] > least).collect();
        let mut towards = eigen.eigenvectors.select_columns(&told);
        for (column, i) in told.iter().enumerate() {
            towards.column_mut(column).scale_mut(eigen.eigenvalues[*i].sqrt().recip());
        }
        let whitened = towards.transpose() * &unit;
        let along = &whitened * of(&coefficients);
        let f_and_pp = LensParameter::F_AND_PP;
        let across = covariance.part(&f_and_pp, &coefficients) * whitened.transpose();
        let explained: Vector3<f64> = (&across * &along).fixed_rows::<3>(0).into();
        let less: Matrix3<f64> = (&across * across.transpose()).fixed_view::<3, 3>(0, 0).into();
        let f_and_pp_covariance = covariance.block(f_and_pp, f_and_pp) - less;
        let f_and_pp_px: Vector3<f64> = of(&f_and_pp).fixed_rows::<3>(0).into();
        let is_usable = f_and_pp_covariance.diagonal().iter().all(|variance| *variance > 0.0);
        is_usable.then_some(Self {
            f_and_pp_px: f_and_pp_px - explained,
            f_and_pp_covariance,
            coefficients,
            whitened,
            along,
        })
    }

    /// Shift of the picture by the change of f and the principal point of `old`. `None` with too
    /// few degrees of freedom.
    pub(super) fn of_f_and_pp(
        &self,
        old: &Camera,
        image_size: ImageSize,
        told: &Told,
    ) -> Option<Shift> {
        let f_pp_px = Vector3::new(old.f_px.x, old.pp_px.x, old.pp_px.y);
        let change = (&self.f_and_pp_px, &self.f_and_pp_covariance);
        f_and_pp_shift(&f_pp_px, change, image_size, told)
    }

    /// Tests for a change of the distortion of `old`: in any way, and in proportion, as by
    /// refocusing or warming, which a few views detect far better. `None` if there is no
    /// information, or if no ray reaches the picture.
    pub(super) fn of_distortion(
        &self,
        old: &Camera,
        image_size: ImageSize,
        told: &Told,
    ) -> Option<LensChange> {
        let coefficients = &self.coefficients;
        let moved_by: Vec<Matrix2xX<f64>> = cell_corners_px(image_size)
            .filter_map(|px| Some(old.project_ray(&old.ray_from_px(&px)?)?.jac_lens))
            .map(|by| {
                Matrix2xX::from_fn(coefficients.len(), |i, j| by[(i, coefficients[j].index())])
            })
            .collect();
        let displacement_px = |change: &DVector<f64>| {
            moved_by.iter().map(|by| (by * change).norm()).fold(0.0, f64::max)
        };
        let vector = |of: &dyn Fn(LensParameter) -> f64| {
            DVector::from_fn(coefficients.len(), |i, _| of(coefficients[i]))
        };
        let parameters = old.lens_parameters();
        let mut whole = vector(&|coefficient| parameters[coefficient.index()]);
        if displacement_px(&whole) < LEAST_DISTORTION_PX {
            whole = vector(&|coefficient| if coefficient == LensParameter::K1 { 0.1 } else { 0.0 });
        }
        let proportional = &self.whitened * &whole;
        let information = proportional.norm_squared();
        let share = proportional.dot(&self.along) / information;
        let limit = told.limit(1, UNCHANGED)?;
        let is_proportional = share * share * information > limit;
        let is_any = self.along.norm_squared() > told.limit(self.along.len(), UNCHANGED)?;
        let furthest_px = Vector2::new(displacement_px(&whole), 0.0);
        let covariance = furthest_px * furthest_px.transpose() / information;
        let sds = (told.limit(1, CONFIDENCE)?, told.noncentrality(1, limit));
        let shift = Shift::over(std::iter::once((share * furthest_px, covariance)), sds);
        shift
            .visible_px
            .is_finite()
            .then_some(LensChange { is_significant: is_proportional || is_any, shift })
    }
}

/// Cell centres and corners of the picture.
fn cell_corners_px(image_size: ImageSize) -> impl Iterator<Item = Point2<f64>> {
    let (right, bottom) =
        (f64::from(image_size.width_px) - 1.0, f64::from(image_size.height_px) - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    cell_centres_px(image_size).chain(corners.map(|(x, y)| Point2::new(x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_chi_squared_where_the_covariance_is_known() {
        let known = Told::by(1e6);
        let limit = known.limit(3, 0.991).expect("enough freedom");
        assert!((limit - 11.573).abs() < 0.01, "{limit}");
        assert!((known.noncentrality(3, limit) - 23.017).abs() < 0.02);
        // Few views determine their noise poorly: F with 3 and 12 degrees of freedom.
        let few = Told::by(14.0).limit(3, 0.99).expect("enough freedom");
        assert!((few - 3.0 * 14.0 / 12.0 * 5.953).abs() < 0.02, "{few}");
        assert!(Told::by(2.0).limit(3, 0.99).is_none());
    }

    #[test]
    fn a_change_that_the_distortion_explains_is_none() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let old = Camera::pinhole(950.0, size.centre_px());
        let (f, k1) = (LensParameter::Fx.index(), LensParameter::K1.index());
        let mut covariance = LensMatrix::identity();
        covariance[(k1, k1)] = 1e-4;
        // f grows by 50 px for each unit of k1, and little else is unknown about f.
        covariance[(f, k1)] = 50.0 * 1e-4;
        covariance[(k1, f)] = covariance[(f, k1)];
        covariance[(f, f)] = 50.0 * 50.0 * 1e-4 + 1e-4;
        let mut new = old;
        new.f_px += nalgebra::Vector2::repeat(0.5);
        new.distortion.k1 += 0.01;
        let change = Change::between((&old, &covariance), (&new, &covariance)).expect("stated");
        assert!(change.f_and_pp_px.x.abs() < 1e-9, "{change:?}");
        let lens = change.of_distortion(&old, size, &Told::by(1e6)).expect("told");
        assert!(!lens.is_significant);
    }
}
