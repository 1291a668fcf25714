//! Turn of the camera, and changes of a lens, that bring its rays nearest to those of another lens.

use nalgebra::{Point2, SMatrix, SVector, UnitQuaternion, Vector2, Vector3};

use boresight_geometry::{
    Camera, LENS_PARAMETERS,
    least_squares::{Limits, Linearised, Problem, minimise},
};

/// Rotation in three numbers, then a number for each free direction of the lens.
const UNKNOWNS: usize = 3 + LENS_PARAMETERS;

/// Angle between a ray and that of its pixel, up to which both are one.
const SAME_RAY_RAD: f64 = 1e-6;

/// Direction in which a lens may change, in the order of [`LENS_PARAMETERS`].
pub(super) type LensDirection = SVector<f64, LENS_PARAMETERS>;

/// Pixels of a lens with their rays.
#[derive(Clone, Debug)]
pub(super) struct Rays(Vec<(Point2<f64>, Vector3<f64>)>);

/// A lens brought nearest to the rays of another.
#[derive(Clone, Debug)]
pub(super) struct Closest {
    /// Rotation of the camera.
    pub(super) turn: UnitQuaternion<f64>,
    /// Changed lens.
    pub(super) camera: Camera,
    /// Remaining displacement at each pixel whose ray has an image.
    pub(super) displaced_px: Vec<(Point2<f64>, Vector2<f64>)>,
    /// Root mean square of the displacements, per coordinate. Infinite if a ray has no image.
    pub(super) off_px: f64,
}

impl Rays {
    /// Rays of `camera` at `px`. Pixels beyond the lens have none.
    pub(super) fn of(camera: &Camera, px: impl Iterator<Item = Point2<f64>>) -> Self {
        Self(px.filter_map(|px| Some((px, camera.ray_from_px(&px)?))).collect())
    }

    /// `camera` turned, and changed along `free`, such that the images of the rays are nearest to
    /// their pixels. `None` if no ray has an image.
    pub(super) fn closest_to(&self, camera: &Camera, free: &[LensDirection]) -> Option<Closest> {
        let (mut camera, mut turn) = (*camera, UnitQuaternion::identity());
        // The turn may bring rays into the field of the lens.
        for _ in 0..2 {
            let seen = |(_, ray): &&(_, Vector3<f64>)| image_px(&camera, &(turn * ray)).is_some();
            let rays: Vec<_> = self.0.iter().filter(seen).copied().collect();
            if rays.is_empty() {
                return None;
            }
            let problem = Nearest { rays: &rays, free };
            (camera, turn) = minimise(&problem, (camera, turn), Limits::EXACT)?.state;
            if rays.len() == self.0.len() {
                break;
            }
        }
        let displaced_px = self.displaced(&camera, &turn);
        let squares: f64 = displaced_px.iter().map(|(_, by)| by.norm_squared()).sum();
        let is_whole = displaced_px.len() == self.0.len();
        let mean = squares / (2 * displaced_px.len().max(1)) as f64;
        let off_px = if is_whole { mean.sqrt() } else { f64::INFINITY };
        Some(Closest { turn, camera, displaced_px, off_px })
    }

    /// Displacement at each pixel whose ray has an image by the turned `camera`.
    pub(super) fn displaced(
        &self,
        camera: &Camera,
        turn: &UnitQuaternion<f64>,
    ) -> Vec<(Point2<f64>, Vector2<f64>)> {
        let displaced = |(px, ray): &(Point2<f64>, Vector3<f64>)| {
            Some((*px, image_px(camera, &(turn * ray))? - px))
        };
        self.0.iter().filter_map(displaced).collect()
    }

    /// Number of the rays.
    pub(super) fn count(&self) -> usize {
        self.0.len()
    }
}

/// Pixel that shows `ray`. `None` beyond a pole, and where the lens folds over: another ray has
/// that pixel.
fn image_px(camera: &Camera, ray: &Vector3<f64>) -> Option<Point2<f64>> {
    let px = camera.project_ray(ray)?.px;
    (camera.ray_from_px(&px)?.angle(ray) < SAME_RAY_RAD).then_some(px)
}

