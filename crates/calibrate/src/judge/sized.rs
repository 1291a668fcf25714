//! A lens for pictures of another size.

use nalgebra::{Point2, Vector2};

use super::GivenLens;
use boresight_geometry::{Camera, frame::ImageSize};

/// How pictures of another size come from those of a calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resized {
    /// Turned by 90° either way.
    Turned,
    /// Scaled to this share of their size.
    Scaled(f64),
    /// Cut from the middle, scaled to this share of their size.
    Cut(f64),
    /// Squeezed to another shape.
    Squeezed,
}

impl Resized {
    /// True if nothing in the sizes says so: other shapes have several explanations.
    pub(super) fn is_guess(self) -> bool {
        matches!(self, Self::Cut(_) | Self::Squeezed)
    }
}

/// Lenses of `given` for `pictures`, each with how those come from pictures of another size.
pub(super) fn sized(given: &GivenLens, pictures: ImageSize) -> Vec<(Option<Resized>, Camera)> {
    let sides = |size: ImageSize| Vector2::new(size.width_px, size.height_px).map(f64::from);
    let (from, to) = (sides(given.image_size), sides(pictures));
    let scale = to.component_div(&from);
    let scaled = |scale: Vector2<f64>| cut(&given.camera, scale, [from, to]);
    if from == to {
        vec![(None, given.camera)]
    } else if from == to.yx() {
        let quarter = quarter_turned(&given.camera, from.y);
        let three = quarter_turned(&quarter_turned(&quarter, from.x), from.y);
        [quarter, three].map(|camera| (Some(Resized::Turned), camera)).into()
    } else if (to.y - scale.x * from.y).abs() <= 1.0 {
        vec![(Some(Resized::Scaled(scale.x)), scaled(Vector2::repeat(scale.x)))]
    } else {
        let cuts = [scale.max(), 1.0];
        let cuts = cuts.map(|by| (Some(Resized::Cut(by)), scaled(Vector2::repeat(by))));
        [(Some(Resized::Squeezed), scaled(scale))].into_iter().chain(cuts).collect()
    }
}

/// Lens of pictures of the sides `to`, the middle of pictures of the sides `from` after scaling.
/// Pixels are counted from the centre of the first.
fn cut(camera: &Camera, scale: Vector2<f64>, [from, to]: [Vector2<f64>; 2]) -> Camera {
    let half = Vector2::repeat(0.5);
    let corner = (to - from.component_mul(&scale)) / 2.0;
    let pp_px = Point2::from((camera.pp_px.coords + half).component_mul(&scale) - half + corner);
    Camera { f_px: camera.f_px.component_mul(&scale), pp_px, ..*camera }
}

/// Lens of pictures turned clockwise by 90°, from pictures of `height_px`.
fn quarter_turned(camera: &Camera, height_px: f64) -> Camera {
    let mut turned = *camera;
    turned.f_px = camera.f_px.yx();
    turned.pp_px = Point2::new(height_px - 1.0 - camera.pp_px.y, camera.pp_px.x);
    // (p2, p1) turns as an arrow in the picture.
    (turned.distortion.p1, turned.distortion.p2) = (camera.distortion.p2, -camera.distortion.p1);
    turned
}

#[cfg(test)]
mod tests {
    use boresight_geometry::Distortion;

    use super::*;

    #[test]
    fn a_turned_picture_shows_the_same_rays() {
        let size = ImageSize { width_px: 1280, height_px: 720 };
        let distortion = Distortion { k1: -0.2, p1: 0.003, p2: -0.001, ..Distortion::default() };
        let camera = Camera {
            f_px: Vector2::new(900.0, 910.0),
            distortion,
            ..Camera::pinhole(900.0, Point2::new(650.0, 350.0))
        };
        let point = Point2::new(0.3, -0.2);
        let px = camera.px_from_normalized(&point);
        let turned = quarter_turned(&camera, 720.0);
        let seen = turned.px_from_normalized(&Point2::new(0.2, 0.3));
        assert!((seen - Point2::new(719.0 - px.y, px.x)).norm() < 1e-9);
        let given = GivenLens { camera, image_size: size };
        let of = |width_px, height_px| sized(&given, ImageSize { width_px, height_px });
        let [_, (_, turned)] = of(720, 1280)[..] else { panic!("turned either way") };
        let seen = turned.px_from_normalized(&Point2::new(-0.2, -0.3));
        assert!((seen - Point2::new(px.y, 1279.0 - px.x)).norm() < 1e-9);
        let (how, half) = of(640, 360)[0];
        assert!((half.pp_px - Point2::new(324.75, 174.75)).norm() < 1e-9);
        assert_eq!(how, Some(Resized::Scaled(0.5)));
    }
    #[test]
    fn pictures_of_another_shape_are_squeezed_or_cut_from_the_middle() {
        let size = ImageSize { width_px: 1600, height_px: 1200 };
        let given =
            GivenLens { camera: Camera::pinhole(1200.0, size.centre_px()), image_size: size };
        let pictures = ImageSize { width_px: 1280, height_px: 720 };
        let found: Vec<_> = sized(&given, pictures)
            .into_iter()
            .map(|(how, camera)| (how.expect("resized"), camera.f_px.x, camera.f_px.y))
            .collect();
        let expected = [
            (Resized::Squeezed, 960.0, 720.0),
            (Resized::Cut(0.8), 960.0, 960.0),
            (Resized::Cut(1.0), 1200.0, 1200.0),
        ];
        assert_eq!(found, expected);
        let middle =
            |(_, camera): &(_, Camera)| (camera.pp_px - pictures.centre_px()).norm() < 1e-9;
        assert!(sized(&given, pictures).iter().all(middle));
    }
}
