use nalgebra::{
    Isometry3, Matrix2, Matrix2x3, Point2, Point3, SMatrix, UnitQuaternion, Vector2, Vector3,
};

/// Number of lens parameters: `fx, fy, cx, cy` in pixels, then `k1, k2, p1, p2, k3` without unit, always in this
/// order.
pub const LENS_PARAMETERS: usize = 9;

/// Radial and tangential distortion, in the model and sign convention of OpenCV (Brown 1971).
///
/// Coefficients act on normalised coordinates and have no unit. With `x = X/Z`, `y = Y/Z`, `r² = x² + y²`:
/// ```text
/// x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
/// y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// Radial, r².
    pub k1: f64,
    /// Radial, r⁴.
    pub k2: f64,
    /// Tangential, vertical decentring.
    pub p1: f64,
    /// Tangential, horizontal decentring.
    pub p2: f64,
    /// Radial, r⁶.
    pub k3: f64,
}

/// A camera: maps points in its own frame (metres, `z` forward) to distorted pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Focal length along x and y, in pixels; equal for square pixels.
    pub f_px: Vector2<f64>,
    /// Principal point, in pixels from the centre of the top-left pixel.
    pub pp_px: Point2<f64>,
    /// Deviation of the lens from a pinhole.
    pub distortion: Distortion,
}

/// The image of a board point, with derivatives by lens and pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Distorted pixel.
    pub px: Point2<f64>,
    /// d px / d lens, columns in the order of [`LENS_PARAMETERS`].
    pub jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    /// d px / d pose, columns `ω` then `τ` of `R ← exp([ω]×) R`, `t ← t + τ` (see [`Camera::moved`]).
    pub jac_pose: SMatrix<f64, 2, 6>,
}

/// The image of a ray, with derivatives by lens and rotation of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayProjection {
    /// Distorted pixel.
    pub px: Point2<f64>,
    /// d px / d lens, columns in the order of [`LENS_PARAMETERS`].
    pub jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    /// d px / d rotation, in radians about the camera's axes.
    pub jac_rotation: SMatrix<f64, 2, 3>,
}

/// The image of a point, with derivatives by lens and point.
struct Sighting {
    px: Point2<f64>,
    jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    by_cam: SMatrix<f64, 2, 3>,
}

