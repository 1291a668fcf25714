//! Patches: chosen at corners, found by normalised correlation, to a fraction of a pixel.

use boresight_geometry::{
    frame::ImageSize,
    simd::{Loop, widest},
};
use image::GrayImage;
use nalgebra::Point2;

use crate::level::{COARSE, MEAN_LEVEL};

/// Half side of a patch in the full-size picture, px.
pub const FINE_HALF: usize = 15;
/// Side of a patch in the full-size picture, px.
pub(crate) const FINE_SIDE: usize = 2 * FINE_HALF + 1;
/// Half side of a patch in the reduced picture, px.
pub const COARSE_HALF: usize = 7;
/// Half side of the search around the prediction, px.
pub const FINE_SEARCH: usize = 5;
/// Half side of the search in the reduced picture; four times as far in the full-size picture.
pub const COARSE_SEARCH: usize = 12;
/// Columns and rows of cells, each with at most one patch.
pub const GRID: [usize; 2] = [14, 10];
/// Minimum mean square of the slope along the weaker direction of a corner, levels per px squared:
/// noise after levelling stays below.
const LEAST_CORNER: f32 = 16.0;
/// Minimum correlation of a match.
const LEAST_CORRELATION: f32 = 0.6;
/// Minimum curvature of the correlation along the flatter direction, per px squared: an edge slides
/// along itself.
const LEAST_CURVATURE: f32 = 0.002;

/// Square of levels around a point, relative to the mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    half: usize,
    /// Levels, row by row.
    bytes: Vec<u8>,
    sum: i64,
    /// Root of the sum of squares about the mean.
    norm: f32,
}

/// Match of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Centre, px.
    pub px: Point2<f64>,
    /// Normalised correlation, at most 1.
    pub correlation: f32,
}

impl Patch {
    /// Square around the pixel (x, y); `None` unless inside the picture.
    pub fn at(image: &GrayImage, [x, y]: [i64; 2], half: usize) -> Option<Self> {
        let (bytes, side) = (square(image, [x, y], half)?, 2 * half + 1);
        Self::from_bytes(&bytes, side)
    }

    /// Patch from levels, row by row, as from [`Self::bytes`].
    pub fn from_bytes(bytes: &[u8], side: usize) -> Option<Self> {
        if side.is_multiple_of(2) || bytes.len() != side * side {
            return None;
        }
        let level = |v: &u8| i64::from(*v) - i64::from(MEAN_LEVEL);
        let sum: i64 = bytes.iter().map(level).sum();
        let squares: i64 = bytes.iter().map(|v| level(v).pow(2)).sum();
        let norm =
            (squares as f64 - (sum * sum) as f64 / bytes.len() as f64).max(0.0).sqrt() as f32;
        Some(Self { half: side / 2, bytes: bytes.to_vec(), sum, norm })
    }

    /// Levels, row by row.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Finds the patch at most `search` px around `guess`. `None` if the area isn't inside the
    /// picture, nothing there is similar, or only an edge is.
    pub fn find(&self, image: &GrayImage, guess: [i64; 2], search: usize) -> Option<Match> {
        let (side, window) = (2 * self.half + 1, 2 * search + 1);
        let area = square(image, guess, self.half + search)?;
        let wide = side + window - 1;
        // One more column of zeros in the patch, so that rows are even.
        let own = padded(&self.bytes, side);
        let levels = padded(&area, wide);
        let sums = Sums::of(&levels, wide);
        let count = (side * side) as f64;
        let mut surface = vec![0.0_f32; window * window];
        let into = &mut surface;
        widest(Products { own: &own, levels: &levels, side, wide, into });
        for (n, product) in surface.iter_mut().enumerate() {
            let (sum, squares) = sums.over(n % window, n / window, side);
            let norm =
                (squares as f64 - (sum * sum) as f64 / count).max(0.0).sqrt() as f32 * self.norm;
            let cross = f64::from(*product) - (self.sum * sum) as f64 / count;
            *product = if norm > 1.0 { cross as f32 / norm } else { 0.0 };
        }
        let (at, peak) = peak(&surface, window)?;
        let from = |guess: i64, at: f32| guess as f64 - search as f64 + f64::from(at);
        Some(Match {
            px: Point2::new(from(guess[0], at[0]), from(guess[1], at[1])),
            correlation: peak,
        })
    }
}

/// Sums of the products of a patch's levels with those at each place of an area: both padded, with
/// `side` and `wide` levels a row.
struct Products<'a> {
    own: &'a [f32],
    levels: &'a [f32],
    side: usize,
    wide: usize,
    into: &'a mut [f32],
}

impl Loop for Products<'_> {
    type Output = ();

    /// Sums, exact in any order: a thousand products of levels stay below 2²⁴.
    #[inline(always)]
    fn run(self) {
        const LANES: usize = 16;
        let Self { own, levels, side, wide, into } = self;
        let window = wide - side + 1;
        for (n, product) in into.iter_mut().enumerate() {
            let (x, y) = (n % window, n / window);
            let mut lanes = [0.0_f32; LANES];
            for (row, own) in own.chunks_exact(side + 1).enumerate() {
                let other = &levels[(y + row) * (wide + 1) + x..][..side + 1];
                let pairs = own.as_chunks::<LANES>().0.iter().zip(other.as_chunks::<LANES>().0);
                for (own, other) in pairs {
                    for k in 0..LANES {
                        lanes[k] += own[k] * other[k];
                    }
                }
            }
            *product = lanes.iter().sum();
        }
    }
}

