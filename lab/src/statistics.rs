//! Statistics over many trials.

/// Median; `None` for none.
pub(super) fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// Quantile of the `values` at `share`, linear between neighbours; `None` for none.
///
/// An infinite value was never reached: between it and a finite neighbour the result is infinite,
/// too.
pub(super) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (low, high) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    // The difference of equal infinities is NaN.
    Some(if low == high { low } else { low + (high - low) * at.fract() })
}

/// 95 % interval of the median, by order statistics: holds for any distribution.
pub(super) fn median_interval(values: &[f64]) -> Option<(f64, f64)> {
    let half_width = 0.98 / (values.len().max(1) as f64).sqrt();
    Some((quantile(values, 0.5 - half_width)?, quantile(values, 0.5 + half_width)?))
}

/// Root mean square; `None` for none.
pub(super) fn rms(values: &[f64]) -> Option<f64> {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    (!values.is_empty()).then(|| (sum / values.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEVER: f64 = f64::INFINITY;

    #[test]
    fn quantiles_lie_between_their_neighbours() {
        let values = [4.0, 1.0, 3.0, 2.0];
        assert_eq!(median(&values), Some(2.5));
        assert_eq!(quantile(&values, 0.0), Some(1.0));
        assert_eq!(quantile(&values, 1.0), Some(4.0));
        assert_eq!(median(&[]), None);
    }

    #[test]
    fn what_was_never_reached_is_infinite_and_not_unknown() {
        for (values, middle) in [
            (&[NEVER, 1.0, 2.0][..], 2.0),
            (&[NEVER, 1.0], NEVER),
            (&[NEVER, NEVER, 1.0], NEVER),
            (&[NEVER, NEVER, NEVER, 1.0], NEVER),
        ] {
            assert_eq!(median(values), Some(middle), "{values:?}");
        }
        assert_eq!(median_interval(&[NEVER; 5]), Some((NEVER, NEVER)));
    }

    #[test]
    fn the_root_mean_square_of_nothing_is_unknown() {
        assert_eq!(rms(&[3.0, -4.0, 0.0, 0.0]), Some(2.5));
        assert_eq!(rms(&[]), None);
    }
}
