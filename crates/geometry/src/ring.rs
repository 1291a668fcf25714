use nalgebra::{Matrix2, Matrix3, Matrix4, Point2, SMatrix, Vector2, Vector3};

use super::PrincipalLine;

/// Principal point and common focal length from principal lines and vanishing points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RingEstimate {
    /// Principal point in pixels.
    pub pp_px: Point2<f64>,
    /// Common focal length in pixels.
    pub f_px: f64,
    /// Covariance of `(f, cx, cy)`, px².
    pub covariance: Matrix3<f64>,
}

/// Reason for a missing [`RingEstimate`].
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoRing {
    /// Fewer than two views.
    #[error("{have} views, needs 2")]
    TooFewLines {
        /// Number of given views.
        have: usize,
    },
    /// The views don't determine the three unknowns.
    #[error("the views do not differ enough")]
    Degenerate,
    /// The best fit has `f² ≤ 0`.
    #[error("no common focal length fits")]
    Imaginary,
}

/// Estimates principal point and focal length in closed form, with both of Zhang's constraints per
/// view.
///
/// One opposed pair is enough. Assumes a focal length common to all views, square pixels and
/// undistorted corners.
///
/// Unknowns `(Px, Py, s = f² + |P|²)`, counted from the lines' origin; per view the rows `n·P = c`
/// and `2V·P − s = |V|² − D²`, weighted by the 2×2 covariance of their residuals, iterated;
/// `f = √(s − |P|²)`. See `docs/method.md`, section 2.
///
/// # Errors
///
/// [`NoRing::TooFewLines`] below two lines, [`NoRing::Degenerate`] if the views don't differ
/// enough, [`NoRing::Imaginary`] if the best fit has `f² ≤ 0`.
pub fn principal_line_and_ring(lines: &[PrincipalLine]) -> Result<RingEstimate, NoRing> {
    let have = lines.len();
    let origin_px = match lines.first() {
        Some(first) if have >= 2 => first.origin_px,
        _ => return Err(NoRing::TooFewLines { have }),
    };
    // Scaled so that P and s are of similar magnitude.
    let scale = lines.iter().map(|line| line.d_px).fold(1.0, f64::max);
    let rows: Vec<View> = lines.iter().map(|line| View::new(line, &origin_px)).collect();
    let mut p = Vector2::zeros();
    let mut inverse = Matrix3::zeros();
    let mut s = 0.0;
    for round in 0..100 {
        let mut normal_matrix = Matrix3::zeros();
        let mut rhs = Vector3::zeros();
        for row in &rows {
            let weight = if round == 0 { row.rough_weight(scale) } else { row.weight(&p)? };
            let a = SMatrix::<f64, 2, 3>::new(
                row.n.x,
                row.n.y,
                0.0,
                2.0 * row.v.x,
                2.0 * row.v.y,
                -scale * scale,
            );
            let b = Vector2::new(row.c_px, row.v.norm_squared() - row.d_px * row.d_px);
            normal_matrix += a.transpose() * weight * a;
            rhs += a.transpose() * weight * b;
        }
        inverse = normal_matrix.try_inverse().ok_or(NoRing::Degenerate)?;
        let solved = inverse * rhs;
        let next = Vector2::new(solved.x, solved.y);
        if !next.iter().all(|value| value.is_finite()) {
            return Err(NoRing::Degenerate);
        }
        let step = (next - p).norm();
        p = next;
        s = solved.z * scale * scale;
        if round > 0 && step < 1e-11 {
            break;
        }
    }
    let f2 = s - p.norm_squared();
    if !(f2 > 0.0) {
        return Err(NoRing::Imaginary);
    }
    let f_px = f2.sqrt();
    // df = (ds − 2 P·dP)/(2f).
    let change = Matrix3::new(
        -p.x / f_px,
        -p.y / f_px,
        scale * scale / (2.0 * f_px),
        1.0,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
    );
    let covariance = change * inverse * change.transpose();
    Ok(RingEstimate { pp_px: origin_px + p, f_px, covariance })
}

struct View {
    n: Vector2<f64>,
    t: Vector2<f64>,
    v: Vector2<f64>,
    c_px: f64,
    d_px: f64,
    along_px: f64,
    covariance: Matrix4<f64>,
}

impl View {
    fn new(line: &PrincipalLine, origin_px: &Point2<f64>) -> Self {
        let (n, t) = (line.normal(), line.direction());
        let v = line.vanishing_point_px - origin_px;
        Self {
            n,
            t,
            v,
            c_px: n.dot(&v),
            d_px: line.d_px,
            along_px: t.dot(&v),
            covariance: line.covariance,
        }
    }

    /// Inverse covariance of the residuals `r1 = c − n·P`, `r2 = 2V·P − s − |V|² + D²` up to sign:
    /// partials over (φ, c, v, D) are `(−t·P, 1, 0, 0)` and
    /// `(2(c − n·P)(t·P) − 2(v − t·P)(n·P), −2(c − n·P), −2(v − t·P), 2D)`.
    fn weight(&self, p: &Vector2<f64>) -> Result<Matrix2<f64>, NoRing> {
        let (across, along) = (self.n.dot(p), self.t.dot(p));
        let (dc, dv) = (self.c_px - across, self.along_px - along);
        let partials = SMatrix::<f64, 2, 4>::new(
            -along,
            1.0,
            0.0,
            0.0,
            2.0 * dc * along - 2.0 * dv * across,
            -2.0 * dc,
            -2.0 * dv,
            2.0 * self.d_px,
        );
        // Residuals as observed minus predicted: r1 = c − n·P, r2 = (|V|² − D²) − (2V·P − s) with
        // the sign of the second row turned to match.
        let sign = Matrix2::new(1.0, 0.0, 0.0, -1.0);
        let covariance = sign * partials * self.covariance * partials.transpose() * sign;
        covariance.try_inverse().ok_or(NoRing::Degenerate)
    }

    fn rough_weight(&self, scale: f64) -> Matrix2<f64> {
        Matrix2::new(1.0, 0.0, 0.0, 1.0 / (scale * scale))
    }
}
