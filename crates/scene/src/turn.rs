//! Turn and zoom of a camera, and projection through its lens afterwards.

use boresight_geometry::{Camera, LensMatrix, LensParameter, LensParts, frame::ImageSize};
use nalgebra::{Matrix2x4, Point2, UnitQuaternion, Vector2, Vector3, Vector4};

/// Standard deviations assumed for a lens whose file states none: 1 % of the focal lengths, and 1 %
/// of the width for the principal point, as in careless calibrations.
const UNSTATED: f64 = 0.01;

/// Calibrated lens with the picture size.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// Lens model with parameters.
    pub camera: Camera,
    /// Covariance of the parameters, stated or [`Self::unstated_covariance`].
    pub covariance: LensMatrix,
    /// Picture size.
    pub image_size: ImageSize,
}

impl Lens {
    /// Lens with the covariance stated by the calibration, if any.
    pub fn new(camera: Camera, covariance: Option<LensMatrix>, image_size: ImageSize) -> Self {
        let covariance =
            covariance.unwrap_or_else(|| Self::unstated_covariance(&camera, image_size));
        Self { camera, covariance, image_size }
    }

    /// Covariance assumed for a calibration without uncertainty.
    pub fn unstated_covariance(camera: &Camera, image_size: ImageSize) -> LensMatrix {
        let mut covariance = LensMatrix::zeros();
        let f_px = UNSTATED * camera.f_px.x;
        covariance.set_block(
            LensParameter::F,
            LensParameter::F,
            &nalgebra::Matrix2::repeat(f_px * f_px),
        );
        let pp_px = UNSTATED * f64::from(image_size.width_px);
        let pp = nalgebra::Matrix2::from_diagonal_element(pp_px * pp_px);
        covariance.set_block(LensParameter::PP, LensParameter::PP, &pp);
        covariance
    }

    /// Ray of a pixel; `None` outside the lens model's field.
    pub fn ray(&self, px: &Point2<f64>) -> Option<Vector3<f64>> {
        self.camera.ray_from_px(px).map(|ray| ray.normalize())
    }

    /// Half the picture's diagonal, px: roll and focal length are most visible in the corner.
    pub fn half_diagonal_px(&self) -> f64 {
        libm::hypot(f64::from(self.image_size.width_px), f64::from(self.image_size.height_px)) / 2.0
    }
}

/// Turn of the camera since the reference, small or large, and the log ratio of focal lengths.
///
/// The rotation vector (tilt, pan, roll) turns the rays of the reference into those of now: with
/// pan > 0 the scene moves to the right and the camera points to the left; with tilt > 0 the scene
/// moves up and the camera points down; with roll > 0 the scene turns clockwise and the camera
/// anticlockwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turn {
    /// Angle about the vertical axis, rad.
    pub pan_rad: f64,
    /// Angle about the horizontal axis, rad.
    pub tilt_rad: f64,
    /// Angle about the line of sight, rad.
    pub roll_rad: f64,
    /// Logarithm of the ratio of focal lengths.
    pub log_focal: f64,
}

/// Projection of a ray, with the derivative by pan, tilt, roll and log focal ratio.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Pixel.
    pub px: Point2<f64>,
    /// d px / d (pan, tilt, roll, log focal).
    pub by_turn: Matrix2x4<f64>,
}

impl Turn {
    /// Turn from a vector in the order pan, tilt, roll, log focal ratio.
    pub fn from_vector(v: &Vector4<f64>) -> Self {
        Self { pan_rad: v[0], tilt_rad: v[1], roll_rad: v[2], log_focal: v[3] }
    }

    /// Turn that shifts the middle of the picture by `shift_px`, to first order.
    pub fn by_shift(lens: &Lens, shift_px: &Vector2<f64>) -> Self {
        let f = lens.camera.f_px;
        Self { pan_rad: shift_px.x / f.x, tilt_rad: -shift_px.y / f.y, ..Self::default() }
    }

    /// Vector in the order pan, tilt, roll, log focal ratio.
    pub fn vector(&self) -> Vector4<f64> {
        Vector4::new(self.pan_rad, self.tilt_rad, self.roll_rad, self.log_focal)
    }

