//! Picture with levelled local brightness and contrast, so that day and night look alike.

use boresight_geometry::frame::ImageSize;
use image::GrayImage;
use nalgebra::Point2;

use crate::fit::SIGMA_OF_MEDIAN;

/// Level of a pixel equal to the local mean.
pub(crate) const MEAN_LEVEL: u8 = 127;
/// Levels per local standard deviation: three deviations stay within 8 bits.
const LEVELS_PER_DEVIATION: f32 = 42.0;
/// Term added to the local deviation, in grey levels, to keep noise in flat areas small.
const LEAST_DEVIATION: f32 = 5.0;
/// Half width of the window, as a Gaussian's σ, in the full-size and in the reduced picture.
const FINE_SIGMA_PX: f32 = 6.0;
const COARSE_SIGMA_PX: f32 = 4.0;
/// Reduction of the coarse picture.
pub const COARSE: u32 = 4;
/// Size of the thumbnail for comparing pictures.
pub(crate) const THUMB_WIDTH: usize = 64;
/// See [`THUMB_WIDTH`].
pub(crate) const THUMB_HEIGHT: usize = 48;

/// Minimum contrast of a scene, in standard deviations of a pixel's noise.
const SEEN: f64 = 3.0;

/// Picture prepared for comparison.
#[derive(Clone, Debug)]
pub struct View {
    /// Original picture.
    pub grey: GrayImage,
    /// Levelled picture, in full size.
    pub fine: GrayImage,
    /// Levelled picture, a quarter as wide and high.
    pub coarse: GrayImage,
    /// Levelled picture in 64×48, of unit norm.
    pub thumb: Thumb,
}

/// Levelled thumbnail of unit norm, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Thumb(pub Vec<f32>);

impl View {
    /// Prepares `grey`.
    pub fn of(grey: GrayImage) -> Self {
        let fine = levelled(&grey, FINE_SIGMA_PX);
        let coarse = levelled(&reduced(&grey), COARSE_SIGMA_PX);
        let thumb = Thumb::of(&coarse);
        Self { grey, fine, coarse, thumb }
    }

    /// True if the scene is distinct from the pixel noise, so that a single pixel tells light from
    /// dark. At night without lamps, behind a veil, or under a cover the scene isn't, and
    /// correlations then say nothing about the camera's view.
    pub fn shows_something(&self) -> bool {
        let pixels = self.grey.as_raw();
        let count = pixels.len().max(1) as f64;
        let sum: u64 = pixels.iter().map(|&v| u64::from(v)).sum();
        let squares: u64 = pixels.iter().map(|&v| u64::from(v) * u64::from(v)).sum();
        let mean = sum as f64 / count;
        (squares as f64 / count - mean * mean).max(0.0).sqrt() >= SEEN * noise(&self.grey)
    }

    /// Amount of detail: the mean distance from the mean level.
    pub fn texture(&self) -> f64 {
        let sum: u64 = self.fine.as_raw().iter().map(|&v| u64::from(v.abs_diff(MEAN_LEVEL))).sum();
        sum as f64 / self.fine.as_raw().len().max(1) as f64
    }
}

impl Thumb {
    fn of(levelled: &GrayImage) -> Self {
        let mut small = area_average(levelled, THUMB_WIDTH, THUMB_HEIGHT);
        for value in &mut small {
            *value -= f32::from(MEAN_LEVEL);
        }
        Self::normalized(small)
    }

    /// Scales `values` to unit norm; zeros stay.
    pub fn normalized(mut values: Vec<f32>) -> Self {
        let norm = values.iter().map(|v| v * v).sum::<f32>().sqrt() + 1e-9;
        for value in &mut values {
            *value /= norm;
        }
        Self(values)
    }

    /// Values in 8 bits, as stored.
    pub fn levels(&self) -> Vec<i8> {
        let largest = self.0.iter().fold(1e-9_f32, |m, v| m.max(v.abs()));
        self.0.iter().map(|v| (v / largest * 127.0).round() as i8).collect()
    }

    /// Thumbnail from [`Self::levels`]; `None` for a wrong number of levels.
    pub fn from_levels(levels: &[i8]) -> Option<Self> {
        let is_whole = levels.len() == THUMB_WIDTH * THUMB_HEIGHT;
        is_whole.then(|| Self::normalized(levels.iter().map(|v| f32::from(*v)).collect()))
    }

