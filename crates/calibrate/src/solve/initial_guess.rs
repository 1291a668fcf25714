//! Initial guess for bundle adjustment: closed forms from the distorted corners.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point2, SymmetricEigen};

use super::{
    bundle::{BundleState, Observations},
    zhang,
};
use boresight_geometry::{
    Camera, Corner, Homography, PrincipalLine, PrincipalPoint, RingEstimate, boards::Board,
    frame::ImageSize, intersect_unweighted, intersect_weighted, mean_px, pose_from_homography,
    principal_line_and_ring, seen_count,
};

/// Least credible error of a corner, in pixels; far below any detector's, it bounds only exact
/// corners.
const NOISE_FLOOR_PX: f64 = 1e-3;
/// Root mean square difference of two views' corners below which both count once, as a fraction of
/// the picture's width: 13 px at 1280.
pub const ALIKE_WIDTHS: f64 = 0.01;
/// Ratio of minor to major extent of the corners below which the board is edge-on.
const THINNEST: f64 = 0.01;

/// Error of a view whose corners are not the image of a flat board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NotPlanar {
    pub(crate) view: usize,
}

/// Homographies and principal lines of the distorted corners, and the intersections of the lines.
pub(crate) struct AsSeen {
    pub(crate) image_from_board: Vec<Matrix3<f64>>,
    pub(crate) lines: Vec<Option<PrincipalLine>>,
    pub(crate) unweighted: Option<PrincipalPoint>,
    pub(crate) weighted: Option<PrincipalPoint>,
    pub(crate) ring: Option<RingEstimate>,
}

/// Fits homographies and principal lines to the distorted corners, as in Chuang 2021: with equal
/// weights, so that no corner dominates where distortion is the largest error.
pub(crate) fn as_seen(
    views: &[Vec<Corner>],
    board_m: &[Point2<f64>],
    image_size: ImageSize,
) -> Result<AsSeen, NotPlanar> {
    let sigma_px = typical_sigma_px(views);
    let homographies: Vec<Homography> = views
        .iter()
        .enumerate()
        .map(|(view, corners)| {
            let missing = NotPlanar { view };
            if thinness(corners).is_nan() || thinness(corners) < THINNEST {
                return Err(missing);
            }
            let equal: Vec<Corner> = corners
                .iter()
                .map(|corner| match corner.is_seen() {
                    true => Corner::isotropic(corner.px, sigma_px),
                    false => *corner,
                })
                .collect();
            Homography::fit(board_m, &equal).map_err(|_| missing)
        })
        .collect::<Result<_, _>>()?;
    let lines: Vec<Option<PrincipalLine>> = homographies
        .iter()
        .zip(views)
        .map(|(homography, corners)| {
            PrincipalLine::of(homography, image_size.centre_px(), mean_px(corners)).ok()
        })
        .collect();
    let usable: Vec<PrincipalLine> = lines.iter().flatten().cloned().collect();
    Ok(AsSeen {
        image_from_board: homographies.iter().map(|h| *h.image_from_board()).collect(),
        unweighted: intersect_unweighted(&usable).ok(),
        weighted: intersect_weighted(&usable).ok(),
        ring: principal_line_and_ring(&usable).ok(),
        lines,
    })
}

/// Ratio of minor to major extent of the seen corners.
fn thinness(corners: &[Corner]) -> f64 {
    let mean = mean_px(corners);
    let seen = corners.iter().filter(|corner| corner.is_seen());
    let scatter = seen.fold(Matrix2::zeros(), |scatter, corner| {
        let off = corner.px - mean;
        scatter + off * off.transpose()
    });
    let eigenvalues = SymmetricEigen::new(scatter).eigenvalues;
    (eigenvalues.min().max(0.0) / eigenvalues.max()).sqrt()
}

/// Floor of the noise factor: [`NOISE_FLOOR_PX`] over the typical stated error.
pub(crate) fn noise_floor(views: &[Vec<Corner>]) -> f64 {
    NOISE_FLOOR_PX / typical_sigma_px(views)
}

/// Typical stated error of a corner coordinate in pixels: root mean square.
pub(crate) fn typical_sigma_px(views: &[Vec<Corner>]) -> f64 {
    let (sum, count) = views
        .iter()
        .flatten()
        .filter(|corner| corner.is_seen())
        .fold((0.0, 0.0), |(sum, count), c| (sum + c.sigma_px().powi(2), count + 1.0));
    (sum / count).sqrt()
}