/// Least sum of the squared displacements of rays.
struct Nearest<'a> {
    rays: &'a [(Point2<f64>, Vector3<f64>)],
    free: &'a [LensDirection],
}

impl Problem<UNKNOWNS> for Nearest<'_> {
    /// Lens, and rotation of the rays.
    type State = (Camera, UnitQuaternion<f64>);
    type Extra = ();

    fn linearise(&self, (camera, turn): &Self::State) -> Option<Linearised<UNKNOWNS>> {
        let mut linear = Linearised {
            cost: 0.0,
            gradient: SVector::zeros(),
            // Numbers that aren't free stay.
            normal_matrix: SMatrix::from_diagonal(&SVector::from_fn(|i, _| {
                f64::from(u8::from(i >= 3 + self.free.len()))
            })),
            extra: (),
        };
        for (px, ray) in self.rays {
            let at = camera.project_ray(&(turn * ray))?;
            let residual = px - at.px;
            let mut by = SMatrix::<f64, 2, UNKNOWNS>::zeros();
            by.fixed_columns_mut::<3>(0).copy_from(&at.jac_rotation);
            for (column, direction) in (3..).zip(self.free) {
                by.set_column(column, &(at.jac_lens * direction));
            }
            linear.cost += residual.norm_squared();
            linear.gradient += by.transpose() * residual;
            linear.normal_matrix += by.transpose() * by;
        }
        linear.cost.is_finite().then_some(linear)
    }

    fn moved(&self, (camera, turn): &Self::State, step: &SVector<f64, UNKNOWNS>) -> Self::State {
        let mut lens = SVector::from(camera.lens_parameters());
        for (number, direction) in step.iter().skip(3).zip(self.free) {
            lens += direction * *number;
        }
        let by = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        (camera.with_lens_parameters(&lens.into()), by * turn)
    }
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Distortion, cell_centres_px, frame::ImageSize};

    use super::*;

    const SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    #[test]
    fn a_turned_camera_is_no_difference() {
        let camera = Camera::pinhole(900.0, SIZE.centre_px());
        let turn = UnitQuaternion::from_euler_angles(0.01, -0.02, 0.03);
        let rays: Vec<_> = Rays::of(&camera, cell_centres_px(SIZE)).0;
        let turned = Rays(rays.into_iter().map(|(px, ray)| (px, turn * ray)).collect());
        let closest = turned.closest_to(&camera, &[]).expect("shared");
        assert!(closest.off_px < 1e-6 && closest.turn.angle_to(&turn.inverse()) < 1e-8);
    }

    #[test]
    fn a_free_number_takes_its_part_of_the_difference() {
        let camera = Camera::pinhole(900.0, SIZE.centre_px());
        let longer = Camera::pinhole(909.0, SIZE.centre_px());
        let rays = Rays::of(&camera, cell_centres_px(SIZE));
        let off_px = rays.closest_to(&longer, &[]).expect("shared").off_px;
        assert!(off_px > 2.0, "{off_px}");
        let mut f = LensDirection::zeros();
        f.fixed_rows_mut::<2>(0).fill(1.0);
        let closest = rays.closest_to(&longer, &[f]).expect("shared");
        assert!(closest.off_px < 1e-6 && (closest.camera.f_px.x - 900.0).abs() < 1e-6);
    }

    #[test]
    fn a_ray_in_a_fold_has_no_image() {
        let camera = Camera::pinhole(900.0, SIZE.centre_px());
        // Folds over 547 px from the middle.
        let distortion = Distortion { k1: -0.9, ..Distortion::default() };
        let rays = Rays::of(&camera, cell_centres_px(SIZE));
        let closest =
            rays.closest_to(&Camera { distortion, ..camera }, &[]).expect("some are seen");
        assert!(closest.off_px.is_infinite() && closest.displaced_px.len() < rays.count());
    }
}