    /// Thumbnail of the pixels of a picture of `size` for which `counts`; the others are level.
    pub fn only(&self, size: ImageSize, counts: impl Fn(&Point2<f64>) -> bool) -> Self {
        let [wide_px, high_px] = [
            f64::from(size.width_px) / THUMB_WIDTH as f64,
            f64::from(size.height_px) / THUMB_HEIGHT as f64,
        ];
        let value = |(i, value): (usize, &f32)| {
            let [column, row] = [i % THUMB_WIDTH, i / THUMB_WIDTH].map(|at| at as f64 + 0.5);
            if counts(&Point2::new(column * wide_px, row * high_px)) { *value } else { 0.0 }
        };
        Self::normalized(self.0.iter().enumerate().map(value).collect())
    }

    /// Correlation of two thumbnails without a shift, −1 to 1.
    pub fn likeness(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| f64::from(a * b)).sum()
    }
}

/// Levels a picture: mean 0 and deviation 1 in a Gaussian window of `sigma_px`, then 8 bits.
///
/// Mean and deviation vary slowly, so they are computed in half size: three running sums there,
/// interpolated linearly.
fn levelled(grey: &GrayImage, sigma_px: f32) -> GrayImage {
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    let (w, h) = (width.div_ceil(2), height.div_ceil(2));
    let pixels = grey.as_raw();
    let mut moments = vec![[0.0_f32; 2]; w * h];
    for y in 0..h {
        let upper = &pixels[2 * y * width..][..width];
        let lower = &pixels[(2 * y + 1).min(height - 1) * width..][..width];
        for (x, moment) in moments[y * w..][..w].iter_mut().enumerate() {
            let right = (2 * x + 1).min(width - 1);
            let four = [upper[2 * x], upper[right], lower[2 * x], lower[right]].map(f32::from);
            *moment =
                [four.iter().sum::<f32>() / 4.0, four.iter().map(|v| v * v).sum::<f32>() / 4.0];
        }
    }
    blur(&mut moments, w, h, sigma_px / 2.0);
    // From moments to gain and offset of a pixel.
    for moment in &mut moments {
        let [mean, square] = *moment;
        let gain =
            LEVELS_PER_DEVIATION / ((square - mean * mean).max(0.0).sqrt() + LEAST_DEVIATION);
        *moment = [gain, f32::from(MEAN_LEVEL) - mean * gain];
    }
    let mut out = vec![0_u8; width * height];
    let mut row = vec![[0.0_f32; 2]; w + 2];
    for y in 0..height {
        // A half-size cell's centre is between two rows: the nearer row counts three quarters.
        let near = y / 2;
        let far = if y % 2 == 0 { near.saturating_sub(1) } else { (near + 1).min(h - 1) };
        let (near, far) = (&moments[near * w..][..w], &moments[far * w..][..w]);
        for x in 0..w {
            row[x + 1] = [0, 1].map(|i| 0.75 * near[x][i] + 0.25 * far[x][i]);
        }
        (row[0], row[w + 1]) = (row[1], row[w]);
        let from = &pixels[y * width..][..width];
        for (x, to) in out[y * width..][..width].iter_mut().enumerate() {
            let at = x / 2 + 1;
            let (near, far) = (row[at], if x % 2 == 0 { row[at - 1] } else { row[at + 1] });
            let [gain, offset] = [0, 1].map(|i| 0.75 * near[i] + 0.25 * far[i]);
            *to = (f32::from(from[x]) * gain + offset) as u8;
        }
    }
    GrayImage::from_raw(grey.width(), grey.height(), out).unwrap_or_default()
}

