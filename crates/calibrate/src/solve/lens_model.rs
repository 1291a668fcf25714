//! Families of lens models, nested within each family, and priors on the parameters.

use nalgebra::SMatrix;

use super::odds::UNLIKELY;
use boresight_geometry::{
    Camera, LENS_PARAMETERS, LensKind, LensMatrix, LensParameter, frame::ImageSize,
};

/// Declares the lens models by rows `Model = "name", family, [estimated coefficients]`.
macro_rules! models {
    ($($(#[$about:meta])* $model:ident = $name:literal, $family:ident, [$($free:ident),*];)*) => {
        /// Lens model, by the estimated distortion coefficients and terms. Within a [`LensFamily`],
        /// the models are nested: each contains the previous ones.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum LensModel {
            $($(#[$about])* $model,)*
        }

        impl LensModel {
            /// All models, family by family, simplest first.
            pub const ALL: [Self; [$(Self::$model),*].len()] = [$(Self::$model),*];

            /// Family of the model.
            pub fn family(self) -> LensFamily {
                match self {
                    $(Self::$model => LensFamily::$family,)*
                }
            }

            /// Stable name, for files and programs.
            pub fn code(self) -> &'static str {
                match self {
                    $(Self::$model => $name,)*
                }
            }

            /// Estimated distortion coefficients, in the order of [`LENS_PARAMETERS`].
            pub fn distortion(self) -> &'static [LensParameter] {
                match self {
                    $(Self::$model => &[$(LensParameter::$free),*],)*
                }
            }
        }
    };
}

models! {
    /// No distortion.
    Pinhole = "none", Brown, [];
    /// Radial, r².
    K1 = "k1", Brown, [K1];
    /// Radial, r² and r⁴.
    K1K2 = "k1k2", Brown, [K1, K2];
    /// Radial r², r⁴, and tangential.
    K1K2P1P2 = "k1k2p1p2", Brown, [K1, K2, P1, P2];
    /// Radial r², r⁴, r⁶, and tangential.
    K1K2P1P2K3 = "k1k2p1p2k3", Brown, [K1, K2, P1, P2, K3];
    /// Terms of `K1K2P1P2K3`, over a denominator with r², r⁴, r⁶.
    Rational = "rational", Rational, [K1, K2, P1, P2, K3, K4, K5, K6];
    /// Image height proportional to the angle to the optical axis.
    Fisheye = "fisheye", Fisheye, [];
    /// Fisheye with θ³.
    FisheyeK1 = "fisheye_k1", Fisheye, [K1];
    /// Fisheye with θ³ and θ⁵.
    FisheyeK1K2 = "fisheye_k1k2", Fisheye, [K1, K2];
    /// Fisheye with θ³, θ⁵, θ⁷ and θ⁹.
    FisheyeK1K2K3K4 = "fisheye_k1k2k3k4", Fisheye, [K1, K2, K3, K4];
}

/// Family of lens models of the same kind; properties are in `traits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LensFamily {
    /// Polynomial of the distance from the optical axis, with tangential terms (Brown 1971).
    Brown,
    /// Quotient of two polynomials, for wide lenses (Claus & Fitzgibbon 2005).
    Rational,
    /// Polynomial of the angle to the optical axis (Kannala & Brandt 2006).
    Fisheye,
}

/// Properties of a [`LensFamily`], except the starts of the adjustment in `wide_lens.rs`.
struct FamilyTraits {
    /// Stable name.
    code: &'static str,
    /// Kind of lens.
    kind: LensKind,
    /// Richest model determined by one, two, and three or more distinct views. A family without a
    /// simple enough model isn't fitted to one or two views.
    by_views: [LensModel; 3],
    /// See [`LensModel::truncated_sd`].
    truncated_sd: &'static [(LensParameter, f64)],
    /// See [`LensModel::own_prior`].
    own_prior: Option<fn() -> LensPrior>,
    /// True if the minimum of a model with some coefficients is near the next simpler model's.
    is_near: bool,
    /// Twice the logarithm of the prior odds against the family.
    against: f64,
    /// Prior standard deviation of the coefficient of the next radial term, from `k1` and the
    /// term's power of the radius at the edge of the picture.
    next_radial_sd: fn(k1: f64, at_edge: f64) -> f64,
}

