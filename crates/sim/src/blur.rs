//! Gaussian blur of a part of a floating-point picture.

/// Half of a symmetric kernel: central weight, then the weight of each distance.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    weights: Vec<f32>,
}

/// Columns and rows `[x0, x1) × [y0, y1)` of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Region {
    pub(super) x0: usize,
    pub(super) x1: usize,
    pub(super) y0: usize,
    pub(super) y1: usize,
}

impl Kernel {
    /// Sampled Gaussian with weights of exactly the given variance, in px².
    ///
    /// Sampling a Gaussian narrower than a pixel loses variance, so the width is found by
    /// bisection.
    pub(super) fn with_variance(variance: f64) -> Self {
        if variance.is_nan() || variance <= 1e-6 {
            return Self { weights: vec![1.0] };
        }
        let (mut narrow, mut wide) = (0.01_f64, 2.0 + 2.0 * variance.sqrt());
        for _ in 0..60 {
            let middle = 0.5 * (narrow + wide);
            if variance_of(&sampled(middle)) < variance { narrow = middle } else { wide = middle }
        }
        Self { weights: sampled(wide).iter().map(|weight| *weight as f32).collect() }
    }

    /// Farthest pixel with a weight.
    pub(super) fn radius(&self) -> usize {
        self.weights.len() - 1
    }

    /// Blurs along rows: `into[i]` from `from[i ..= i + 2 radius]`.
    pub(super) fn along_row(&self, from: &[f32], into: &mut [f32]) {
        let (radius, count) = (self.radius(), into.len());
        for (value, middle) in into.iter_mut().zip(&from[radius..radius + count]) {
            *value = self.weights[0] * middle;
        }
        for (distance, weight) in self.weights.iter().enumerate().skip(1) {
            let before = &from[radius - distance..radius - distance + count];
            let after = &from[radius + distance..radius + distance + count];
            for ((value, a), b) in into.iter_mut().zip(before).zip(after) {
                *value += weight * (a + b);
            }
        }
    }

    /// Blurs across rows: a single row, columns `[x0, x1)`, of a picture with rows `stride` long.
    pub(super) fn across_rows(
        &self,
        from: &[f32],
        stride: usize,
        (row, x0): (usize, usize),
        into: &mut [f32],
    ) {
        let count = into.len();
        let line = |row: usize| &from[row * stride + x0..row * stride + x0 + count];
        for (value, middle) in into.iter_mut().zip(line(row)) {
            *value = self.weights[0] * middle;
        }
        for (distance, weight) in self.weights.iter().enumerate().skip(1) {
            for ((value, a), b) in
                into.iter_mut().zip(line(row - distance)).zip(line(row + distance))
            {
                *value += weight * (a + b);
            }
        }
    }
}

fn sampled(sigma: f64) -> Vec<f64> {
    let radius = (3.7 * sigma).ceil().max(1.0) as u32;
    let raw: Vec<f64> = (0..=radius)
        .map(|distance| libm::exp(-0.5 * (f64::from(distance) / sigma).powi(2)))
        .collect();
    let total = 2.0 * raw.iter().sum::<f64>() - raw[0];
    raw.iter().map(|weight| weight / total).collect()
}

fn variance_of(weights: &[f64]) -> f64 {
    weights.iter().enumerate().map(|(i, weight)| 2.0 * weight * (i * i) as f64).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_has_its_variance_and_sums_to_one() {
        for variance in [0.05, 0.17, 0.4, 0.9, 2.0] {
            let kernel = Kernel::with_variance(variance);
            let weights: Vec<f64> = kernel.weights.iter().map(|w| f64::from(*w)).collect();
            assert!((2.0 * weights.iter().sum::<f64>() - weights[0] - 1.0).abs() < 1e-6);
            assert!((variance_of(&weights) - variance).abs() < 1e-4 * (1.0 + variance));
        }
    }
}
