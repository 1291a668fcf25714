//! Plane of a board in a picture, bent as the lens bends lines.

use boresight_geometry::{Homography, frame::ImageSize};
use nalgebra::Point2;

/// Bounds of the division model's coefficient at the corner of the picture: fisheye to pincushion.
const LENS: (f64, f64) = (-0.9, 0.4);
const LENS_STEPS: usize = 11;

/// Plane of a board in a picture of a lens that bends lines: a homography with Fitzgibbon's
/// division model (2001) about the middle of the picture.
pub(super) struct Plane {
    homography: Homography,
    bend: f64,
    centre_px: Point2<f64>,
    radius_px: f64,
}

impl Plane {
    /// Plane through pairs of points, in any unit, and pixels; the origin of the points is in front
    /// of the camera. Allocates nothing. `None` if the pairs don't determine it.
    pub(super) fn through(
        pairs: &(impl Iterator<Item = (Point2<f64>, Point2<f64>)> + Clone),
        image_size: ImageSize,
    ) -> Option<Self> {
        let centre_px = image_size.centre_px();
        let radius_px = centre_px.coords.norm().max(1.0);
        let fit = |bend: f64| {
            let straight = |(point, px): (Point2<f64>, Point2<f64>)| {
                let off = (px - centre_px) / radius_px;
                (point, centre_px + radius_px * off / (1.0 + bend * off.norm_squared()))
            };
            Homography::fit_unweighted(pairs.clone().map(straight)).ok()
        };
        let cost = |bend: f64| fit(bend).map_or(f64::INFINITY, |fit| fit.rms_px());
        // Golden-section search.
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        let (mut low, mut high) = LENS;
        let mut inner = [high - golden * (high - low), low + golden * (high - low)];
        let mut costs = inner.map(cost);
        for _ in 0..LENS_STEPS {
            if costs[0] < costs[1] {
                high = inner[1];
                inner = [high - golden * (high - low), inner[0]];
                costs = [cost(inner[0]), costs[0]];
            } else {
                low = inner[0];
                inner = [inner[1], low + golden * (high - low)];
                costs = [costs[1], cost(inner[1])];
            }
        }
        let bend = (low + high) / 2.0;
        Some(Self { homography: fit(bend)?, bend, centre_px, radius_px })
    }

    /// Pixel of a point of the plane.
    pub(super) fn px(&self, point: &Point2<f64>) -> Option<Point2<f64>> {
        let straight = self.homography.map(point)?;
        let off = (straight - self.centre_px) / self.radius_px;
        // off = bent / (1 + bend · |bent|²), solved for the bent radius.
        let discriminant = 1.0 - 4.0 * self.bend * off.norm_squared();
        let stretch = 2.0 / (1.0 + discriminant.max(0.0).sqrt());
        (discriminant >= 0.0).then(|| self.centre_px + self.radius_px * stretch * off)
    }
}
