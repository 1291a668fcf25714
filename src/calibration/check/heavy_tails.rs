//! Weighs corners down that lie far off, where errors have heavier tails than a normal distribution.
//!
//! The errors are modelled by Student's t distribution (Lange, Little & Taylor 1989): with ν degrees of freedom, a corner
//! that is `d` standard deviations off has the weight `(ν + 2)/(ν + d²)`. How far a corner is off is measured against its
//! neighbours on the board: a lens that the model doesn't describe shifts them together, and must not be hidden by weights.

use nalgebra::Vector2;

use crate::{
    board::Checkerboard,
    calibration::solve::{bundle::Observations, free_homography::FreeHomographies},
    geometry::Corner,
};

/// Degrees of freedom to choose from.
const FREEDOM: [f64; 7] = [2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 12.0];
/// Least gain in −2 log L over normal errors: that of −2 ln of 1 % for one parameter, twice over, and far above chance.
const MIN_GAIN: f64 = 20.0;
/// Steps of the fixed point for the scale; it changes by less than a percent after ten.
const STEPS: usize = 15;

/// Weights of all corners, view by view.
#[derive(Clone, Debug)]
pub(in crate::calibration) struct TailWeights {
    weights: Vec<Vec<f64>>,
    /// Degrees of freedom ν.
    freedom: f64,
}

impl TailWeights {
    /// The weights that the residuals of the free homographies ask for. `None` if normal errors explain them as well.
    pub(in crate::calibration) fn of(
        observations: &Observations,
        free: &FreeHomographies,
        board: &Checkerboard,
    ) -> Option<Self> {
        let residuals = free.residuals_px(observations);
        let corners = observations.board_m().len();
        if residuals.len() != corners * observations.view_count() {
            return None;
        }
        let off: Vec<f64> = residuals
            .chunks(corners)
            .flat_map(|view| {
                let px: Vec<Vector2<f64>> =
                    view.iter().map(|(residual_px, _)| *residual_px).collect();
                let of =
                    |(corner, (residual_px, stated_px2)): (usize, &(_, nalgebra::Matrix2<f64>))| {
                        let alone: Vector2<f64> = residual_px - of_neighbours(&px, corner, board);
                        stated_px2
                            .try_inverse()
                            .map_or(f64::NAN, |i| (alone.transpose() * i * alone).x)
                    };
                view.iter().enumerate().map(of).collect::<Vec<_>>()
            })
            .collect();
        let count = off.len() as f64;
        let mean = off.iter().sum::<f64>() / (2.0 * count);
        if !(mean.is_finite() && mean > 0.0) {
            return None;
        }
        let normal = 2.0 * count * (mean.ln() + 1.0);
        let (cost, freedom, scale) = FREEDOM
            .into_iter()
            .map(|freedom| {
                let scale = scale(&off, freedom, mean);
                let tails: f64 = off.iter().map(|d2| (d2 / (freedom * scale)).ln_1p()).sum();
                (2.0 * count * scale.ln() + (freedom + 2.0) * tails, freedom, scale)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        if normal - cost < MIN_GAIN {
            return None;
        }
        let weights: Vec<f64> = off.iter().map(|d2| weight(*d2, freedom, scale)).collect();
        Some(Self { weights: weights.chunks(corners).map(<[f64]>::to_vec).collect(), freedom })
    }

    /// `views` with the variance of each corner divided by its weight.
    pub(in crate::calibration) fn applied(&self, views: &[Vec<Corner>]) -> Vec<Vec<Corner>> {
        let weigh = |(corner, weight): (&Corner, &f64)| Corner {
            covariance_px2: corner.covariance_px2 / *weight,
            ..*corner
        };
        let view = |(view, weights): (&Vec<Corner>, &Vec<f64>)| {
            view.iter().zip(weights).map(weigh).collect()
        };
        views.iter().zip(&self.weights).map(view).collect()
    }

    /// Variance of an estimate from weighted corners over what their weights say: `(ν + 4)/(ν + 2)`, from the information
    /// of two coordinates with errors by Student's t distribution.
    pub(in crate::calibration) fn variance_factor(&self) -> f64 {
        (self.freedom + 4.0) / (self.freedom + 2.0)
    }
}

fn weight(square: f64, freedom: f64, scale: f64) -> f64 {
    (freedom + 2.0) / (freedom + square / scale)
}

/// Maximum likelihood of the squared scale, `s² = Σ w d² / 2N`.
fn scale(squares: &[f64], freedom: f64, start: f64) -> f64 {
    (0..STEPS).fold(start, |scale, _| {
        let sum: f64 = squares.iter().map(|d2| d2 * weight(*d2, freedom, scale)).sum();
        (sum / (2 * squares.len()) as f64).max(f64::MIN_POSITIVE)
    })
}

/// Median residual of the corners next to `corner` on the board.
fn of_neighbours(px: &[Vector2<f64>], corner: usize, board: &Checkerboard) -> Vector2<f64> {
    let (columns, rows) = (board.columns() as usize, board.rows() as usize);
    let (row, column) = (corner / columns, corner % columns);
    let mut axes = [Vec::with_capacity(8), Vec::with_capacity(8)];
    for r in row.saturating_sub(1)..(row + 2).min(rows) {
        for c in column.saturating_sub(1)..(column + 2).min(columns) {
            if (r, c) != (row, column) {
                let residual_px = px[r * columns + c];
                axes[0].push(residual_px.x);
                axes[1].push(residual_px.y);
            }
        }
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        if values.len() % 2 == 0 {
            0.5 * (values[middle - 1] + values[middle])
        } else {
            values[middle]
        }
    };
    let [x, y] = axes;
    Vector2::new(median(x), median(y))
}