/// [`FamilyTraits::truncated_sd`] of a perspective lens.
const PERSPECTIVE_TRUNCATED_SD: &[(LensParameter, f64)] = &[
    (LensParameter::K2, 0.1),
    (LensParameter::P1, 1.5e-4),
    (LensParameter::P2, 1.5e-4),
    (LensParameter::K3, 0.05),
];
/// [`FamilyTraits::truncated_sd`] of a fisheye lens: its series in the angle falls off quickly.
const FISHEYE_TRUNCATED_SD: &[(LensParameter, f64)] = &[
    (LensParameter::K1, 0.05),
    (LensParameter::K2, 0.02),
    (LensParameter::K3, 5e-3),
    (LensParameter::K4, 1e-3),
];

/// [`FamilyTraits::next_radial_sd`] of a lens without distortion.
const LEAST_COEFFICIENT_SD: f64 = 0.1;
/// Ratio of the coefficient of r⁸ to the fourth power of that of r². A lens with an angle as image
/// height has the series `atan(g r)/g = r (1 − g² r²/3 + … + g⁸ r⁸/9)`; other wide lenses have
/// similar series.
const OVER_K1: f64 = 9.0;
/// [`FamilyTraits::next_radial_sd`] of a fisheye lens.
const FISHEYE_COEFFICIENT_SD: f64 = 3e-3;
/// Shift of a ray at the edge of the picture by the term, as a share of the radius, under a
/// rational lens, at one standard deviation.
const RATIONAL_SHARE: f64 = 0.02;

/// Lens parameters estimated by an adjustment, in the order of [`LENS_PARAMETERS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LensFreedom {
    /// True for each estimated parameter. With square pixels, `fy` isn't one: it follows `fx`.
    pub free: [bool; LENS_PARAMETERS],
    /// True if `fy = fx`, a single parameter.
    pub square_pixels: bool,
}

/// Prior on the lens parameters: independent normal distributions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPrior {
    /// Means of the prior.
    pub mean: [f64; LENS_PARAMETERS],
    /// Information 1/sd² of each parameter; zero for no prior.
    pub information: [f64; LENS_PARAMETERS],
}

impl LensModel {
    /// Kind of lens, which defines the coefficients.
    pub fn kind(self) -> LensKind {
        self.family().kind()
    }

    /// Number of distortion coefficients.
    pub fn coefficients(self) -> usize {
        self.distortion().len()
    }

    /// Simplest model with all nonzero coefficients of `camera`; the richest of its kind if none
    /// has them all.
    ///
    /// ```
    /// # use boresight_calibrate::LensModel;
    /// # use boresight_geometry::{Camera, Distortion};
    /// # use nalgebra::Point2;
    /// let distortion = Distortion { k1: -0.2, ..Distortion::default() };
    /// let camera = Camera { distortion, ..Camera::pinhole(900.0, Point2::new(640.0, 360.0)) };
    /// assert_eq!(LensModel::simplest_with(&camera), LensModel::K1);
    /// ```
    pub fn simplest_with(camera: &Camera) -> Self {
        let parameters = camera.lens_parameters();
        let needed = |parameter: &LensParameter| {
            parameter.is_distortion() && parameters[parameter.index()] != 0.0
        };
        let needed: Vec<LensParameter> =
            LensParameter::ALL.into_iter().filter(|parameter| needed(parameter)).collect();
        let of_kind = |model: &Self| model.kind() == camera.distortion.kind;
        let holds = |model: &Self| needed.iter().all(|needed| model.distortion().contains(needed));
        let mut models = Self::ALL.into_iter().filter(of_kind);
        models.clone().find(holds).or(models.next_back()).unwrap_or(Self::Pinhole)
    }

    /// Prior standard deviations of the coefficients that the chosen model may fix at zero.
    ///
    /// A coefficient too small for BIC to choose isn't zero. A tangential coefficient of 1e-4,
    /// about the centring error of good lenses, shifts the principal point by as much as the
    /// standard error of eight good views.
    pub(super) fn truncated_sd(self) -> &'static [(LensParameter, f64)] {
        self.family().traits().truncated_sd
    }

    /// Prior needed to determine the family's coefficients, if any.
    #[doc(hidden)]
    pub fn own_prior(self) -> Option<LensPrior> {
        self.family().traits().own_prior.map(|prior| prior())
    }

    /// True if the minimum is near that of the next simpler model of the family.
    pub(super) fn is_near_simpler(self) -> bool {
        self.family().traits().is_near
    }

    /// `camera` with zero for the coefficients not estimated by this model.
    pub(crate) fn without_others(self, camera: &Camera) -> Camera {
        let free = self.freedom(false).free;
        let mut parameters = camera.lens_parameters();
        for (value, _) in parameters.iter_mut().zip(free).filter(|(_, is_free)| !is_free) {
            *value = 0.0;
        }
        Camera::from_lens_parameters(self.kind(), &parameters)
    }

    /// Freedom of the focal length, the principal point and the coefficients of this model.
    pub fn freedom(self, square_pixels: bool) -> LensFreedom {
        let mut free = [false; LENS_PARAMETERS];
        for parameter in LensParameter::ALL {
            free[parameter.index()] =
                !parameter.is_distortion() || self.distortion().contains(&parameter);
        }
        free[LensParameter::Fy.index()] = !square_pixels;
        LensFreedom { free, square_pixels }
    }
}

