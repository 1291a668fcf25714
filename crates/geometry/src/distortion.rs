use nalgebra::{Matrix2, Matrix2x3, Point2, SMatrix, Vector3};

/// Number of lens parameters: `fx, fy, cx, cy` in pixels, then `k1, k2, p1, p2, k3, k4, k5, k6`
/// without unit, always in OpenCV's order.
pub const LENS_PARAMETERS: usize = 12;
/// Number of parameters in Brown's model: up to `k3`.
pub const BROWN_PARAMETERS: usize = 9;

/// Largest angle between the optical axis and a ray in a fisheye lens, in radians: 110°.
const FISHEYE_FIELD_RAD: f64 = 110.0 * std::f64::consts::PI / 180.0;
/// `sin` of the angle to the optical axis below which a fisheye lens is a perspective lens, to
/// double precision.
const PARAXIAL: f64 = 1e-4;
/// Least `cos` of the angle to the optical axis for which a ray has normalised coordinates: 89.4°.
const LEAST_COS: f64 = 1e-2;
/// Denominator of the rational model at which a ray counts as at a pole: no lens enlarges so much,
/// so a ray there is due to rounding.
const AT_POLE: f64 = 0.02;

/// Projection of a ray onto a plane before polynomial distortion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LensKind {
    /// Projects by normalised coordinates `(X/Z, Y/Z)`. Reaches rays in front of the camera.
    #[default]
    Perspective,
    /// Projects by the angle θ to the optical axis: `θ (X, Y) / √(X² + Y²)`. Reaches rays up to
    /// 110° from the axis.
    Fisheye,
}

/// Radial and tangential distortion, in the models and sign conventions of OpenCV.
///
/// Coefficients act on the flat coordinates `g = (x, y)` of a ray by [`LensKind`], and have no
/// unit. With `r² = x² + y²`:
/// ```text
/// x_d = x m + 2 p1 x y + p2 (r² + 2 x²)
/// y_d = y m + p1 (r² + 2 y²) + 2 p2 x y
///
/// perspective: m = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)    Brown 1971; rational: Claus & Fitzgibbon 2005
/// fisheye:     m = 1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸,   r = θ                    Kannala & Brandt 2006
/// ```
/// Tangential coefficients, `k5` and `k6` of a fisheye lens are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Kind of lens, which defines the coefficients.
    pub kind: LensKind,
    /// Radial coefficient of r².
    pub k1: f64,
    /// Radial coefficient of r⁴.
    pub k2: f64,
    /// Tangential, vertical decentring.
    pub p1: f64,
    /// Tangential, horizontal decentring.
    pub p2: f64,
    /// Radial coefficient of r⁶.
    pub k3: f64,
    /// Radial, r² of the denominator; of a fisheye lens, r⁸.
    pub k4: f64,
    /// Radial, r⁴ of the denominator.
    pub k5: f64,
    /// Radial, r⁶ of the denominator.
    pub k6: f64,
}

/// Radial factor `m` at a radius.
struct Radial {
    factor: f64,
    /// d factor / d r².
    slope: f64,
    denominator: f64,
}

/// Distorted coordinates, with derivatives.
pub(super) struct Bent {
    pub(super) at: Point2<f64>,
    /// Derivatives by the flat coordinates.
    pub(super) by_flat: Matrix2<f64>,
    /// Derivatives by the lens parameters, for focal lengths of 1: columns in the order of
    /// [`LENS_PARAMETERS`].
    pub(super) by_parameters: SMatrix<f64, 2, LENS_PARAMETERS>,
}

impl LensKind {
    /// Kind of lens for a file's `is_fisheye`.
    #[doc(hidden)]
    pub const fn of_fisheye(is_fisheye: bool) -> Self {
        if is_fisheye { Self::Fisheye } else { Self::Perspective }
    }

