//! Parts of the picture that aren't the scene, found automatically: text and logos written by
//! camera or recorder, and what moves with the camera.

use boresight_geometry::frame::ImageSize;
use image::GrayImage;

use crate::slot::SEVERAL;
use boresight_scene::{APART_PX, GRID, Sighting, cell_of};

/// Minimum ratio of mean brightness between pictures of different light.
const DIFFERENT_LIGHT: f64 = 1.5;

/// Pixels that aren't the scene, in boxes.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mask {
    /// Boxes: left, top, right, bottom, px; right and bottom are outside.
    pub boxes: Vec<[u32; 4]>,
}

impl Mask {
    /// True if a pixel is covered.
    pub fn covers(&self, x: u32, y: u32) -> bool {
        self.boxes.iter().any(|b| (b[0]..b[2]).contains(&x) && (b[1]..b[3]).contains(&y))
    }

    /// Covered share of a picture.
    pub fn share(&self, width: u32, height: u32) -> f64 {
        let covered = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let count = covered.filter(|&(x, y)| self.covers(x, y)).count();
        count as f64 / f64::from(width * height).max(1.0)
    }

    /// Adds the cells in which most patches stay at their pixels; true if there are some. While the
    /// scene moves, such cells show the camera's own mount, the frame of a window, or dirt.
    pub(crate) fn add_own(&mut self, sightings: &[Sighting], size: ImageSize) -> bool {
        let before = self.boxes.len();
        let mut votes = [[0_i32; GRID[0]]; GRID[1]];
        for Sighting { px, reference_px, .. } in sightings {
            let [i, j] = cell_of(reference_px, size);
            votes[j][i] += if (px - reference_px).norm() < APART_PX { 1 } else { -1 };
        }
        let sides = [size.width_px, size.height_px].map(|px| px as usize);
        let edge = |k: usize, n: usize| (n * sides[k]).div_ceil(GRID[k]) as u32;
        for (j, row) in votes.iter().enumerate() {
            let own = row.iter().enumerate().filter(|(_, votes)| **votes > 0);
            let cell = |(i, _)| [edge(0, i), edge(1, j), edge(0, i + 1), edge(1, j + 1)];
            self.boxes.extend(own.map(cell));
        }
        self.boxes.len() > before
    }

    /// Finds edges with the same direction and strength in any light, and areas bright even at
    /// night. Nothing is found among fewer than three pictures, or if all are of the same light.
    pub fn of(pictures: &[GrayImage]) -> Self {
        let Some(first) = pictures.first() else { return Self::default() };
        let (w, h) = (first.width() as usize, first.height() as usize);
        let mean = |p: &GrayImage| {
            p.as_raw().iter().map(|&v| f64::from(v)).sum::<f64>() / (w * h).max(1) as f64
        };
        let means: Vec<f64> = pictures.iter().map(mean).collect();
        let darkest = means.iter().copied().fold(f64::INFINITY, f64::min).max(1.0);
        let brightest = means.iter().copied().fold(0.0, f64::max);
        let same_size = pictures.iter().all(|p| p.dimensions() == first.dimensions());
        if pictures.len() < SEVERAL
            || !same_size
            || brightest < DIFFERENT_LIGHT * darkest
            || w < 4
            || h < 4
        {
            return Self::default();
        }
        let soft: Vec<Vec<u8>> = pictures.iter().map(|p| softened(p.as_raw(), w, h)).collect();
        let mut seeds = vec![false; w * h];
        let mut levels = vec![0_u8; pictures.len()];
        let mut strengths = vec![0.0_f32; pictures.len()];
        let mut slopes = vec![[0.0_f32; 2]; pictures.len()];
        let mut text = vec![false; w * h];
        for y in 1..h - 1 {
            for x in 1..w - 1 {
                for (i, s) in soft.iter().enumerate() {
                    let at = |dx: usize, dy: usize| f32::from(s[(y + dy - 1) * w + x + dx - 1]);
                    let gx =
                        at(2, 0) + 2.0 * at(2, 1) + at(2, 2) - at(0, 0) - 2.0 * at(0, 1) - at(0, 2);
                    let gy =
                        at(0, 2) + 2.0 * at(1, 2) + at(2, 2) - at(0, 0) - 2.0 * at(1, 0) - at(2, 0);
                    slopes[i] = [gx, gy];
                    strengths[i] = libm::hypotf(gx, gy);
                    levels[i] = s[y * w + x];
                }
                let seed = is_constant(&slopes) || is_lit(&mut levels, &strengths);
                seeds[y * w + x] = seed;
                text[y * w + x] = seed && is_changing_text(&mut levels, &mut strengths);
            }
        }
        Self { boxes: boxes(&opened(&seeds, &text, w, h), w, h) }
    }
}