impl LensFamily {
    /// All families. Brown's is tried first; the others are compared with it for wide pictures.
    pub const ALL: [Self; 3] = [Self::Brown, Self::Rational, Self::Fisheye];

    const fn traits(self) -> FamilyTraits {
        match self {
            Self::Brown => FamilyTraits {
                code: "brown",
                kind: LensKind::Perspective,
                by_views: [LensModel::K1, LensModel::K1K2, LensModel::K1K2P1P2K3],
                truncated_sd: PERSPECTIVE_TRUNCATED_SD,
                own_prior: None,
                is_near: true,
                against: 0.0,
                next_radial_sd: |k1, _| LEAST_COEFFICIENT_SD + OVER_K1 * k1.powi(4),
            },
            Self::Rational => FamilyTraits {
                code: "rational",
                kind: LensKind::Perspective,
                by_views: [LensModel::K1, LensModel::K1K2, LensModel::Rational],
                truncated_sd: PERSPECTIVE_TRUNCATED_SD,
                own_prior: Some(LensPrior::of_quotient),
                // A quotient has more than one minimum.
                is_near: false,
                // Most wide lenses are designed for angles.
                against: UNLIKELY + UNLIKELY,
                next_radial_sd: |_, at_edge| RATIONAL_SHARE / at_edge,
            },
            Self::Fisheye => FamilyTraits {
                code: "fisheye",
                kind: LensKind::Fisheye,
                by_views: [LensModel::Fisheye, LensModel::FisheyeK1, LensModel::FisheyeK1K2K3K4],
                truncated_sd: FISHEYE_TRUNCATED_SD,
                own_prior: None,
                is_near: false,
                against: UNLIKELY,
                next_radial_sd: |_, _| FISHEYE_COEFFICIENT_SD,
            },
        }
    }

    /// Stable name, for files and programs.
    pub fn code(self) -> &'static str {
        self.traits().code
    }

    /// Kind of lens, which defines the coefficients of the family's models.
    pub fn kind(self) -> LensKind {
        self.traits().kind
    }

    /// Models of the family, simplest first.
    ///
    /// ```
    /// # use boresight_calibrate::LensFamily;
    /// let nested = LensFamily::Brown.models();
    /// let nested: Vec<&str> = nested.into_iter().map(|model| model.code()).collect();
    /// assert_eq!(nested, ["none", "k1", "k1k2", "k1k2p1p2", "k1k2p1p2k3"]);
    /// assert_eq!(LensFamily::Fisheye.richest().coefficients(), 4);
    /// ```
    pub fn models(self) -> Vec<LensModel> {
        LensModel::ALL.into_iter().filter(|model| model.family() == self).collect()
    }

    /// Model with all coefficients of the family.
    pub fn richest(self) -> LensModel {
        let [.., richest] = self.traits().by_views;
        richest
    }

    /// Richest model determined by `distinct` distinct views. A simple one may be a Brown model
    /// outside the family.
    #[doc(hidden)]
    pub fn richest_of(self, distinct: usize) -> LensModel {
        let [one, two, more] = self.traits().by_views;
        match distinct {
            0 | 1 => one,
            2 => two,
            _ => more,
        }
    }

    /// Twice the logarithm of the prior odds against the family.
    pub(super) fn against(self) -> f64 {
        self.traits().against
    }

    /// Prior standard deviation of the coefficient of the next radial term; `at_edge` is the term's
    /// power of the radius at the edge of the picture.
    pub(crate) fn next_radial_sd(self, k1: f64, at_edge: f64) -> f64 {
        (self.traits().next_radial_sd)(k1, at_edge)
    }
}

/// Ties fy to fx for square pixels, in lens parameters or their change.
pub(crate) fn tie_focal_lengths(lens: &mut [f64]) {
    lens[LensParameter::Fy.index()] = lens[LensParameter::Fx.index()];
}

/// Joins the derivatives by both focal lengths: adds the derivative by fy to that by fx.
pub(crate) fn join_focal_lengths(jac_lens: &mut SMatrix<f64, 2, LENS_PARAMETERS>) {
    let [fx, fy] = LensParameter::F.map(LensParameter::index);
    let of_f = jac_lens.column(fx) + jac_lens.column(fy);
    jac_lens.set_column(fx, &of_f);
}

