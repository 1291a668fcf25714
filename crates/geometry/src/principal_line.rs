use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix3, Matrix4, Point2, SMatrix, Vector2, Vector4};

use super::Homography;

/// Largest standard deviation of the direction of a principal line.
const MAX_SIGMA_PHI_RAD: f64 = 2.0 * PI / 180.0;
/// Least foreshortening in standard deviations.
const MIN_FORESHORTENING_SIGMAS: f64 = 5.0;

/// Principal line of a view: the image line in which the plane through the optical axis parallel to
/// the board's normal meets the picture. It passes through the principal point and is the board's
/// axis of symmetry in the image.
///
/// With `H = image_from_board`, pixels counted from [`Self::origin_px`], `a = h31`, `b = h32`,
/// `ρ² = a² + b²`:
/// ```text
/// V = ((a h11 + b h12)/ρ², (a h21 + b h22)/ρ²)    vanishing point of the direction in which the board recedes
/// u = (a h12 − b h11, a h22 − b h21)              image direction of the horizon
/// n = u/|u|, t = (−n_y, n_x), φ = atan2(n_y, n_x), c = n·V, v = t·V       line: n·p = c
/// D = |u|/ρ²                                      from V to the ±45° vanishing points on the horizon
/// ```
/// Assumes square pixels, no skew and undistorted corners; with `fy/fx = 1 + ε` the line misses the
/// principal point by up to `f ε / tan(tilt)`. The sign of `n` is arbitrary, so directions of lines
/// are compared modulo π; the direction in which the board recedes has a sign.
///
/// Source: Chuang et al., "Geometry-based camera calibration using closed-form solution of
/// principal line", IEEE TIP 2021. D, the covariance and the tilt azimuth are derived in
/// `docs/method.md`, section 1.
///
/// # Examples
///
/// A board tilted by 40° about its vertical axis recedes to the right, so its line is horizontal
/// and passes through the principal point:
///
/// ```
/// use boresight_geometry::{Camera, Corner, Homography, PrincipalLine, mean_px, boards::Board};
/// use nalgebra::{Isometry3, Matrix2, Point2, Vector3};
///
/// let camera = Camera::pinhole(900.0, Point2::new(650.0, 350.0));
/// let tilt_rad = 40_f64.to_radians();
/// let cam_from_board = Isometry3::new(Vector3::new(0.0, 0.0, 0.4), Vector3::y() * -tilt_rad);
/// let board_m = Board::new(9, 6, 0.025)?.corners_in_board_m();
/// let corners: Vec<Corner> = board_m
///     .iter()
///     .filter_map(|point_m| camera.px_from_board(&cam_from_board, point_m))
///     .map(|px| Corner::isotropic(px, 0.1))
///     .collect();
///
/// let homography = Homography::fit(&board_m, &corners)?;
/// let image_centre_px = Point2::new(639.5, 359.5);
/// let line = PrincipalLine::of(&homography, image_centre_px, mean_px(&corners))?;
///
/// assert!(line.direction().y.abs() < 1e-9);
/// assert!(line.distance_px(&camera.pp_px).abs() < 1e-6);
/// assert!((line.tilt_rad(&camera.pp_px).unwrap_or_default() - tilt_rad).abs() < 1e-9);
/// let focal = line.focal_length(&camera.pp_px, &Matrix2::zeros())?;
/// assert!((focal.f_px - 900.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipalLine {
    /// Direction φ of the normal, `(-π, π]`.
    pub phi_rad: f64,
    /// Signed distance `c` of the line from [`Self::origin_px`] along the normal.
    pub c_px: f64,
    /// Coordinate `v` of the vanishing point along the line.
    pub v_px: f64,
    /// `D`: distance on the horizon from the vanishing point to those at ±45°; equals
    /// `f / sin(tilt)`.
    pub d_px: f64,
    /// Vanishing point of the direction in which the board recedes, in pixels of the picture.
    pub vanishing_point_px: Point2<f64>,
    /// Origin of `c` and `v`, in pixels of the picture.
    pub origin_px: Point2<f64>,
    /// Direction in the image in which the board recedes, `[0, 2π)`.
    pub tilt_azimuth_rad: f64,
    /// Covariance of `(φ, c, v, D)`, rad and px, for the corner covariances of the homography.
    pub covariance: Matrix4<f64>,
}

