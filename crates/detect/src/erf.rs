//! Single-precision `erf` and `exp`, by plain operations that vectorise.

/// `erf(x)` to 3e-7 and `exp(−x²)`. Abramowitz & Stegun 7.1.26.
#[inline(always)]
pub(super) fn erf(x: f32) -> (f32, f32) {
    let size = x.abs();
    let bell = exp_negative(-(size * size));
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let series = t
        * (0.254_829_6
            + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4))));
    ((1.0 - series * bell).copysign(x), bell)
}

/// `exp(x)` for `x <= 0`, to a relative error of 2e-7.
#[inline(always)]
fn exp_negative(x: f32) -> f32 {
    // Adding 1.5·2²³ rounds to an integer and leaves it in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    let x = x.max(-80.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    // ln 2 in two parts, so that the remainder is exact.
    let rest = (x - whole * 0.693_359_4) + whole * 2.121_944_4e-4;
    let series = 1.0
        + rest
            * (1.0
                + rest
                    * (0.5
                        + rest
                            * (0.166_666_55
                                + rest
                                    * (0.041_665_795
                                        + rest * (0.008_333_452 + rest * 0.001_398_2)))));
    f32::from_bits((shifted.to_bits() << 23).wrapping_add(series.to_bits()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn erf_and_its_bell_are_right_to_single_precision() {
        for k in -60..=60 {
            let x = f64::from(k) * 0.1;
            let (value, bell) = erf(x as f32);
            assert!((f64::from(value) - statrs::function::erf::erf(x)).abs() < 1e-6, "erf({x})");
            assert!((f64::from(bell) - (-x * x).exp()).abs() < 3e-7, "exp(-{x}^2)");
        }
    }
}
