//! Noise of a rig's corners, from the residuals of the joint fit.
//!
//! A camera has a variance in excess of the stated one, or a share of it, from the median residual,
//! which outliers don't move; a picture has a factor, drawn towards 1 by the share of chance in the
//! scatter of the pictures (`docs/method.md`, 2.6).

use nalgebra::{Matrix2, Vector2};

use crate::check::noise_inflation::ALIKE;
use boresight_geometry::Corner;

/// Median of half a χ² with two degrees of freedom.
const MEDIAN: f64 = core::f64::consts::LN_2;
/// Squared distance from which a corner is an outlier, in variances.
const OUTLIER: f64 = 12.0;
/// Pictures from which the noise of each is estimated.
const PICTURES: usize = 3;

/// Residuals of a picture's seen corners with the stated variance: px and px².
pub(super) type Residuals = Vec<(Vector2<f64>, f64)>;

/// Noise of a camera's corners.
#[derive(Clone, Debug)]
pub(super) struct CameraNoise {
    /// Share of the stated variance; below 1 only without an excess.
    share: f64,
    excess_px2: f64,
    /// Factor on the variance of each picture's corners.
    of_pictures: Vec<f64>,
}

impl CameraNoise {
    /// Noise by the residuals of each picture.
    pub(super) fn of(pictures: &[Residuals]) -> Self {
        let ratio = |share: f64, excess_px2: f64| {
            let all = pictures.iter().flatten();
            let mut halves: Vec<f64> = all
                .map(|(px, stated)| 0.5 * px.norm_squared() / (share * stated + excess_px2))
                .collect();
            halves.sort_by(f64::total_cmp);
            halves.get(halves.len() / 2).map_or(1.0, |median| median / MEDIAN)
        };
        let alone = ratio(1.0, 0.0);
        let (share, excess_px2) = if alone <= 1.0 {
            (alone.max(1e-4), 0.0)
        } else {
            // The ratio falls with the excess.
            let largest = pictures.iter().flatten().map(|(px, _)| px.norm_squared());
            let (mut low, mut high) = (0.0, largest.fold(0.0, f64::max));
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                *(if ratio(1.0, middle) > 1.0 { &mut low } else { &mut high }) = middle;
            }
            (1.0, high)
        };
        let logs: Vec<(f64, f64)> = pictures
            .iter()
            .map(|picture| {
                let count = picture.len() as f64;
                let squares = picture.iter().map(|(px, stated)| {
                    (px.norm_squared() / (share * stated + excess_px2)).min(OUTLIER)
                });
                let freedom = (2.0 * count - 6.0).max(4.0);
                let chance = 2.0 / (2.0 * count / ALIKE - 2.0).max(1.0);
                (libm::log((squares.sum::<f64>() / freedom).max(1e-2)), chance)
            })
            .collect();
        Self { share, excess_px2, of_pictures: drawn_together(&logs) }
    }

    /// Corner of a picture with its whole variance.
    pub(super) fn applied(&self, picture: usize, corner: &Corner) -> Corner {
        let more = Matrix2::from_diagonal_element(self.excess_px2);
        let covariance_px2 =
            (corner.covariance_px2 * self.share + more) * self.of_pictures[picture];
        Corner { covariance_px2, common_px: 0.0, ..*corner }
    }
}

/// Factors from the logarithms of variances with their own variance by chance.
fn drawn_together(logs: &[(f64, f64)]) -> Vec<f64> {
    let count = logs.len() as f64;
    if logs.len() < PICTURES {
        return vec![1.0; logs.len()];
    }
    let mean = logs.iter().map(|(log, _)| log).sum::<f64>() / count;
    let scatter = logs.iter().map(|(log, _)| (log - mean).powi(2)).sum::<f64>() / count;
    let chance = logs.iter().map(|(_, chance)| chance).sum::<f64>() / count;
    let differ = (scatter - chance).max(0.0);
    let factor = |(log, chance): &(f64, f64)| match differ {
        0.0 => 1.0,
        differ => libm::exp((log - mean) * differ / (differ + chance)),
    };
    logs.iter().map(factor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals with the distribution of errors of `sd_px` along both axes, in a fixed order.
    fn picture(sd_px: f64, stated_px: f64) -> Residuals {
        (0..50)
            .map(|i| {
                let radius_px = sd_px * (-2.0 * ((f64::from(i) + 0.5) / 50.0).ln()).sqrt();
                let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
                (Vector2::new(cos, sin) * radius_px, stated_px * stated_px)
            })
            .collect()
    }

    #[test]
    fn noise_is_what_the_residuals_show() {
        for (sd_px, stated_px) in [(0.1, 0.02), (0.1, 0.1), (0.02, 0.1)] {
            let pictures = vec![picture(sd_px, stated_px); 6];
            let noise = CameraNoise::of(&pictures);
            let corner = Corner::isotropic(nalgebra::Point2::origin(), stated_px);
            let found = noise.applied(2, &corner).sigma_px();
            assert!((found / sd_px - 1.0).abs() < 0.05, "{sd_px} {stated_px}: {found}");
        }
    }

    #[test]
    fn a_blurred_picture_counts_as_what_it_is() {
        let mut pictures = vec![picture(0.1, 0.02); 8];
        pictures[3] = picture(0.3, 0.02);
        let noise = CameraNoise::of(&pictures);
        assert!(noise.of_pictures[3] > 2.5 * noise.of_pictures[0], "{noise:?}");
    }
}