    /// True for a fisheye lens, as stored in files and restored by [`Self::of_fisheye`].
    ///
    /// ```
    /// # use boresight_geometry::LensKind;
    /// # use nalgebra::Vector3;
    /// let at_45_deg = Vector3::new(1.0, 0.0, 1.0);
    /// let flat = LensKind::Fisheye.flat(&at_45_deg).ok_or("on the axis")?;
    /// assert!(LensKind::Fisheye.is_fisheye());
    /// assert!((flat.x - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
    /// # Ok::<(), &str>(())
    /// ```
    pub const fn is_fisheye(self) -> bool {
        match self {
            Self::Perspective => false,
            Self::Fisheye => true,
        }
    }

    /// Stable name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Perspective => "perspective",
            Self::Fisheye => "fisheye",
        }
    }

    /// Power of r² of the first radial term beyond the richest polynomial.
    #[doc(hidden)]
    pub const fn next_radial_power(self) -> i32 {
        match self {
            Self::Perspective => 4,
            Self::Fisheye => 5,
        }
    }

    /// True if k4, k5 and k6 are coefficients of a denominator; else k4 is that of the fourth
    /// radial term.
    const fn has_denominator(self) -> bool {
        match self {
            Self::Perspective => true,
            Self::Fisheye => false,
        }
    }

    /// True if straight lines stay straight with zero coefficients.
    #[doc(hidden)]
    pub const fn keeps_lines(self) -> bool {
        match self {
            Self::Perspective => true,
            Self::Fisheye => false,
        }
    }

    /// Flat coordinates of a point in camera coordinates. `None` outside the field: behind a
    /// perspective camera, or beyond 110° of a fisheye lens.
    pub fn flat(self, in_cam: &Vector3<f64>) -> Option<Point2<f64>> {
        match self {
            Self::Perspective => {
                (in_cam.z > 1e-9).then(|| Point2::new(in_cam.x / in_cam.z, in_cam.y / in_cam.z))
            }
            Self::Fisheye => Some((in_cam.xy() * angle_over_radius(in_cam)?).into()),
        }
    }

    /// [`Self::flat`] with the derivative by the point, 2×3.
    pub(super) fn flat_with_derivative(
        self,
        in_cam: &Vector3<f64>,
    ) -> Option<(Point2<f64>, Matrix2x3<f64>)> {
        let flat = self.flat(in_cam)?;
        let perspective = || Matrix2x3::new(1.0, 0.0, -flat.x, 0.0, 1.0, -flat.y) / in_cam.z;
        let by_point = match self {
            Self::Perspective => perspective(),
            Self::Fisheye => {
                let radius = in_cam.xy().norm();
                let squared = in_cam.norm_squared();
                if in_cam.z > 0.0 && radius < PARAXIAL * in_cam.z {
                    perspective()
                } else {
                    let along = in_cam.xy() / radius;
                    let projector = along * along.transpose();
                    let across = Matrix2::identity() - projector;
                    let by_xy =
                        across * angle_over_radius(in_cam)? + projector * (in_cam.z / squared);
                    let by_z = along * (-radius / squared);
                    Matrix2x3::from_columns(&[by_xy.column(0), by_xy.column(1), by_z.column(0)])
                }
            }
        };
        Some((flat, by_point))
    }

    /// Ray with the given flat coordinates: a direction, not of unit length. `None` outside the
    /// field.
    pub(super) fn ray(self, flat: &Point2<f64>) -> Option<Vector3<f64>> {
        match self {
            Self::Perspective => Some(Vector3::new(flat.x, flat.y, 1.0)),
            Self::Fisheye => {
                let angle_rad = flat.coords.norm();
                if !(angle_rad <= FISHEYE_FIELD_RAD) {
                    return None;
                }
                let (sin, cos) = libm::sincos(angle_rad);
                let scale = if angle_rad < PARAXIAL { 1.0 } else { sin / angle_rad };
                Some(Vector3::new(flat.x * scale, flat.y * scale, cos))
            }
        }
    }

    /// Normalised coordinates `(X/Z, Y/Z)` of the ray with the given flat coordinates. `None` for
    /// rays more than 89° from the axis of a fisheye lens.
    pub(super) fn normalized(self, flat: &Point2<f64>) -> Option<Point2<f64>> {
        match self {
            Self::Perspective => Some(*flat),
            Self::Fisheye => {
                let ray = self.ray(flat)?;
                (ray.z > LEAST_COS).then(|| Point2::new(ray.x / ray.z, ray.y / ray.z))
            }
        }
    }
}

