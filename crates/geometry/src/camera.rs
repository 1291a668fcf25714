use nalgebra::{Isometry3, Matrix2, Point2, Point3, SMatrix, UnitQuaternion, Vector2, Vector3};

use super::{
    corner::Corner,
    distortion::{Bent, Distortion, LENS_PARAMETERS, LensKind},
};

/// `tan 80°`: limit beyond which rays of a fisheye lens, close to its plane, aren't straightened.
const STEEPEST: f64 = 5.67;

/// Camera model: maps points in the camera frame (metres, `z` forward) to distorted pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Focal length along x and y, in pixels; equal for square pixels.
    pub f_px: Vector2<f64>,
    /// Principal point, in pixels from the centre of the top-left pixel.
    pub pp_px: Point2<f64>,
    /// Deviation of the lens from a pinhole.
    pub distortion: Distortion,
}

/// Image of a board point, with derivatives by lens and pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Image point, distorted, in pixels.
    pub px: Point2<f64>,
    /// d px / d lens, columns in the order of [`LENS_PARAMETERS`].
    pub jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    /// d px / d pose, columns `ω` then `τ` of `R ← exp([ω]×) R`, `t ← t + τ` (see
    /// [`Camera::moved`]).
    pub jac_pose: SMatrix<f64, 2, 6>,
    /// Point before distortion: see [`LensKind::flat`].
    pub flat: Point2<f64>,
    /// d flat / d pose, columns as in `jac_pose`.
    pub flat_by_pose: SMatrix<f64, 2, 6>,
}

/// Image of a ray, with derivatives by lens and rotation of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayProjection {
    /// Image point, distorted, in pixels.
    pub px: Point2<f64>,
    /// d px / d lens, columns in the order of [`LENS_PARAMETERS`].
    pub jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    /// d px / d rotation, in radians about the camera's axes.
    pub jac_rotation: SMatrix<f64, 2, 3>,
}

/// Image of a point, with derivatives by lens and point.
struct Sighting {
    px: Point2<f64>,
    jac_lens: SMatrix<f64, 2, LENS_PARAMETERS>,
    by_cam: SMatrix<f64, 2, 3>,
    flat: Point2<f64>,
    flat_by_cam: SMatrix<f64, 2, 3>,
}

impl Camera {
    /// Pinhole camera with square pixels.
    pub fn pinhole(f_px: f64, pp_px: Point2<f64>) -> Self {
        Self { f_px: Vector2::new(f_px, f_px), pp_px, distortion: Distortion::default() }
    }

    /// Pixel of a point in camera coordinates. `None` outside the field: behind the camera or on
    /// its plane, more than 110° from the axis of a fisheye lens, or at a pole of the rational
    /// model and beyond.
    ///
    /// ```
    /// # use boresight_geometry::Camera;
    /// # use nalgebra::{Point2, Point3};
    /// let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
    /// // 10 cm to the right of the axis, at a distance of 1 m.
    /// assert_eq!(camera.project(&Point3::new(0.1, 0.0, 1.0)), Some(Point2::new(730.0, 360.0)));
    /// assert_eq!(camera.project(&Point3::new(0.1, 0.0, -1.0)), None);
    /// ```
    pub fn project(&self, point_in_cam: &Point3<f64>) -> Option<Point2<f64>> {
        let flat = self.distortion.kind.flat(&point_in_cam.coords)?;
        self.distortion.reaches(&flat).then(|| self.px_from_flat(&flat))
    }

    /// Pixel of a point on the board (metres, `z = 0`). `None` outside the field, see
    /// [`Self::project`].
    ///
    /// ```
    /// # use boresight_geometry::Camera;
    /// # use nalgebra::{Isometry3, Point2};
    /// let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
    /// let cam_from_board = Isometry3::translation(0.0, 0.1, 0.5);
    /// let middle_px = camera.px_from_board(&cam_from_board, &Point2::origin());
    /// assert_eq!(middle_px, Some(Point2::new(640.0, 540.0)));
    /// ```
    pub fn px_from_board(
        &self,
        cam_from_board: &Isometry3<f64>,
        point_in_board_m: &Point2<f64>,
    ) -> Option<Point2<f64>> {
        let on_board = Point3::new(point_in_board_m.x, point_in_board_m.y, 0.0);
        self.project(&(cam_from_board * on_board))
    }

