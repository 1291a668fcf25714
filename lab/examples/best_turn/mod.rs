//! Difference of two cameras, each in the best orientation: the target of a stated bound.

use boresight_geometry::{Camera, cell_centres_px, frame::ImageSize};
use nalgebra::{Matrix3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// Differences of `project` from `camera`, in pixels, at the cells' centres selected by
/// `is_inside`, after the best rotation. `None` if undetermined.
pub(crate) fn differences_px(
    camera: &Camera,
    project: &dyn Fn(&Point3<f64>) -> Option<Point2<f64>>,
    size: ImageSize,
    is_inside: &dyn Fn(&Point2<f64>) -> bool,
) -> Option<Vec<(Point2<f64>, Vector2<f64>)>> {
    let rays: Vec<(Point2<f64>, Vector3<f64>)> = cell_centres_px(size)
        .filter(|px| is_inside(px))
        .filter_map(|px| Some((px, camera.ray_from_px(&px)?)))
        .collect();
    let mut turn = UnitQuaternion::identity();
    let error = |turn: &UnitQuaternion<f64>, px: &Point2<f64>, ray: &Vector3<f64>| {
        project(&Point3::from(turn * ray)).map(|at| at - px)
    };
    for _ in 0..5 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (px, ray) in &rays {
            let Some(off) = error(&turn, px, ray) else { continue };
            let columns = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
                let turned = UnitQuaternion::from_scaled_axis(axis * 1e-6) * turn;
                error(&turned, px, ray).map_or(Vector2::zeros(), |it| (it - off) / 1e-6)
            });
            for i in 0..3 {
                right[i] -= columns[i].dot(&off);
                for j in 0..3 {
                    normal[(i, j)] += columns[i].dot(&columns[j]);
                }
            }
        }
        turn = UnitQuaternion::from_scaled_axis(normal.lu().solve(&right)?) * turn;
    }
    let all = rays.iter().filter_map(|(px, ray)| Some((*px, error(&turn, px, ray)?)));
    Some(all.collect())
}

/// Root mean square a coordinate, as for bounds.
pub(crate) fn rms_px(differences: &[(Point2<f64>, Vector2<f64>)]) -> f64 {
    let squares: f64 = differences.iter().map(|(_, off)| off.norm_squared()).sum();
    (squares / (2 * differences.len().max(1)) as f64).sqrt()
}
