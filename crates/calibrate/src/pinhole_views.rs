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
        free_homography::{DistortionCentrePrior, FreeHomographies, RoughHomographies, fit_near},
    },
};
use boresight_geometry::{Camera, Corner, Homography, frame::ImageSize};

/// Corners as a pinhole with square pixels shows them.
pub(super) struct PinholeViews {
    /// Indices of the views inside its field.
    kept: Vec<usize>,
    /// Number of all views.
    count: usize,
    pub(super) observations: Observations,
    prior: DistortionCentrePrior,
    /// Ratio of height to width of the camera's pixels.
    pixel_aspect: f64,
}

impl PinholeViews {
    /// The observed corners.
    pub(super) fn observed(observations: Observations, image_size: ImageSize) -> Self {
        let count = observations.view_count();
        Self {
            kept: (0..count).collect(),
            count,
            observations,
            prior: DistortionCentrePrior::of(image_size),
            pixel_aspect: 1.0,
        }
    }

    /// Corners in a picture whose pixels of the given ratio of height to width became square:
    /// principal lines meet in the principal point only there.
    pub(super) fn squared(
        observations: Observations,
        image_size: ImageSize,
        pixel_aspect: f64,
    ) -> Self {
        let observed = Self::observed(observations, image_size);
        let prior = observed.prior.with_square_pixels(pixel_aspect);
        Self { prior, pixel_aspect, ..observed }
    }

    /// Corners converted to a pinhole with the focal length and principal point of `camera`. Views
    /// with a corner outside its field are left out. `None` if a corner isn't finite.
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
        let observed = Self::observed(observations, image_size);
        Some(Self { kept, count: views.len(), ..observed })
    }

    /// First fit of the homographies. `None` if it fails.
    pub(super) fn rough(&self) -> Option<RoughHomographies> {
        let through = |view: usize| {
            let corners = self.observations.view(view).iter();
            let pairs = corners.map(|corner| (corner.board_m, corner.px));
            Some(*Homography::fit_unweighted(pairs).ok()?.image_from_board())
        };
        let views = 0..self.observations.view_count();
        let image_from_board: Vec<Matrix3<f64>> = views.map(through).collect::<Option<_>>()?;
        RoughHomographies::of(&self.observations, self.prior, &image_from_board)
    }

    /// Homographies and lines near a first fit, with a line for every view; `None` for views
    /// outside a pinhole's field. `None` if the fit fails.
    pub(super) fn fit_near(&self, rough: &RoughHomographies) -> Option<FreeHomographies> {
        let free = fit_near(&self.observations, self.prior, rough)?;
        Some(free.with_pixel_aspect(self.pixel_aspect).with_views(&self.kept, self.count))
    }

    /// False if views were left out.
    pub(super) fn is_whole(&self) -> bool {
        self.kept.len() == self.count
    }

    /// Residual and stated covariance of each corner of `views`, the source of these, in the
    /// camera's picture, view by view; empty for views outside a pinhole's field.
    pub(super) fn residuals_px(
        &self,
        rough: &RoughHomographies,
        views: &[Vec<Corner>],
    ) -> Vec<Vec<Residual>> {
        let mut of_pinhole = rough.residuals_px(&self.observations).into_iter();
        let mut residuals_px = vec![Vec::new(); self.count];
        for view in &self.kept {
            let seen = views[*view].iter().filter(|corner| corner.is_seen());
            residuals_px[*view] = seen
                .zip(of_pinhole.by_ref())
                .map(|(corner, (mut residual_px, pinhole_px2))| {
                    // The local scale is the root of the ratio of the areas of the error ellipses.
                    let areas = pinhole_px2.determinant() / corner.covariance_px2.determinant();
                    residual_px /= libm::pow(areas, 0.25);
                    (residual_px, corner.covariance_px2)
                })
                .collect();
        }
        residuals_px
    }
}