    /// Pixel of flat coordinates, see [`LensKind`].
    #[doc(hidden)]
    pub fn px_from_flat(&self, flat: &Point2<f64>) -> Point2<f64> {
        self.pp_px + self.distortion.apply(flat).coords.component_mul(&self.f_px)
    }

    /// Projects undistorted normalised coordinates `(X/Z, Y/Z)` to a distorted pixel.
    pub fn px_from_normalized(&self, normalized: &Point2<f64>) -> Point2<f64> {
        if self.distortion.kind.keeps_lines() {
            return self.px_from_flat(normalized);
        }
        let ray = Vector3::new(normalized.x, normalized.y, 1.0);
        // Every ray in front of the camera is inside the field.
        self.distortion.kind.flat(&ray).map_or(self.pp_px, |flat| self.px_from_flat(&flat))
    }

    /// Derivative of [`Self::px_from_normalized`], 2×2. `None` outside the field of the lens model.
    #[doc(hidden)]
    pub fn px_by_normalized(&self, normalized: &Point2<f64>) -> Option<Matrix2<f64>> {
        let ray = Vector3::new(normalized.x, normalized.y, 1.0);
        let by_cam = self.sight(&ray)?.by_cam;
        Some(by_cam.fixed_columns::<2>(0).into_owned())
    }

