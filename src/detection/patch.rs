//! The pixels around a corner to which the edge model is fitted.

use image::GrayImage;

/// A neighbourhood of a corner: the intersection of a parallelogram along the board's axes and a circle, or of bands along
/// the axes if something else is drawn in the squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Patch {
    /// Central pixel.
    pub(super) centre_px: (i32, i32),
    pub(super) radius_px: i32,
    /// Maps an offset in pixels to squares along both axes.
    board_from_px: [[f32; 2]; 2],
    /// Half the extent of the parallelogram in squares.
    reach_squares: f32,
    /// Half the width of the bands along both axes in squares; infinite for the whole parallelogram.
    band_squares: f32,
    /// Half the width of the parallelogram across its narrower axis, in pixels.
    pub(super) half_px: f64,
}

impl Patch {
    /// The pixels within `reach_squares` of `start` along the axes `u`, `v` (pixels per square), but at least
    /// `least_px` and at most `radius_px` away; of these, only pixels within `band_squares` of one of the axes.
    /// `None` if the axes are parallel or not finite.
    pub(super) fn around(
        start: [f64; 2],
        [u, v]: [[f64; 2]; 2],
        (reach_squares, least_px, radius_px): (f64, f64, i32),
        band_squares: f64,
    ) -> Option<Self> {
        let area_px2 = u[0] * v[1] - u[1] * v[0];
        let height_px = area_px2.abs() / u[0].hypot(u[1]).max(v[0].hypot(v[1]));
        // Also refuses NaN.
        if !(height_px > 1.0) {
            return None;
        }
        let reach_squares = reach_squares.max(least_px / height_px);
        let inverse = [[v[1], -v[0]], [-u[1], u[0]]];
        Some(Self {
            centre_px: (start[0].round() as i32, start[1].round() as i32),
            radius_px,
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
        parallelogram.min(std::f64::consts::PI * f64::from(self.radius_px).powi(2))
            * (1.0 - free * free)
    }

    /// Whether only bands along the axes belong to the patch.
    pub(super) fn has_bands(&self) -> bool {
        self.band_squares < self.reach_squares
    }

    /// Half the width of the bands across the narrower axis, in pixels; infinite without bands.
    pub(super) fn band_px(&self) -> f64 {
        self.half_px * f64::from(self.band_squares / self.reach_squares)
    }

    /// Whether a pixel of the parallelogram lies in one of the bands.
    pub(super) fn in_bands(&self, dx: i32, dy: i32) -> bool {
        let [[a, b], [c, d]] = self.board_from_px;
        let (dx, dy) = (dx as f32, dy as f32);
        (a * dx + b * dy).abs().min((c * dx + d * dy).abs()) < self.band_squares
    }

    /// How far the whole patch reaches from its centre along both axes, in pixels.
    pub(super) fn reach_px(&self) -> [f64; 2] {
        let [[a, b], [c, d]] = self.board_from_px.map(|row| row.map(f64::from));
        let px2_per_square = 1.0 / (a * d - b * c).abs();
        let [v, u] = [a.hypot(b), c.hypot(d)].map(|length| length * px2_per_square);
        [u, v]
            .map(|side_px| (f64::from(self.reach_squares) * side_px).min(f64::from(self.radius_px)))
    }

    /// First and last offset of the pixels in a row, clipped to the picture; empty if the last is smaller.
    pub(super) fn row(&self, image: &GrayImage, dy: i32) -> (i32, i32) {
        let (cx, radius_px) = (self.centre_px.0, self.radius_px);
        let round = ((radius_px * radius_px - dy * dy) as f32).sqrt();
        let (mut low, mut high) = (-round, round);
        for [p, q] in self.board_from_px {
            let middle = -q * dy as f32 / p;
            let half = (self.reach_squares / p).abs();
            if half.is_finite() {
                (low, high) = (low.max(middle - half), high.min(middle + half));
            } else if (q * dy as f32).abs() > self.reach_squares {
                return (0, -1);
            }
        }
        let (low, high) = (low.ceil() as i32, high.floor() as i32);
        (low.max(-cx), high.min(image.width() as i32 - 1 - cx))
    }
}
