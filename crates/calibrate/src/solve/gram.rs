//! Sums of products of the columns of a tall matrix, the parts of normal equations.

use boresight_geometry::simd::{Loop, widest};
use nalgebra::{SMatrix, SVector};

use super::schur_lm::ViewBlock;

/// Columns per register tile.
pub const TILE: usize = 4;

/// Rows that stay in the processor's nearest cache during multiplication.
const CACHED: usize = 64;

type Tile = [[f64; TILE]; TILE];

/// Row of `4 T` columns.
#[derive(Clone, Copy, Debug)]
pub struct Row<const T: usize>([[f64; TILE]; T]);

impl<const T: usize> Row<T> {
    /// Row of zeros.
    pub fn zeros() -> Self {
        Self([[0.0; TILE]; T])
    }

    /// Adds `factor` times another row.
    #[inline(always)]
    pub(crate) fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (tile, other) in self.0.iter_mut().zip(&other.0) {
            tile.iter_mut().zip(other).for_each(|(value, other)| *value += factor * other);
        }
    }

    #[inline(always)]
    pub(crate) fn scale(&mut self, factor: f64) {
        self.0.as_flattened_mut().iter_mut().for_each(|value| *value *= factor);
    }

    pub(crate) fn at(&self, column: usize) -> f64 {
        self.0[column / TILE][column % TILE]
    }

    /// Sets the value of a column.
    pub fn set(&mut self, column: usize, value: f64) {
        self.0[column / TILE][column % TILE] = value;
    }
}

/// `Σ rowᵀ row`.
#[derive(Clone, Debug)]
pub struct Gram<const T: usize> {
    /// Tiles on and above the diagonal.
    tiles: [[Tile; T]; T],
}

impl<const T: usize> Gram<T> {
    /// Sums the products of `rows`, in order.
    pub fn of(rows: &[Row<T>]) -> Self {
        Self { tiles: widest(Products(rows)) }
    }

    /// Sum of the products of two columns.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.min(j), i.max(j));
        self.tiles[i / TILE][j / TILE][i % TILE][j % TILE]
    }

    /// Normal equations and cost of a view, from columns for the shared parameters, the view's own
    /// parameters, and the residual.
    pub(crate) fn split<const S: usize, const L: usize>(&self) -> (f64, ViewBlock<S, L>) {
        let residual = S + L;
        let block = ViewBlock {
            shared: SMatrix::from_fn(|i, j| self.at(i, j)),
            shared_gradient: SVector::from_fn(|i, _| self.at(i, residual)),
            cross: SMatrix::from_fn(|i, j| self.at(i, S + j)),
            local: SMatrix::from_fn(|i, j| self.at(S + i, S + j)),
            gradient: SVector::from_fn(|i, _| self.at(S + i, residual)),
        };
        (self.at(residual, residual), block)
    }
}

struct Products<'a, const T: usize>(&'a [Row<T>]);

impl<const T: usize> Loop for Products<'_, T> {
    type Output = [[Tile; T]; T];

    #[inline(always)]
    fn run(self) -> Self::Output {
        let mut tiles = [[[[0.0; TILE]; TILE]; T]; T];
        for rows in self.0.chunks(CACHED) {
            for (i, tiles) in tiles.iter_mut().enumerate() {
                for (j, sums) in tiles.iter_mut().enumerate().skip(i) {
                    *sums = with_products(*sums, rows, i, j);
                }
            }
        }
        tiles
    }
}

/// Adds the products of two groups of columns to `sums`.
#[inline(always)]
fn with_products<const T: usize>(mut sums: Tile, rows: &[Row<T>], i: usize, j: usize) -> Tile {
    for row in rows {
        let (first, second) = (&row.0[i], &row.0[j]);
        for (sums, first) in sums.iter_mut().zip(first) {
            for (sum, second) in sums.iter_mut().zip(second) {
                *sum += first * second;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_columns() {
        let value = |row: usize, column: usize| ((3 * row + 5 * column) % 11) as f64 - 4.0;
        let count = CACHED + 7;
        let rows: Vec<Row<3>> = (0..count)
            .map(|row| {
                let mut all = Row::zeros();
                (0..12).for_each(|column| all.set(column, value(row, column)));
                all
            })
            .collect();
        let gram = Gram::of(&rows);
        for i in 0..12 {
            for j in 0..12 {
                let sum: f64 = (0..count).map(|row| value(row, i) * value(row, j)).sum();
                assert_eq!(gram.at(i, j), sum);
            }
        }
        let (cost, block) = gram.split::<5, 6>();
        assert_eq!(cost, gram.at(11, 11));
        assert_eq!(block.shared[(4, 1)], gram.at(4, 1));
        assert_eq!(block.cross[(2, 3)], gram.at(2, 8));
        assert_eq!(block.local[(1, 5)], gram.at(6, 10));
        assert_eq!(block.shared_gradient[3], gram.at(3, 11));
        assert_eq!(block.gradient[3], gram.at(8, 11));
    }
}
