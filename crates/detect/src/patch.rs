//! Pixels around a corner for the fit of the edge model.

use image::GrayImage;

/// Largest reach of a patch from its central pixel.
pub(super) const RADIUS_LIMIT_PX: i32 = 24;

/// Neighbourhood of a corner: the intersection of a parallelogram along the board's axes and a
/// circle, or of bands along the axes if there are markers in the squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    /// Central pixel of the patch: column, row.
    pub(super) centre_px: (i32, i32),
    /// Map from an offset in pixels to squares along both axes.
    board_from_px: [[f32; 2]; 2],
    /// Half the extent of the parallelogram in squares.
    reach_squares: f32,
    /// Half the width of the bands along both axes in squares; infinite for the whole
    /// parallelogram.
    band_squares: f32,
    /// Half the width of the parallelogram across the narrower axis, in pixels.
    pub(super) half_px: f64,
}

impl Patch {
    /// Patch of the pixels within `reach_squares` of `start` along the axes `u`, `v` (pixels per
    /// square), but at least `least_px` and at most [`RADIUS_LIMIT_PX`] away; of these, only pixels
    /// within `band_squares` of one of the axes. `None` if the axes are parallel or not finite.
    pub(super) fn around(
        start: [f64; 2],
        [u, v]: [[f64; 2]; 2],
        (reach_squares, least_px): (f64, f64),
        band_squares: f64,
    ) -> Option<Self> {
        let area_px2 = u[0] * v[1] - u[1] * v[0];
        let height_px = area_px2.abs() / libm::hypot(u[0], u[1]).max(libm::hypot(v[0], v[1]));
        // Also refuses NaN.
        if !(height_px > 1.0) {
            return None;
        }
        let reach_squares = reach_squares.max(least_px / height_px);
        let inverse = [[v[1], -v[0]], [-u[1], u[0]]];
        Some(Self {
            centre_px: (start[0].round() as i32, start[1].round() as i32),
            board_from_px: inverse.map(|row| row.map(|value| (value / area_px2) as f32)),
            reach_squares: reach_squares as f32,
            band_squares: band_squares as f32,
            half_px: reach_squares * height_px,
        })
    }

    /// Area of the whole patch, including any part outside the picture.
    pub(super) fn area_px(&self) -> f64 {
        let [[a, b], [c, d]] = self.board_from_px.map(|row| row.map(f64::from));
        let parallelogram = (2.0 * f64::from(self.reach_squares)).powi(2) / (a * d - b * c).abs();
        let free = (1.0 - f64::from(self.band_squares / self.reach_squares)).max(0.0);
        parallelogram.min(std::f64::consts::PI * f64::from(RADIUS_LIMIT_PX).powi(2))
            * (1.0 - free * free)
    }

    /// True if only bands along the axes belong to the patch.
    pub(super) fn has_bands(&self) -> bool {
        self.band_squares < self.reach_squares
    }

    /// Half the width of the bands across the narrower axis, in pixels; infinite without bands.
    pub(super) fn band_px(&self) -> f64 {
        self.half_px * f64::from(self.band_squares / self.reach_squares)
    }

    /// True if an offset from the centre lies in the patch and in a picture of `size_px`. Without
    /// branches, so that a loop is vectorised.
    #[inline(always)]
    pub(super) fn holds(&self, size_px: [f32; 2], [x, y]: [f32; 2]) -> bool {
        let [one, other] = self.board_from_px.map(|[a, b]| (a * x + b * y).abs());
        let radius_px = RADIUS_LIMIT_PX as f32;
        let is_inside = |at: f32, size: f32| (at >= 0.0) & (at <= size - 1.0);
        let [left, top] = [self.centre_px.0 as f32, self.centre_px.1 as f32];
        (one.max(other) <= self.reach_squares)
            & (one.min(other) <= self.band_squares)
            & (x * x + y * y <= radius_px * radius_px)
            & is_inside(left + x, size_px[0])
            & is_inside(top + y, size_px[1])
    }

