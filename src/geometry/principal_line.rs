use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Matrix4, Point2, SMatrix, Vector2, Vector4};

use super::Homography;

/// Largest uncertainty of the direction at which a view still has a principal line.
const MAX_SIGMA_PHI_RAD: f64 = 2.0 * PI / 180.0;
/// Least ratio of the foreshortening to its own uncertainty.
const MIN_FORESHORTENING_SIGMAS: f64 = 5.0;

/// The image line through the principal point that one view of the board fixes: the board's axis of
/// symmetry in the picture, image of the plane that holds the optical axis and the board's normal.
///
/// With `H = image_from_board`, pixels counted from [`Self::origin_px`], `a = h31`, `b = h32`, `ρ² = a² + b²`:
/// ```text
/// V = ((a h11 + b h12)/ρ², (a h21 + b h22)/ρ²)    vanishing point of the direction in which the board recedes
/// u = (a h12 − b h11, a h22 − b h21)              image direction of the horizon
/// n = u/|u|, t = (−n_y, n_x), φ = atan2(n_y, n_x), c = n·V, v = t·V       line: n·p = c
/// D = |u|/ρ²                                      from V to the ±45° vanishing points on the horizon
/// ```
/// Assumes square pixels, no skew and undistorted corners; with `fy/fx = 1 + ε` the line misses the
/// principal point by up to `f ε / tan(tilt)`. The sign of `n` is arbitrary.
///
/// Source: Chuang et al., "Geometry-based camera calibration using closed-form solution of principal
/// line", IEEE TIP 2021; D, the covariance and the slot are ours (METHOD section 1).
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipalLine {
    /// Direction of the normal, `(-π, π]`.
    pub phi_rad: f64,
    /// Signed distance from the origin along the normal.
    pub c_px: f64,
    /// Vanishing point's coordinate along the line.
    pub v_px: f64,
    /// Distance on the horizon from the vanishing point to that of ±45°; `f / sin(tilt)`.
    pub d_px: f64,
    /// Vanishing point, absolute pixels.
    pub vanishing_point_px: Point2<f64>,
    /// Where `c` and `v` are counted from.
    pub origin_px: Point2<f64>,
    /// Direction in the image in which the board recedes, `[0, 2π)`.
    pub slot_rad: f64,
    /// Covariance of `(φ, c, v, D)` for the corner covariances of the homography.
    pub covariance: Matrix4<f64>,
}

/// Why a view has no principal line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoPrincipalLine {
    /// The board faces the camera: every line through the principal point fits.
    #[error(
        "the board faces the camera: its foreshortening is {sigmas:.1} sd, its direction known to {sigma_phi_rad:.3} rad"
    )]
    FrontoParallel {
        /// Foreshortening in units of its own uncertainty; 5 are needed.
        sigmas: f64,
        /// Uncertainty of the direction; 2° are allowed.
        sigma_phi_rad: f64,
    },
    /// A number is not finite.
    #[error("the homography is not finite")]
    NotFinite,
}

/// A view's own focal length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalLength {
    /// Focal length.
    pub f_px: f64,
    /// Its standard deviation.
    pub sigma_px: f64,
}

/// Why a view has no focal length of its own.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoFocalLength {
    /// `D² < d²`: the principal point lies too far from where this view would put it.
    #[error(
        "no focal length fits: D = {d_px:.1} px, distance to the vanishing point {distance_px:.1} px"
    )]
    Imaginary {
        /// `D`.
        d_px: f64,
        /// Distance from the principal point's foot on the line to the vanishing point.
        distance_px: f64,
    },
}

