//! The sheet at one pose: intersection with a ray.

use super::bend::BentView;

/// Minimum depth at which a ray meets the sheet, for a ray of length 1 along the axis.
const LEAST_DEPTH: f32 = 1e-6;

/// Sheet coordinates (squares) from undistorted rays, for a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetView {
    pub(super) rows: [[f32; 3]; 3],
    /// Middle of the sheet, and the bend, unless flat.
    pub(super) bent: Option<([f32; 2], BentView)>,
}

/// Position of a pixel on the sheet, and the change per pixel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spot {
    /// Distance of the ray to the sheet's plane: zero, negative or NaN if the ray misses.
    pub(super) depth: f32,
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) by_x: [f32; 2],
    pub(super) by_y: [f32; 2],
}

/// Ray of a pixel, with the derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelRay {
    pub(super) ray: [f32; 2],
    pub(super) by_x: [f32; 2],
    pub(super) by_y: [f32; 2],
}

impl Spot {
    pub(super) fn is_met(&self) -> bool {
        // False also for NaN: a pixel without a ray.
        self.depth > LEAST_DEPTH
    }
}

impl SheetView {
    /// Sheet coordinates of a row of rays; far outside the sheet where a ray misses the plane.
    pub(super) fn trace_row(&self, rays_x: &[f32], rays_y: &[f32], us: &mut [f32], vs: &mut [f32]) {
        let [a, b, c] = &self.rows;
        for ((x, y), (u, v)) in rays_x.iter().zip(rays_y).zip(us.iter_mut().zip(vs.iter_mut())) {
            let w = c[0] * x + c[1] * y + c[2];
            // False also for NaN: a pixel without a ray.
            let inverse = if w > LEAST_DEPTH { 1.0 / w } else { 0.0 };
            let missed = if w > LEAST_DEPTH { 0.0 } else { -1e6 };
            let (x, y) = if x.is_finite() { (*x, *y) } else { (0.0, 0.0) };
            *u = (a[0] * x + a[1] * y + a[2]) * inverse + missed;
            *v = (b[0] * x + b[1] * y + b[2]) * inverse + missed;
            if let Some(bent) = &self.bent {
                [*u, *v] = met(bent, [x, y], [*u, *v]);
            }
        }
    }

    /// Spot of a pixel, without branches, so that several views are computed at once.
    #[inline(always)]
    pub(super) fn spot(&self, pixel: &PixelRay) -> Spot {
        let [a, b, c] = &self.rows;
        let [x, y] = pixel.ray;
        let w = c[0] * x + c[1] * y + c[2];
        let inverse = 1.0 / w;
        let u = (a[0] * x + a[1] * y + a[2]) * inverse;
        let v = (b[0] * x + b[1] * y + b[2]) * inverse;
        let change = |ray: [f32; 2]| {
            let dw = c[0] * ray[0] + c[1] * ray[1];
            [
                (a[0] * ray[0] + a[1] * ray[1] - u * dw) * inverse,
                (b[0] * ray[0] + b[1] * ray[1] - v * dw) * inverse,
            ]
        };
        let (by_x, by_y) = (change(pixel.by_x), change(pixel.by_y));
        let Some(bent @ (middle, view)) = &self.bent else {
            return Spot { depth: w, u, v, by_x, by_y };
        };
        let [u, v] = met(bent, pixel.ray, [u, v]);
        let from_middle = [u - middle[0], v - middle[1]];
        let change = |by_ray, by_flat| view.change(pixel.ray, from_middle, by_ray, by_flat);
        let (by_x, by_y) = (change(pixel.by_x, by_x), change(pixel.by_y, by_y));
        Spot { depth: w, u, v, by_x, by_y }
    }
}

/// Intersection of a ray with the bent sheet, from the intersection `flat` with a flat sheet.
#[inline(always)]
fn met((middle, view): &([f32; 2], BentView), ray: [f32; 2], flat: [f32; 2]) -> [f32; 2] {
    let [u, v] = view.met(ray, [flat[0] - middle[0], flat[1] - middle[1]]);
    [u + middle[0], v + middle[1]]
}