/// Rows of `side` levels about the mean level, each followed by a zero.
fn padded(bytes: &[u8], side: usize) -> Vec<f32> {
    let mut levels = vec![0.0; bytes.len() + side];
    for (row, from) in levels.chunks_exact_mut(side + 1).zip(bytes.chunks_exact(side)) {
        for (to, &from) in row.iter_mut().zip(from) {
            *to = f32::from(from) - f32::from(MEAN_LEVEL);
        }
    }
    levels
}

/// Sums of levels and squares over rectangles.
struct Sums {
    wide: usize,
    levels: Vec<[i64; 2]>,
}

impl Sums {
    fn of(area: &[f32], wide: usize) -> Self {
        let mut levels = vec![[0_i64; 2]; (wide + 1) * (wide + 1)];
        for y in 0..wide {
            let mut row = [0_i64; 2];
            for x in 0..wide {
                let v = area[y * (wide + 1) + x] as i64;
                row = [row[0] + v, row[1] + v * v];
                let above = levels[y * (wide + 1) + x + 1];
                levels[(y + 1) * (wide + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
            }
        }
        Self { wide, levels }
    }

    fn over(&self, x: usize, y: usize, side: usize) -> (i64, i64) {
        let at = |x: usize, y: usize| self.levels[y * (self.wide + 1) + x];
        let [a, b, c, d] = [at(x, y), at(x + side, y), at(x, y + side), at(x + side, y + side)];
        (d[0] - b[0] - c[0] + a[0], d[1] - b[1] - c[1] + a[1])
    }
}

/// Levels of the square around a pixel, row by row; `None` unless inside.
pub(crate) fn square(image: &GrayImage, [x, y]: [i64; 2], half: usize) -> Option<Vec<u8>> {
    let (width, height) = (i64::from(image.width()), i64::from(image.height()));
    let reach = half as i64;
    if x < reach || y < reach || x + reach >= width || y + reach >= height {
        return None;
    }
    let side = 2 * half + 1;
    let mut out = Vec::with_capacity(side * side);
    for row in y - reach..=y + reach {
        out.extend_from_slice(&image.as_raw()[(row * width + x - reach) as usize..][..side]);
    }
    Some(out)
}

/// Peak of a surface by a quadratic through 3×3; `None` at the border or without a peak.
fn peak(surface: &[f32], window: usize) -> Option<([f32; 2], f32)> {
    let best = (0..surface.len()).max_by(|&a, &b| surface[a].total_cmp(&surface[b]))?;
    let (x, y) = (best % window, best / window);
    if x == 0 || y == 0 || x + 1 == window || y + 1 == window || surface[best] <= LEAST_CORRELATION
    {
        return None;
    }
    let z = |dx: usize, dy: usize| surface[(y + dy - 1) * window + x + dx - 1];
    let (gx, gy) = ((z(2, 1) - z(0, 1)) / 2.0, (z(1, 2) - z(1, 0)) / 2.0);
    let (gxx, gyy) = (z(2, 1) - 2.0 * z(1, 1) + z(0, 1), z(1, 2) - 2.0 * z(1, 1) + z(1, 0));
    let gxy = (z(2, 2) - z(2, 0) - z(0, 2) + z(0, 0)) / 4.0;
    let determinant = gxx * gyy - gxy * gxy;
    if determinant <= 1e-9 || gxx >= 0.0 {
        return None;
    }
    let dx = -(gyy * gx - gxy * gy) / determinant;
    let dy = -(gxx * gy - gxy * gx) / determinant;
    let flatter = -0.5 * (gxx + gyy) - 0.5 * libm::hypotf(gxx - gyy, 2.0 * gxy);
    let is_peak = dx.abs() <= 1.0 && dy.abs() <= 1.0 && flatter > LEAST_CURVATURE;
    is_peak.then_some(([x as f32 + dx, y as f32 + dy], surface[best]))
}

/// Best corner of each cell of a levelled picture outside `is_masked`: [x, y] in px.
pub fn corners(levelled: &GrayImage, is_masked: impl Fn(u32, u32) -> bool) -> Vec<[i64; 2]> {
    /// Border of the picture: a patch, and its maximum movement.
    const BORDER: usize = FINE_HALF + 12;
    /// Half side of a corner's window, px.
    const WINDOW: usize = 3;
    let (w, h) = (levelled.width() as usize, levelled.height() as usize);
    if w <= 2 * BORDER + 1 || h <= 2 * BORDER + 1 {
        return Vec::new();
    }
    let pixels = levelled.as_raw();
    let mut slopes = vec![[0.0_f32; 3]; w * h];
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            let at = |dx: usize, dy: usize| f32::from(pixels[(y + dy - 1) * w + x + dx - 1]);
            let gx =
                (at(2, 0) + 2.0 * at(2, 1) + at(2, 2) - at(0, 0) - 2.0 * at(0, 1) - at(0, 2)) / 8.0;
            let gy =
                (at(0, 2) + 2.0 * at(1, 2) + at(2, 2) - at(0, 0) - 2.0 * at(1, 0) - at(2, 0)) / 8.0;
            slopes[y * w + x] = [gx * gx, gx * gy, gy * gy];
        }
    }
    let mut across = vec![[0.0_f32; 3]; w * h];
    for y in 0..h {
        for x in WINDOW..w - WINDOW {
            let row = &slopes[y * w + x - WINDOW..=y * w + x + WINDOW];
            across[y * w + x] =
                row.iter().fold([0.0; 3], |sum, v| [0, 1, 2].map(|i| sum[i] + v[i]));
        }
    }
    let area = ((2 * WINDOW + 1) * (2 * WINDOW + 1)) as f32;
    let strength = |x: usize, y: usize| {
        let rows = (y - WINDOW..=y + WINDOW).map(|row| across[row * w + x]);
        let [a, b, c] = rows.fold([0.0_f32; 3], |sum, v| [0, 1, 2].map(|i| sum[i] + v[i]));
        (0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt()) / area
    };
    let mut found = Vec::new();
    for j in 0..GRID[1] {
        for i in 0..GRID[0] {
            let inside = |index: usize, parts: usize, length: usize| {
                let (from, to) = (index * length / parts, (index + 1) * length / parts);
                from.max(BORDER)..to.min(length - BORDER)
            };
            let mut best = (LEAST_CORNER, None);
            for y in inside(j, GRID[1], h) {
                for x in inside(i, GRID[0], w) {
                    let here = strength(x, y);
                    if here > best.0 && !is_masked(x as u32, y as u32) {
                        best = (here, Some([x as i64, y as i64]));
                    }
                }
            }
            found.extend(best.1);
        }
    }
    found
}

