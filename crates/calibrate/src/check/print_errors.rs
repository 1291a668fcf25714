//! Widens the covariance of the lens if corners of the board are misplaced.
//!
//! A printer misplaces corners by some hundredths of a millimetre, the same ones in all views. More
//! views don't average that out, and the agreement of the views doesn't show it. The corners do.
//! With the residual `r` of a corner in a view and `B` the derivative of its image by its place on
//! the board, both in standard deviations of the noise,
//!
//! ```text
//! q = Σ Bᵀ r,   P = Σ Bᵀ B   (over the views),   Σ qᵀ P⁻¹ q = w² · 2N + s² · Σ tr P   (over N corners, on average)
//! ```
//!
//! where `w²` is the variance between views, and `s²` that of the corners on the board: an analysis
//! of variance (Searle, Casella & McCulloch, "Variance components", 1992, chapter 3). With `A` the
//! derivative of a corner's image by the lens, its view's pose eliminated, and `C = Σ Aᵀ B`, the
//! errors of the print move the lens by a covariance of `I⁻¹ (s² Σ C Cᵀ) I⁻¹`.

use nalgebra::{Matrix2, SMatrix, Vector2};

use crate::solve::{
    bundle::{Bundle, Observations},
    common_error::CommonError,
    gram::{Gram, Row},
    model_choice::ModelChoice,
    whitened::Whitened,
};
use boresight_geometry::LENS_PARAMETERS;

use super::noise_correlation::{POSE, RESIDUAL, TILES, averaged_doubt, rows};

type LensMatrix = SMatrix<f64, LENS_PARAMETERS, LENS_PARAMETERS>;

/// Errors of the corners on the board.
#[derive(Clone, Debug)]
pub(crate) struct PrintErrors {
    /// Information beyond independent errors of the same size: `s² (Σ C Cᵀ − Σ Aᵀ B Bᵀ A)`.
    information: LensMatrix,
}

/// Sums over the views of a corner.
#[derive(Clone, Copy)]
struct OfCorner {
    pull: Vector2<f64>,
    power: Matrix2<f64>,
    /// `Σ Aᵀ B`.
    by_lens: SMatrix<f64, LENS_PARAMETERS, 2>,
}

/// Errors shared by all views around the minimum of `bundle`, the richest bundle. `None` if there
/// are none, or if too few views show the corners.
pub(crate) fn print_errors(observations: &Observations, bundle: &Bundle) -> Option<PrintErrors> {
    let none =
        OfCorner { pull: Vector2::zeros(), power: Matrix2::zeros(), by_lens: SMatrix::zeros() };
    let mut corners = vec![none; observations.board_m().len()];
    let mut in_views = LensMatrix::zeros();
    let mut cost = 0.0;
    for view in 0..observations.view_count() {
        let seen: Vec<&Whitened> = observations.view(view).iter().collect();
        let mut rows = rows(&seen, bundle, view)?;
        // Moving a point on the board moves its image like a shift of the board.
        let turn = bundle.state.cam_from_board.get(view)?.rotation.to_rotation_matrix();
        let along_board = turn.matrix().fixed_columns::<2>(0);
        let by_board: Vec<Matrix2<f64>> = rows
            .chunks_exact(2)
            .map(|rows| {
                let by_shift = SMatrix::<f64, 2, 3>::from_fn(|axis, k| rows[axis].at(POSE + 3 + k));
                by_shift * along_board
            })
            .collect();
        // Downweight the common error of a view's corners: once for `Aᵀ A`, twice for products with
        // unweighted rows.
        let common = CommonError::of(seen.iter().copied());
        let weigh_down = |rows: &mut [Row<TILES>]| common.iter().for_each(|it| it.take_out(rows));
        weigh_down(&mut rows);
        let (of_view, block) = Gram::of(&rows).split::<LENS_PARAMETERS, 6>();
        let absorbed = block.local_inverse(0.0)? * block.cross.transpose();
        cost += of_view;
        weigh_down(&mut rows);
        for ((corner, rows), by_board) in seen.iter().zip(rows.chunks_exact(2)).zip(&by_board) {
            let by_lens = SMatrix::<f64, 2, LENS_PARAMETERS>::from_fn(|axis, column| {
                let of_pose = (0..6).map(|i| rows[axis].at(POSE + i) * absorbed[(i, column)]);
                rows[axis].at(column) - of_pose.sum::<f64>()
            });
            let residual = Vector2::from_fn(|axis, _| rows[axis].at(RESIDUAL));
            let pulled = by_lens.transpose() * by_board;
            in_views += pulled * pulled.transpose();
            let corner = &mut corners[corner.place];
            corner.pull += by_board.transpose() * residual;
            corner.power += by_board.transpose() * by_board;
            corner.by_lens += pulled;
        }
    }
    let count = observations.coordinate_count() as f64;
    let left = count - (bundle.freedom.count() + 6 * observations.view_count()) as f64;
    let mut between = 0.0;
    let (mut places, mut power) = (0.0, 0.0);
    let mut in_corners = LensMatrix::zeros();
    for corner in &corners {
        let Some(inverse) = corner.power.try_inverse() else { continue };
        between += corner.pull.dot(&(inverse * corner.pull));
        places += 2.0;
        power += corner.power.trace();
        in_corners += corner.by_lens * corner.by_lens.transpose();
    }
    // Lens and poses absorb their share of both.
    let kept = left / count;
    let freedom = left - places * kept;
    if freedom < 1.0 || power <= 0.0 {
        return None;
    }
    let noise = (cost - between) / freedom;
    let variance_m2 = (between - noise * places * kept) / (power * kept);
    (variance_m2 > 0.0).then(|| PrintErrors { information: (in_corners - in_views) * variance_m2 })
}

impl PrintErrors {
    /// Covariance to add to the chosen lens's, averaged over the models as in
    /// [`ModelChoice::averaged_covariance`]. Never negative.
    pub(crate) fn doubt(&self, choice: &ModelChoice) -> LensMatrix {
        averaged_doubt(choice, |_| self.information)
    }
}
