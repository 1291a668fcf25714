use nalgebra::{
    DMatrix, Matrix2, Matrix3, Point2, SMatrix, SVector, SymmetricEigen, Vector2, Vector3,
};

use super::{
    Corner,
    corner::seen,
    least_squares::{Limits, Linearised, Problem, minimise},
};

/// Nine entries of a homography, row by row.
type Nine = SVector<f64, 9>;
type NineByNine = SMatrix<f64, 9, 9>;

/// Ratio of minor to major extent below which points count as collinear; rounding alone makes about
/// 1e-8.
const COLLINEAR: f64 = 1e-6;
/// Rounds of [`Homography::fit_unweighted`]: more change nothing visible in a cell or a corner.
const UNWEIGHTED_ROUNDS: usize = 3;

/// Map from the board plane (metres) to pixels in a view, with covariance.
///
/// Scaled so that `h33 = 1`. This is always possible for a visible board: `h33` is proportional to
/// the depth of the board's origin, which is its centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Homography {
    image_from_board: Matrix3<f64>,
    covariance: NineByNine,
    rms_px: f64,
    chi2: f64,
}

/// Reason why corners give no homography.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoHomography {
    /// Fewer than four corners, or not as many board points as corners.
    #[error("{corners} corners for {points} board points: needs the same number, at least 4")]
    TooFewPoints {
        /// Number of given corners.
        corners: usize,
        /// Number of given board points.
        points: usize,
    },
    /// The corners, or the board points, are collinear or coincide.
    #[error("the corners do not span an area")]
    Degenerate,
    /// A number is NaN or infinite, or a covariance is not positive definite.
    #[error("the corners are not finite")]
    NotFinite,
}

impl Homography {
    /// Fits by maximum likelihood: minimises the reprojection error, each corner weighted by the
    /// inverse covariance.
    ///
    /// `board_points_m[i]` is the board point, in metres, of `corners[i]`; at least four corners
    /// must be seen. The corners should be undistorted: a homography can't describe distortion.
    ///
    /// Isotropic normalisation on both sides (unequal scaling would lose perpendicularity), direct
    /// linear transform (Hartley & Zisserman, *Multiple View Geometry*, algorithm 4.2), then
    /// Levenberg–Marquardt. See `docs/method.md`, section 1.
    ///
    /// # Errors
    ///
    /// [`NoHomography`] if there are fewer than four corners, if they or the board points are
    /// collinear, or if a number is not finite.
    pub fn fit(board_points_m: &[Point2<f64>], corners: &[Corner]) -> Result<Self, NoHomography> {
        Self::fit_from(board_points_m, corners, None)
    }

    /// [`Self::fit`] from a homography near the result.
    ///
    /// # Errors
    ///
    /// See [`Self::fit`].
    #[doc(hidden)]
    pub fn fit_near(
        board_points_m: &[Point2<f64>],
        corners: &[Corner],
        image_from_board: &Matrix3<f64>,
    ) -> Result<Self, NoHomography> {
        Self::fit_from(board_points_m, corners, Some(image_from_board))
    }

    fn fit_from(
        board_points_m: &[Point2<f64>],
        corners: &[Corner],
        near: Option<&Matrix3<f64>>,
    ) -> Result<Self, NoHomography> {
        let (points, seen_corners) = seen(board_points_m, corners);
        let (board_points_m, corners) = (points.as_ref(), seen_corners.as_ref());
        if corners.len() != board_points_m.len() || corners.len() < 4 {
            let (corners, points) = (corners.len(), board_points_m.len());
            return Err(NoHomography::TooFewPoints { corners, points });
        }
        let seen_px: Vec<Point2<f64>> = corners.iter().map(|corner| corner.px).collect();
        let normal_from_board = normalisation(board_points_m.iter().copied())?;
        let normal_from_image = normalisation(seen_px.iter().copied())?;
        let image_scale = normal_from_image[(0, 0)];
        let board: Vec<Point2<f64>> =
            board_points_m.iter().map(|point| moved(&normal_from_board, point)).collect();
        let image: Vec<Point2<f64>> =
            seen_px.iter().map(|point| moved(&normal_from_image, point)).collect();
        let weights: Option<Vec<Matrix2<f64>>> = corners
            .iter()
            .map(|corner| (corner.covariance_px2 * image_scale * image_scale).try_inverse())
            .collect();
        let weights = weights.ok_or(NoHomography::NotFinite)?;
        let board_from_normal = normal_from_board.try_inverse().ok_or(NoHomography::Degenerate)?;
        let start = match near {
            None => direct_linear_transform(&board, &image)?,
            Some(h) => {
                let h = normal_from_image * h * board_from_normal;
                Nine::from_row_slice(h.transpose().as_slice())
            }
        };
        let problem = Reprojection { board: &board, image: &image, weights: &weights };
        let minimum =
            minimise(&problem, start.normalize(), Limits::EXACT).ok_or(NoHomography::Degenerate)?;
        let information = minimum.at.normal_matrix.cholesky().ok_or(NoHomography::Degenerate)?;
        let normalized = to_matrix(&minimum.state);
        let unit_covariance = in_gauge(&information.inverse(), &normalized);
        let image_from_normal = normal_from_image.try_inverse().ok_or(NoHomography::Degenerate)?;
        let h = image_from_normal * normalized * normal_from_board;
        if !(h[(2, 2)].abs() > 1e-12 * h.row(2).norm()) {
            return Err(NoHomography::Degenerate);
        }
        let scale = 1.0 / h[(2, 2)];
        let image_from_board = h * scale;
        // vec(A H B) = (A ⊗ Bᵀ) vec(H), row by row.
        let change = image_from_normal.kronecker(&normal_from_board.transpose()) * scale;
        let covariance =
            in_gauge(&(change * unit_covariance * change.transpose()), &image_from_board);
        if image_from_board.iter().chain(covariance.iter()).any(|value| !value.is_finite()) {
            return Err(NoHomography::NotFinite);
        }
        let pairs = board_points_m.iter().copied().zip(seen_px.iter().copied());
        let rms_px = rms_px(&image_from_board, pairs);
        Ok(Self { image_from_board, covariance, rms_px, chi2: minimum.at.cost })
    }

