//! Stated covariance of a fitted point from pixel noise, above a floor.

use nalgebra::{Matrix2, SMatrix, Vector2};

/// Variance of a grey level rounded to a whole number.
pub(super) const ROUNDING_VARIANCE: f64 = 1.0 / 12.0;
/// Floor of the stated error: pixels integrate over their area, and prints are imperfect.
const SIGMA_FLOOR_PX: f64 = 0.004;
/// Side of a block of pixels with correlated errors, by sharpening, the interpolation of colours
/// and compression.
const BLOCK_PX: f64 = 5.0;
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
    half: i32,
}

/// Sums over a block of each derivative times the residual, and of the derivative's square
/// products.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    moves: Vector2<f64>,
    information: Matrix2<f64>,
}

impl Blocks {
    /// Clears all sums, for pixels up to `reach_px` away.
    pub(super) fn clear(&mut self, reach_px: f64) {
        self.half = libm::round(reach_px / BLOCK_PX) as i32;
        let side = 2 * self.half + 1;
        self.sums.clear();
        self.sums.resize((side * side) as usize, Block::default());
    }

    /// Adds a pixel at an offset from the point, with residual and derivative of the brightness by
    /// the position.
    pub(super) fn add(&mut self, offset_px: Vector2<f64>, change: Vector2<f64>, residual: f64) {
        let place =
            |px: f64| (libm::round(px / BLOCK_PX) as i32).clamp(-self.half, self.half) + self.half;
        let at = place(offset_px.y) * (2 * self.half + 1) + place(offset_px.x);
        let block = &mut self.sums[at as usize];
        block.moves += change * residual;
        block.information += change * change.transpose();
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
