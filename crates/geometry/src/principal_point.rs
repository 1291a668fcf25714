use nalgebra::{Matrix2, Point2, SymmetricEigen, Vector2};

use super::PrincipalLine;

/// Intersection of the principal lines of several views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalPoint {
    /// Intersection, in pixels of the picture.
    pub px: Point2<f64>,
    /// Covariance in px², propagated from the lines' covariances.
    pub covariance_px2: Matrix2<f64>,
    /// Sum of squared distances of the lines from the point over the variances; expected value
    /// `n − 2`.
    pub chi2: f64,
}

/// Reason why principal lines don't determine a point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoPrincipalPoint {
    /// Fewer than two lines.
    #[error("{have} principal lines, needs 2")]
    TooFewLines {
        /// Number of given lines.
        have: usize,
    },
    /// All lines are nearly parallel.
    #[error(
        "all principal lines run the same way (smallest eigenvalue of the mean of n nᵀ is {spread:.1e})"
    )]
    Parallel {
        /// Smallest eigenvalue of the mean of `n nᵀ`, 0.5 for evenly crossing lines.
        spread: f64,
    },
    /// A line has zero variance, so the lines can't be weighted.
    #[error("a principal line has no variance")]
    NoVariance,
}

/// Smallest eigenvalue of the mean of `n nᵀ` below which lines count as parallel: the directions
/// scatter by less than 0.06°.
const PARALLEL_SPREAD: f64 = 1e-6;

/// Intersects lines with equal weights: minimises `Σ (nᵢ·P − cᵢ)²` over unit normals.
///
/// Chuang 2021 intersects the lines with the homography's normals, which aren't of unit length;
/// their length acts as a hidden weight there.
///
/// # Errors
///
/// [`NoPrincipalPoint::TooFewLines`] below two lines, [`NoPrincipalPoint::Parallel`] if they are
/// nearly parallel.
pub fn intersect_unweighted(lines: &[PrincipalLine]) -> Result<PrincipalPoint, NoPrincipalPoint> {
    let weights = vec![1.0; lines.len()];
    let (px, inverse) = intersect(lines, &weights)?;
    let mut spread = Matrix2::zeros();
    for line in lines {
        let n = line.normal();
        // dP/d(distance) = N⁻¹ n, at the intersection.
        spread += n * n.transpose() * line.variance_of_distance(&px);
    }
    Ok(PrincipalPoint { px, covariance_px2: inverse * spread * inverse, chi2: chi2(lines, &px) })
}

/// Intersects lines by maximum likelihood: `P = N⁻¹ Σ n c/var`, `N = Σ n nᵀ/var`, with
/// `var(P) = [t·P, −1] S[φ,c] [t·P, −1]ᵀ` iterated to convergence. Covariance `N⁻¹`. See
/// `docs/method.md`, section 2.
///
/// # Errors
///
/// As [`intersect_unweighted`], and [`NoPrincipalPoint::NoVariance`] if a line has no variance.
pub fn intersect_weighted(lines: &[PrincipalLine]) -> Result<PrincipalPoint, NoPrincipalPoint> {
    let mut px = intersect_unweighted(lines)?.px;
    let mut covariance_px2 = Matrix2::zeros();
    for _ in 0..100 {
        let weights: Vec<f64> =
            lines.iter().map(|line| 1.0 / line.variance_of_distance(&px)).collect();
        if weights.iter().any(|weight| !weight.is_finite()) {
            return Err(NoPrincipalPoint::NoVariance);
        }
        let (next, inverse) = intersect(lines, &weights)?;
        let step = (next - px).norm();
        (px, covariance_px2) = (next, inverse);
        if step < 1e-12 {
            break;
        }
    }
    Ok(PrincipalPoint { px, covariance_px2, chi2: chi2(lines, &px) })
}

fn intersect(
    lines: &[PrincipalLine],
    weights: &[f64],
) -> Result<(Point2<f64>, Matrix2<f64>), NoPrincipalPoint> {
    let have = lines.len();
    let origin_px = match lines.first() {
        Some(first) if have >= 2 => first.origin_px,
        _ => return Err(NoPrincipalPoint::TooFewLines { have }),
    };
    let mut directions = Matrix2::zeros();
    let mut normal_matrix = Matrix2::zeros();
    let mut rhs = Vector2::zeros();
    for (line, weight) in lines.iter().zip(weights) {
        let n = line.normal();
        let c_px = line.c_px + n.dot(&(line.origin_px - origin_px));
        directions += n * n.transpose() / have as f64;
        normal_matrix += n * n.transpose() * *weight;
        rhs += n * (c_px * weight);
    }
    let spread = SymmetricEigen::new(directions).eigenvalues.min();
    if !(spread > PARALLEL_SPREAD) {
        return Err(NoPrincipalPoint::Parallel { spread });
    }
    let inverse = normal_matrix.try_inverse().ok_or(NoPrincipalPoint::Parallel { spread })?;
    Ok((origin_px + inverse * rhs, inverse))
}

fn chi2(lines: &[PrincipalLine], px: &Point2<f64>) -> f64 {
    lines
        .iter()
        .map(|line| line.distance_px(px).powi(2) / line.variance_of_distance(px).max(1e-300))
        .sum()
}
