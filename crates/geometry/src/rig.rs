//! Cameras with fixed mutual places.

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Unit, UnitQuaternion, Vector2, Vector3};

use super::{Camera, frame::ImageSize};

/// Least sine of the angle between two rays that meet in a point: 0.01°.
const LEAST_PARALLAX: f64 = 1.7e-4;

/// Least cosine of the angle between a ray and the middle of two cameras' views across the
/// baseline: beyond, as for cameras that face each other, their pictures have no common rows.
const LEAST_FORWARD: f64 = 0.2;

/// Cameras with fixed mutual places, all in one frame.
///
/// # Examples
///
/// A point seen by two cameras, 12 cm apart:
///
/// ```
/// use boresight_geometry::{Camera, Rig};
/// use nalgebra::{Isometry3, Point2, Point3};
///
/// let rig = Rig {
///     cameras: vec![Camera::pinhole(900.0, Point2::new(640.0, 360.0)); 2],
///     cam_from_rig: vec![Isometry3::identity(), Isometry3::translation(-0.12, 0.0, 0.0)],
/// };
/// let point_m = Point3::new(0.1, -0.2, 1.5);
/// let px = [0, 1].map(|of| rig.cameras[of].project(&(rig.cam_from_rig[of] * point_m)));
/// let [Some(left), Some(right)] = px else { panic!("both see it") };
///
/// assert!(rig.row_error_px([0, 1], [left, right]).is_some_and(|off_px| off_px.abs() < 1e-9));
/// let found_m = rig.triangulate(&[(0, left), (1, right)]).expect("rays that meet");
/// assert!((found_m - point_m).norm() < 1e-9);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Lens of each camera.
    pub cameras: Vec<Camera>,
    /// Rigid motion from the rig's frame to each camera, in metres; as many as cameras.
    pub cam_from_rig: Vec<Isometry3<f64>>,
}

/// Turns that rectify a pair of cameras (Fusiello et al. 2000, with OpenCV's sign): after them, the
/// pictures of a point lie in one row, or in one column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectified {
    /// Rotation of the first and of the second camera's frame to the common one.
    pub rotations: [UnitQuaternion<f64>; 2],
    /// Position of the second camera in the common frame, metres: `(b, 0, 0)` if rows agree,
    /// `(0, b, 0)` if columns do.
    pub second_m: Vector3<f64>,
    /// True if columns agree, as with cameras above each other.
    pub is_vertical: bool,
}

impl Rectified {
    /// Common principal point of rectified pictures of the focal length `f_px` that centres both
    /// cameras' pictures, as OpenCV's `stereoRectify` with `CALIB_ZERO_DISPARITY` and alpha −1.
    pub fn centre_px(&self, cameras: [(&Camera, ImageSize); 2], f_px: f64) -> Point2<f64> {
        let mut centre_px = Point2::origin();
        for (rotation, (camera, size)) in self.rotations.iter().zip(cameras) {
            let [width, height] = [size.width_px, size.height_px].map(|px| f64::from(px) - 1.0);
            let middle = Point2::new(0.5 * width, 0.5 * height);
            // Opposite points of the rim, left out together where the lens model ends.
            let rim = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 0.5)];
            let seen = rim.iter().filter_map(|(x, y)| {
                let turned = |x: f64, y: f64| {
                    let ray = camera.ray_from_px(&Point2::new(x * width, y * height))?;
                    let turned = rotation * ray;
                    (turned.z > 0.1 * turned.norm()).then(|| turned.xy() / turned.z)
                };
                Some(0.5 * (turned(*x, *y)? + turned(1.0 - x, 1.0 - y)?))
            });
            let all: Vec<Vector2<f64>> = seen.collect();
            let mean = all.iter().sum::<Vector2<f64>>() / all.len().max(1) as f64;
            centre_px += 0.5 * (middle.coords - f_px * mean);
        }
        centre_px
    }
}

impl Rig {
    /// Rigid motion from camera `from` to camera `to`.
    pub fn cam_from_cam(&self, to: usize, from: usize) -> Isometry3<f64> {
        self.cam_from_rig[to] * self.cam_from_rig[from].inverse()
    }

    /// Distance of two cameras' centres, in metres.
    pub fn baseline_m(&self, a: usize, b: usize) -> f64 {
        self.cam_from_cam(a, b).translation.vector.norm()
    }

