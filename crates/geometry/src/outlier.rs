//! Outliers among principal lines: lines that miss the intersection of the others. Deterministic:
//! every pair is tried, or an even sample.

use super::{PrincipalLine, PrincipalPoint, intersect_weighted};

/// Fewest lines to identify an outlier: with two pairs, either could be wrong.
pub const LINES_TO_TELL_OUTLIERS: usize = 5;
/// Least angle between lines for a useful crossing.
const LEAST_CROSSING_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Twice the 0.999 quantile of χ² with 1 degree of freedom: the point is uncertain, too.
/// `docs/method.md`, section 2.
const REJECTED: f64 = 2.0 * 10.828;

/// Most pairs tried: all of 45 lines. More than half of the lines meet, so one pair in four
/// consists of such lines.
const MOST_PAIRS: usize = 1000;

/// Consistent principal lines and outliers.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistentLines {
    /// Intersection of the consistent lines.
    pub pp: PrincipalPoint,
    /// Factor on the stated variances to explain the spread of the lines, at least 1.
    pub variance_scale: f64,
    /// Outliers, in the given order.
    pub outliers: Vec<OutlierLine>,
}

/// Line that misses the intersection of the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutlierLine {
    /// Index of the line in the given order.
    pub index: usize,
    /// Distance from the point in pixels, signed.
    pub distance_px: f64,
    /// Distance in standard deviations of line and point, scaled by the spread of the other lines.
    pub sigmas: f64,
}

impl OutlierLine {
    /// Outlier with `times` the variance of the distance. `None` if the line then may be good.
    pub fn with_variance(self, times: f64) -> Option<Self> {
        let sigmas = self.sigmas / times.sqrt();
        (sigmas * sigmas > REJECTED).then_some(Self { sigmas, ..self })
    }
}

/// Reason why outliers can't be identified.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OutliersUnknown {
    /// Too few lines; repeat a doubtful pose instead.
    #[error("{have} principal lines, telling outliers needs 5")]
    TooFewLines {
        /// Number of given lines.
        have: usize,
    },
    /// The lines are nearly parallel, or have no variance.
    #[error("the principal lines fix no point")]
    NoPoint,
}

/// Finds outliers from the intersection of most lines.
///
/// Every pair crossing at more than 10° gives a point; of more than 1000 pairs, an even sample
/// does. Its score is an order statistic, `⌈(N + 3)/2⌉` of N, of the squared distances over their
/// variances: an intersection of more than half of the lines scores low regardless of the others.
/// The best score, divided by its expected χ² quantile, scales the variances (at least 1). Lines
/// with `r²/(var s²) > 2 χ²₁(0.999)` are rejected, and the rest intersected again, until nothing
/// changes. See `docs/method.md`, section 2.
///
/// The lines should be of undistorted corners: distortion moves good lines off the principal point.
///
/// # Errors
///
/// [`OutliersUnknown::TooFewLines`] below five lines, where an outlier and the lines that
/// contradict it look alike; [`OutliersUnknown::NoPoint`] if no pair crosses.
pub fn consistent_lines(lines: &[PrincipalLine]) -> Result<ConsistentLines, OutliersUnknown> {
    let have = lines.len();
    if have < LINES_TO_TELL_OUTLIERS {
        return Err(OutliersUnknown::TooFewLines { have });
    }
    let rank = (have + 3).div_ceil(2);
    let mut best: Option<(f64, PrincipalPoint)> = None;
    let pairs = (0..have).flat_map(|i| (i + 1..have).map(move |j| [&lines[i], &lines[j]]));
    let step = (have * (have - 1) / 2).div_ceil(MOST_PAIRS);
    let mut squares: Vec<f64> = Vec::with_capacity(have);
    for [first, second] in pairs.step_by(step) {
        if first.angle_to(second) <= LEAST_CROSSING_RAD {
            continue;
        }
        let Ok(point) = intersect_weighted(&[first.clone(), second.clone()]) else { continue };
        squares.clear();
        squares.extend(lines.iter().map(|line| square(line, &point)));
        let (_, score, _) = squares.select_nth_unstable_by(rank - 1, f64::total_cmp);
        if score.is_finite() && best.as_ref().is_none_or(|(least, _)| *score < *least) {
            best = Some((*score, point));
        }
    }
    let (score, mut pp) = best.ok_or(OutliersUnknown::NoPoint)?;
    let variance_scale = (score / expected(rank, have)).max(1.0);
    let mut kept: Vec<bool> = vec![true; have];
    for _ in 0..have {
        let now: Vec<bool> =
            lines.iter().map(|line| square(line, &pp) <= REJECTED * variance_scale).collect();
        let consistent: Vec<PrincipalLine> = lines
            .iter()
            .zip(&now)
            .filter(|(_, keep)| **keep)
            .map(|(line, _)| line.clone())
            .collect();
        pp = intersect_weighted(&consistent).map_err(|_| OutliersUnknown::NoPoint)?;
        if std::mem::replace(&mut kept, now.clone()) == now {
            break;
        }
    }
    let outliers = lines
        .iter()
        .enumerate()
        .filter(|(index, _)| !kept[*index])
        .filter_map(|(index, line)| {
            let (distance_px, own) = (line.distance_px(&pp.px), line.variance_of_distance(&pp.px));
            let sigmas = distance_px.abs() / (own * variance_scale).sqrt();
            // The other lines give the point, and may leave it open in just this direction.
            let normal = line.normal();
            let of_point = (normal.transpose() * pp.covariance_px2 * normal).x;
            OutlierLine { index, distance_px, sigmas }.with_variance(1.0 + of_point / own)
        })
        .collect();
    Ok(ConsistentLines { pp, variance_scale, outliers })
}

