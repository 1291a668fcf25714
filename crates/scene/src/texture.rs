//! Sharpness and contrast of a patch.

use image::GrayImage;

use crate::patches::{FINE_HALF, FINE_SIDE as SIDE, square};

/// Texture of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Logarithm of the share of fine detail.
    pub sharpness: f64,
    /// Logarithm of the contrast.
    pub contrast: f64,
}

impl Texture {
    /// Texture of the patch around a pixel; `None` at the picture's edge.
    ///
    /// Fine detail is taken 2 px apart, after a little blur: noise and JPEG's blocks are weaker
    /// there.
    pub fn at(grey: &GrayImage, px: [i64; 2]) -> Option<Self> {
        /// Gaussian of σ 0.8 px.
        const BLUR: [f32; 5] = [0.021_927, 0.228_51, 0.499_126, 0.228_51, 0.021_927];
        let levels = square(grey, px, FINE_HALF)?;
        let mut across = [0.0_f32; SIDE * SIDE];
        let mut row = [0.0_f32; SIDE + 4];
        for y in 0..SIDE {
            let from = &levels[y * SIDE..][..SIDE];
            for (x, to) in row.iter_mut().enumerate() {
                *to = f32::from(from[x.saturating_sub(2).min(SIDE - 1)]);
            }
            for (x, to) in across[y * SIDE..][..SIDE].iter_mut().enumerate() {
                *to = BLUR.iter().zip(&row[x..]).map(|(weight, v)| weight * v).sum();
            }
        }
        let mut soft = [0.0_f32; SIDE * SIDE];
        for y in 0..SIDE {
            for (k, weight) in BLUR.iter().enumerate() {
                let from = &across[(y + k).saturating_sub(2).min(SIDE - 1) * SIDE..][..SIDE];
                for (to, v) in soft[y * SIDE..][..SIDE].iter_mut().zip(from) {
                    *to += weight * v;
                }
            }
        }
        let count = (SIDE * (SIDE - 2)) as f32;
        let (mut along_x, mut along_y) = (0.0_f32, 0.0_f32);
        for y in 0..SIDE {
            for x in 0..SIDE - 2 {
                along_x += (soft[y * SIDE + x + 2] - soft[y * SIDE + x]).powi(2);
                along_y += (soft[(x + 2) * SIDE + y] - soft[x * SIDE + y]).powi(2);
            }
        }
        let mean = soft.iter().sum::<f32>() / soft.len() as f32;
        let variance = soft.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / soft.len() as f32;
        let fine = f64::from((along_x + along_y) / count) + 1e-3;
        let all = f64::from(variance) + 1.0;
        Some(Self { sharpness: libm::log(fine / all), contrast: 0.5 * libm::log(all) })
    }
}