    /// Fits by least squares of distances, with equal weights: no covariance, no χ², and no
    /// allocation.
    ///
    /// Takes at least four pairs of a board point and its pixel; `rms_px` has the unit of the
    /// pixels. The direct linear transform with `h33 = 1` in the middle of the board, whose
    /// equations are divided by the depth of the previous round.
    ///
    /// # Errors
    ///
    /// [`NoHomography::Degenerate`] for fewer than four pairs and for collinear ones,
    /// [`NoHomography::NotFinite`].
    pub fn fit_unweighted(
        pairs: impl Iterator<Item = (Point2<f64>, Point2<f64>)> + Clone,
    ) -> Result<Self, NoHomography> {
        let normal_from_board = normalisation(pairs.clone().map(|(point, _)| point))?;
        let normal_from_image = normalisation(pairs.clone().map(|(_, px)| px))?;
        let mut h = Matrix3::<f64>::identity();
        for _ in 0..UNWEIGHTED_ROUNDS {
            let (mut squares, mut pull) =
                (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
            for (point, px) in pairs.clone() {
                let (b, p) = (moved(&normal_from_board, &point), moved(&normal_from_image, &px));
                let depth = h[(2, 0)] * b.x + h[(2, 1)] * b.y + 1.0;
                for (row, to) in [
                    ([b.x, b.y, 1.0, 0.0, 0.0, 0.0, -p.x * b.x, -p.x * b.y], p.x),
                    ([0.0, 0.0, 0.0, b.x, b.y, 1.0, -p.y * b.x, -p.y * b.y], p.y),
                ] {
                    let row = SVector::from(row) / depth;
                    squares += row * row.transpose();
                    pull += row * (to / depth);
                }
            }
            let found = squares.cholesky().ok_or(NoHomography::Degenerate)?.solve(&pull);
            h.copy_from_slice(found.push(1.0).as_slice());
            h.transpose_mut();
        }
        let image_from_normal = normal_from_image.try_inverse().ok_or(NoHomography::Degenerate)?;
        let fitted = Self::from_matrix(&(image_from_normal * h * normal_from_board))
            .ok_or(NoHomography::NotFinite)?;
        let rms_px = rms_px(&fitted.image_from_board, pairs);
        Ok(Self { rms_px, ..fitted })
    }

    /// Exact homography, with zero covariance. `None` if the matrix isn't finite or invertible, or
    /// puts the board's origin on the camera's plane.
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

    /// 3×3 matrix from board points (metres, homogeneous) to pixels, `h33 = 1`.
    pub fn image_from_board(&self) -> &Matrix3<f64> {
        &self.image_from_board
    }

    /// Covariance of the nine entries, row by row, for the stated corner covariances; in the gauge
    /// `h·dh = 0`, therefore of rank 8.
    pub fn covariance(&self) -> &NineByNine {
        &self.covariance
    }

    /// Root mean square distance between the corners and the mapped board points, in pixels.
    pub fn rms_px(&self) -> f64 {
        self.rms_px
    }

    /// Sum of squared residuals weighted by the corner covariances; expected value `2n − 8` for `n`
    /// corners.
    pub fn chi2(&self) -> f64 {
        self.chi2
    }

    /// Maps a board point to a pixel; `None` for a point behind the camera or on its plane.
    ///
    /// ```
    /// # use boresight_geometry::{Corner, Homography};
    /// # use nalgebra::Point2;
    /// let board_m = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(Point2::from);
    /// let seen = [[100.0, 100.0], [300.0, 110.0], [280.0, 290.0], [90.0, 280.0]];
    /// let corners = seen.map(|px| Corner::isotropic(Point2::from(px), 0.1));
    /// let homography = Homography::fit(&board_m, &corners)?;
    /// let third_px = homography.map(&board_m[2]).ok_or("beyond the horizon")?;
    /// assert!((third_px - corners[2].px).norm() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn map(&self, point_in_board_m: &Point2<f64>) -> Option<Point2<f64>> {
        let mapped = self.image_from_board * point_in_board_m.to_homogeneous();
        (mapped.z > 1e-12).then(|| Point2::new(mapped.x / mapped.z, mapped.y / mapped.z))
    }
}

