//! Estimates the noise of the corners from the residuals.
//!
//! The detector's covariances cover the noise of the picture, but not errors of the print, of the
//! flatness of the board or of the fine shape of the lens. On real boards the latter dominate, and
//! weights from picture noise alone would let the sharpest view decide the result. Blur and motion
//! differ from view to view, too. So the covariance of each corner is taken as `s² vᵢ (C + ρ I)`,
//! with ρ common to all and vᵢ common to a view. Both follow from the residuals of the free
//! homographies, which assume neither a common focal length nor a principal point; s² is estimated
//! by the adjustment (σ₀²).

use nalgebra::{Matrix2, Vector2};

use boresight_geometry::Corner;

/// Least gain in −2 log L for a nonzero ρ: the 0.999 quantile of χ² with 1 degree of freedom.
const MIN_GAIN: f64 = 10.8;
/// Ratio of consecutive trial values of ρ; 10 % accuracy of a standard deviation is plenty for a
/// weight.
const STEP: f64 = 1.2;
/// Number of correlated residuals with the information of a single residual about a view's noise.
pub(crate) const ALIKE: f64 = 4.0;
/// Parameters of a homography.
const HOMOGRAPHY: f64 = 8.0;

/// Residual and stated covariance of a corner, px and px².
pub(crate) type Residual = (Vector2<f64>, Matrix2<f64>);

/// Noise of the corners beyond the stated covariances.
#[derive(Clone, Debug)]
pub(crate) struct CornerNoise {
    /// ρ: variance in px² to add to that of every corner. Zero if the residuals agree with the
    /// stated covariances up to a factor.
    pub(crate) excess_px2: f64,
    /// vᵢ: factor on the covariances of each view's corners, 1 overall.
    pub(crate) of_views: Vec<f64>,
}

impl CornerNoise {
    /// Noise estimated from residuals of free homographies, view by view; a view without residuals
    /// has the noise of all.
    pub(crate) fn of(residuals_px: &[Vec<Residual>]) -> Self {
        let excess_px2 = excess_variance_px2(residuals_px);
        Self { excess_px2, of_views: factors(residuals_px, excess_px2) }
    }

    /// `views` with covariances from the residuals. `None` if unchanged.
    pub(crate) fn applied(&self, views: &[Vec<Corner>]) -> Option<Vec<Vec<Corner>>> {
        if self.excess_px2 == 0.0 && self.of_views.iter().all(|factor| *factor == 1.0) {
            return None;
        }
        let more = Matrix2::from_diagonal_element(self.excess_px2);
        let of_view = |(corners, factor): (&Vec<Corner>, &f64)| {
            let noisy = |corner: &Corner| Corner {
                covariance_px2: (corner.covariance_px2 + more) * *factor,
                ..*corner
            };
            corners.iter().map(noisy).collect()
        };
        Some(views.iter().zip(&self.of_views).map(of_view).collect())
    }
}

/// ρ, by maximum likelihood.
fn excess_variance_px2(residuals_px: &[Vec<Residual>]) -> f64 {
    // Mean squared residual and mean stated variance of each corner.
    let corners: Vec<(f64, f64)> = residuals_px
        .iter()
        .flatten()
        .map(|(residual_px, stated_px2)| {
            (residual_px.norm_squared() / 2.0, stated_px2.trace() / 2.0)
        })
        .filter(|(squared, stated)| squared.is_finite() && *stated > 0.0)
        .collect();
    let Some(least) = corners.iter().map(|(_, stated)| *stated).reduce(f64::min) else {
        return 0.0;
    };
    let most = corners.iter().map(|(squared, _)| *squared).fold(least, f64::max);
    let count = corners.len() as f64;
    // −2 log L of two coordinates per corner at the best s², up to a constant.
    let cost = |rho: f64| {
        let (squares, logs) = corners.iter().fold((0.0, 0.0), |(squares, logs), (q, v)| {
            (squares + q / (v + rho), logs + libm::log(v + rho))
        });
        2.0 * (count * libm::log(squares / count) + logs)
    };
    let mut best = (cost(0.0) - MIN_GAIN, 0.0);
    let mut rho = 0.01 * least;
    while rho <= most {
        let here = cost(rho);
        if here < best.0 {
            best = (here, rho);
        }
        rho *= STEP;
    }
    best.1
}