    /// Flat coordinates of the ray at a pixel, see [`LensKind`]. `None` outside the field of the
    /// lens model.
    #[doc(hidden)]
    pub fn flat_from_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        self.distortion.invert(&Point2::from((px - self.pp_px).component_div(&self.f_px)))
    }

    /// True if a pixel lies outside the round picture of a fisheye lens: more than 110° from the
    /// axis.
    #[doc(hidden)]
    pub fn is_outside_field(&self, px: &Point2<f64>) -> bool {
        self.distortion.is_outside(&Point2::from((px - self.pp_px).component_div(&self.f_px)))
    }

    /// Undistorts a pixel to normalised coordinates `(X/Z, Y/Z)`. `None` outside the field of the
    /// lens model, see [`Distortion::invert`], and for rays more than 89° from the axis of a
    /// fisheye lens, for which see [`Self::ray_from_px`].
    pub fn normalized_from_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        self.distortion.kind.normalized(&self.flat_from_px(px)?)
    }

    /// Direction of the ray at a pixel, in camera coordinates; not of unit length. `None` outside
    /// the field of the lens model, see [`Distortion::invert`], and beyond 110° of a fisheye lens.
    ///
    /// ```
    /// # use boresight_geometry::{Camera, Distortion};
    /// # use nalgebra::Point2;
    /// let distortion = Distortion { k1: -0.2, ..Distortion::default() };
    /// let camera = Camera { distortion, ..Camera::pinhole(900.0, Point2::new(640.0, 360.0)) };
    /// let px = Point2::new(1200.0, 90.0);
    /// let ray = camera.ray_from_px(&px).ok_or("outside the lens's field")?;
    /// let seen_px = camera.project(&(ray * 2.0).into()).ok_or("behind the camera")?;
    /// assert!((seen_px - px).norm() < 1e-6);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn ray_from_px(&self, px: &Point2<f64>) -> Option<Vector3<f64>> {
        self.distortion.kind.ray(&self.flat_from_px(px)?)
    }

    /// Pixel in a pinhole camera with the same `f_px` and `pp_px` for the ray at `px`. `None` where
    /// [`Self::normalized_from_px`] has none.
    ///
    /// ```
    /// # use boresight_geometry::{Camera, Distortion};
    /// # use nalgebra::Point2;
    /// let distortion = Distortion { k1: -0.2, ..Distortion::default() };
    /// let camera = Camera { distortion, ..Camera::pinhole(900.0, Point2::new(640.0, 360.0)) };
    /// // A barrel pulls points towards the principal point.
    /// let straight_px = camera.undistort_px(&Point2::new(1200.0, 360.0)).ok_or("outside")?;
    /// assert!(straight_px.x > 1200.0);
    /// assert_eq!(straight_px.y, 360.0);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn undistort_px(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        self.normalized_from_px(px)
            .map(|normalized| self.pp_px + normalized.coords.component_mul(&self.f_px))
    }

    /// Corner in a pinhole camera with the same `f_px` and `pp_px`, see [`Self::undistort_px`],
    /// with covariance. `None` where that has none, and more than 80° from the axis, where a wide
    /// lens's errors grow thirtyfold.
    #[doc(hidden)]
    pub fn straighten_corner(&self, corner: &Corner) -> Option<Corner> {
        let normalized = self.normalized_from_px(&corner.px)?;
        if normalized.coords.norm() > STEEPEST {
            return None;
        }
        let straight_by_px = Matrix2::from_diagonal(&self.f_px)
            * self.px_by_normalized(&normalized)?.try_inverse()?;
        let covariance_px2 = straight_by_px * corner.covariance_px2 * straight_by_px.transpose();
        let px = self.pp_px + normalized.coords.component_mul(&self.f_px);
        Some(Corner { px, covariance_px2, ..*corner })
    }

    /// Corner without distortion: [`Self::straighten_corner`] for a fisheye lens. A perspective
    /// lens changes scale little over a board: the covariance is kept, so that none of its corners
    /// dominates. An unseen corner is unchanged.
    pub fn undistort_corner(&self, corner: &Corner) -> Option<Corner> {
        if !corner.is_seen() {
            return Some(*corner);
        }
        if !self.distortion.kind.keeps_lines() {
            return self.straighten_corner(corner);
        }
        let px = self.undistort_px(&corner.px)?;
        Some(Corner { px, ..*corner })
    }

    /// [`Self::px_from_board`] with derivatives.
    #[inline]
    pub fn project_board_point(
        &self,
        cam_from_board: &Isometry3<f64>,
        point_in_board_m: &Point2<f64>,
    ) -> Option<Projection> {
        let point_m = Point3::new(point_in_board_m.x, point_in_board_m.y, 0.0);
        self.project_body_point(cam_from_board, &point_m)
    }

    /// Image of a point of a body at a pose, in metres, with derivatives; z = 0 for a flat board.
    /// `None` outside the field, see [`Self::project`].
    #[inline(always)]
    pub fn project_body_point(
        &self,
        cam_from_body: &Isometry3<f64>,
        point_in_body_m: &Point3<f64>,
    ) -> Option<Projection> {
        let turned = cam_from_body.rotation * point_in_body_m.coords;
        let in_cam = turned + cam_from_body.translation.vector;
        let Sighting { px, jac_lens, by_cam, flat, flat_by_cam } = self.sight(&in_cam)?;
        let jac_pose = by_pose(&turned, &by_cam);
        Some(Projection {
            px,
            jac_lens,
            jac_pose,
            flat,
            flat_by_pose: by_pose(&turned, &flat_by_cam),
        })
    }

    /// Projects a ray, a direction of any length in camera coordinates, with derivatives. `None`
    /// outside the field, see [`Self::project`].
    ///
    /// A small rotation ω of the camera moves the ray `r` by `ω × r = −[r]× ω`.
    pub fn project_ray(&self, ray: &Vector3<f64>) -> Option<RayProjection> {
        let Sighting { px, jac_lens, by_cam, .. } = self.sight(ray)?;
        Some(RayProjection { px, jac_lens, jac_rotation: by_cam * -ray.cross_matrix() })
    }

    /// Pixel of a point inside the field, with derivatives.
    #[inline(always)]
    fn sight(&self, in_cam: &Vector3<f64>) -> Option<Sighting> {
        let (flat, flat_by_cam) = self.distortion.kind.flat_with_derivative(in_cam)?;
        let Bent { at, by_flat, by_parameters: mut jac_lens } = self.distortion.bend(&flat)?;
        for column in 4..LENS_PARAMETERS {
            jac_lens[(0, column)] *= self.f_px.x;
            jac_lens[(1, column)] *= self.f_px.y;
        }
        let px = self.pp_px + at.coords.component_mul(&self.f_px);
        let px_by_flat = Matrix2::from_diagonal(&self.f_px) * by_flat;
        Some(Sighting { px, jac_lens, by_cam: px_by_flat * flat_by_cam, flat, flat_by_cam })
    }

    /// Moves `cam_from_board` by the small step `(ω, τ)`, radians and metres, of
    /// [`Projection::jac_pose`].
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

    /// Lens parameters in the order of [`LENS_PARAMETERS`].
    ///
    /// ```
    /// # use boresight_geometry::{Camera, LensParameter};
    /// # use nalgebra::Point2;
    /// let camera = Camera::pinhole(900.0, Point2::new(640.0, 360.0));
    /// let parameters = camera.lens_parameters();
    /// assert_eq!(parameters[LensParameter::Cx.index()], 640.0);
    /// assert_eq!(Camera::from_lens_parameters(camera.distortion.kind, &parameters), camera);
    /// ```
    pub fn lens_parameters(&self) -> [f64; LENS_PARAMETERS] {
        let Distortion { k1, k2, p1, p2, k3, k4, k5, k6, .. } = self.distortion;
        [self.f_px.x, self.f_px.y, self.pp_px.x, self.pp_px.y, k1, k2, p1, p2, k3, k4, k5, k6]
    }

    /// Camera of the given kind with the given [`Self::lens_parameters`].
    pub fn from_lens_parameters(kind: LensKind, parameters: &[f64; LENS_PARAMETERS]) -> Self {
        let [fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6] = *parameters;
        Self {
            f_px: Vector2::new(fx, fy),
            pp_px: Point2::new(cx, cy),
            distortion: Distortion { kind, k1, k2, p1, p2, k3, k4, k5, k6 },
        }
    }

    /// Camera of the same kind with the given [`Self::lens_parameters`].
    pub fn with_lens_parameters(&self, parameters: &[f64; LENS_PARAMETERS]) -> Self {
        Self::from_lens_parameters(self.distortion.kind, parameters)
    }
}

