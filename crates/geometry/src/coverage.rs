//! Coverage of the picture by boards, counted in cells of a grid.

use nalgebra::Point2;

use crate::frame::ImageSize;

/// Columns of the grid over the picture, for coverage and for projection uncertainty.
pub const GRID_COLUMNS: u32 = 12;
/// Rows of the grid.
pub const GRID_ROWS: u32 = 8;

/// The four outermost seen points of a board in a view, in order around the board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardOutline {
    corners_px: [Point2<f64>; 4],
}

impl BoardOutline {
    /// Outline of the seen points, each at a `place`, column and row in any unit: between the
    /// points nearest to the corners of all places. For a flat board in perspective, the outline is
    /// convex, because these points are extreme in four directions of the board.
    ///
    /// `None` if fewer than two are seen, or if one of the four isn't finite.
    pub(crate) fn of_seen(
        corners_px: &[Point2<f64>],
        place: &dyn Fn(usize) -> [f64; 2],
        is_seen: &dyn Fn(usize) -> bool,
    ) -> Option<Self> {
        let seen = || (0..corners_px.len()).filter(|&index| is_seen(index));
        let mut two = seen();
        let (Some(first), Some(_)) = (two.next(), two.next()) else { return None };
        let [right, bottom] = (0..corners_px.len())
            .map(place)
            .fold([0.0_f64; 2], |end, at| std::array::from_fn(|axis| end[axis].max(at[axis])));
        let corners = [[0.0, 0.0], [right, 0.0], [right, bottom], [0.0, bottom]];
        Self::around(corners.map(|corner| {
            let apart = |index: usize| {
                let at = place(index);
                let [across, down] = [0, 1].map(|axis: usize| (at[axis] - corner[axis]).abs());
                [down + across, down.max(across)]
            };
            let nearest = seen().min_by(|a, b| {
                let ([a, a_longer], [b, b_longer]) = (apart(*a), apart(*b));
                a.total_cmp(&b).then(a_longer.total_cmp(&b_longer))
            });
            corners_px[nearest.unwrap_or(first)]
        }))
    }

    /// Outline with the given corners, in order around the board. `None` unless all are finite.
    pub fn around(corners_px: [Point2<f64>; 4]) -> Option<Self> {
        corners_px
            .iter()
            .all(|px| px.x.is_finite() && px.y.is_finite())
            .then_some(Self { corners_px })
    }

    /// Corners in order around the board.
    pub fn corners_px(&self) -> &[Point2<f64>; 4] {
        &self.corners_px
    }

    /// True if `px` lies inside the outline or at most `reach_px` pixels outside.
    pub fn reaches(&self, px: &Point2<f64>, reach_px: f64) -> bool {
        self.covers(px)
            || (0..4).any(|i| {
                let (from, to) = (self.corners_px[i], self.corners_px[(i + 1) % 4]);
                let side = to - from;
                let share = ((px - from).dot(&side) / side.norm_squared()).clamp(0.0, 1.0);
                (px - (from + side * share)).norm() <= reach_px
            })
    }

    /// True if `px` lies inside the outline, a convex quadrilateral of either orientation.
    pub fn covers(&self, px: &Point2<f64>) -> bool {
        let sides = (0..4).map(|i| {
            let (from, to) = (self.corners_px[i], self.corners_px[(i + 1) % 4]);
            (to - from).perp(&(px - from))
        });
        sides.clone().all(|side| side >= 0.0) || sides.clone().all(|side| side <= 0.0)
    }
}

/// Fraction of the grid's cells with centres covered by `outlines`, 0 to 1.
pub fn coverage(outlines: &[BoardOutline], image_size: ImageSize) -> f64 {
    let covered = cell_centres_px(image_size)
        .filter(|px| outlines.iter().any(|outline| outline.covers(px)))
        .count();
    covered as f64 / f64::from(GRID_COLUMNS * GRID_ROWS)
}

/// Columns and rows of cells in a corner of the picture.
const CORNER_CELLS: (u32, u32) = (3, 2);
/// Share of a corner's cells below which the corner counts as open.
const HARDLY: f64 = 0.34;

/// Share of the cells in each corner of the picture covered by `outlines`, 0 to 1: top left, top
/// right, bottom right, bottom left.
pub fn corner_coverage(outlines: &[BoardOutline], image_size: ImageSize) -> [f64; 4] {
    let (columns, rows) = CORNER_CELLS;
    let (right, bottom) = (GRID_COLUMNS - columns, GRID_ROWS - rows);
    [(0, 0), (right, 0), (right, bottom), (0, bottom)].map(|(left, top)| {
        let cells = (top..top + rows)
            .flat_map(|row| (left..left + columns).map(move |column| (column, row)));
        let covered = cells.filter(|(column, row)| {
            let centre_px = cell_centre_px(image_size, *column, *row);
            outlines.iter().any(|outline| outline.covers(&centre_px))
        });
        covered.count() as f64 / f64::from(columns * rows)
    })
}

/// Corners of the picture hardly reached by `outlines`, with less than about a third of the cells
/// covered. In the order of [`corner_coverage`].
pub fn open_corners(outlines: &[BoardOutline], image_size: ImageSize) -> [bool; 4] {
    corner_coverage(outlines, image_size).map(|share| share < HARDLY)
}

/// Pixels at the centres of the grid's cells, row by row.
pub fn cell_centres_px(image_size: ImageSize) -> impl Iterator<Item = Point2<f64>> {
    (0..GRID_ROWS)
        .flat_map(|row| (0..GRID_COLUMNS).map(move |column| (column, row)))
        .map(move |(column, row)| cell_centre_px(image_size, column, row))
}

/// Pixel at the centre of a cell of the grid.
pub(crate) fn cell_centre_px(image_size: ImageSize, column: u32, row: u32) -> Point2<f64> {
    let along = |cell: u32, cells: u32, size: u32| {
        (f64::from(cell) + 0.5) / f64::from(cells) * f64::from(size) - 0.5
    };
    Point2::new(
        along(column, GRID_COLUMNS, image_size.width_px),
        along(row, GRID_ROWS, image_size.height_px),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_over_the_left_half_covers_half() {
        let view: Vec<Point2<f64>> = (0..9)
            .map(|i| Point2::new(300.0 * f64::from(i % 3), 400.0 * f64::from(i / 3)))
            .collect();
        let size = ImageSize { width_px: 1200, height_px: 800 };
        let place = |index: usize| [(index % 3) as f64, (index / 3) as f64];
        let outline = BoardOutline::of_seen(&view, &place, &|_| true).expect("three rows of three");
        assert!((coverage(&[outline], size) - 0.5).abs() < 1e-12);
        assert!(coverage(&[], size).abs() < 1e-12);
        assert_eq!(open_corners(&[outline], size), [false, true, true, false]);
        assert_eq!(corner_coverage(&[outline], size), [1.0, 0.0, 0.0, 1.0]);
        let part = BoardOutline::of_seen(&view, &place, &|index| [0, 1, 3, 4, 6].contains(&index));
        assert_eq!(part, BoardOutline::around([view[0], view[1], view[4], view[6]]));
        assert_eq!(BoardOutline::of_seen(&view, &place, &|index| index == 4), None);
    }
}