/// Standard deviation of a pixel's noise, grey levels: from the median of a second difference
/// across both axes, in which smooth surfaces and straight edges cancel (Immerkær 1996); at least
/// the noise of rounding to whole levels.
fn noise(grey: &GrayImage) -> f64 {
    /// Every third row and column suffices.
    const EVERY: usize = 3;
    const ROUNDING: f64 = 0.289;
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    let pixels = grey.as_raw();
    let mut differences = Vec::with_capacity(pixels.len() / (EVERY * EVERY) + 1);
    for y in (1..height.saturating_sub(1)).step_by(EVERY) {
        for x in (1..width.saturating_sub(1)).step_by(EVERY) {
            let row = |y: usize| -> i32 {
                let row = &pixels[y * width + x - 1..][..3];
                i32::from(row[0]) - 2 * i32::from(row[1]) + i32::from(row[2])
            };
            differences.push((row(y - 1) - 2 * row(y) + row(y + 1)).unsigned_abs() as u16);
        }
    }
    if differences.is_empty() {
        return ROUNDING;
    }
    let middle = differences.len() / 2;
    // From the median size to the standard deviation of a normal variable; the weights' root sum of
    // squares is 6.
    let sd = SIGMA_OF_MEDIAN * f64::from(*differences.select_nth_unstable(middle).1) / 6.0;
    sd.max(ROUNDING)
}

/// Blurs by three running sums along each axis, with variances that add up to about that of a
/// Gaussian of `sigma_px`.
fn blur(values: &mut Vec<[f32; 2]>, w: usize, h: usize, sigma_px: f32) {
    // A window of 2r + 1 has the variance ((2r + 1)² − 1)/12; three of them have σ².
    let radius = (((4.0 * sigma_px * sigma_px + 1.0).sqrt() - 1.0) / 2.0).round().max(1.0) as usize;
    let share = 1.0 / (2 * radius + 1) as f32;
    let mut line = vec![[0.0_f32; 2]; w];
    for y in 0..h {
        let row = &mut values[y * w..][..w];
        for _ in 0..3 {
            line.copy_from_slice(row);
            let at = |x: isize| line[x.clamp(0, w as isize - 1) as usize];
            let mut sum = [0.0_f32; 2];
            for x in -(radius as isize)..=radius as isize {
                sum = [0, 1].map(|i| sum[i] + at(x)[i]);
            }
            for (x, to) in row.iter_mut().enumerate() {
                *to = sum.map(|s| s * share);
                let (new, old) = (at((x + radius + 1) as isize), at(x as isize - radius as isize));
                sum = [0, 1].map(|i| sum[i] + new[i] - old[i]);
            }
        }
    }
    let mut out = vec![[0.0_f32; 2]; w * h];
    let mut sum = vec![[0.0_f32; 2]; w];
    for _ in 0..3 {
        let row = |y: isize| &values[y.clamp(0, h as isize - 1) as usize * w..][..w];
        sum.fill([0.0; 2]);
        for y in -(radius as isize)..=radius as isize {
            for (sum, value) in sum.iter_mut().zip(row(y)) {
                *sum = [sum[0] + value[0], sum[1] + value[1]];
            }
        }
        for y in 0..h {
            let (new, old) = (row((y + radius + 1) as isize), row(y as isize - radius as isize));
            for (x, to) in out[y * w..][..w].iter_mut().enumerate() {
                *to = [sum[x][0] * share, sum[x][1] * share];
                sum[x] = [sum[x][0] + new[x][0] - old[x][0], sum[x][1] + new[x][1] - old[x][1]];
            }
        }
        std::mem::swap(values, &mut out);
    }
}

/// Picture a quarter as wide and high, each pixel the mean of 16.
fn reduced(grey: &GrayImage) -> GrayImage {
    let n = COARSE as usize;
    let (w, h) = ((grey.width() as usize / n).max(1), (grey.height() as usize / n).max(1));
    let pixels = grey.as_raw();
    let width = grey.width() as usize;
    if width < n || (grey.height() as usize) < n {
        return grey.clone();
    }
    let mut out = Vec::with_capacity(w * h);
    let mut sums = vec![0_u32; w];
    for y in 0..h {
        sums.fill(0);
        for row in 0..n {
            let from = &pixels[(n * y + row) * width..][..n * w];
            for (sum, four) in sums.iter_mut().zip(from.chunks_exact(n)) {
                *sum += four.iter().map(|&v| u32::from(v)).sum::<u32>();
            }
        }
        out.extend(sums.iter().map(|sum| ((sum + 8) / 16) as u8));
    }
    GrayImage::from_raw(w as u32, h as u32, out).unwrap_or_default()
}

