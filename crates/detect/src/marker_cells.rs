//! Reads the cells of a marker in a square of a grid.

use image::GrayImage;

use super::reduce::sample;
use boresight_geometry::markers::Markers;

/// Least difference between the white around a marker and the black frame, in grey levels.
const LEAST_CONTRAST: f32 = 10.0;
/// Reciprocal of the largest share of the frame's cells that may look white.
const FRAME_SHARE: usize = 8;
/// Most cells along a side of a marker, with the frame.
const MOST_CELLS: usize = 10;
/// Added share of a cell's difference from the neighbours: blur as wide as half a cell hides single
/// cells.
const SHARPENING: f32 = 2.0;
/// Sampling places in a cell, in cells from the middle.
const WITHIN_CELL: [[f32; 2]; 5] = [[0.0, 0.0], [-0.2, -0.2], [0.2, -0.2], [0.2, 0.2], [-0.2, 0.2]];
/// Sampling places along a side of the square, in the white around the marker.
const ALONG_SIDE: [f32; 4] = [0.2, 0.4, 0.6, 0.8];

/// Colour of the squares around markers: light (positive), or dark on a board printed white on
/// black.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Polarity {
    Positive,
    Negative,
}

/// White cells of the marker in a square with the corners `quad_px`, clockwise from the first: row
/// by row from the highest bit, without the frame, rows along the first side. In a negative, the
/// black cells.
///
/// `None` if the square isn't white around a black frame, nor black around a white one, or isn't
/// seen whole.
pub(super) fn read_cells(
    image: &GrayImage,
    quad_px: [[f32; 2]; 4],
    markers: Markers,
) -> Option<(Polarity, u64)> {
    let (right, bottom) = (image.width() as f32 - 1.0, image.height() as f32 - 1.0);
    let is_seen = |[x, y]: &[f32; 2]| (0.0..=right).contains(x) && (0.0..=bottom).contains(y);
    if !quad_px.iter().all(is_seen) {
        return None;
    }
    let map = Square::new(quad_px)?;
    let at = |u: f32, v: f32| {
        let [x, y] = map.px(u, v);
        sample(image, x, y)
    };
    let strips = ALONG_SIDE.iter().flat_map(|t| {
        let near = markers.white_at as f32;
        let far = 1.0 - near;
        [(*t, near), (*t, far), (near, *t), (far, *t)]
    });
    let white = strips.map(|(u, v)| at(u, v)).sum::<f32>() / (4 * ALONG_SIDE.len()) as f32;
    let (all, width) = (markers.cells(), markers.frame_cells);
    let (inset, cell_squares) = (markers.inset() as f32, markers.cell_side() as f32);
    let cell = |[column, row]: [usize; 2]| {
        let [u, v] = [column, row].map(|place| inset + cell_squares * (place as f32 + 0.5));
        let values = WITHIN_CELL.map(|[du, dv]| at(u + du * cell_squares, v + dv * cell_squares));
        values.iter().sum::<f32>() / values.len() as f32
    };
    let mut cells = [[0.0; MOST_CELLS]; MOST_CELLS];
    let frame = || {
        (0..width).flat_map(|k| {
            let (first, last) = (k, all - 1 - k);
            let side = first..last;
            side.flat_map(move |k| [[k, first], [last, k], [k + 1, last], [first, k + 1]])
        })
    };
    let in_frame = frame().count();
    let mut dark = 0.0;
    for [column, row] in frame() {
        cells[row][column] = cell([column, row]);
        dark += cells[row][column] / in_frame as f32;
    }
    let middle = 0.5 * (white + dark);
    let polarity = if white > dark { Polarity::Positive } else { Polarity::Negative };
    let is_white = |value: f32| (value > middle) == (polarity == Polarity::Positive);
    let light = frame().filter(|[column, row]| is_white(cells[*row][*column])).count();
    if (white - dark).abs() < LEAST_CONTRAST || light * FRAME_SHARE > in_frame {
        return None;
    }
    let inner = width..all - width;
    let inside = || inner.clone().flat_map(|row| inner.clone().map(move |column| [column, row]));
    for [column, row] in inside() {
        cells[row][column] = cell([column, row]);
    }
    let (mut code, mut has_white) = (0, false);
    for [column, row] in inside() {
        let beside = cells[row][column - 1]
            + cells[row][column + 1]
            + cells[row - 1][column]
            + cells[row + 1][column];
        let value = cells[row][column];
        let sharp = value + SHARPENING * (value - 0.25 * beside);
        code = code << 1 | u64::from(is_white(sharp));
        has_white |= is_white(value);
    }
    // Beside light squares, a dark square looks framed. No marker is all black.
    (code != 0 && has_white).then_some((polarity, code))
}

/// Maps the unit square to a quadrilateral in the picture (Heckbert 1989, section 2.2.3).
struct Square {
    rows: [[f32; 3]; 3],
}

impl Square {
    /// Map to the given quadrilateral; `None` if three corners are in line.
    fn new([p, q, r, s]: [[f32; 2]; 4]) -> Option<Self> {
        let (ax, ay) = (q[0] - r[0], q[1] - r[1]);
        let (bx, by) = (s[0] - r[0], s[1] - r[1]);
        let (cx, cy) = (p[0] - q[0] + r[0] - s[0], p[1] - q[1] + r[1] - s[1]);
        let area = ax * by - bx * ay;
        if area.abs() < 1.0 {
            return None;
        }
        let (g, h) = ((cx * by - bx * cy) / area, (ax * cy - cx * ay) / area);
        let row = |k: usize| [q[k] - p[k] + g * q[k], s[k] - p[k] + h * s[k], p[k]];
        Some(Self { rows: [row(0), row(1), [g, h, 1.0]] })
    }

    fn px(&self, u: f32, v: f32) -> [f32; 2] {
        let [x, y, w] = self.rows.map(|[a, b, c]| a * u + b * v + c);
        [x / w, y / w]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_square_map_to_themselves() {
        let quad = [[10.0, 5.0], [42.0, 9.0], [38.0, 44.0], [7.0, 31.0]];
        let map = Square::new(quad).expect("not in line");
        for (k, (u, v)) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].iter().enumerate() {
            let at = map.px(*u, *v);
            assert!((at[0] - quad[k][0]).hypot(at[1] - quad[k][1]) < 1e-4, "{k}: {at:?}");
        }
        assert!(Square::new([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]).is_none());
    }
}
