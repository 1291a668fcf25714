//! Halves and doubles pictures, and interpolates between pixels.

use image::GrayImage;

use super::simd;

/// Doubles a picture by linear interpolation. Pixel `p` of the result lies at `p / 2 − 0.25` in the
/// source.
pub(super) fn double(source: &GrayImage, into: &mut GrayImage) {
    let (width, height) = source.dimensions();
    refill(into, [2 * width, 2 * height], |pixels| {
        simd::widest(Doubling(source.as_raw(), width as usize, pixels));
    });
}

/// Resizes `into`, and lets `fill` set its pixels, if any.
fn refill(into: &mut GrayImage, [width, height]: [u32; 2], fill: impl FnOnce(&mut [u8])) {
    let mut pixels = std::mem::take(into).into_raw();
    pixels.resize(width as usize * height as usize, 0);
    if !pixels.is_empty() {
        fill(&mut pixels);
    }
    // The buffer has exactly this size, so the default is never used.
    *into = GrayImage::from_raw(width, height, pixels).unwrap_or_default();
}

/// Pixels, width, and doubled pixels.
struct Doubling<'a>(&'a [u8], usize, &'a mut [u8]);

impl simd::Loop for Doubling<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(raw, width, into) = self;
        let last = raw.len() / width - 1;
        let row = |y: usize| &raw[y * width..][..width];
        for (y, out) in into.chunks_exact_mut(2 * width).enumerate() {
            let near = row(y / 2);
            let far =
                row(if y % 2 == 0 { (y / 2).saturating_sub(1) } else { (y / 2 + 1).min(last) });
            // Three quarters of the nearer row and column, a quarter of the others.
            let mixed = |x: usize| 3 * u16::from(near[x]) + u16::from(far[x]);
            let between = |here: u16, beside: u16| ((3 * here + beside + 8) / 16) as u8;
            (out[0], out[2 * width - 1]) =
                (between(mixed(0), mixed(0)), between(mixed(width - 1), mixed(width - 1)));
            let pairs = near.iter().zip(&near[1..]).zip(far.iter().zip(&far[1..]));
            for (out, ((a, b), (c, d))) in out[1..].chunks_exact_mut(2).zip(pairs) {
                let (left, right) =
                    (3 * u16::from(*a) + u16::from(*c), 3 * u16::from(*b) + u16::from(*d));
                (out[0], out[1]) = (between(left, right), between(right, left));
            }
        }
    }
}

/// Halves a picture by averaging 2×2 pixels. Pixel `p` of the result lies at `2p + 0.5` in the
/// source.
pub(super) fn halve(source: &GrayImage, into: &mut GrayImage) {
    let (width, height) = source.dimensions();
    halve_part(source, &Part { left: 0, top: 0, width, height }, into);
}

/// Rectangle of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) left: u32,
    pub(super) top: u32,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Part {
    /// Part of `image` that contains `points` with a margin of `margin_px`, aligned to multiples of
    /// `step` pixels; `None` if it lies outside the picture.
    pub(super) fn around(
        points: &[[f64; 2]],
        margin_px: f64,
        step: u32,
        image: &GrayImage,
    ) -> Option<Self> {
        let bounds = |axis: usize, size: u32| {
            let (low, high) = points.iter().fold((f64::MAX, f64::MIN), |(low, high), point| {
                (low.min(point[axis]), high.max(point[axis]))
            });
            let size = f64::from(size);
            let low = ((low - margin_px).clamp(0.0, size) as u32) / step * step;
            let high = ((high + margin_px).clamp(0.0, size) as u32) / step * step;
            (high >= low + 8 * step).then_some((low, high - low))
        };
        let (left, width) = bounds(0, image.width())?;
        let (top, height) = bounds(1, image.height())?;
        Some(Self { left, top, width, height })
    }
}

/// Map between the pixels of a halved and of the full-size picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Halved {
    /// Full-size pixels per pixel.
    pub(super) scale: f64,
    /// Top-left pixel, in the full-size picture, of the halved part.
    pub(super) origin_px: [f64; 2],
}

impl Halved {
    /// Map of the whole picture, [doubled](double).
    pub(super) fn doubled() -> Self {
        Self { scale: 0.5, origin_px: [0.0, 0.0] }
    }

    /// Map of the whole picture, halved `times` times.
    pub(super) fn whole(times: usize) -> Self {
        Self { scale: f64::from(1_u32 << times), origin_px: [0.0, 0.0] }
    }

    /// Position in the full-size picture.
    pub(super) fn full_px(&self, at: [f32; 2]) -> [f64; 2] {
        std::array::from_fn(|k| (f64::from(at[k]) + 0.5) * self.scale - 0.5 + self.origin_px[k])
    }

    /// Position in the halved picture.
    pub(super) fn at(&self, full_px: [f64; 2]) -> [f32; 2] {
        std::array::from_fn(|k| ((full_px[k] - self.origin_px[k] + 0.5) / self.scale - 0.5) as f32)
    }
}

/// [`halve`] for a part of a picture, which must lie inside it.
pub(super) fn halve_part(source: &GrayImage, part: &Part, into: &mut GrayImage) {
    let row_bytes = source.width() as usize;
    let first = part.top as usize * row_bytes + part.left as usize;
    let [width, height] = [part.width / 2, part.height / 2];
    refill(into, [width, height], |pixels| {
        simd::widest(Halving(&source.as_raw()[first..], row_bytes, width as usize, pixels));
    });
}

/// Pixels from the part's first on, pixels in a row, width of the half, and its pixels.
struct Halving<'a>(&'a [u8], usize, usize, &'a mut [u8]);