/// Root mean square distance of the mapped points from the pixels.
fn rms_px(
    image_from_board: &Matrix3<f64>,
    pairs: impl Iterator<Item = (Point2<f64>, Point2<f64>)>,
) -> f64 {
    let (mut squares, mut count) = (0.0, 0.0);
    for (point, px) in pairs {
        squares += (moved(image_from_board, &point) - px).norm_squared();
        count += 1.0;
    }
    f64::sqrt(squares / count)
}

/// Similarity that moves the centroid to the origin and scales the root mean square distance to √2.
fn normalisation(
    points: impl Iterator<Item = Point2<f64>> + Clone,
) -> Result<Matrix3<f64>, NoHomography> {
    let (sum, count) = points
        .clone()
        .fold((Vector2::zeros(), 0.0), |(sum, count), p| (sum + p.coords, count + 1.0));
    let centre = sum / count;
    let scatter = points.fold(Matrix2::zeros(), |sum, p| {
        let off = p.coords - centre;
        sum + off * off.transpose()
    }) / count;
    let spread = scatter.trace();
    if !spread.is_finite() {
        return Err(NoHomography::NotFinite);
    }
    // For small ratios, determinant over squared trace is the squared ratio of minor to major
    // extent.
    if !(scatter.determinant() > COLLINEAR * COLLINEAR * spread * spread) {
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
    // The right null vector of `rows`, from the eigenvectors of the normal matrix: accurate enough
    // as an initial guess, and of fixed size.
    let normal_matrix: NineByNine =
        (rows.transpose() * &rows).fixed_view::<9, 9>(0, 0).into_owned();
    let eigen = SymmetricEigen::new(normal_matrix);
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let (least, next, largest) =
        (order[0], eigen.eigenvalues[order[1]], eigen.eigenvalues[order[8]]);
    // A second null direction means collinear points.
    if !(next > 1e-12 * largest) {
        return Err(NoHomography::Degenerate);
    }
    let h: Nine = eigen.eigenvectors.column(least).into_owned();
    Ok(if h[8] < 0.0 { -h } else { h })
}

/// Normalised points on both sides, and the inverse covariance of each corner.
struct Reprojection<'a> {
    board: &'a [Point2<f64>],
    image: &'a [Point2<f64>],
    weights: &'a [Matrix2<f64>],
}

impl Problem<9> for Reprojection<'_> {
    /// Nine entries row by row, of unit length.
    type State = Nine;
    type Extra = ();

    /// Linearises the problem; `None` if a point falls on the camera's plane.
    fn linearise(&self, h: &Nine) -> Option<Linearised<9>> {
        let mut cost = 0.0;
        let mut gradient = Nine::zeros();
        let mut normal_matrix = NineByNine::zeros();
        for ((b, p), weight) in self.board.iter().zip(self.image).zip(self.weights) {
            let x = Vector3::new(b.x, b.y, 1.0);
            let depth = h.fixed_rows::<3>(6).dot(&x);
            if !(depth.abs() > 1e-9) {
                return None;
            }
            let u = h.fixed_rows::<3>(0).dot(&x) / depth;
            let v = h.fixed_rows::<3>(3).dot(&x) / depth;
            let residual = Vector2::new(p.x - u, p.y - v);
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
        // Fixes the free scale of h without affecting the other eight directions.
        normal_matrix += h * h.transpose() * (normal_matrix.trace() / 9.0);
        cost.is_finite().then_some(Linearised { cost, gradient, normal_matrix, extra: () })
    }

    fn moved(&self, h: &Nine, step: &Nine) -> Nine {
        (h + step).normalize()
    }
}

/// Moves the unseen corners to the expected places on the plane through the seen corners. Leaves
/// them unchanged if fewer than four are seen, or if those span no area.
pub fn expect_unseen(board_points_m: &[Point2<f64>], corners: &mut [Corner]) {
    if corners.iter().all(Corner::is_seen) {
        return;
    }
    let Ok(plane) = Homography::fit(board_points_m, corners) else { return };
    for (point_m, corner) in board_points_m.iter().zip(corners).filter(|(_, c)| !c.is_seen()) {
        if let Some(px) = plane.map(point_m) {
            corner.px = px;
        }
    }
}

/// Projects a covariance onto the changes at constant length of `h`.
fn in_gauge(covariance: &NineByNine, matrix: &Matrix3<f64>) -> NineByNine {
    let h = Nine::from_row_slice(matrix.transpose().as_slice()).normalize();
    let projection = NineByNine::identity() - h * h.transpose();
    projection * covariance * projection
}