/// Ratio `θ / √(X² + Y²)`. `None` beyond the field of a fisheye lens, and for the camera's centre.
fn angle_over_radius(in_cam: &Vector3<f64>) -> Option<f64> {
    let radius = in_cam.xy().norm();
    if in_cam.z > 0.0 && radius < PARAXIAL * in_cam.z {
        let slope = radius / in_cam.z;
        return Some((1.0 - slope * slope / 3.0) / in_cam.z);
    }
    let angle_rad = libm::atan2(radius, in_cam.z);
    (radius > 0.0 && angle_rad <= FISHEYE_FIELD_RAD).then(|| angle_rad / radius)
}

impl Distortion {
    /// True if every coefficient of a perspective lens is zero.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// True if a ray with the given flat coordinates is visible, unlike at a pole of the rational
    /// model and beyond.
    pub(super) fn reaches(&self, flat: &Point2<f64>) -> bool {
        self.is_polynomial() || self.radial(flat.coords.norm_squared()).denominator > AT_POLE
    }

    fn is_polynomial(&self) -> bool {
        let is_undivided = self.k4 == 0.0 && self.k5 == 0.0 && self.k6 == 0.0;
        is_undivided || !self.kind.has_denominator()
    }

    /// True if distorted coordinates lie outside the round picture of a fisheye lens: farther from
    /// the centre than the rays at 110° from the axis. False if the polynomial folds over before.
    pub(super) fn is_outside(&self, distorted: &Point2<f64>) -> bool {
        const STEPS: u32 = 110;
        if self.kind.keeps_lines() {
            return false;
        }
        let height = |step: u32| {
            let angle_rad = FISHEYE_FIELD_RAD * f64::from(step) / f64::from(STEPS);
            angle_rad * self.radial(angle_rad * angle_rad).factor
        };
        distorted.coords.norm() > height(STEPS)
            && (0..STEPS).all(|step| height(step) < height(step + 1))
    }

