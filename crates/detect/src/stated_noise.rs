//! Stated covariance of a fitted point from pixel noise, above a floor.

use nalgebra::{Matrix2, SMatrix, Vector2};

/// Variance of a grey level rounded to a whole number.
pub(super) const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
/// Floor of the stated error: pixels integrate over their area, and prints are imperfect.
const SIGMA_FLOOR_PX: f64 = 0.004;
/// Reciprocal of the side of a block of pixels with correlated errors, by sharpening, the
/// interpolation of colours and compression.
const BLOCKS_PER_PX: f64 = 0.2;
/// Least degrees of freedom, of a position's two, left to the residuals by the fit: fewer determine
/// no noise.
const LEAST_FREEDOM: f64 = 0.5;

/// Shifts of a point by the surrounding residuals, block by block.
///
/// The shift of a least-squares position is the sum of the residuals, each times the derivative of
/// the brightness by the position. Sums over independent blocks show the variance of the whole sum,
/// for any correlation within a block: the robust variance of clustered data.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Blocks, row by row, with the point in the middle of the middle block.
    sums: Vec<Block>,
    /// Column and row of the block of each offset.
    places: [Vec<usize>; 2],
}

/// Sums over a block of each derivative times the residual, and of the derivative's square
/// products.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    moves: Vector2<f64>,
    information: Matrix2<f64>,
}

impl Blocks {
    /// Variance of white noise with the same effect on a point at the offset `at` as the residuals.
    /// Pixels are at whole offsets `x` and `y` up to `reach_px`, each with the derivative of the
    /// brightness by the point's position, and the residual. `None` if undetermined.
    ///
    /// The models of corners and discs are even about the point. So if a fit `is_even`, a block and
    /// its mirror image are merged: even residuals, such as halos or the blur of a disc, can't move
    /// the point.
    pub(super) fn noise(
        &mut self,
        (at, reach_px): ([f64; 2], i32),
        [x, y, by_x, by_y, residuals]: [&[f32]; 5],
        is_even: bool,
    ) -> Option<f64> {
        let whole = |px: f64| {
            let blocks = px * BLOCKS_PER_PX;
            (blocks + (0.5 - 0.25 * f64::EPSILON).copysign(blocks)) as i32
        };
        let half = whole(f64::from(reach_px) + at[0].abs().max(at[1].abs()));
        let side = 2 * half as usize + 1;
        self.sums.clear();
        self.sums.resize(side * side, Block::default());
        for (places, at) in self.places.iter_mut().zip(at) {
            let place = |px: i32| (whole(f64::from(px) - at) + half) as usize;
            places.clear();
            places.extend((-reach_px..=reach_px).map(place));
        }
        // Neighbours are mostly in one block.
        let (mut last, mut sums) = (0, self.sums[0]);
        let changes = by_x.iter().zip(by_y).zip(residuals);
        for ((x, y), ((by_x, by_y), residual)) in x.iter().zip(y).zip(changes) {
            let place = |axis: usize, px: f32| self.places[axis][(px as i32 + reach_px) as usize];
            let at = place(1, *y) * side + place(0, *x);
            if at != last {
                self.sums[last] = sums;
                (last, sums) = (at, self.sums[at]);
            }
            let change = Vector2::new(f64::from(*by_x), f64::from(*by_y));
            sums.moves += change * f64::from(*residual);
            sums.information += change * change.transpose();
        }
        self.sums[last] = sums;
        let middle = self.sums.len() / 2;
        let blocks = match is_even {
            true => &self.sums[..=middle],
            false => &self.sums[..],
        };
        let blocks = blocks.iter().enumerate().map(|(k, block)| match is_even && k != middle {
            true => {
                let mirrored = &self.sums[self.sums.len() - 1 - k];
                let moves = block.moves + mirrored.moves;
                Block { moves, information: block.information + mirrored.information }
            }
            false => *block,
        });
        let all: Matrix2<f64> = blocks.clone().map(|block| block.information).sum();
        let inverse = all.try_inverse()?;
        // The fit takes from each block the part of its noise that moves the point.
        let (mut seen, mut freedom) = (0.0, 2.0);
        for Block { moves, information } in blocks {
            seen += moves.dot(&(inverse * moves));
            let share = information * inverse;
            freedom -= (share * share).trace();
        }
        (freedom > LEAST_FREEDOM).then(|| seen / freedom)
    }
}

/// Covariance of the first two parameters, a position in pixels, with a floor.
pub(super) fn position_px2<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Matrix2<f64> {
    // A computed inverse is symmetric only up to rounding; a recording stores three numbers.
    let [xx, xy, yy] = [covariance[(0, 0)], covariance[(1, 0)], covariance[(1, 1)]];
    Matrix2::new(xx, xy, xy, yy) + floor_px2()
}

/// Covariance of a position with pixel noise of at least `least`, from `covariance_px2` of pixels
/// with `noise`; the floor stays.
pub(super) fn with_least_noise_px2(
    covariance_px2: Matrix2<f64>,
    noise: f64,
    least: f64,
) -> Matrix2<f64> {
    (covariance_px2 - floor_px2()) * (least / noise).max(1.0) + floor_px2()
}

fn floor_px2() -> Matrix2<f64> {
    Matrix2::from_diagonal_element(SIGMA_FLOOR_PX * SIGMA_FLOOR_PX)
}