/// Ties the covariance of both focal lengths: copies the row and column of fx to fy.
pub(crate) fn tie_covariance(covariance: &mut LensMatrix) {
    let [fx, fy] = LensParameter::F.map(LensParameter::index);
    let row = covariance.row(fx).clone_owned();
    covariance.row_mut(fy).copy_from(&row);
    let column = covariance.column(fx).clone_owned();
    covariance.column_mut(fy).copy_from(&column);
}

impl LensFreedom {
    /// Number of free parameters.
    ///
    /// ```
    /// # use boresight_calibrate::LensModel;
    /// // f, cx, cy, k1 and k2; then fx and fy.
    /// assert_eq!(LensModel::K1K2.freedom(true).count(), 5);
    /// assert_eq!(LensModel::K1K2.freedom(false).count(), 6);
    /// ```
    pub fn count(&self) -> usize {
        self.free.iter().filter(|free| **free).count()
    }

    /// Zeroes the derivatives by fixed parameters; with square pixels, adds the derivative by fy to
    /// that by fx.
    pub(crate) fn restrict(&self, jac_lens: &mut SMatrix<f64, 2, LENS_PARAMETERS>) {
        if self.square_pixels {
            join_focal_lengths(jac_lens);
        }
        for fixed in (0..LENS_PARAMETERS).filter(|i| !self.free[*i]) {
            jac_lens.column_mut(fixed).fill(0.0);
        }
    }

    /// Free parameters, in the order of [`LENS_PARAMETERS`].
    pub fn parameters(&self) -> Vec<LensParameter> {
        LensParameter::ALL.into_iter().filter(|parameter| self.free[parameter.index()]).collect()
    }
}

impl LensPrior {
    /// Weak prior that makes few views sufficient, `docs/method.md`, section 2: PP at the image
    /// centre ± 100 px (in proportion for pictures wider than 1920 px), k1 0 ± 0.4, p1 and p2 0 ±
    /// 0.01, the other coefficients 0 ± 0.6.
    ///
    /// ```
    /// # use boresight_calibrate::LensPrior;
    /// # use boresight_geometry::{LensParameter, frame::ImageSize};
    /// let prior = LensPrior::weak(ImageSize { width_px: 1280, height_px: 720 });
    /// assert_eq!(prior.mean[LensParameter::Cx.index()], 639.5);
    /// assert_eq!(prior.information[LensParameter::Fx.index()], 0.0);
    /// ```
    pub fn weak(image_size: ImageSize) -> Self {
        let centre = image_size.centre_px();
        let pp_sd_px = 100.0_f64.max(100.0 * f64::from(image_size.width_px) / 1920.0);
        let mut prior = Self { mean: [0.0; LENS_PARAMETERS], information: [0.0; LENS_PARAMETERS] };
        prior.mean[LensParameter::Cx.index()] = centre.x;
        prior.mean[LensParameter::Cy.index()] = centre.y;
        for parameter in LensParameter::ALL {
            let sd = match parameter {
                LensParameter::Fx | LensParameter::Fy => f64::INFINITY,
                LensParameter::Cx | LensParameter::Cy => pp_sd_px,
                LensParameter::K1 => 0.4,
                LensParameter::P1 | LensParameter::P2 => 0.01,
                _ => 0.6,
            };
            prior.information[parameter.index()] = 1.0 / (sd * sd);
        }
        prior
    }

    /// Prior for the fit of a rational lens: its numerator and denominator can nearly cancel, so
    /// that their coefficients change without changing the lens. k4, k5, k6 are, ± 3, those of a
    /// lens with an angle as image height: of the quotient nearest to `atan(r)/r` (Padé), whose
    /// denominator has no pole.
    pub(crate) fn of_quotient() -> Self {
        let mut prior = Self { mean: [0.0; LENS_PARAMETERS], information: [0.0; LENS_PARAMETERS] };
        for (parameter, mean) in [
            (LensParameter::K4, 10.0 / 9.0),
            (LensParameter::K5, 5.0 / 21.0),
            (LensParameter::K6, 0.0),
        ] {
            prior.mean[parameter.index()] = mean;
            prior.information[parameter.index()] = 1.0 / 9.0;
        }
        prior
    }

    /// Adds a prior on the focal length along both axes: `f_px` ± `sd_px`.
    #[must_use]
    pub fn with_focal_length(mut self, f_px: f64, sd_px: f64) -> Self {
        for parameter in LensParameter::F {
            self.mean[parameter.index()] = f_px;
            self.information[parameter.index()] = 1.0 / (sd_px * sd_px);
        }
        self
    }
}
