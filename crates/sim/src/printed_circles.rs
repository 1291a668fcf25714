//! The circles of a printed circle grid.

use boresight_geometry::{
    boards::Board,
    boards::{Circles, Target},
};

/// Circles of a printed grid, in row distances from the upper left corner of the pattern.
#[derive(Clone, Debug)]
pub(super) struct PrintedCircles {
    /// Circles in a row, and rows.
    grid: [f32; 2],
    /// Distance between circles in a row.
    step: f32,
}

const RADIUS: f32 = 0.5 * Circles::DIAMETER as f32;

impl PrintedCircles {
    pub(super) fn new(board: &Board) -> Option<Self> {
        let Board::Circles(circles) = board else { return None };
        let grid = circles.grid().map(|count| count as f32);
        Some(Self { grid, step: circles.step() as f32 })
    }

    /// Distance of a position from the nearest circle's outline; negative inside.
    fn distance(&self, u: f32, v: f32) -> f32 {
        let (x, y) = (u - RADIUS, v - RADIUS);
        let near = y.floor();
        let of_row = |row: f32| {
            let row = row.clamp(0.0, self.grid[1] - 1.0);
            let shift = row % self.step;
            let column = ((x - shift) / self.step).round().clamp(0.0, self.grid[0] - 1.0);
            libm::hypotf(x - shift - self.step * column, y - row)
        };
        of_row(near).min(of_row(near + 1.0)) - RADIUS
    }

    pub(super) fn is_black(&self, u: f32, v: f32) -> bool {
        self.distance(u, v) < 0.0
    }

    /// True if an outline may pass within `du`, `dv` of a position.
    pub(super) fn is_edge_near(&self, u: f32, v: f32, du: f32, dv: f32) -> bool {
        self.distance(u, v).abs() <= libm::hypotf(du, dv)
    }
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{
        boards::{Pattern, Shape},
        markers::CircleRows,
    };

    use super::*;

    #[test]
    fn what_is_printed_are_the_dark_discs_of_the_board() {
        for rows in CircleRows::ALL {
            let plain = Board::new(4, 5, 0.02).expect("valid");
            let board = plain.drawn_with(Pattern::Circles(rows));
            let (target, printed) = (board.target(), PrintedCircles::new(&board).expect("circles"));
            let (discs, size_m) = (target.dark_shapes().large, target.size_m());
            let mut black = 0;
            for step in 0..20_000 {
                let share = [0.618_033_9, 0.754_877_7].map(|k| (f64::from(step) * k).fract());
                let at_m: [f64; 2] = std::array::from_fn(|k| (share[k] - 0.5) * size_m[k]);
                let [u, v] = [0, 1].map(|k| (share[k] * size_m[k] / 0.02) as f32);
                let is_in = |shape: &Shape| match shape {
                    Shape::Disc { centre_m, radius_m } => {
                        libm::hypot(at_m[0] - centre_m[0], at_m[1] - centre_m[1]) < *radius_m
                    }
                    Shape::Rectangle { .. } => false,
                };
                let is_black = discs.iter().any(is_in);
                black += u32::from(is_black);
                let is_near = printed.is_edge_near(u, v, 1e-4, 1e-4);
                assert!(is_near || printed.is_black(u, v) == is_black, "{u} {v}");
            }
            assert!((2_000..6_000).contains(&black), "{black}");
        }
    }
}