/// vᵢ: the variances of the views, shrunk towards the common one by the share of chance in their
/// scatter (empirical Bayes on their logarithms, which scatter by `2/freedom`).
fn factors(residuals_px: &[Vec<Residual>], excess_px2: f64) -> Vec<f64> {
    let more = Matrix2::from_diagonal_element(excess_px2);
    let squared = |(residual_px, stated_px2): &Residual| {
        let information = (stated_px2 + more).try_inverse()?;
        Some((residual_px.transpose() * information * residual_px).x)
    };
    // Logarithm of the variance of each view, and the chance variance of that logarithm.
    let views: Vec<Option<(f64, f64)>> = residuals_px
        .iter()
        .map(|view| {
            let freedom = 2.0 * view.len() as f64 - HOMOGRAPHY;
            let squares: f64 = view.iter().filter_map(squared).sum();
            let log = libm::log(squares / freedom);
            (freedom > 0.0 && log.is_finite()).then_some((log, 2.0 * ALIKE / freedom))
        })
        .collect();
    let known = || views.iter().flatten();
    let count = known().count() as f64;
    if count < 2.0 {
        return vec![1.0; views.len()];
    }
    let mean = known().map(|(log, _)| log).sum::<f64>() / count;
    let scatter = known().map(|(log, _)| (log - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let by_chance = known().map(|(_, chance)| chance).sum::<f64>() / count;
    let differ = (scatter - by_chance).max(0.0);
    let factor = |view: &Option<(f64, f64)>| {
        view.map_or(1.0, |(log, chance)| libm::exp((log - mean) * differ / (differ + chance)))
    };
    let factors: Vec<f64> = views.iter().map(factor).collect();
    // The total information stays the same.
    let level = factors.iter().map(|factor| factor.recip()).sum::<f64>() / factors.len() as f64;
    factors.into_iter().map(|factor| factor * level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals of `count` corners per view, alternately up and down by `sd_px` of each view.
    fn residuals(sd_px: &[f64], count: usize) -> Vec<Vec<Residual>> {
        let sign = |corner: usize| if corner.is_multiple_of(2) { 1.0 } else { -1.0 };
        let view = |sd_px: &f64| {
            let of =
                |corner| (Vector2::new(*sd_px, *sd_px) * sign(corner), Matrix2::identity() * 0.01);
            (0..count).map(of).collect()
        };
        sd_px.iter().map(view).collect()
    }

    #[test]
    fn a_blurred_view_counts_as_what_it_is() {
        let noise = CornerNoise {
            excess_px2: 0.0,
            of_views: factors(&residuals(&[0.1, 0.1, 0.1, 0.1, 0.5], 54), 0.0),
        };
        let ratio = noise.of_views[4] / noise.of_views[0];
        assert!((15.0..26.0).contains(&ratio), "{ratio}");
        let information: f64 = noise.of_views.iter().map(|factor| factor.recip()).sum();
        assert!((information - 5.0).abs() < 1e-9);
    }

    #[test]
    fn views_that_differ_by_chance_keep_their_stated_errors() {
        let noise = CornerNoise::of(&residuals(&[0.1, 0.11, 0.09, 0.105, 0.1], 54));
        assert!(noise.of_views.iter().all(|factor| *factor == 1.0), "{noise:?}");
    }

    #[test]
    fn a_view_without_residuals_has_the_noise_of_all() {
        let mut some = residuals(&[0.1, 0.4, 0.1, 0.1], 54);
        some.push(Vec::new());
        assert!(
            (CornerNoise::of(&some).of_views[4] / CornerNoise::of(&some).of_views[0] - 1.0).abs()
                < 1.0
        );
    }
}