/// Squared distance from the point in units of the line's variance at the point.
fn square(line: &PrincipalLine, point: &PrincipalPoint) -> f64 {
    line.distance_px(&point.px).powi(2) / line.variance_of_distance(&point.px)
}

/// Quantile of χ² with 1 degree of freedom at `rank / (count + 1)`, from the normal quantile's
/// rational approximation (Abramowitz & Stegun 26.2.23, 4.5e-4).
fn expected(rank: usize, count: usize) -> f64 {
    let upper = 0.5 * (1.0 - rank as f64 / (count as f64 + 1.0));
    let t = (-2.0 * libm::log(upper)).sqrt();
    let normal = t
        - (2.515_517 + t * (0.802_853 + t * 0.010_328))
            / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    normal * normal
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix4, Point2, Vector2};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    const PP: Point2<f64> = Point2::new(650.0, 350.0);

    /// Line through PP, moved by `off_px`, of the stated variance.
    fn line(phi_rad: f64, off_px: f64, sigma_px: f64) -> PrincipalLine {
        let origin_px = Point2::new(639.5, 359.5);
        let n = Vector2::new(phi_rad.cos(), phi_rad.sin());
        let mut covariance = Matrix4::zeros();
        covariance[(1, 1)] = sigma_px * sigma_px;
        PrincipalLine {
            phi_rad,
            c_px: n.dot(&(PP - origin_px)) + off_px,
            v_px: 900.0,
            d_px: 1400.0,
            vanishing_point_px: PP,
            origin_px,
            tilt_azimuth_rad: 0.0,
            covariance,
        }
    }

    /// `count` lines evenly around, with noise `noise` times as large as stated.
    fn lines(rng: &mut ChaCha8Rng, count: usize, noise: f64) -> Vec<PrincipalLine> {
        (0..count)
            .map(|i| {
                let phi_rad =
                    std::f64::consts::PI * (i as f64 + rng.random_range(-0.2..0.2)) / count as f64;
                let sigma_px = rng.random_range(0.5..2.0);
                let off_px = noise * sigma_px * rng.sample::<f64, _>(StandardNormal);
                line(phi_rad, off_px, sigma_px)
            })
            .collect()
    }

    #[test]
    fn one_outlier_of_eight_is_always_found_and_no_other() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut false_alarms = 0;
        for trial in 0..500 {
            let noise = [1.0, 1.0, 1.5][trial % 3];
            let mut eight = lines(&mut rng, 8, noise);
            let wrong = trial % 8;
            eight[wrong].c_px += 40.0 * if trial % 2 == 0 { 1.0 } else { -1.0 };
            let found = consistent_lines(&eight).expect("eight lines");
            assert!(found.outliers.iter().any(|outlier| outlier.index == wrong), "trial {trial}");
            false_alarms += found.outliers.len() - 1;
            assert!((found.pp.px - PP).norm() < 8.0 * noise);
        }
        assert!(false_alarms <= 35, "{false_alarms} of 3500 good lines");
    }

    #[test]
    fn good_lines_are_left_alone() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut alarms = 0;
        for trial in 0..500 {
            let good = lines(&mut rng, 5 + trial % 8, [1.0, 3.0][trial % 2]);
            alarms += consistent_lines(&good).expect("enough lines").outliers.len();
        }
        assert!(alarms <= 45, "{alarms} of 4250 lines");
    }

    #[test]
    fn two_of_eight_are_found_in_any_order() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for _ in 0..100 {
            let mut eight = lines(&mut rng, 8, 1.0);
            eight[1].c_px += 40.0;
            eight[5].c_px -= 55.0;
            let indices = |lines: &[PrincipalLine]| -> Vec<usize> {
                let found = consistent_lines(lines).expect("eight lines");
                found.outliers.iter().map(|outlier| outlier.index).collect()
            };
            let found = indices(&eight);
            assert!(found.contains(&1) && found.contains(&5), "{found:?}");
            eight.reverse();
            let mut turned: Vec<usize> = indices(&eight).iter().map(|index| 7 - index).collect();
            turned.sort_unstable();
            assert_eq!(turned, found);
        }
    }

    #[test]
    fn two_pairs_tell_no_outlier() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let four = lines(&mut rng, 4, 1.0);
        let unknown = OutliersUnknown::TooFewLines { have: 4 };
        assert_eq!(consistent_lines(&four), Err(unknown));
        let parallel: Vec<_> = (0..6).map(|i| line(0.3, f64::from(i), 1.0)).collect();
        assert_eq!(consistent_lines(&parallel), Err(OutliersUnknown::NoPoint));
    }

    #[test]
    fn the_expected_score_is_a_chi_square_quantile() {
        // χ²₁ at 2/3 and at 0.9.
        assert!((expected(6, 8) - 0.935_8).abs() < 2e-3, "{}", expected(6, 8));
        assert!((expected(9, 9) - 2.705_5).abs() < 3e-3, "{}", expected(9, 9));
    }
}
