//! Covariance of the intersection of the principal lines of free homographies.

use nalgebra::{Matrix2, Matrix2x4, Matrix4, RowVector2, SMatrix, SVector, Vector2};

use super::schur_lm::ViewBlock;

/// `h11 … h32` of a homography with `h33 = 1`.
pub(super) type Local = SVector<f64, 8>;

/// Principal line of a view, in units of g: `n·p = c`, and `v` along it.
struct Line {
    normal: Vector2<f64>,
    tangent: Vector2<f64>,
    c: f64,
    v: f64,
    /// |u| and ρ² of `docs/method.md`, section 1.
    length: f64,
    rho2: f64,
}

impl Line {
    fn of(view: &Local) -> Self {
        let (a, b) = (view[6], view[7]);
        let rho2 = a * a + b * b;
        let vanishing = Vector2::new(a * view[0] + b * view[1], a * view[3] + b * view[4]) / rho2;
        let u = Vector2::new(a * view[1] - b * view[0], a * view[4] - b * view[3]);
        let length = u.norm();
        let normal = u / length;
        let tangent = Vector2::new(-normal.y, normal.x);
        let (c, v) = (normal.dot(&vanishing), tangent.dot(&vanishing));
        Self { normal, tangent, c, v, length, rho2 }
    }

    /// `d (c − n·P) / d view`, with `d(c − n·P) = dc − (t·P) dφ`.
    fn miss_by_view(&self, view: &Local, at: &Vector2<f64>) -> SMatrix<f64, 1, 8> {
        let (a, b) = (view[6], view[7]);
        let vanishing = self.normal * self.c + self.tangent * self.v;
        let mut d_vanishing = SMatrix::<f64, 2, 8>::zeros();
        let mut d_u = SMatrix::<f64, 2, 8>::zeros();
        for row in 0..2 {
            let (h1, h2) = (view[3 * row], view[3 * row + 1]);
            d_vanishing[(row, 3 * row)] = a / self.rho2;
            d_vanishing[(row, 3 * row + 1)] = b / self.rho2;
            d_vanishing[(row, 6)] = (h1 - 2.0 * a * vanishing[row]) / self.rho2;
            d_vanishing[(row, 7)] = (h2 - 2.0 * b * vanishing[row]) / self.rho2;
            d_u[(row, 3 * row)] = -b;
            d_u[(row, 3 * row + 1)] = a;
            d_u[(row, 6)] = h2;
            d_u[(row, 7)] = -h1;
        }
        let d_phi = self.tangent.transpose() * d_u / self.length;
        let d_c = self.normal.transpose() * d_vanishing + d_phi * self.v;
        RowVector2::new(-self.tangent.dot(at), 1.0) * SMatrix::<f64, 2, 8>::from_rows(&[d_phi, d_c])
    }
}

/// Covariance, px², of the weighted intersection at `pp_in_g`, for corners with the stated noise.
///
/// Every line has independent noise from `V⁻¹` of its view, and all lines depend on the shared
/// lens, whose covariance over (DC, K1, K2) is `shared_covariance`: `p = DC + S g`,
/// `dP = N⁻¹ Σ w n (dc − (t·P) dφ)`, `N = Σ w n nᵀ`, `w` from the independent noise of each line.
pub(crate) fn pp_covariance(
    views: &[(&Local, &ViewBlock<4, 8>)],
    shared_covariance: &Matrix4<f64>,
    pp_in_g: &Vector2<f64>,
    scale_px: f64,
) -> Option<Matrix2<f64>> {
    let mut normal_matrix = Matrix2::zeros();
    let mut weighted = Vec::with_capacity(views.len());
    for (view, block) in views {
        let line = Line::of(view);
        let covariance = block.local_inverse(0.0)?;
        let by_view = line.miss_by_view(view, pp_in_g);
        let weight = 1.0 / (by_view * covariance * by_view.transpose())[(0, 0)];
        normal_matrix += weight * line.normal * line.normal.transpose();
        weighted.push((line.normal * by_view * weight, covariance, block));
    }
    let normal_inverse = normal_matrix.try_inverse()? * scale_px;
    let mut by_shared = Matrix2x4::zeros();
    by_shared.fixed_view_mut::<2, 2>(0, 0).fill_with_identity();
    let mut independent = Matrix2::zeros();
    for (by_view, covariance, block) in weighted {
        let by_view = normal_inverse * by_view;
        independent += by_view * covariance * by_view.transpose();
        by_shared -= by_view * covariance * block.cross.transpose();
    }
    Some(independent + by_shared * shared_covariance * by_shared.transpose())
}