impl simd::Loop for Halving<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(raw, row_bytes, width, into) = self;
        for (y, row) in into.chunks_exact_mut(width.max(1)).enumerate() {
            let upper = &raw[2 * y * row_bytes..][..2 * width];
            let lower = &raw[(2 * y + 1) * row_bytes..][..2 * width];
            let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            for (out, (a, b)) in row.iter_mut().zip(pairs) {
                let sum = u16::from(a[0]) + u16::from(a[1]) + u16::from(b[0]) + u16::from(b[1]);
                *out = ((sum + 2) >> 2) as u8;
            }
        }
    }
}

/// Colour grown by a pixel on every side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grow {
    Dark,
    Light,
}

/// Exchanges black and white.
pub(super) fn negate(source: &GrayImage, into: &mut GrayImage) {
    into.clone_from(source);
    into.iter_mut().for_each(|level| *level = !*level);
}

/// Replaces every pixel by the darkest or the lightest pixel of the surrounding 3×3. This joins
/// squares of one colour again where light has spread into the dark squares, or dark into the light
/// ones.
pub(super) fn grow(source: &GrayImage, what: Grow, rows: &mut Vec<u8>, into: &mut GrayImage) {
    let (raw, width) = (source.as_raw(), source.width() as usize);
    rows.resize(raw.len(), 0);
    refill(into, source.dimensions().into(), |pixels| match what {
        Grow::Dark => simd::widest(Growing(raw, width, u8::min, rows, pixels)),
        Grow::Light => simd::widest(Growing(raw, width, u8::max, rows, pixels)),
    });
}

/// Pixels, width, extreme of two levels, extremes of three pixels in a row, and grown pixels.
struct Growing<'a, Of>(&'a [u8], usize, Of, &'a mut [u8], &'a mut [u8]);

impl<Of: Fn(u8, u8) -> u8> simd::Loop for Growing<'_, Of> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self(raw, width, of, rows, into) = self;
        for (line, out) in raw.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            out.copy_from_slice(line);
            for (out, next) in out.iter_mut().zip(&line[1..]) {
                *out = of(*out, *next);
            }
            for (out, before) in out.iter_mut().skip(1).zip(line) {
                *out = of(*out, *before);
            }
        }
        into.copy_from_slice(rows);
        for (out, below) in into.iter_mut().zip(rows.iter().skip(width)) {
            *out = of(*out, *below);
        }
        for (out, above) in into.iter_mut().skip(width).zip(rows.iter()) {
            *out = of(*out, *above);
        }
    }
}

/// [`sample`] without bounds handling: the position must be at least one pixel inside the picture.
pub(super) fn sample_inside(image: &GrayImage, x: f32, y: f32) -> f32 {
    let width = image.width() as usize;
    let (column, row) = (x as usize, y as usize);
    let (fx, fy) = (x - column as f32, y - row as f32);
    let upper = &image.as_raw()[row * width + column..][..width + 2];
    let line = |a: u8, b: u8| f32::from(a) + fx * (f32::from(b) - f32::from(a));
    let (top, bottom) = (line(upper[0], upper[1]), line(upper[width], upper[width + 1]));
    top + fy * (bottom - top)
}

/// Brightness at `(x, y)`, bilinear; outside the picture, the nearest border pixel's.
pub(super) fn sample(image: &GrayImage, x: f32, y: f32) -> f32 {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let x = x.clamp(0.0, width as f32 - 1.001);
    let y = y.clamp(0.0, height as f32 - 1.001);
    let (column, row) = (x as usize, y as usize);
    let (fx, fy) = (x - column as f32, y - row as f32);
    let at = row * width + column;
    let raw = image.as_raw();
    let right = usize::from(column + 1 < width);
    let down = if row + 1 < height { width } else { 0 };
    let value = |offset: usize| f32::from(raw[at + offset]);
    let upper = value(0) * (1.0 - fx) + value(right) * fx;
    let lower = value(down) * (1.0 - fx) + value(down + right) * fx;
    upper * (1.0 - fy) + lower * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_doubled_picture_has_means_between_the_pixels() {
        for (width, height) in [(1, 1), (1, 4), (37, 5), (64, 3)] {
            let at = |x: u32, y: u32| (x * 7919 + y * 104_729) % 251;
            let source = GrayImage::from_fn(width, height, |x, y| image::Luma([at(x, y) as u8]));
            let mut into = GrayImage::default();
            double(&source, &mut into);
            assert_eq!(into.dimensions(), (2 * width, 2 * height));
            for (x, y, pixel) in into.enumerate_pixels() {
                let beside = |place: u32, size: u32| match place % 2 {
                    0 => (place / 2).saturating_sub(1),
                    _ => (place / 2 + 1).min(size - 1),
                };
                let (far_x, far_y) = (beside(x, width), beside(y, height));
                let (x, y) = (x / 2, y / 2);
                let sum = 9 * at(x, y) + 3 * (at(far_x, y) + at(x, far_y)) + at(far_x, far_y);
                assert_eq!(u32::from(pixel.0[0]), (sum + 8) / 16, "{x}, {y} of {width}x{height}");
            }
        }
    }

    #[test]
    fn what_grows_grows_by_a_pixel_on_every_side() {
        let source =
            GrayImage::from_fn(9, 7, |x, y| image::Luma([if (x, y) == (4, 3) { 10 } else { 200 }]));
        let (mut rows, mut into) = (Vec::new(), GrayImage::default());
        grow(&source, Grow::Dark, &mut rows, &mut into);
        let dark = |x: u32, y: u32| (3..=5).contains(&x) && (2..=4).contains(&y);
        assert!(into.enumerate_pixels().all(|(x, y, p)| (p.0[0] == 10) == dark(x, y)));
        grow(&source, Grow::Light, &mut rows, &mut into);
        assert!(into.pixels().all(|p| p.0[0] == 200));
    }
}
