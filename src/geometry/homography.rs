use nalgebra::{DMatrix, Matrix2, Matrix3, Point2, SMatrix, SVector, SymmetricEigen, Vector3};

use super::Corner;

/// A homography's nine numbers, row by row.
type Nine = SVector<f64, 9>;
type NineByNine = SMatrix<f64, 9, 9>;

/// Points thinner than this share of their length lie on a line, but for rounding.
const THINNEST: f64 = 1e-6;

/// The plane-to-picture map of one view, with its uncertainty.
///
/// Scaled so that `h33 = 1`: the board's origin is at its centre, so its depth is positive there.
#[derive(Clone, Debug, PartialEq)]
pub struct Homography {
    image_from_board: Matrix3<f64>,
    covariance: NineByNine,
    rms_px: f64,
    chi2: f64,
}

/// Why corners give no homography.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoHomography {
    /// Fewer than four corners, or as many board points as corners are needed.
    #[error("{corners} corners for {points} board points: needs the same number, at least 4")]
    TooFewPoints {
        /// Corners given.
        corners: usize,
        /// Board points given.
        points: usize,
    },
    /// The corners, or the board points, lie on a line or a point.
    #[error("the corners do not span an area")]
    Degenerate,
    /// A number is NaN or infinite, or a covariance is not positive definite.
    #[error("the corners are not finite")]
    NotFinite,
}

impl Homography {
    /// Fits by maximum likelihood: isotropic normalisation on both sides (unequal scaling would lose
    /// perpendicularity), direct linear transform, then Levenberg–Marquardt on the reprojection error,
    /// each corner weighted by its covariance. METHOD section 1.
    ///
    /// # Errors
    ///
    /// [`NoHomography`].
    pub fn fit(board_points_m: &[Point2<f64>], corners: &[Corner]) -> Result<Self, NoHomography> {
        if corners.len() != board_points_m.len() || corners.len() < 4 {
            let (corners, points) = (corners.len(), board_points_m.len());
            return Err(NoHomography::TooFewPoints { corners, points });
        }
        let seen: Vec<Point2<f64>> = corners.iter().map(|corner| corner.px).collect();
        let normal_from_board = normalisation(board_points_m)?;
        let normal_from_image = normalisation(&seen)?;
        let image_scale = normal_from_image[(0, 0)];
        let board: Vec<Point2<f64>> =
            board_points_m.iter().map(|point| moved(&normal_from_board, point)).collect();
        let image: Vec<Point2<f64>> =
            seen.iter().map(|point| moved(&normal_from_image, point)).collect();
        let weights: Option<Vec<Matrix2<f64>>> = corners
            .iter()
            .map(|corner| (corner.covariance_px2 * image_scale * image_scale).try_inverse())
            .collect();
        let weights = weights.ok_or(NoHomography::NotFinite)?;
        let start = direct_linear_transform(&board, &image)?;
        let fitted = refine(start, &board, &image, &weights)?;
        let image_from_normal = normal_from_image.try_inverse().ok_or(NoHomography::Degenerate)?;
        let h = image_from_normal * to_matrix(&fitted.h) * normal_from_board;
        if !(h[(2, 2)].abs() > 1e-12 * h.row(2).norm()) {
            return Err(NoHomography::Degenerate);
        }
        let scale = 1.0 / h[(2, 2)];
        let image_from_board = h * scale;
        // vec(A H B) = (A ⊗ Bᵀ) vec(H), row by row.
        let change = image_from_normal.kronecker(&normal_from_board.transpose()) * scale;
        let covariance =
            in_gauge(&(change * fitted.covariance * change.transpose()), &image_from_board);
        if image_from_board.iter().chain(covariance.iter()).any(|value| !value.is_finite()) {
            return Err(NoHomography::NotFinite);
        }
        let mut squares = 0.0;
        for (point, px) in board_points_m.iter().zip(&seen) {
            squares += (moved(&image_from_board, point) - px).norm_squared();
        }
        let rms_px = (squares / seen.len() as f64).sqrt();
        Ok(Self { image_from_board, covariance, rms_px, chi2: fitted.cost })
    }