impl PrincipalLine {
    /// The principal line of a view whose corners average at `mean_corner_px`.
    ///
    /// # Errors
    ///
    /// [`NoPrincipalLine::FrontoParallel`] if the foreshortening is below five times its uncertainty or
    /// the direction is known worse than 2°; for a homography without covariance only if it has none.
    pub fn of(
        homography: &Homography,
        origin_px: Point2<f64>,
        mean_corner_px: Point2<f64>,
    ) -> Result<Self, NoPrincipalLine> {
        let centred_from_image =
            Matrix3::new(1.0, 0.0, -origin_px.x, 0.0, 1.0, -origin_px.y, 0.0, 0.0, 1.0);
        let h = centred_from_image * homography.image_from_board();
        let (a, b) = (h[(2, 0)], h[(2, 1)]);
        let rho2 = a * a + b * b;
        if !rho2.is_finite() {
            return Err(NoPrincipalLine::NotFinite);
        }
        if rho2 <= f64::MIN_POSITIVE {
            return Err(NoPrincipalLine::FrontoParallel { sigmas: 0.0, sigma_phi_rad: PI });
        }
        let row = |k: usize| Vector2::new(h[(k, 0)], h[(k, 1)]);
        let vanishing =
            Vector2::new(a * row(0).x + b * row(0).y, a * row(1).x + b * row(1).y) / rho2;
        let u = Vector2::new(a * row(0).y - b * row(0).x, a * row(1).y - b * row(1).x);
        let length = u.norm();
        if !(length > 0.0 && length.is_finite()) {
            return Err(NoPrincipalLine::NotFinite);
        }
        let n = u / length;
        let t = Vector2::new(-n.y, n.x);
        let (c_px, v_px, d_px) = (n.dot(&vanishing), t.dot(&vanishing), length / rho2);
        let mean = mean_corner_px - origin_px;
        let away = t * (t.dot(&(vanishing - mean))).signum();
        let change = centred_from_image.kronecker(&Matrix3::identity());
        let nine_by_nine = change * homography.covariance() * change.transpose();
        let line = Self {
            phi_rad: n.y.atan2(n.x),
            c_px,
            v_px,
            d_px,
            vanishing_point_px: origin_px + vanishing,
            origin_px,
            slot_rad: away.y.atan2(away.x).rem_euclid(2.0 * PI),
            covariance: Matrix4::zeros(),
        };
        let jacobian = line.jacobian(&h, length, rho2);
        let covariance = jacobian * nine_by_nine * jacobian.transpose();
        // Variance of ρ, by ρ dρ = a da + b db.
        let by_rho = Vector2::new(a, b) / rho2.sqrt();
        let variance_rho =
            (by_rho.transpose() * nine_by_nine.fixed_view::<2, 2>(6, 6) * by_rho).x.max(0.0);
        let sigmas = rho2.sqrt() / variance_rho.sqrt();
        let sigma_phi_rad = covariance[(0, 0)].max(0.0).sqrt();
        if sigmas < MIN_FORESHORTENING_SIGMAS || sigma_phi_rad > MAX_SIGMA_PHI_RAD {
            return Err(NoPrincipalLine::FrontoParallel { sigmas, sigma_phi_rad });
        }
        Ok(Self { covariance, ..line })
    }

    /// d(φ, c, v, D)/dh, METHOD section 1.
    fn jacobian(&self, h: &Matrix3<f64>, length: f64, rho2: f64) -> SMatrix<f64, 4, 9> {
        let (a, b) = (h[(2, 0)], h[(2, 1)]);
        let (n, t) = (self.normal(), self.direction());
        let vanishing = self.vanishing_point_px - self.origin_px;
        // Columns of d V / dh and d u / dh.
        let mut by_v = SMatrix::<f64, 2, 9>::zeros();
        let mut by_u = SMatrix::<f64, 2, 9>::zeros();
        for k in 0..2 {
            let (first, second) = (3 * k, 3 * k + 1);
            by_v[(k, first)] = a / rho2;
            by_v[(k, second)] = b / rho2;
            by_v[(k, 6)] = (h[(k, 0)] - 2.0 * a * vanishing[k]) / rho2;
            by_v[(k, 7)] = (h[(k, 1)] - 2.0 * b * vanishing[k]) / rho2;
            by_u[(k, first)] = -b;
            by_u[(k, second)] = a;
            by_u[(k, 6)] = h[(k, 1)];
            by_u[(k, 7)] = -h[(k, 0)];
        }
        let by_phi = t.transpose() * by_u / length;
        let mut by_d = n.transpose() * by_u / rho2;
        by_d[6] -= 2.0 * self.d_px * a / rho2;
        by_d[7] -= 2.0 * self.d_px * b / rho2;
        let by_c = n.transpose() * by_v + by_phi * self.v_px;
        let by_along = t.transpose() * by_v - by_phi * self.c_px;
        SMatrix::<f64, 4, 9>::from_rows(&[by_phi, by_c, by_along, by_d])
    }

