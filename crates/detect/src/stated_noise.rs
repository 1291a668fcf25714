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
    side: usize,
}

/// Sums over a block of each derivative times the residual, and of the derivative's square
/// products.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    moves: Vector2<f64>,
    information: Matrix2<f64>,
}

impl Blocks {
    /// Clears all sums, for pixels up to `reach_px` away. Returns the map from an offset from the
    /// point to the column or row of a block.
    pub(super) fn clear(&mut self, reach_px: f64) -> impl Fn(f64) -> usize + use<> {
        let whole = |px: f64| {
            let blocks = px * BLOCKS_PER_PX;
            (blocks + (0.5 - 0.25 * f64::EPSILON).copysign(blocks)) as i32
        };
        let half = whole(reach_px);
        self.side = 2 * half as usize + 1;
        self.sums.clear();
        self.sums.resize(self.side * self.side, Block::default());
        move |offset_px| (whole(offset_px).clamp(-half, half) + half) as usize
    }

    /// Adds pixels, each with column and row of a block, residual, and derivative of the brightness
    /// by the position.
    pub(super) fn add(&mut self, pixels: impl Iterator<Item = ([usize; 2], Vector2<f64>, f64)>) {
        // Neighbours are mostly in one block.
        let (mut last, mut sums) = (0, self.sums[0]);
        for ([column, row], change, residual) in pixels {
            let at = row * self.side + column;
            if at != last {
                self.sums[last] = sums;
                (last, sums) = (at, self.sums[at]);
            }
            sums.moves += change * residual;
            sums.information += change * change.transpose();
        }
        self.sums[last] = sums;
    }

    /// Variance of white noise with the same effect on the point as the residuals. `None` if
    /// undetermined.
    ///
    /// The models of corners and discs are even about the point. So if a fit `is_even`, a block and
    /// its mirror image are merged: even residuals, such as halos or the blur of a disc, can't move
    /// the point.
    pub(super) fn noise(&self, is_even: bool) -> Option<f64> {
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