    #[inline]
    fn radial(&self, r2: f64) -> Radial {
        let Self { k1, k2, k3, k4, k5, k6, .. } = *self;
        let fourth = if self.kind.has_denominator() { 0.0 } else { k4 };
        let numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * (k3 + r2 * fourth)));
        let slope = k1 + r2 * (2.0 * k2 + r2 * (3.0 * k3 + 4.0 * r2 * fourth));
        if self.is_polynomial() {
            return Radial { factor: numerator, slope, denominator: 1.0 };
        }
        let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let factor = numerator / denominator;
        let slope_below = k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6);
        Radial { factor, slope: (slope - factor * slope_below) / denominator, denominator }
    }

    /// Distorts flat coordinates.
    ///
    /// ```
    /// # use boresight_geometry::Distortion;
    /// # use nalgebra::Point2;
    /// let barrel = Distortion { k1: -0.1, ..Distortion::default() };
    /// // r (1 + k1 r²) at r = 0.5.
    /// assert_eq!(barrel.apply(&Point2::new(0.5, 0.0)), Point2::new(0.4875, 0.0));
    /// ```
    pub fn apply(&self, flat: &Point2<f64>) -> Point2<f64> {
        self.applied(flat, &self.radial(flat.coords.norm_squared()))
    }

    #[inline]
    fn applied(&self, flat: &Point2<f64>, radial: &Radial) -> Point2<f64> {
        let (x, y) = (flat.x, flat.y);
        let r2 = x * x + y * y;
        Point2::new(
            x * radial.factor + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial.factor + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// Jacobian of [`Self::apply`] at `flat`, 2×2.
    pub fn derivative(&self, flat: &Point2<f64>) -> Matrix2<f64> {
        self.derived(flat, &self.radial(flat.coords.norm_squared()))
    }

    #[inline]
    fn derived(&self, flat: &Point2<f64>, radial: &Radial) -> Matrix2<f64> {
        let (x, y) = (flat.x, flat.y);
        let Radial { factor: radial, slope, .. } = *radial;
        let cross = 2.0 * x * y * slope + 2.0 * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    /// [`Self::apply`] with both derivatives. `None` at a pole of the rational model and beyond.
    #[inline]
    pub(super) fn bend(&self, flat: &Point2<f64>) -> Option<Bent> {
        let radial = self.radial(flat.coords.norm_squared());
        (radial.denominator > AT_POLE).then(|| self.bent(flat, &radial))
    }

    /// Derivative of [`Self::apply`] by the lens parameters, for focal lengths of 1: 2 rows,
    /// columns in the order of [`LENS_PARAMETERS`].
    pub fn by_parameters(&self, flat: &Point2<f64>) -> SMatrix<f64, 2, LENS_PARAMETERS> {
        self.bent(flat, &self.radial(flat.coords.norm_squared())).by_parameters
    }

    #[inline]
    fn bent(&self, flat: &Point2<f64>, radial: &Radial) -> Bent {
        let (x, y) = (flat.x, flat.y);
        let r2 = x * x + y * y;
        let at = self.applied(flat, radial);
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let (top, bottom) = (1.0 / radial.denominator, -radial.factor / radial.denominator);
        let [by_k4, by_k5, by_k6] = match self.kind {
            LensKind::Perspective => [bottom * r2, bottom * r4, bottom * r6],
            LensKind::Fisheye => [r4 * r4, 0.0, 0.0],
        };
        let by_parameters = SMatrix::from_row_slice(&[
            at.x,
            0.0,
            1.0,
            0.0,
            x * (top * r2),
            x * (top * r4),
            2.0 * x * y,
            r2 + 2.0 * x * x,
            x * (top * r6),
            x * by_k4,
            x * by_k5,
            x * by_k6,
            0.0,
            at.y,
            0.0,
            1.0,
            y * (top * r2),
            y * (top * r4),
            r2 + 2.0 * y * y,
            2.0 * x * y,
            y * (top * r6),
            y * by_k4,
            y * by_k5,
            y * by_k6,
        ]);
        Bent { at, by_flat: self.derived(flat, radial), by_parameters }
    }

    /// Undistorts to flat coordinates, by Newton's method.
    ///
    /// ```
    /// # use boresight_geometry::Distortion;
    /// # use nalgebra::Point2;
    /// let barrel = Distortion { k1: -0.1, ..Distortion::default() };
    /// let flat = barrel.invert(&Point2::new(0.4875, 0.0)).ok_or("beyond the fold")?;
    /// assert!((flat.x - 0.5).abs() < 1e-12);
    /// # Ok::<(), &str>(())
    /// ```
    ///
    /// `None` where the model folds over: no point with a positive Jacobian maps to `distorted`, so
    /// it lies outside the field of the model. Also `None` for NaN.
    pub fn invert(&self, distorted: &Point2<f64>) -> Option<Point2<f64>> {
        if self.is_none() {
            return Some(*distorted);
        }
        let mut flat = *distorted;
        for _ in 0..50 {
            let radial = self.radial(flat.coords.norm_squared());
            let residual = distorted - self.applied(&flat, &radial);
            let derivative = self.derived(&flat, &radial);
            let determinant = derivative.determinant();
            if !(determinant > 1e-6 && derivative.trace() > 0.0) {
                return None;
            }
            let mut step = derivative.try_inverse()? * residual;
            // A long step would jump across the fold at the edge of the valid field.
            let longest = 0.3 * (1.0 + flat.coords.norm());
            let length = step.norm();
            if length > longest {
                step *= longest / length;
            }
            flat += step;
            // The next step would be about as long as the square of this one.
            if length <= 1e-9 * longest {
                break;
            }
        }
        let missed = (distorted - self.apply(&flat)).norm();
        (missed < 1e-11 * (1.0 + distorted.coords.norm())).then_some(flat)
    }
}