/// Reason why a view has no principal line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoPrincipalLine {
    /// The board faces the camera: every line through the principal point fits.
    #[error(
        "the board faces the camera: its foreshortening is {sigmas:.1} sd, its direction known to {sigma_phi_rad:.3} rad"
    )]
    FrontoParallel {
        /// Foreshortening in standard deviations; at least 5 is required.
        sigmas: f64,
        /// Standard deviation of the direction; at most 2° is allowed.
        sigma_phi_rad: f64,
    },
    /// A number is not finite.
    #[error("the homography is not finite")]
    NotFinite,
}

/// Focal length from a single view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FocalLength {
    /// Focal length in pixels.
    pub f_px: f64,
    /// Standard deviation in pixels.
    pub sigma_px: f64,
}

/// Reason why a single view gives no focal length.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoFocalLength {
    /// `D² ≤ d²`: no focal length is consistent with this principal point.
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
    /// Principal line of a view.
    ///
    /// `homography` should be of undistorted corners. `c` and `v` are measured from `origin_px`,
    /// usually the image centre; lines to be intersected may have different origins.
    /// `mean_corner_px` is the mean of the view's corners and decides the sign of the tilt azimuth.
    ///
    /// # Errors
    ///
    /// [`NoPrincipalLine::FrontoParallel`] if the foreshortening is below five times its standard
    /// deviation or the direction is uncertain by more than 2°; for an exact homography, only if
    /// there is no foreshortening at all. [`NoPrincipalLine::NotFinite`] if the homography isn't
    /// finite.
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
            phi_rad: libm::atan2(n.y, n.x),
            c_px,
            v_px,
            d_px,
            vanishing_point_px: origin_px + vanishing,
            origin_px,
            tilt_azimuth_rad: libm::atan2(away.y, away.x).rem_euclid(2.0 * PI),
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

    /// d(φ, c, v, D)/dh, see `docs/method.md`, section 1.
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

    /// Unit normal `n`.
    pub fn normal(&self) -> Vector2<f64> {
        Vector2::new(libm::cos(self.phi_rad), libm::sin(self.phi_rad))
    }

    /// Unit vector `t` along the line: the normal turned by +90°.
    pub fn direction(&self) -> Vector2<f64> {
        Vector2::new(-libm::sin(self.phi_rad), libm::cos(self.phi_rad))
    }

    /// Standard deviation of the direction, in radians.
    pub fn sigma_phi_rad(&self) -> f64 {
        self.covariance[(0, 0)].max(0.0).sqrt()
    }

    /// Standard deviation of `c`, in pixels.
    pub fn sigma_c_px(&self) -> f64 {
        self.covariance[(1, 1)].max(0.0).sqrt()
    }

    /// Signed distance of `point` (pixels) from the line, `n·(p − x0) − c`.
    pub fn distance_px(&self, point: &Point2<f64>) -> f64 {
        self.normal().dot(&(point - self.origin_px)) - self.c_px
    }

    /// Variance of [`Self::distance_px`], px²: `[t·p, −1] S[φ,c] [t·p, −1]ᵀ`.
    pub fn variance_of_distance(&self, point: &Point2<f64>) -> f64 {
        let by = Vector2::new(self.direction().dot(&(point - self.origin_px)), -1.0);
        (by.transpose() * self.covariance.fixed_view::<2, 2>(0, 0) * by).x.max(0.0)
    }

    /// Angle between the two lines in radians, `[0, π/2]`.
    pub fn angle_to(&self, other: &Self) -> f64 {
        libm::asin(self.normal().perp(&other.normal()).abs().min(1.0))
    }

    /// Distance from the vanishing point to the foot of `pp` on the line: `t·P − v`, signed.
    fn along_px(&self, pp: &Point2<f64>) -> f64 {
        self.direction().dot(&(pp - self.origin_px)) - self.v_px
    }

    /// Tilt of the board in radians for the principal point `pp`, from `cos θ = |t·P − v| / D`.
    /// `None` if the cosine would exceed 1.
    pub fn tilt_rad(&self, pp: &Point2<f64>) -> Option<f64> {
        let cosine = self.along_px(pp).abs() / self.d_px;
        (cosine <= 1.0).then(|| libm::acos(cosine))
    }

    /// Focal length of this view alone for the principal point `pp`: `f² = D² − δ²` with
    /// `δ = t·P − v`.
    ///
    /// `df = (δ n·P, 0, δ, D)/f` over `(φ, c, v, D)` and `−δ t/f` over `P`.
    ///
    /// # Errors
    ///
    /// [`NoFocalLength::Imaginary`] if `D² ≤ δ²`.
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