    /// Rotation of the rays.
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(Vector3::new(self.tilt_rad, self.pan_rad, self.roll_rad))
    }

    fn of_rotation(rotation: &UnitQuaternion<f64>, log_focal: f64) -> Self {
        let axis = rotation.scaled_axis();
        Self { pan_rad: axis.y, tilt_rad: axis.x, roll_rad: axis.z, log_focal }
    }

    /// Composition: this turn, then `next`.
    pub fn then(&self, next: &Self) -> Self {
        Self::of_rotation(&(next.rotation() * self.rotation()), self.log_focal + next.log_focal)
    }

    /// Inverse turn.
    pub fn inverse(&self) -> Self {
        Self::of_rotation(&self.rotation().inverse(), -self.log_focal)
    }

    /// Turn relative to a reference turned by `reference`.
    pub fn since(&self, reference: &Self) -> Self {
        reference.inverse().then(self)
    }

    /// Turn moved by a small step (pan, tilt, roll, log focal) about the current axes.
    pub fn stepped(&self, step: &Vector4<f64>) -> Self {
        self.then(&Self::from_vector(step))
    }

    /// Pixel of a ray of the reference. `None` outside the field.
    pub fn project(&self, lens: &Lens, ray: &Vector3<f64>) -> Option<Point2<f64>> {
        self.project_by(lens, &self.rotation(), ray)
    }

    /// [`Self::project`] with the turn's rotation precomputed.
    pub fn project_by(
        &self,
        lens: &Lens,
        rotation: &UnitQuaternion<f64>,
        ray: &Vector3<f64>,
    ) -> Option<Point2<f64>> {
        let at = lens.camera.project(&(rotation * ray).into())?;
        Some(lens.camera.pp_px + (at - lens.camera.pp_px) * libm::exp(self.log_focal))
    }

    /// [`Self::project`] with derivatives by a step as in `stepped`.
    pub fn see(
        &self,
        lens: &Lens,
        rotation: &UnitQuaternion<f64>,
        ray: &Vector3<f64>,
    ) -> Option<Seen> {
        let at = lens.camera.project_ray(&(rotation * ray))?;
        let scale = libm::exp(self.log_focal);
        let out: Vector2<f64> = (at.px - lens.camera.pp_px) * scale;
        let by = at.jac_rotation * scale;
        let by_turn = Matrix2x4::from_columns(&[
            by.column(1).into_owned(),
            by.column(0).into_owned(),
            by.column(2).into_owned(),
            out,
        ]);
        Some(Seen { px: lens.camera.pp_px + out, by_turn })
    }

    /// Turn in pixels: pan and tilt in the middle of the picture, roll and focal length in its
    /// corner.
    pub fn in_px(&self, lens: &Lens) -> Vector4<f64> {
        self.vector().component_mul(&px_per_turn(lens))
    }
}

/// Pixels per radian of pan, tilt, roll, and per unit of log focal ratio: see [`Turn::in_px`].
pub fn px_per_turn(lens: &Lens) -> Vector4<f64> {
    let f = lens.camera.f_px;
    Vector4::new(f.x, f.y, lens.half_diagonal_px(), lens.half_diagonal_px())
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn wide() -> Lens {
        let mut camera = Camera::pinhole(439.2, Point2::new(499.9, 274.1));
        camera.distortion.k1 = -0.04;
        Lens::new(camera, None, ImageSize { width_px: 1024, height_px: 768 })
    }

    #[test]
    fn signs_are_those_of_who_stands_behind_the_camera() {
        let lens = wide();
        let axis = Vector3::z();
        let seen =
            |turn: Turn| turn.project(&lens, &axis).expect("in the field") - lens.camera.pp_px;
        assert!(seen(Turn { pan_rad: 0.01, ..Turn::default() }).x > 4.0);
        assert!(seen(Turn { tilt_rad: 0.01, ..Turn::default() }).y < -4.0);
        let right = lens.ray(&Point2::new(900.0, 274.1)).expect("in the field");
        let rolled = Turn { roll_rad: 0.01, ..Turn::default() }.project(&lens, &right);
        assert!(rolled.expect("in the field").y > 277.0);
    }

    #[test]
    fn a_turn_and_its_inverse_are_nothing() {
        let turn = Turn { pan_rad: 0.3, tilt_rad: -0.2, roll_rad: 0.1, log_focal: 0.05 };
        assert!(turn.then(&turn.inverse()).vector().norm() < 1e-12);
        let more = Turn { pan_rad: 0.01, ..Turn::default() };
        assert!((turn.then(&more).since(&turn).vector().norm() - 0.01).abs() < 1e-3);
    }

    #[test]
    fn derivatives_match_differences() {
        let lens = wide();
        let turn = Turn { pan_rad: 0.1, tilt_rad: -0.05, roll_rad: 0.03, log_focal: 0.02 };
        let ray = lens.ray(&Point2::new(200.0, 600.0)).expect("in the field");
        let seen = turn.see(&lens, &turn.rotation(), &ray).expect("in the field");
        for i in 0..4 {
            let mut step = Vector4::zeros();
            step[i] = 1e-6;
            let moved = turn.stepped(&step).project(&lens, &ray).expect("in the field");
            let difference = (moved - seen.px) / 1e-6;
            assert!((difference - seen.by_turn.column(i)).norm() < 2e-2, "{i}");
        }
    }
}