/// Initial cameras, each with the poses of the views, most promising first.
///
/// Candidates: principal lines and ring; Zhang's closed form; the median of single-view focal
/// lengths with the principal point at the image centre; a lens with a focal length of one picture
/// width. Candidates without a pose for some view are left out; the lowest reprojection cost comes
/// first.
pub(crate) fn starts(
    observations: &Observations,
    as_seen: &AsSeen,
    image_size: ImageSize,
) -> Vec<BundleState> {
    let width_px = f64::from(image_size.width_px.max(image_size.height_px));
    let centre = image_size.centre_px();
    let plausible = |camera: &Camera| {
        camera.f_px.iter().all(|f| (0.2 * width_px..20.0 * width_px).contains(f))
            && (camera.pp_px - centre).norm() < 0.5 * width_px
    };
    let mut cameras: Vec<Camera> = Vec::new();
    if let Some(ring) = &as_seen.ring {
        cameras.push(Camera::pinhole(ring.f_px, ring.pp_px));
    }
    if let Some(camera) = zhang::closed_form(&as_seen.image_from_board, image_size) {
        cameras.push(Camera::pinhole(camera.f_px.mean(), camera.pp_px));
    }
    let mut focal: Vec<f64> = as_seen
        .lines
        .iter()
        .flatten()
        .map(|line| {
            let along = (centre - line.origin_px).dot(&line.direction()) - line.v_px;
            (line.d_px * line.d_px - along * along).sqrt()
        })
        .filter(|f_px| f_px.is_finite())
        .collect();
    focal.sort_by(f64::total_cmp);
    if let Some(f_px) = focal.get(focal.len() / 2) {
        cameras.push(Camera::pinhole(*f_px, centre));
    }
    cameras.retain(plausible);
    cameras.push(Camera::pinhole(width_px, centre));
    let mut starts: Vec<(f64, BundleState)> = cameras
        .into_iter()
        .filter_map(|camera| {
            let cam_from_board = poses(&as_seen.image_from_board, &camera)?;
            let cost = observations.cost(&camera, &cam_from_board)?;
            Some((cost, BundleState { camera, cam_from_board }))
        })
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.into_iter().map(|(_, state)| state).collect()
}

/// Poses of all views under `camera`.
pub(crate) fn poses(
    image_from_board: &[Matrix3<f64>],
    camera: &Camera,
) -> Option<Vec<Isometry3<f64>>> {
    image_from_board.iter().map(|h| pose_from_homography(h, camera)).collect()
}

/// Number of views distinct from all earlier views.
pub(crate) fn distinct_views(views: &[Vec<Corner>], board: &Board, image_size: ImageSize) -> usize {
    alike_views(views, board, image_size).0.len()
}

/// Views distinct from all earlier ones, as [`first_alike`].
pub(crate) fn alike_views(
    views: &[Vec<Corner>],
    board: &Board,
    image_size: ImageSize,
) -> (Vec<usize>, Vec<usize>) {
    first_alike(views, board, ALIKE_WIDTHS * f64::from(image_size.width_px))
}

/// Indices of views that differ from all earlier distinct ones by `limit_px` or more (root mean
/// square), and for each view the place in that list of its distinct view.
pub(crate) fn first_alike(
    views: &[Vec<Corner>],
    board: &Board,
    limit_px: f64,
) -> (Vec<usize>, Vec<usize>) {
    let means_px: Vec<Option<Point2<f64>>> =
        views.iter().map(|view| view.iter().all(Corner::is_seen).then(|| mean_px(view))).collect();
    let (mut kept, mut place) = (Vec::new(), Vec::with_capacity(views.len()));
    for (index, view) in views.iter().enumerate() {
        let alike = kept.iter().position(|other: &usize| {
            // Means are never farther apart than corners are.
            let means = means_px[index].zip(means_px[*other]);
            means.is_none_or(|(mean, other)| (mean - other).norm() < limit_px)
                && rms_distance_px(view, &views[*other], board) < limit_px
        });
        place.push(alike.unwrap_or(kept.len()));
        if alike.is_none() {
            kept.push(index);
        }
    }
    (kept, place)
}

/// Root mean square distance between corresponding corners seen in both views, or between opposite
/// corners if that is less: some boards look the same upside down. Infinite unless most corners are
/// seen in both, because another part of the board adds information.
fn rms_distance_px(a: &[Corner], b: &[Corner], board: &Board) -> f64 {
    let most = seen_count(a).max(seen_count(b));
    let mean = |pairs: &mut dyn Iterator<Item = (&Corner, &Corner)>| {
        let in_both = pairs.filter(|(a, b)| a.is_seen() && b.is_seen());
        let (sum, count) = in_both.fold((0.0, 0_usize), |(sum, count), (a, b)| {
            (sum + (a.px - b.px).norm_squared(), count + 1)
        });
        if 10 * count >= 9 * most { sum / count.max(1) as f64 } else { f64::INFINITY }
    };
    let same = mean(&mut a.iter().zip(b));
    let opposite = |(index, corner)| Some((corner, &b[board.target().half_turn(index)?]));
    let turned = mean(&mut a.iter().enumerate().filter_map(opposite));
    same.min(turned).sqrt()
}