/// Cell of a pixel: column and row.
pub fn cell_of(px: &Point2<f64>, size: ImageSize) -> [usize; 2] {
    let cell = |at: f64, parts: usize, length: u32| {
        ((at.max(0.0) * parts as f64 / f64::from(length.max(1))) as usize).min(parts - 1)
    };
    [cell(px.x, GRID[0], size.width_px), cell(px.y, GRID[1], size.height_px)]
}

/// Position in the reduced picture of a point of the full picture: their corners, not centres,
/// coincide.
pub(crate) fn reduced_px(px: f64) -> f64 {
    let n = f64::from(COARSE);
    (px - (n - 1.0) / 2.0) / n
}

/// Inverse of [`reduced_px`].
pub(crate) fn full_px(px: f64) -> f64 {
    let n = f64::from(COARSE);
    px * n + (n - 1.0) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(dx: f64, dy: f64) -> GrayImage {
        GrayImage::from_fn(120, 120, |x, y| {
            let (x, y) = (f64::from(x) - dx, f64::from(y) - dy);
            let level = 127.0
                + 30.0 * (x * 0.21).sin()
                + 30.0 * (y * 0.17 + x * 0.05).cos()
                + 25.0 * (0.09 * (x + y)).sin();
            image::Luma([level as u8])
        })
    }

    #[test]
    fn a_patch_is_found_where_it_has_moved() {
        let patch = Patch::at(&wave(0.0, 0.0), [60, 60], FINE_HALF).expect("inside");
        for (dx, dy) in [(0.0, 0.0), (1.3, -2.4), (-3.5, 0.25)] {
            let found = patch.find(&wave(dx, dy), [60, 60], FINE_SEARCH).expect("found");
            assert!((found.px - Point2::new(60.0 + dx, 60.0 + dy)).norm() < 0.06, "{found:?}");
            assert!(found.correlation > 0.98);
        }
        assert_eq!(patch.find(&wave(0.0, 0.0), [18, 60], FINE_SEARCH), None);
        assert_eq!(Patch::from_bytes(patch.bytes(), 31), Some(patch));
    }

    #[test]
    fn an_edge_and_an_even_area_are_no_match() {
        let edge =
            GrayImage::from_fn(120, 120, |x, _| image::Luma([if x < 60 { 40 } else { 200 }]));
        let patch = Patch::at(&edge, [60, 60], FINE_HALF).expect("inside");
        assert_eq!(patch.find(&edge, [60, 60], FINE_SEARCH), None);
        let even = GrayImage::from_pixel(120, 120, image::Luma([127]));
        assert_eq!(patch.find(&even, [60, 60], FINE_SEARCH), None);
        assert!(corners(&even, |_, _| false).is_empty());
    }

    #[test]
    fn nothing_is_chosen_under_the_mask() {
        let blob = GrayImage::from_fn(200, 160, |x, y| {
            image::Luma([if (x / 9 + y / 9) % 2 == 0 { 60 } else { 190 }])
        });
        assert!(corners(&blob, |_, _| false).len() > 20);
        assert!(corners(&blob, |x, _| x < 100).iter().all(|[x, _]| *x >= 100));
    }
}