    /// A homography known without error. `None` if it is not finite, not invertible, or has the board's
    /// origin on the camera's plane.
    pub fn from_matrix(image_from_board: &Matrix3<f64>) -> Option<Self> {
        let scaled = image_from_board / image_from_board[(2, 2)];
        let finite = scaled.iter().all(|value| value.is_finite());
        (finite && scaled.determinant() != 0.0).then(|| Self {
            image_from_board: scaled,
            covariance: NineByNine::zeros(),
            rms_px: 0.0,
            chi2: 0.0,
        })
    }

    /// The matrix, `h33 = 1`.
    pub fn image_from_board(&self) -> &Matrix3<f64> {
        &self.image_from_board
    }

    /// Covariance of the nine numbers, row by row, for the corner covariances given; in the gauge
    /// `h·dh = 0`, so of rank 8.
    pub fn covariance(&self) -> &NineByNine {
        &self.covariance
    }

    /// Root mean square distance of the corners from where the homography puts them.
    pub fn rms_px(&self) -> f64 {
        self.rms_px
    }

    /// Sum of squared distances in units of the corners' covariances; `2n − 8` is expected.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Pixel of a board point; `None` behind the camera.
    pub fn map(&self, point_in_board_m: &Point2<f64>) -> Option<Point2<f64>> {
        let mapped = self.image_from_board * point_in_board_m.to_homogeneous();
        (mapped.z > 1e-12).then(|| Point2::new(mapped.x / mapped.z, mapped.y / mapped.z))
    }
}

/// Moves the centroid to the origin and the root mean square distance to √2, by one factor.
fn normalisation(points: &[Point2<f64>]) -> Result<Matrix3<f64>, NoHomography> {
    let count = points.len() as f64;
    let centre = points.iter().fold(nalgebra::Vector2::zeros(), |sum, p| sum + p.coords) / count;
    let scatter = points.iter().fold(Matrix2::zeros(), |sum, p| {
        let off = p.coords - centre;
        sum + off * off.transpose()
    }) / count;
    let spread = scatter.trace();
    if !spread.is_finite() {
        return Err(NoHomography::NotFinite);
    }
    // The determinant over the squared trace is the square of how thin the points lie.
    if !(scatter.determinant() > THINNEST * THINNEST * spread * spread) {
        return Err(NoHomography::Degenerate);
    }
    let scale = (2.0 / spread).sqrt();
    Ok(Matrix3::new(scale, 0.0, -scale * centre.x, 0.0, scale, -scale * centre.y, 0.0, 0.0, 1.0))
}

fn moved(matrix: &Matrix3<f64>, point: &Point2<f64>) -> Point2<f64> {
    let mapped = matrix * point.to_homogeneous();
    Point2::new(mapped.x / mapped.z, mapped.y / mapped.z)
}

fn to_matrix(h: &Nine) -> Matrix3<f64> {
    Matrix3::from_row_slice(h.as_slice())
}

fn direct_linear_transform(
    board: &[Point2<f64>],
    image: &[Point2<f64>],
) -> Result<Nine, NoHomography> {
    let mut rows = DMatrix::zeros(2 * board.len(), 9);
    for (i, (b, p)) in board.iter().zip(image).enumerate() {
        let x = [b.x, b.y, 1.0];
        for k in 0..3 {
            rows[(2 * i, k)] = x[k];
            rows[(2 * i, 6 + k)] = -p.x * x[k];
            rows[(2 * i + 1, 3 + k)] = x[k];
            rows[(2 * i + 1, 6 + k)] = -p.y * x[k];
        }
    }
    // The right null vector of `rows`, by the eigenvectors of its normal matrix: accurate enough for a
    // start, and of fixed size.
    let normal_matrix: NineByNine =
        (rows.transpose() * &rows).fixed_view::<9, 9>(0, 0).into_owned();
    let eigen = SymmetricEigen::new(normal_matrix);
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let (least, next, largest) =
        (order[0], eigen.eigenvalues[order[1]], eigen.eigenvalues[order[8]]);
    // A second null direction means that the points lie on a line.
    if !(next > 1e-12 * largest) {
        return Err(NoHomography::Degenerate);
    }
    let h: Nine = eigen.eigenvectors.column(least).into_owned();
    Ok(if h[8] < 0.0 { -h } else { h })
}