    /// Unit normal.
    pub fn normal(&self) -> Vector2<f64> {
        Vector2::new(self.phi_rad.cos(), self.phi_rad.sin())
    }

    /// Unit vector along the line, the normal turned by +90°.
    pub fn direction(&self) -> Vector2<f64> {
        Vector2::new(-self.phi_rad.sin(), self.phi_rad.cos())
    }

    /// Standard deviation of the direction.
    pub fn sigma_phi_rad(&self) -> f64 {
        self.covariance[(0, 0)].max(0.0).sqrt()
    }

    /// Standard deviation of the offset at the origin.
    pub fn sigma_c_px(&self) -> f64 {
        self.covariance[(1, 1)].max(0.0).sqrt()
    }

    /// Signed distance of `point` from the line, `n·(p − x0) − c`.
    pub fn distance_px(&self, point: &Point2<f64>) -> f64 {
        self.normal().dot(&(point - self.origin_px)) - self.c_px
    }

    /// Variance of [`Self::distance_px`]: `[t·p, −1] S[φ,c] [t·p, −1]ᵀ`.
    pub fn variance_of_distance(&self, point: &Point2<f64>) -> f64 {
        let by = Vector2::new(self.direction().dot(&(point - self.origin_px)), -1.0);
        (by.transpose() * self.covariance.fixed_view::<2, 2>(0, 0) * by).x.max(0.0)
    }

    /// Angle between the two lines, `[0, π/2]`.
    pub fn angle_to(&self, other: &Self) -> f64 {
        self.normal().perp(&other.normal()).abs().min(1.0).asin()
    }

    /// Distance from the vanishing point to the foot of `pp` on the line: `t·P − v`, signed.
    fn along_px(&self, pp: &Point2<f64>) -> f64 {
        self.direction().dot(&(pp - self.origin_px)) - self.v_px
    }

    /// Tilt of the board, from `cos θ = |t·P − v| / D`. `None` if the principal point does not fit.
    pub fn tilt_rad(&self, pp: &Point2<f64>) -> Option<f64> {
        let cosine = self.along_px(pp).abs() / self.d_px;
        (cosine <= 1.0).then(|| cosine.acos())
    }

    /// This view's own focal length, `f² = D² − δ²` with `δ = t·P − v`; needs no other view.
    ///
    /// `df = (δ n·P, 0, δ, D)/f` over `(φ, c, v, D)` and `−δ t/f` over `P`.
    ///
    /// # Errors
    ///
    /// [`NoFocalLength::Imaginary`].
    pub fn focal_length(
        &self,
        pp: &Point2<f64>,
        pp_covariance_px2: &Matrix2<f64>,
    ) -> Result<FocalLength, NoFocalLength> {
        let delta_px = self.along_px(pp);
        let f2 = self.d_px * self.d_px - delta_px * delta_px;
        if !(f2 > 0.0) {
            let (d_px, distance_px) = (self.d_px, delta_px.abs());
            return Err(NoFocalLength::Imaginary { d_px, distance_px });
        }
        let f_px = f2.sqrt();
        let across = self.normal().dot(&(pp - self.origin_px));
        let by_line = Vector4::new(delta_px * across, 0.0, delta_px, self.d_px) / f_px;
        let by_pp = -self.direction() * delta_px / f_px;
        let variance = (by_line.transpose() * self.covariance * by_line).x
            + (by_pp.transpose() * pp_covariance_px2 * by_pp).x;
        Ok(FocalLength { f_px, sigma_px: variance.max(0.0).sqrt() })
    }
}
