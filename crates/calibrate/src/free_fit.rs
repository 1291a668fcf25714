//! Free homographies of the views: of the observed corners, or, under a wide lens, of corners
//! converted to a pinhole's.
//!
//! A lens symmetric about its centre maps every line through that centre to itself, so the plane of
//! symmetry of a board appears as a line through the principal point under any such lens. The
//! closed forms of the principal line need a homography, though, and only a pinhole has one: see
//! `docs/method.md`, section 2.12.

use nalgebra::{Matrix3, Point2};

use super::{
    check::noise_inflation::Residual,
    solve::{
        bundle::Observations,
        free_homography::{self, DistortionCentrePrior, FreeHomographies},
    },
};
use boresight_geometry::{Camera, Corner, Homography, frame::ImageSize};

/// Free homographies of all views, with residuals at the corners in the picture.
pub(super) struct FreeFit {
    /// Free homographies, with a line for every given view; `None` for views outside a pinhole's
    /// field.
    pub(super) free: FreeHomographies,
    /// Residual and stated covariance of each corner in the picture, view by view; empty for views
    /// outside a pinhole's field.
    pub(super) residuals_px: Vec<Vec<Residual>>,
    /// Fitted corners, if no view was left out.
    pub(super) observations: Option<Observations>,
}

impl FreeFit {
    /// Fit of the observed corners.
    pub(super) fn of(free: FreeHomographies, observations: Observations) -> Self {
        let all = free.residuals_px(&observations);
        let mut all = all.into_iter();
        let of_view = |view| all.by_ref().take(observations.view(view).len()).collect();
        let residuals_px = (0..observations.view_count()).map(of_view).collect();
        Self { free, residuals_px, observations: Some(observations) }
    }

    /// Fits the corners converted to a pinhole with the focal length and principal point of
    /// `camera`. Views with a corner outside its field are left out. `None` if the fit fails.
    pub(super) fn straightened(
        views: &[Vec<Corner>],
        board_m: &[Point2<f64>],
        image_size: ImageSize,
        camera: &Camera,
    ) -> Option<Self> {
        let straight = |view: &Vec<Corner>| -> Option<Vec<Corner>> {
            view.iter().map(|corner| camera.straighten_corner(corner)).collect()
        };
        let (kept, straight): (Vec<usize>, Vec<Vec<Corner>>) = views
            .iter()
            .enumerate()
            .filter_map(|(number, view)| Some((number, straight(view)?)))
            .unzip();
        let slices: Vec<&[Corner]> = straight.iter().map(Vec::as_slice).collect();
        let observations = Observations::new(board_m, &slices).ok()?;
        let image_from_board: Vec<Matrix3<f64>> = straight
            .iter()
            .map(|view| Some(*Homography::fit(board_m, view).ok()?.image_from_board()))
            .collect::<Option<_>>()?;
        let prior = DistortionCentrePrior::of(image_size);
        let free = free_homography::fit(&observations, prior, &image_from_board)?;
        let corners = kept.iter().flat_map(|number| &views[*number]);
        let seen = corners.filter(|corner| corner.is_seen());
        let mut in_picture = free.residuals_px(&observations).into_iter().zip(seen).map(
            |((residual_px, straight_px2), corner)| {
                // The local scale is the root of the ratio of the areas of the error ellipses.
                let areas = straight_px2.determinant() / corner.covariance_px2.determinant();
                (residual_px / libm::pow(areas, 0.25), corner.covariance_px2)
            },
        );
        let mut residuals_px = vec![Vec::new(); views.len()];
        for (number, view) in kept.iter().enumerate() {
            residuals_px[*view] =
                in_picture.by_ref().take(observations.view(number).len()).collect();
        }
        let is_whole = kept.len() == views.len();
        Some(Self {
            free: free.with_views(&kept, views.len()),
            residuals_px,
            observations: is_whole.then_some(observations),
        })
    }
}