/// Converts derivatives by a point in camera coordinates, at the offset `turned` from the middle of
/// the body, to derivatives by the pose.
#[inline(always)]
fn by_pose(turned: &Vector3<f64>, by_cam: &SMatrix<f64, 2, 3>) -> SMatrix<f64, 2, 6> {
    // ω × t moves the pixel by b·(ω × t) = (t × b)·ω, for each row b of `by_cam`.
    let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
    for axis in 0..2 {
        let b = [by_cam[(axis, 0)], by_cam[(axis, 1)], by_cam[(axis, 2)]];
        for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            by_pose[(axis, i)] = turned[j] * b[k] - turned[k] * b[j];
            by_pose[(axis, 3 + i)] = b[i];
        }
    }
    by_pose
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            f_px: Vector2::new(900.0, 910.0),
            pp_px: Point2::new(652.3, 351.8),
            distortion: Distortion {
                k1: -0.3,
                k2: 0.12,
                p1: 1e-3,
                p2: -7e-4,
                k3: -0.02,
                ..Distortion::default()
            },
        }
    }

    fn rational() -> Camera {
        let mut camera = camera();
        (camera.distortion.k4, camera.distortion.k5, camera.distortion.k6) = (-0.05, 0.02, 0.004);
        camera
    }

    fn fisheye() -> Camera {
        Camera {
            f_px: Vector2::new(430.0, 434.0),
            pp_px: Point2::new(652.3, 351.8),
            distortion: Distortion {
                kind: LensKind::Fisheye,
                k1: 0.03,
                k2: -0.01,
                k3: 2e-3,
                k4: -3e-4,
                ..Distortion::default()
            },
        }
    }

    fn pose() -> Isometry3<f64> {
        Isometry3::new(Vector3::new(0.03, -0.05, 0.7), Vector3::new(0.5, -0.4, 0.3))
    }

    #[test]
    fn undistortion_inverts_distortion() {
        for camera in [camera(), rational(), fisheye()] {
            for row in 0..=20 {
                for column in 0..=20 {
                    let px = Point2::new(64.0 * f64::from(column), 36.0 * f64::from(row));
                    let ray = camera.ray_from_px(&px).expect("inside the field");
                    let back = camera.project(&Point3::from(ray)).expect("inside the field");
                    assert!((back - px).norm() < 1e-9, "{px}");
                    let Some(normalized) = camera.normalized_from_px(&px) else {
                        assert!(ray.z / ray.norm() < 0.02);
                        continue;
                    };
                    assert!((camera.px_from_normalized(&normalized) - px).norm() < 1e-9, "{px}");
                }
            }
        }
    }

    #[test]
    fn a_fisheye_sees_behind_its_plane_but_not_beyond_its_field() {
        let camera = fisheye();
        let seen = |angle_deg: f64| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            camera.project(&Point3::new(0.6 * sin, 0.8 * sin, cos))
        };
        for angle_deg in [0.0, 1e-3, 30.0, 89.0, 91.0, 109.9] {
            let px = seen(angle_deg).expect("inside the field");
            let ray = camera.ray_from_px(&px).expect("inside the field");
            let found_deg = ray.xy().norm().atan2(ray.z).to_degrees();
            assert!((found_deg - angle_deg).abs() < 1e-9, "{angle_deg}: {found_deg}");
        }
        assert_eq!(seen(110.1), None);
        assert_eq!(seen(180.0), None);
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
        for (camera, ray) in [
            (camera(), Vector3::new(0.2, -0.15, 1.0)),
            (fisheye(), Vector3::new(0.2, -0.15, 1.0)),
            (fisheye(), Vector3::new(0.9, -0.4, -0.05)),
            (fisheye(), Vector3::new(1e-6, 2e-6, 1.0)),
        ] {
            let at = camera.project_ray(&ray).expect("inside the field");
            for i in 0..3 {
                let turned = |sign: f64| {
                    let mut turn_rad = Vector3::zeros();
                    turn_rad[i] = sign * 1e-6;
                    let ray = UnitQuaternion::from_scaled_axis(turn_rad) * ray;
                    camera.project(&Point3::from(ray)).expect("inside the field")
                };
                let difference = (turned(1.0) - turned(-1.0)) / 2e-6;
                assert!((difference - at.jac_rotation.column(i)).norm() < 1e-4, "turn {i}");
            }
            assert_eq!(camera.project(&Point3::from(ray)), Some(at.px));
        }
    }

    #[test]
    fn derivatives_match_differences() {
        for camera in [camera(), rational(), fisheye()] {
            derivatives_of(&camera, &pose());
        }
        derivatives_of(&fisheye(), &Isometry3::translation(0.9, -0.2, 0.01));
    }

    fn derivatives_of(camera: &Camera, pose: &Isometry3<f64>) {
        let point_m = Point2::new(0.08, -0.06);
        let at = camera.project_board_point(pose, &point_m).expect("in front");
        let px = |camera: &Camera, pose: &Isometry3<f64>| {
            camera.px_from_board(pose, &point_m).expect("in front")
        };
        assert!((px(camera, pose) - at.px).norm() < 1e-10);
        let is_fisheye = camera.distortion.kind == LensKind::Fisheye;
        let unused = |i: usize| is_fisheye && matches!(i, 10 | 11);
        for i in (0..LENS_PARAMETERS).filter(|i| !unused(*i)) {
            let nudged = |sign: f64| {
                let mut parameters = camera.lens_parameters();
                parameters[i] += sign * 1e-6;
                px(&camera.with_lens_parameters(&parameters), pose)
            };
            let difference = (nudged(1.0) - nudged(-1.0)) / 2e-6;
            assert!((difference - at.jac_lens.column(i)).norm() < 1e-5, "lens {i}");
        }
        for i in 0..6 {
            let nudged = |sign: f64| {
                let mut step = [Vector3::zeros(), Vector3::zeros()];
                step[i / 3][i % 3] = sign * 1e-6;
                px(camera, &Camera::moved(pose, &step[0], &step[1]))
            };
            let difference = (nudged(1.0) - nudged(-1.0)) / 2e-6;
            assert!((difference - at.jac_pose.column(i)).norm() < 1e-4, "pose {i}");
        }
    }
}
