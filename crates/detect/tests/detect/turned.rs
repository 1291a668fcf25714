//! Drawn boards, turned by quarters.

use image::{GrayImage, imageops};
use nalgebra::Point2;

/// `picture` turned clockwise by 0 to 3 `quarters`, and a function from a point of `picture` to
/// the same point there, in pixels.
pub(crate) fn turned(
    picture: &GrayImage,
    quarters: usize,
) -> (GrayImage, impl Fn([f64; 2]) -> Point2<f64>) {
    let turned = (0..quarters).fold(picture.clone(), |picture, _| imageops::rotate90(&picture));
    let (width, height) = (f64::from(picture.width()), f64::from(picture.height()));
    let place = move |[x, y]: [f64; 2]| match quarters {
        0 => Point2::new(x, y),
        1 => Point2::new(height - 1.0 - y, x),
        2 => Point2::new(width - 1.0 - x, height - 1.0 - y),
        _ => Point2::new(y, width - 1.0 - x),
    };
    (turned, place)
}
