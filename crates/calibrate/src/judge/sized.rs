//! A lens for pictures of another size.

use nalgebra::{Point2, Vector2};

use super::GivenLens;
use boresight_geometry::{Camera, frame::ImageSize};

/// Lenses of `given` for `pictures` of another size: scaled, or turned either way. Empty if the
/// shape differs: the pictures are cropped or squeezed, and nothing says how.
pub(super) fn sized(given: &GivenLens, pictures: ImageSize) -> Vec<Camera> {
    let side = |size: ImageSize| [size.width_px, size.height_px].map(f64::from);
    let ([width, height], [to_width, to_height]) = (side(given.image_size), side(pictures));
    let scale = to_width / width;
    if given.image_size == pictures {
        vec![given.camera]
    } else if [to_width, to_height] == [height, width] {
        let quarter = quarter_turned(&given.camera, height);
        let half = quarter_turned(&quarter, width);
        vec![quarter, quarter_turned(&half, height)]
    } else if (to_height - scale * height).abs() <= 1.0 {
        vec![scaled(&given.camera, scale)]
    } else {
        Vec::new()
    }
}

/// Lens of pictures larger by `scale`. Pixels are counted from the centre of the first.
fn scaled(camera: &Camera, scale: f64) -> Camera {
    let half = Vector2::repeat(0.5);
    let pp_px = Point2::from((camera.pp_px.coords + half) * scale - half);
    Camera { f_px: camera.f_px * scale, pp_px, ..*camera }
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
        let [_, turned] = of(720, 1280)[..] else { panic!("turned either way") };
        let seen = turned.px_from_normalized(&Point2::new(-0.2, -0.3));
        assert!((seen - Point2::new(px.y, 1279.0 - px.x)).norm() < 1e-9);
        assert_eq!(of(1280, 960), []);
        let half = of(640, 360)[0];
        assert!((half.pp_px - Point2::new(324.75, 174.75)).norm() < 1e-9);
    }
}
