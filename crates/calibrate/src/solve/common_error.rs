//! Error common to all corners of a view: a rolling shutter's, up to the uncertainty of the board's
//! motion.
//!
//! The board moves and turns meanwhile, so the error is linear in the pixel: six numbers per view,
//! each a column of `U` with [`Corner::common_px`](boresight_geometry::Corner::common_px) of the
//! corners. Their whitened residuals then have the covariance `I + U Uᵀ`, whose inverse square root
//! is `I − Q Φ Qᵀ` with the eigenvectors `Q` of `U Uᵀ` and `φ = 1 − 1/√(1 + λ)`: only the
//! information along the columns is reduced.

use boresight_geometry::simd::{Loop, widest};
use nalgebra::{Point2, SMatrix, SVector, Vector2};

use super::{gram::Row, whitened::Whitened};

/// Number of parameters of a view's error.
pub const COLUMNS: usize = 6;
/// Motion of a board's edge by turning, as a share of the motion of the middle: measured with
/// hands.
const TURNING: f64 = 0.5;

/// Directions of a view's residuals with common errors.
#[derive(Clone, Debug)]
pub(crate) struct CommonError {
    /// `Q`: two rows per corner.
    directions: Vec<SVector<f64, COLUMNS>>,
    /// `λ` of each direction.
    variances: SVector<f64, COLUMNS>,
}

/// Derivative of a corner's error by the parameters of the view, all with unit standard deviation.
/// `off` is the corner's offset from the middle of the board in the picture, as a share of half the
/// board's size there.
pub fn error_by_numbers(common_px: f64, off: &Vector2<f64>) -> SMatrix<f64, 2, COLUMNS> {
    let by = [1.0, TURNING * off.x, TURNING * off.y].map(|share| common_px * share);
    SMatrix::from_fn(|axis, column| if column % 2 == axis { by[column / 2] } else { 0.0 })
}

/// Offsets of pixels from the middle, as a share of half the extent.
pub fn places_on_board<'a>(
    seen: impl Iterator<Item = &'a Point2<f64>> + Clone + 'a,
) -> impl Fn(&Point2<f64>) -> Vector2<f64> {
    let (mut low, mut high) = (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
    for px in seen {
        low = low.inf(&px.coords);
        high = high.sup(&px.coords);
    }
    let middle = 0.5 * (low + high);
    let half = (0.5 * (high - low)).max().max(f64::MIN_POSITIVE);
    move |px| (px.coords - middle) / half
}

impl CommonError {
    /// Common error of `corners`; `None` if they have none.
    pub(crate) fn of<'a>(
        corners: impl IntoIterator<Item = &'a Whitened, IntoIter: 'a> + Clone,
    ) -> Option<Self> {
        if corners.clone().into_iter().all(|corner| corner.common_px == 0.0) {
            return None;
        }
        let pixels: Vec<Point2<f64>> =
            corners.clone().into_iter().map(|corner| corner.px).collect();
        let off = places_on_board(pixels.iter());
        let columns: Vec<SVector<f64, COLUMNS>> = corners
            .into_iter()
            .flat_map(|corner| {
                let by_numbers =
                    corner.whitener * error_by_numbers(corner.common_px, &off(&corner.px));
                [0, 1].map(|axis| by_numbers.row(axis).transpose())
            })
            .collect();
        let squares: SMatrix<f64, COLUMNS, COLUMNS> =
            columns.iter().map(|row| row * row.transpose()).sum();
        let eigen = squares.symmetric_eigen();
        let most = eigen.eigenvalues.max();
        let scale = eigen.eigenvalues.map(|variance| match variance > 1e-9 * most {
            true => variance.sqrt().recip(),
            false => 0.0,
        });
        let turn = eigen.eigenvectors * SMatrix::<f64, COLUMNS, COLUMNS>::from_diagonal(&scale);
        let directions = columns.iter().map(|row| turn.transpose() * row).collect();
        Some(Self { directions, variances: eigen.eigenvalues.map(|variance| variance.max(0.0)) })
    }

    /// Downweights the common error in `rows`, two per corner.
    pub(crate) fn take_out<const T: usize>(&self, rows: &mut [Row<T>]) {
        widest(TakingOut(self, rows));
    }

    /// True if the common error has a larger variance than the corners' own noise.
    pub(crate) fn exceeds_noise(&self) -> bool {
        self.variances.sum() > self.directions.len() as f64
    }

    /// Part of the sum of squares of the whitened `residuals`, one per corner, explained by the
    /// common error.
    pub(crate) fn explained(&self, residuals: &[Vector2<f64>]) -> f64 {
        let along = |axis: usize| -> f64 {
            let values = residuals.iter().flat_map(|residual| residual.iter());
            let sum: f64 =
                values.zip(&self.directions).map(|(value, along)| value * along[axis]).sum();
            sum * sum * (1.0 - 1.0 / (1.0 + self.variances[axis]))
        };
        (0..COLUMNS).map(along).sum()
    }
}

struct TakingOut<'a, const T: usize>(&'a CommonError, &'a mut [Row<T>]);

impl<const T: usize> Loop for TakingOut<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(common, rows) = self;
        for axis in 0..COLUMNS {
            let share = 1.0 - (1.0 + common.variances[axis]).sqrt().recip();
            let mut sum = Row::zeros();
            for (row, along) in rows.iter().zip(&common.directions) {
                sum.add_scaled(row, along[axis]);
            }
            for (row, along) in rows.iter_mut().zip(&common.directions) {
                row.add_scaled(&sum, -share * along[axis]);
            }
        }
    }
}