impl Distortion {
    /// Whether every coefficient is zero.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    fn radial(&self, r2: f64) -> f64 {
        1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
    }

    /// Distorts normalised coordinates `(X/Z, Y/Z)`.
    pub fn apply(&self, normalized: &Point2<f64>) -> Point2<f64> {
        let (x, y) = (normalized.x, normalized.y);
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        Point2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// Jacobian of [`Self::apply`] at `normalized`, 2×2.
    pub fn derivative(&self, normalized: &Point2<f64>) -> Matrix2<f64> {
        let (x, y) = (normalized.x, normalized.y);
        let r2 = x * x + y * y;
        let radial = self.radial(r2);
        // d radial / d r².
        let slope = self.k1 + r2 * (2.0 * self.k2 + 3.0 * r2 * self.k3);
        let cross = 2.0 * x * y * slope + 2.0 * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            radial + 2.0 * x * x * slope + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * slope + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    /// Undistorts normalised coordinates, by Newton's method.
    ///
    /// `None` where the model folds over: no point with a positive Jacobian maps to `distorted`, which therefore
    /// lies outside the field that the model describes. Also `None` for NaN.
    pub fn invert(&self, distorted: &Point2<f64>) -> Option<Point2<f64>> {
        if self.is_none() {
            return Some(*distorted);
        }
        let mut normalized = *distorted;
        for _ in 0..50 {
            let residual = distorted - self.apply(&normalized);
            let derivative = self.derivative(&normalized);
            let determinant = derivative.determinant();
            if !(determinant > 1e-6 && derivative.trace() > 0.0) {
                return None;
            }
            let mut step = derivative.try_inverse()? * residual;
            // A long step would jump across the fold that bounds the valid field.
            let longest = 0.3 * (1.0 + normalized.coords.norm());
            let length = step.norm();
            if length > longest {
                step *= longest / length;
            }
            normalized += step;
            if length <= 1e-15 * (1.0 + normalized.coords.norm()) {
                break;
            }
        }
        let missed = (distorted - self.apply(&normalized)).norm();
        (missed < 1e-11 * (1.0 + distorted.coords.norm())).then_some(normalized)
    }
}

impl Camera {
    /// A pinhole with square pixels.
    pub fn pinhole(f_px: f64, pp_px: Point2<f64>) -> Self {
        Self { f_px: Vector2::new(f_px, f_px), pp_px, distortion: Distortion::default() }
    }

    /// Pixel of a point in camera coordinates. `None` behind the camera or on its plane.
    pub fn project(&self, point_in_cam: &Point3<f64>) -> Option<Point2<f64>> {
        (point_in_cam.z > 1e-9).then(|| {
            let normalized =
                Point2::new(point_in_cam.x / point_in_cam.z, point_in_cam.y / point_in_cam.z);
            self.px_from_normalized(&normalized)
        })
    }

    /// Pixel of a point on the board (metres, `z = 0`). `None` behind the camera or on its plane.
    pub fn px_from_board(
        &self,
        cam_from_board: &Isometry3<f64>,
        point_in_board_m: &Point2<f64>,
    ) -> Option<Point2<f64>> {
        let on_board = Point3::new(point_in_board_m.x, point_in_board_m.y, 0.0);
        self.project(&(cam_from_board * on_board))
    }

    /// Projects undistorted normalised coordinates `(X/Z, Y/Z)` to a distorted pixel.
    pub fn px_from_normalized(&self, normalized: &Point2<f64>) -> Point2<f64> {
        self.pp_px + self.distortion.apply(normalized).coords.component_mul(&self.f_px)
    }

    /// Undistorts a pixel to normalised coordinates `(X/Z, Y/Z)`. `None` outside the field of the lens model, see
    /// [`Distortion::invert`].
    pub fn normalized_from_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        let distorted = Point2::from((px - self.pp_px).component_div(&self.f_px));
        self.distortion.invert(&distorted)
    }

    /// Pixel at which a pinhole camera with the same `f_px` and `pp_px` sees what this camera sees at `px`. `None`
    /// outside the field of the lens model.
    pub fn undistort_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        self.normalized_from_px(px)
            .map(|normalized| self.pp_px + normalized.coords.component_mul(&self.f_px))
    }

    /// [`Self::px_from_board`] with derivatives.
    pub fn project_board_point(
        &self,
        cam_from_board: &Isometry3<f64>,
        point_in_board_m: &Point2<f64>,
    ) -> Option<Projection> {
        let turned =
            cam_from_board.rotation * Vector3::new(point_in_board_m.x, point_in_board_m.y, 0.0);
        let in_cam = turned + cam_from_board.translation.vector;
        if in_cam.z <= 1e-9 {
            return None;
        }
        let Sighting { px, jac_lens, by_cam } = self.sight(&in_cam);
        let mut jac_pose = SMatrix::<f64, 2, 6>::zeros();
        jac_pose.fixed_columns_mut::<3>(0).copy_from(&(by_cam * -turned.cross_matrix()));
        jac_pose.fixed_columns_mut::<3>(3).copy_from(&by_cam);
        Some(Projection { px, jac_lens, jac_pose })
    }

    /// Projects the ray `(x, y, 1)`, undistorted normalised coordinates, with derivatives.
    ///
    /// A small rotation ω of the camera moves the ray `r = (x, y, 1)` by `ω × r = −[r]× ω`.
    pub fn project_ray(&self, normalized: &Point2<f64>) -> RayProjection {
        let ray = Vector3::new(normalized.x, normalized.y, 1.0);
        let Sighting { px, jac_lens, by_cam } = self.sight(&ray);
        RayProjection { px, jac_lens, jac_rotation: by_cam * -ray.cross_matrix() }
    }

    /// Pixel of a point in front of the camera, with derivatives.
    fn sight(&self, in_cam: &Vector3<f64>) -> Sighting {
        let (x, y) = (in_cam.x / in_cam.z, in_cam.y / in_cam.z);
        let normalized = Point2::new(x, y);
        let distorted = self.distortion.apply(&normalized);
        let (fx, fy) = (self.f_px.x, self.f_px.y);
        let r2 = x * x + y * y;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let jac_lens = SMatrix::<f64, 2, LENS_PARAMETERS>::from_row_slice(&[
            distorted.x,
            0.0,
            1.0,
            0.0,
            fx * x * r2,
            fx * x * r4,
            fx * 2.0 * x * y,
            fx * (r2 + 2.0 * x * x),
            fx * x * r6,
            0.0,
            distorted.y,
            0.0,
            1.0,
            fy * y * r2,
            fy * y * r4,
            fy * (r2 + 2.0 * y * y),
            fy * 2.0 * x * y,
            fy * y * r6,
        ]);
        let px_by_normalized =
            Matrix2::from_diagonal(&self.f_px) * self.distortion.derivative(&normalized);
        let normalized_by_cam = Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / in_cam.z;
        let by_cam = px_by_normalized * normalized_by_cam;
        let px = self.pp_px + distorted.coords.component_mul(&self.f_px);
        Sighting { px, jac_lens, by_cam }
    }

    /// Moves `cam_from_board` by the small step `(ω, τ)`, radians and metres, of [`Projection::jac_pose`].
    pub fn moved(
        cam_from_board: &Isometry3<f64>,
        turn_rad: &Vector3<f64>,
        shift_m: &Vector3<f64>,
    ) -> Isometry3<f64> {
        Isometry3::from_parts(
            (cam_from_board.translation.vector + shift_m).into(),
            UnitQuaternion::from_scaled_axis(*turn_rad) * cam_from_board.rotation,
        )
    }

    /// The lens parameters in the order of [`LENS_PARAMETERS`].
    pub fn lens_parameters(&self) -> [f64; LENS_PARAMETERS] {
        let d = &self.distortion;
        [self.f_px.x, self.f_px.y, self.pp_px.x, self.pp_px.y, d.k1, d.k2, d.p1, d.p2, d.k3]
    }

    /// The camera with the given [`Self::lens_parameters`].
    pub fn from_lens_parameters(parameters: &[f64; LENS_PARAMETERS]) -> Self {
        let [fx, fy, cx, cy, k1, k2, p1, p2, k3] = *parameters;
        Self {
            f_px: Vector2::new(fx, fy),
            pp_px: Point2::new(cx, cy),
            distortion: Distortion { k1, k2, p1, p2, k3 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            f_px: Vector2::new(900.0, 910.0),
            pp_px: Point2::new(652.3, 351.8),
            distortion: Distortion { k1: -0.3, k2: 0.12, p1: 1e-3, p2: -7e-4, k3: -0.02 },
        }
    }

    fn pose() -> Isometry3<f64> {
        Isometry3::new(Vector3::new(0.03, -0.05, 0.7), Vector3::new(0.5, -0.4, 0.3))
    }

    #[test]
    fn undistortion_inverts_distortion() {
        let camera = camera();
        for row in 0..=20 {
            for column in 0..=20 {
                let px = Point2::new(64.0 * f64::from(column), 36.0 * f64::from(row));
                let normalized = camera.normalized_from_px(&px).expect("inside the field");
                assert!((camera.px_from_normalized(&normalized) - px).norm() < 1e-9, "{px}");
            }
        }
    }

    #[test]
    fn beyond_the_fold_there_is_no_ray() {
        let lens = Distortion { k1: -0.35, ..Distortion::default() };
        // r (1 - 0.35 r²) peaks at 0.6506.
        assert!(lens.invert(&Point2::new(0.64, 0.0)).is_some());
        assert_eq!(lens.invert(&Point2::new(0.66, 0.0)), None);
        assert_eq!(lens.invert(&Point2::new(f64::NAN, 0.0)), None);
    }

    #[test]
    fn a_ray_moves_with_the_turn_as_differences_say() {
        let (camera, normalized) = (camera(), Point2::new(0.2, -0.15));
        let at = camera.project_ray(&normalized);
        let ray = Vector3::new(normalized.x, normalized.y, 1.0);
        for i in 0..3 {
            let turned = |sign: f64| {
                let mut turn_rad = Vector3::zeros();
                turn_rad[i] = sign * 1e-6;
                let ray = UnitQuaternion::from_scaled_axis(turn_rad) * ray;
                camera.project(&Point3::from(ray)).expect("in front")
            };
            let difference = (turned(1.0) - turned(-1.0)) / 2e-6;
            assert!((difference - at.jac_rotation.column(i)).norm() < 1e-4, "turn {i}");
        }
        assert_eq!(at.px, camera.px_from_normalized(&normalized));
    }

    #[test]
    fn derivatives_match_differences() {
        let (camera, pose) = (camera(), pose());
        let point_m = Point2::new(0.08, -0.06);
        let at = camera.project_board_point(&pose, &point_m).expect("in front");
        let px = |camera: &Camera, pose: &Isometry3<f64>| {
            camera.px_from_board(pose, &point_m).expect("in front")
        };
        assert!((px(&camera, &pose) - at.px).norm() < 1e-10);
        for i in 0..LENS_PARAMETERS {
            let nudged = |sign: f64| {
                let mut parameters = camera.lens_parameters();
                parameters[i] += sign * 1e-6;
                px(&Camera::from_lens_parameters(&parameters), &pose)
            };
            let difference = (nudged(1.0) - nudged(-1.0)) / 2e-6;
            assert!((difference - at.jac_lens.column(i)).norm() < 1e-5, "lens {i}");
        }
        for i in 0..6 {
            let nudged = |sign: f64| {
                let mut step = [Vector3::zeros(), Vector3::zeros()];
                step[i / 3][i % 3] = sign * 1e-6;
                px(&camera, &Camera::moved(&pose, &step[0], &step[1]))
            };
            let difference = (nudged(1.0) - nudged(-1.0)) / 2e-6;
            assert!((difference - at.jac_pose.column(i)).norm() < 1e-4, "pose {i}");
        }
    }
}