    /// Point in the rig's frame, in metres, nearest to the rays at `seen` pixels of cameras: the
    /// least sum of squared distances. `None` with fewer than two rays, with parallel rays, or
    /// outside a lens model's field.
    pub fn triangulate(&self, seen: &[(usize, Point2<f64>)]) -> Option<Point3<f64>> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        let mut rays: Vec<Unit<Vector3<f64>>> = Vec::with_capacity(seen.len());
        for (camera, px) in seen {
            let rig_from_cam = self.cam_from_rig[*camera].inverse();
            let ray =
                Unit::new_normalize(rig_from_cam.rotation * self.cameras[*camera].ray_from_px(px)?);
            let across = Matrix3::identity() - ray.into_inner() * ray.transpose();
            normal += across;
            right += across * rig_from_cam.translation.vector;
            rays.push(ray);
        }
        let first = rays.first()?;
        let has_parallax = rays.iter().any(|ray| first.cross(ray).norm() > LEAST_PARALLAX);
        has_parallax.then(|| normal.try_inverse().map(|inverse| Point3::from(inverse * right)))?
    }

    /// Row error of a point seen at the pixels of cameras `a` and `b`: difference of the angles
    /// about their baseline, in pixels of their mean focal length. `None` for cameras in one
    /// place or facing each other, for rays along the baseline, or outside a lens model's field.
    pub fn row_error_px(&self, [a, b]: [usize; 2], px: [Point2<f64>; 2]) -> Option<f64> {
        let b_from_a = self.cam_from_cam(b, a);
        let a_from_b = b_from_a.rotation.inverse();
        let along = Unit::try_new(a_from_b * b_from_a.translation.vector, 1e-12)?;
        let rays =
            [self.cameras[a].ray_from_px(&px[0])?, a_from_b * self.cameras[b].ray_from_px(&px[1])?];
        let forward = Vector3::z() + a_from_b * Vector3::z();
        let middle = Unit::try_new(forward - along.into_inner() * along.dot(&forward), 1e-6)?;
        let across = middle.cross(&along);
        if rays.iter().any(|ray| ray.dot(&middle) < LEAST_FORWARD * ray.norm()) {
            return None;
        }
        let [one, other] = rays.map(|ray| ray.dot(&across) / ray.dot(&middle));
        let f_px = 0.25 * (self.cameras[a].f_px.sum() + self.cameras[b].f_px.sum());
        let error_px = f_px * (one - other);
        error_px.is_finite().then_some(error_px)
    }

    /// Rectifying turns of the cameras `a` and `b`, as `cv2.stereoRectify` calculates them. `None`
    /// for cameras in one place, to a micrometre.
    pub fn rectified(&self, a: usize, b: usize) -> Option<Rectified> {
        let b_from_a = self.cam_from_cam(b, a);
        // Both cameras turn by half of the rotation between them.
        let half = UnitQuaternion::from_scaled_axis(-0.5 * b_from_a.rotation.scaled_axis());
        let shift = half * b_from_a.translation.vector;
        if !(1e-6..f64::INFINITY).contains(&shift.norm()) {
            return None;
        }
        let is_vertical = shift.y.abs() > shift.x.abs();
        let axis = usize::from(is_vertical);
        let mut wanted = Vector3::zeros();
        wanted[axis] = shift[axis].signum();
        let turn = UnitQuaternion::rotation_between(&shift, &wanted)?;
        let rotations = [turn * half.inverse(), turn * half];
        let second_m = -(rotations[1] * b_from_a.translation.vector);
        Some(Rectified { rotations, second_m, is_vertical })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cameras side by side, 12 cm apart and turned towards each other.
    fn rig() -> Rig {
        let camera = |f_px| Camera::pinhole(f_px, Point2::new(640.0, 360.0));
        let second =
            Isometry3::new(Vector3::new(-0.12, 0.003, 0.01), Vector3::new(0.02, 0.1, 0.01));
        Rig {
            cameras: vec![camera(900.0), camera(950.0)],
            cam_from_rig: vec![Isometry3::identity(), second],
        }
    }

    fn seen(rig: &Rig, point: &Point3<f64>) -> [Point2<f64>; 2] {
        [0, 1].map(|camera| {
            rig.cameras[camera].project(&(rig.cam_from_rig[camera] * point)).expect("in front")
        })
    }

    #[test]
    fn rays_meet_where_the_point_is() {
        let rig = rig();
        for point in [Point3::new(0.1, -0.2, 1.5), Point3::new(-0.3, 0.1, 4.0)] {
            let px = seen(&rig, &point);
            let found = rig.triangulate(&[(0, px[0]), (1, px[1])]).expect("rays that meet");
            assert!((found - point).norm() < 1e-9);
            assert!(rig.row_error_px([0, 1], px).expect("rows").abs() < 1e-9);
            // A pixel up is an error of a pixel in a camera of about the same focal length.
            let up = [px[0], px[1] + Vector3::y().xy()];
            let error_px = rig.row_error_px([0, 1], up).expect("rows");
            assert!((error_px.abs() - 1.0).abs() < 0.1, "{error_px}");
        }
        assert_eq!(rig.triangulate(&[(0, Point2::new(640.0, 360.0))]), None);
        assert!((rig.baseline_m(0, 1) - rig.baseline_m(1, 0)).abs() < 1e-15);
    }

    #[test]
    fn rectified_pictures_of_a_point_lie_in_one_row() {
        let mut rig = rig();
        for is_vertical in [false, true] {
            if is_vertical {
                rig.cam_from_rig[1].translation.vector = Vector3::new(0.004, -0.3, 0.02);
            }
            let found = rig.rectified(0, 1).expect("a baseline");
            assert_eq!(found.is_vertical, is_vertical);
            let point = Point3::new(0.2, -0.1, 2.0);
            let [one, other] = [0, 1].map(|camera| {
                let in_common = found.rotations[camera] * (rig.cam_from_rig[camera] * point);
                in_common.coords / in_common.z
            });
            let axis = usize::from(!is_vertical);
            assert!((one[axis] - other[axis]).abs() < 1e-12);
            assert!((found.second_m[1 - axis].abs() - rig.baseline_m(0, 1)).abs() < 1e-12);
        }
        for apart_m in [0.0, 1e-9, -1e-310] {
            rig.cam_from_rig[1].translation.vector = Vector3::new(apart_m, 0.0, 0.0);
            assert_eq!(rig.rectified(0, 1), None, "{apart_m}");
        }
    }
}