/// Means over equal cells, which may split pixels.
fn area_average(image: &GrayImage, columns: usize, rows: usize) -> Vec<f32> {
    let shares = |length: usize, parts: usize| -> Vec<(usize, usize, f32)> {
        // (part, pixel, length of the pixel inside the part)
        let size = length as f32 / parts as f32;
        let mut all = Vec::new();
        for part in 0..parts {
            let (from, to) = (part as f32 * size, (part + 1) as f32 * size);
            for pixel in from as usize..(to.ceil() as usize).min(length) {
                let inside = (to.min(pixel as f32 + 1.0) - from.max(pixel as f32)).max(0.0);
                all.push((part, pixel, inside / size));
            }
        }
        all
    };
    let (width, height) = (image.width() as usize, image.height() as usize);
    let across = shares(width, columns);
    let mut out = vec![0.0_f32; columns * rows];
    let mut line = vec![0.0_f32; columns];
    let mut of_row = vec![Vec::new(); height];
    for (part, pixel, share) in shares(height, rows) {
        of_row[pixel].push((part, share));
    }
    for (y, parts) in of_row.iter().enumerate() {
        let row = &image.as_raw()[y * width..][..width];
        line.fill(0.0);
        for &(part, pixel, share) in &across {
            line[part] += share * f32::from(row[pixel]);
        }
        for &(part, share) in parts {
            for (to, value) in out[part * columns..][..columns].iter_mut().zip(&line) {
                *to += share * value;
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(gain: f32, offset: f32) -> GrayImage {
        GrayImage::from_fn(320, 240, |x, y| {
            let pattern = ((x * 37 + y * 91) % 101) as f32
                + if (x / 20 + y / 20) % 2 == 0 { 60.0 } else { 0.0 };
            image::Luma([(pattern * gain + offset) as u8])
        })
    }

    #[test]
    fn the_light_goes_and_the_scene_stays() {
        let (day, night) = (View::of(scene(1.0, 40.0)), View::of(scene(0.4, 10.0)));
        assert!(day.thumb.likeness(&night.thumb) > 0.98);
        let far = day
            .fine
            .pixels()
            .zip(night.fine.pixels())
            .filter(|(a, b)| a.0[0].abs_diff(b.0[0]) > 12);
        assert!(far.count() < 320 * 240 / 20);
    }

    #[test]
    fn an_even_picture_is_level_everywhere() {
        let flat = View::of(GrayImage::from_pixel(101, 77, image::Luma([200])));
        assert!(flat.fine.as_raw().iter().all(|v| v.abs_diff(MEAN_LEVEL) <= 1));
        assert!(flat.texture() <= 1.0);
    }

    #[test]
    fn what_noise_hides_is_not_seen() {
        let noisy = |gain: f32, sd: f32| {
            let mut state = 7_u32;
            // Surfaces with edges between them, like most scenes.
            let mut grey = GrayImage::from_fn(320, 240, |x, y| {
                let is_light = (x / 20 + y / 20) % 2 == 0;
                image::Luma([(60.0 + gain * if is_light { 150.0 } else { 0.0 }) as u8])
            });
            for level in grey.iter_mut() {
                // Irwin-Hall: the sum of twelve uniform numbers.
                let mut sum = -6.0;
                for _ in 0..12 {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    sum += (state >> 8) as f32 / (1 << 24) as f32;
                }
                *level = (f32::from(*level) + sd * sum).round().clamp(0.0, 255.0) as u8;
            }
            View::of(grey)
        };
        assert!((noise(&noisy(0.0, 2.0).grey) - 2.0).abs() < 0.35);
        assert!(noisy(0.8, 2.0).shows_something());
        assert!(!noisy(0.03, 2.0).shows_something());
        assert!(!View::of(GrayImage::new(40, 30)).shows_something());
    }

    #[test]
    fn pictures_of_any_size_are_prepared() {
        for (width, height) in [(1, 1), (3, 200), (65, 1), (64, 48), (127, 95)] {
            let view = View::of(GrayImage::new(width, height));
            assert_eq!(view.thumb.0.len(), THUMB_WIDTH * THUMB_HEIGHT);
        }
    }
}