struct Fitted {
    h: Nine,
    covariance: NineByNine,
    cost: f64,
}

/// Residuals' cost, its gradient and normal matrix; `None` if a point falls on the camera's plane.
fn linearise(
    h: &Nine,
    board: &[Point2<f64>],
    image: &[Point2<f64>],
    weights: &[Matrix2<f64>],
) -> Option<(f64, Nine, NineByNine)> {
    let mut cost = 0.0;
    let mut gradient = Nine::zeros();
    let mut normal_matrix = NineByNine::zeros();
    for ((b, p), weight) in board.iter().zip(image).zip(weights) {
        let x = Vector3::new(b.x, b.y, 1.0);
        let depth = h.fixed_rows::<3>(6).dot(&x);
        if !(depth.abs() > 1e-9) {
            return None;
        }
        let u = h.fixed_rows::<3>(0).dot(&x) / depth;
        let v = h.fixed_rows::<3>(3).dot(&x) / depth;
        let residual = nalgebra::Vector2::new(p.x - u, p.y - v);
        let mut jacobian = SMatrix::<f64, 2, 9>::zeros();
        for k in 0..3 {
            let by = x[k] / depth;
            jacobian[(0, k)] = by;
            jacobian[(1, 3 + k)] = by;
            jacobian[(0, 6 + k)] = -u * by;
            jacobian[(1, 6 + k)] = -v * by;
        }
        let weighted = weight * residual;
        cost += residual.dot(&weighted);
        gradient += jacobian.transpose() * weighted;
        normal_matrix += jacobian.transpose() * weight * jacobian;
    }
    cost.is_finite().then_some((cost, gradient, normal_matrix))
}

fn refine(
    start: Nine,
    board: &[Point2<f64>],
    image: &[Point2<f64>],
    weights: &[Matrix2<f64>],
) -> Result<Fitted, NoHomography> {
    let mut h = start.normalize();
    let (mut cost, mut gradient, mut normal_matrix) =
        linearise(&h, board, image, weights).ok_or(NoHomography::Degenerate)?;
    let mut damping = 0.0;
    for _ in 0..50 {
        // The gauge term removes the free scale without touching the other directions.
        let gauge = h * h.transpose() * (normal_matrix.trace() / 9.0);
        let mut damped = normal_matrix + gauge;
        for i in 0..9 {
            damped[(i, i)] += damping * normal_matrix[(i, i)];
        }
        let Some(step) = damped.cholesky().map(|cholesky| cholesky.solve(&gradient)) else {
            return Err(NoHomography::Degenerate);
        };
        let tried = (h + step).normalize();
        match linearise(&tried, board, image, weights) {
            Some((new_cost, new_gradient, new_matrix))
                if new_cost <= cost * (1.0 + 1e-12) + 1e-300 =>
            {
                (h, cost, gradient, normal_matrix) = (tried, new_cost, new_gradient, new_matrix);
                damping *= 0.1;
                if step.norm() < 1e-14 {
                    break;
                }
            }
            _ => damping = (damping * 10.0).max(1e-4),
        }
        if damping > 1e8 {
            break;
        }
    }
    let gauge = h * h.transpose() * (normal_matrix.trace() / 9.0);
    let inverse = (normal_matrix + gauge).cholesky().ok_or(NoHomography::Degenerate)?.inverse();
    let covariance = in_gauge(&inverse, &to_matrix(&h));
    Ok(Fitted { h, covariance, cost })
}

/// Projects a covariance onto the changes that leave the length of `h` alone.
fn in_gauge(covariance: &NineByNine, matrix: &Matrix3<f64>) -> NineByNine {
    let h = Nine::from_row_slice(matrix.transpose().as_slice()).normalize();
    let projection = NineByNine::identity() - h * h.transpose();
    projection * covariance * projection
}
