//! Edges of a reference's patches, for drawing over a live picture.

use nalgebra::Point2;

use crate::{
    patches::{FINE_HALF, FINE_SIDE as SIDE},
    reference::Reference,
    turn::{Lens, Turn},
};

/// Threshold of drawn edges as a share of a patch's steepest slope.
const DRAWN: f32 = 0.5;

impl Reference {
    /// Points along the edges of permanent patches, px, as seen by the camera after turning by
    /// `turn` since this reference. Only patches are stored of a reference, so only they are drawn.
    /// Points outside the lens's field are left out.
    pub fn outline(&self, lens: &Lens, turn: &Turn) -> Vec<Point2<f64>> {
        let rotation = turn.rotation();
        let mut points = Vec::new();
        for landmark in &self.landmarks {
            let Some(centre) = turn.project_by(lens, &rotation, &landmark.ray) else { continue };
            let half = FINE_HALF as f64;
            points.extend(
                edges(landmark.fine.bytes())
                    .into_iter()
                    .map(|[x, y]| Point2::new(centre.x - half + x, centre.y - half + y)),
            );
        }
        points
    }
}

/// Pixels of a patch with the steepest slope across the edge.
fn edges(levels: &[u8]) -> Vec<[f64; 2]> {
    let at = |x: usize, y: usize| f32::from(levels[y * SIDE + x]);
    let mut slopes = [[0.0_f32; 2]; SIDE * SIDE];
    for y in 1..SIDE - 1 {
        for x in 1..SIDE - 1 {
            let across = |dy: usize| at(x + 1, y + dy - 1) - at(x - 1, y + dy - 1);
            let down = |dx: usize| at(x + dx - 1, y + 1) - at(x + dx - 1, y - 1);
            slopes[y * SIDE + x] =
                [across(0) + 2.0 * across(1) + across(2), down(0) + 2.0 * down(1) + down(2)];
        }
    }
    let steep = |x: usize, y: usize| libm::hypotf(slopes[y * SIDE + x][0], slopes[y * SIDE + x][1]);
    let steepest = slopes.iter().map(|[x, y]| libm::hypotf(*x, *y)).fold(0.0, f32::max);
    let mut found = Vec::new();
    for y in 2..SIDE - 2 {
        for x in 2..SIDE - 2 {
            let ([dx, dy], here) = (slopes[y * SIDE + x], steep(x, y));
            let beside = if dx.abs() > dy.abs() {
                [steep(x - 1, y), steep(x + 1, y)]
            } else {
                [steep(x, y - 1), steep(x, y + 1)]
            };
            if here > DRAWN * steepest && here >= beside[0] && here > beside[1] {
                found.push([x as f64, y as f64]);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use image::GrayImage;

    use super::*;
    use crate::level::View;
    use boresight_geometry::{Camera, frame::ImageSize};

    #[test]
    fn the_outline_lies_on_the_edges_and_moves_with_the_camera() {
        // Squares of 24 px: every edge is between columns or rows with a number that is a multiple
        // of 24.
        let grey = GrayImage::from_fn(320, 240, |x, y| {
            image::Luma([if (x / 24 + y / 24) % 2 == 0 { 60 } else { 190 }])
        });
        let size = ImageSize::of(&grey);
        let lens = Lens::new(Camera::pinhole(300.0, size.centre_px()), None, size);
        let reference = Reference::of(&View::of(grey), 0.0, &lens, |_, _| false);
        let away = |v: f64| (v - (v / 24.0).round() * 24.0 + 0.5).abs();
        let still = reference.outline(&lens, &Turn::default());
        assert!(still.len() > 500, "{}", still.len());
        assert!(still.iter().all(|p| away(p.x).min(away(p.y)) <= 1.5));
        let turned = reference.outline(&lens, &Turn { pan_rad: 6.0 / 300.0, ..Turn::default() });
        let moved: f64 =
            turned.iter().zip(&still).map(|(a, b)| a.x - b.x).sum::<f64>() / still.len() as f64;
        assert!((moved - 6.0).abs() < 0.7, "{moved}");
    }
}
