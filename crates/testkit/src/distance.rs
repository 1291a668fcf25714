//! Distance of a found camera from the true one.

use boresight_geometry::{Camera, cell_centres_px, frame::ImageSize};
use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

/// Root mean square distance of projection per coordinate over a picture of `image_size`, after the
/// best rotation, in pixels.
pub fn error_px(found: &Camera, truth: &Camera, image_size: ImageSize) -> f64 {
    let rays: Vec<_> = cell_centres_px(image_size)
        .filter_map(|px| Some((px, truth.ray_from_px(&px)?.normalize())))
        .collect();
    let mut turn = UnitQuaternion::identity();
    for _ in 0..20 {
        let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for (px, ray) in &rays {
            let Some(seen) = found.project_ray(&(turn * ray)) else { continue };
            normal += seen.jac_rotation.transpose() * seen.jac_rotation;
            pull += seen.jac_rotation.transpose() * (px - seen.px);
        }
        let step = normal.try_inverse().expect("a turn") * pull;
        turn = UnitQuaternion::from_scaled_axis(step) * turn;
    }
    let squares: f64 = rays
        .iter()
        .map(|(px, ray)| {
            let seen = found.project(&Point3::from(turn * ray)).expect("inside the field");
            (seen - px).norm_squared()
        })
        .sum();
    (squares / (2 * rays.len()) as f64).sqrt()
}