/// True for edges of text, steep and constant: mean slope over 120 (Sobel), scatter below a quarter
/// of it.
fn is_constant(slopes: &[[f32; 2]]) -> bool {
    let n = slopes.len() as f32;
    let mean = [0, 1].map(|i| slopes.iter().map(|s| s[i]).sum::<f32>() / n);
    let strength = libm::hypotf(mean[0], mean[1]);
    let scatter =
        slopes.iter().map(|s| (s[0] - mean[0]).powi(2) + (s[1] - mean[1]).powi(2)).sum::<f32>() / n;
    strength > 120.0 && scatter.sqrt() < 0.25 * strength
}

/// True for areas bright even in the darkest tenth of the pictures, and not uniform.
fn is_lit(levels: &mut [u8], strengths: &[f32]) -> bool {
    let tenth = levels.len() / 10;
    let dark = *levels.select_nth_unstable(tenth).1;
    dark > 200 && strengths.iter().sum::<f32>() / strengths.len() as f32 > 60.0
}

/// True for changing digits: bright at times, with a steep edge half of the time.
fn is_changing_text(levels: &mut [u8], strengths: &mut [f32]) -> bool {
    let (high, middle) = (levels.len() * 95 / 100, strengths.len() / 2);
    let bright = *levels.select_nth_unstable(high.min(levels.len() - 1)).1;
    bright > 225 && *strengths.select_nth_unstable_by(middle, f32::total_cmp).1 > 250.0
}

/// Gaussian of σ 0.8 px, in 8 bits.
fn softened(pixels: &[u8], w: usize, h: usize) -> Vec<u8> {
    const BLUR: [u32; 5] = [6, 58, 128, 58, 6];
    let mut across = vec![0_u8; w * h];
    for y in 0..h {
        let row = &pixels[y * w..][..w];
        for x in 0..w {
            let sum: u32 = (0..5)
                .map(|k| BLUR[k] * u32::from(row[(x + k).saturating_sub(2).min(w - 1)]))
                .sum();
            across[y * w + x] = ((sum + 128) / 256) as u8;
        }
    }
    let mut out = vec![0_u8; w * h];
    for y in 0..h {
        for x in 0..w {
            let at = |k: usize| u32::from(across[(y + k).saturating_sub(2).min(h - 1) * w + x]);
            let sum: u32 = (0..5).map(|k| BLUR[k] * at(k)).sum();
            out[y * w + x] = ((sum + 128) / 256) as u8;
        }
    }
    out
}

/// Seeds that form squares of 2×2, and the seeds of changing text.
fn opened(seeds: &[bool], text: &[bool], w: usize, h: usize) -> Vec<bool> {
    let mut out = text.to_vec();
    for y in 1..h {
        for x in 1..w {
            let at = [(x, y), (x - 1, y), (x, y - 1), (x - 1, y - 1)];
            if at.iter().all(|&(x, y)| seeds[y * w + x]) {
                for (x, y) in at {
                    out[y * w + x] = true;
                }
            }
        }
    }
    out
}

/// Boxes around seeds within a letter's distance of each other, if numerous enough.
fn boxes(seeds: &[bool], w: usize, h: usize) -> Vec<[u32; 4]> {
    /// Letters are up to 31 px apart, lines up to 9.
    const REACH: [usize; 2] = [15, 4];
    const FEWEST_SEEDS: usize = 25;
    const MARGIN: usize = 6;
    let mut grown = vec![false; w * h];
    for y in 0..h {
        for x in 0..w {
            if seeds[y * w + x] {
                for row in y.saturating_sub(REACH[1])..(y + REACH[1] + 1).min(h) {
                    let from = x.saturating_sub(REACH[0]);
                    grown[row * w + from..row * w + (x + REACH[0] + 1).min(w)].fill(true);
                }
            }
        }
    }
    let mut found = Vec::new();
    let mut open = Vec::new();
    for start in 0..w * h {
        if !grown[start] {
            continue;
        }
        let (mut count, mut edge) = (0, [w, h, 0, 0]);
        open.push(start);
        grown[start] = false;
        while let Some(at) = open.pop() {
            let (x, y) = (at % w, at / w);
            count += usize::from(seeds[at]);
            edge = [edge[0].min(x), edge[1].min(y), edge[2].max(x + 1), edge[3].max(y + 1)];
            for (dx, dy) in
                [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1_isize)]
            {
                let (nx, ny) = (x as isize + dx, y as isize + dy);
                if nx >= 0 && ny >= 0 && nx < w as isize && ny < h as isize {
                    let next = ny as usize * w + nx as usize;
                    if grown[next] {
                        grown[next] = false;
                        open.push(next);
                    }
                }
            }
        }
        if count >= FEWEST_SEEDS {
            let [left, top, right, bottom] = edge;
            let box_px = [
                left.saturating_sub(MARGIN),
                top.saturating_sub(MARGIN),
                (right + MARGIN).min(w),
                (bottom + MARGIN).min(h),
            ];
            found.push(box_px.map(|v| v as u32));
        }
    }
    found
}