    /// Reach of the whole patch from the centre along both axes, in pixels.
    pub(super) fn reach_px(&self) -> [f64; 2] {
        let [[a, b], [c, d]] = self.board_from_px.map(|row| row.map(f64::from));
        let px2_per_square = 1.0 / (a * d - b * c).abs();
        let [v, u] = [libm::hypot(a, b), libm::hypot(c, d)].map(|length| length * px2_per_square);
        [u, v].map(|side_px| {
            (f64::from(self.reach_squares) * side_px).min(f64::from(RADIUS_LIMIT_PX))
        })
    }

    /// First and last offsets of the pixels in a row, clipped to the picture: one run, or two where
    /// the bands are apart. A run is empty if its last offset is smaller.
    pub(super) fn runs(&self, image: &GrayImage, dy: i32) -> [(i32, i32); 2] {
        let (cx, radius_px) = (self.centre_px.0, RADIUS_LIMIT_PX);
        let round = ((radius_px * radius_px - dy * dy) as f32).sqrt();
        let (mut low, mut high) = (-round, round);
        for axis in self.board_from_px {
            let within = within(axis, dy, self.reach_squares);
            (low, high) = (low.max(within.0), high.min(within.1));
        }
        const NONE: (i32, i32) = (0, -1);
        let clipped = |(from, to): (f32, f32)| {
            let (from, to) = (from.max(low).ceil(), to.min(high).floor());
            if from > to {
                return NONE;
            }
            ((from as i32).max(-cx), (to as i32).min(image.width() as i32 - 1 - cx))
        };
        if !self.has_bands() {
            return [clipped((low, high)), NONE];
        }
        let bands = self.board_from_px.map(|axis| clipped(within(axis, dy, self.band_squares)));
        let [one, two] = if bands[0].0 <= bands[1].0 { bands } else { [bands[1], bands[0]] };
        let is_empty = |run: (i32, i32)| run.1 < run.0;
        if is_empty(one) || is_empty(two) || two.0 > one.1 + 1 {
            return [one, two];
        }
        [(one.0, one.1.max(two.1)), NONE]
    }
}

/// Interval of `dx` in which `|a dx + b dy|` is at most `squares` in the row `dy`; the lower end is
/// above the upper if there is none.
fn within([a, b]: [f32; 2], dy: i32, squares: f32) -> (f32, f32) {
    let across = b * dy as f32;
    let half = (squares / a).abs();
    if half.is_finite() {
        let middle = -across / a;
        (middle - half, middle + half)
    } else if across.abs() > squares {
        (f32::INFINITY, f32::NEG_INFINITY)
    } else {
        (f32::NEG_INFINITY, f32::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_hold_each_pixel_of_the_bands_once() {
        let image = GrayImage::new(60, 60);
        for (u, v) in
            [([20.0, 3.0], [-4.0, 19.0]), ([17.0, 0.0], [0.0, 15.0]), ([9.0, 9.0], [-9.0, 9.0])]
        {
            for start in [[30.2, 29.7], [3.0, 55.0]] {
                for band_squares in [0.1, 0.2, f64::INFINITY] {
                    let limits = (0.48, 3.0);
                    let patch = Patch::around(start, [u, v], limits, band_squares).expect("axes");
                    let [[a, b], [c, d]] = patch.board_from_px;
                    for dy in -24..=24 {
                        let is_in = |dx: i32| {
                            let (x, y) = (dx as f32, dy as f32);
                            let (p, q) = ((a * x + b * y).abs(), (c * x + d * y).abs());
                            p.max(q) < 0.48
                                && p.min(q) < band_squares as f32
                                && dx * dx + dy * dy <= 24 * 24
                                && (0..60).contains(&(patch.centre_px.0 + dx))
                        };
                        let runs = patch.runs(&image, dy);
                        let found: Vec<i32> =
                            runs.iter().flat_map(|(from, to)| *from..=*to).collect();
                        let wanted: Vec<i32> = (-24..=24).filter(|dx| is_in(*dx)).collect();
                        assert_eq!(found, wanted, "{u:?} {v:?} {start:?} {band_squares} row {dy}");
                    }
                }
            }
        }
    }
}
