//! Downweights outliers where errors have heavier tails than a normal distribution.
//!
//! The errors are modelled by Student's t distribution (Lange, Little & Taylor 1989): with ν
//! degrees of freedom, a corner `d` standard deviations off has the weight `(ν + 2)/(ν + d²)`. The
//! distance is measured relative to the neighbours on the board, because a lens beyond the model
//! shifts neighbours together, and weights must not hide it.

use nalgebra::{Matrix2, Vector2};

use crate::solve::{bundle::Observations, free_homography::RoughHomographies, whitened::Whitened};
use boresight_geometry::{Corner, boards::Board};

/// Candidate degrees of freedom.
const FREEDOM: [f64; 7] = [2.0, 2.5, 3.0, 4.0, 5.0, 7.0, 12.0];
/// Least gain in −2 log L over normal errors: twice −2 ln of 1 % for one parameter, far above
/// chance.
const MIN_GAIN: f64 = 20.0;
/// Fixed-point steps for the scale, which changes by less than a percent after ten.
const STEPS: usize = 15;
/// Weight of an outlier, and the largest share of independent outliers in a view. Errors with three
/// degrees of freedom put 8 % of all corners below this weight.
const LOW_WEIGHT: f64 = 0.3;
const MOST_LOW: f64 = 0.2;

/// Weights of the seen corners, view by view.
#[derive(Clone, Debug)]
pub(crate) struct TailWeights {
    weights: Vec<Vec<f64>>,
    /// Degrees of freedom ν.
    freedom: f64,
}

impl TailWeights {
    /// Weights of the corners by the residuals of the free homographies. `None` if normal errors
    /// explain the residuals as well.
    pub(crate) fn of(
        observations: &Observations,
        free: &RoughHomographies,
        board: &Board,
    ) -> Option<Self> {
        let residuals = free.residuals_px(observations);
        if 2 * residuals.len() != observations.coordinate_count() {
            return None;
        }
        let mut rest = residuals.as_slice();
        let off: Vec<Vec<f64>> = (0..observations.view_count())
            .map(|view| {
                let corners = observations.view(view);
                let (residuals, after) = rest.split_at(corners.len());
                rest = after;
                let mut px = vec![None; board.corner_count()];
                for (corner, (residual_px, _)) in corners.iter().zip(residuals) {
                    px[corner.place] = Some(*residual_px);
                }
                let of = |(corner, (residual_px, stated_px2)): (
                    &Whitened,
                    &(Vector2<f64>, Matrix2<f64>),
                )| {
                    let alone: Vector2<f64> = residual_px - of_neighbours(&px, corner.place, board);
                    stated_px2.try_inverse().map_or(f64::NAN, |i| (alone.transpose() * i * alone).x)
                };
                corners.iter().zip(residuals).map(of).collect()
            })
            .collect();
        let views: Vec<&[f64]> = off.iter().map(Vec::as_slice).collect();
        let tails = Tails::of(views.iter().copied().flatten())?;
        // Dozens of outliers aren't independent: the view is torn, or shows another object.
        let is_whole = |view: &&&[f64]| {
            let low = view.iter().filter(|d2| tails.weight(**d2) < LOW_WEIGHT).count();
            (low as f64) <= MOST_LOW * view.len() as f64
        };
        let tails = Tails::of(views.iter().filter(is_whole).copied().flatten())?;
        let weights = |view: &&[f64]| {
            let is_whole = is_whole(&view);
            view.iter().map(|d2| if is_whole { tails.weight(*d2) } else { 1.0 }).collect()
        };
        Some(Self { weights: views.iter().map(weights).collect(), freedom: tails.freedom })
    }

    /// `views` with the variance of each corner divided by the weight.
    pub(crate) fn applied(&self, views: &[Vec<Corner>]) -> Vec<Vec<Corner>> {
        let weigh = |(corner, weight): (&Corner, &f64)| Corner {
            covariance_px2: corner.covariance_px2 / *weight,
            ..*corner
        };
        let view = |(view, weights): (&Vec<Corner>, &Vec<f64>)| {
            let mut weights = weights.iter();
            let of = |corner: &Corner| {
                let weight = corner.is_seen().then(|| weights.next()).flatten();
                weight.map_or(*corner, |weight| weigh((corner, weight)))
            };
            view.iter().map(of).collect()
        };
        views.iter().zip(&self.weights).map(view).collect()
    }

    /// Ratio of the true variance of an estimate from weighted corners to the variance stated by
    /// the weights: `(ν + 4)/(ν + 2)`, from the information of two coordinates with errors by
    /// Student's t distribution.
    pub(crate) fn variance_factor(&self) -> f64 {
        (self.freedom + 4.0) / (self.freedom + 2.0)
    }
}

/// Student's t distribution of the errors.
#[derive(Clone, Copy, Debug)]
struct Tails {
    freedom: f64,
    /// Squared scale of the residuals.
    scale: f64,
}

impl Tails {
    /// Likeliest distribution for the given squared distances. `None` if a normal one explains them
    /// as well.
    fn of<'a>(squares: impl Iterator<Item = &'a f64>) -> Option<Self> {
        let squares: Vec<f64> = squares.copied().collect();
        let count = squares.len() as f64;
        let mean = squares.iter().sum::<f64>() / (2.0 * count);
        if !(mean.is_finite() && mean > 0.0) {
            return None;
        }
        let normal = 2.0 * count * (libm::log(mean) + 1.0);
        let fit = |freedom: f64| {
            // The maximum-likelihood squared scale is the fixed point s² = Σ w d² / 2N.
            let tails = (0..STEPS).fold(Self { freedom, scale: mean }, |tails, _| {
                let sum: f64 = squares.iter().map(|d2| d2 * tails.weight(*d2)).sum();
                Self { scale: (sum / (2.0 * count)).max(f64::MIN_POSITIVE), ..tails }
            });
            let Self { scale, .. } = tails;
            let logs: f64 = squares.iter().map(|d2| libm::log1p(d2 / (freedom * scale))).sum();
            (2.0 * count * libm::log(scale) + (freedom + 2.0) * logs, tails)
        };
        let (cost, tails) = FREEDOM.into_iter().map(fit).min_by(|a, b| a.0.total_cmp(&b.0))?;
        (normal - cost >= MIN_GAIN).then_some(tails)
    }

    fn weight(&self, square: f64) -> f64 {
        (self.freedom + 2.0) / (self.freedom + square / self.scale)
    }
}

/// Median residual of the seen corners next to `corner` on the board; zero if there are none.
fn of_neighbours(px: &[Option<Vector2<f64>>], corner: usize, board: &Board) -> Vector2<f64> {
    let neighbours = board.target().neighbours(corner);
    let (x, y) = neighbours.into_iter().filter_map(|it| px[it]).map(|px| (px.x, px.y)).unzip();
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        if values.is_empty() {
            0.0
        } else if values.len().is_multiple_of(2) {
            0.5 * (values[middle - 1] + values[middle])
        } else {
            values[middle]
        }
    };
    Vector2::new(median(x), median(y))
}
