use nalgebra::Point2;

use super::uncertainty::{GRID_COLUMNS, GRID_ROWS, cell_centre_px};
use crate::frame::ImageSize;
use crate::geometry::Corner;

/// Share of the picture's grid cells whose centre lies on a board in some view.
pub(super) fn coverage(
    views: &[Vec<Corner>],
    board_m: &[Point2<f64>],
    image_size: ImageSize,
) -> f64 {
    let outlines: Vec<[Point2<f64>; 4]> =
        views.iter().filter_map(|corners| outline(corners, board_m)).collect();
    let covered = (0..GRID_ROWS)
        .flat_map(|row| (0..GRID_COLUMNS).map(move |column| (column, row)))
        .map(|(column, row)| cell_centre_px(image_size, column, row))
        .filter(|px| outlines.iter().any(|outline| is_inside(px, outline)))
        .count();
    covered as f64 / f64::from(GRID_COLUMNS * GRID_ROWS)
}

/// The board's outermost inner corners, in order around it.
fn outline(corners: &[Corner], board_m: &[Point2<f64>]) -> Option<[Point2<f64>; 4]> {
    // Corners are numbered row by row, centred: the first row ends at the mirror image of its start.
    let columns = 1 + board_m.iter().position(|p| p.x >= -board_m[0].x - 1e-12)?;
    let last = corners.len().checked_sub(1)?;
    let at = |index: usize| corners.get(index).map(|corner| corner.px);
    Some([at(0)?, at(columns - 1)?, at(last)?, at((last + 1).checked_sub(columns)?)?])
}

/// Whether `px` lies in the convex quadrilateral `outline`, either way round.
fn is_inside(px: &Point2<f64>, outline: &[Point2<f64>; 4]) -> bool {
    let sides = (0..4).map(|i| {
        let (from, to) = (outline[i], outline[(i + 1) % 4]);
        (to - from).perp(&(px - from))
    });
    sides.clone().all(|side| side >= 0.0) || sides.clone().all(|side| side <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_over_the_left_half_covers_half() {
        let board_m: Vec<Point2<f64>> =
            (0..9).map(|i| Point2::new(f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0)).collect();
        let view: Vec<Corner> = board_m
            .iter()
            .map(|p| Point2::new(300.0 * (p.x + 1.0), 400.0 * (p.y + 1.0)))
            .map(|px| Corner::isotropic(px, 0.1))
            .collect();
        let size = ImageSize { width_px: 1200, height_px: 800 };
        assert!((coverage(&[view], &board_m, size) - 0.5).abs() < 1e-12);
        assert!(coverage(&[], &board_m, size).abs() < 1e-12);
    }
}
