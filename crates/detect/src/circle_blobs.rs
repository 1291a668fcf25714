//! Ellipses darker or lighter than the surroundings: candidates for circles.
//!
//! A pixel is dark or light by the midpoint between the darkest and the lightest pixel of the tiles
//! around it (as in AprilTag 3: Krogius, Haggenmiller, Olson, "Flexible layouts for fiducial tags",
//! 2019). Connected pixels of one kind are an ellipse if their area is that of the ellipse with
//! their second moments.

use std::f32::consts::PI;

use image::GrayImage;

/// Sides of the tiles in pixels: the larger tiles show larger circles, the smaller ones ignore
/// shadows.
pub(super) const TILES_PX: [usize; 2] = [32, 8];
/// Least range of brightness around a dark or light pixel.
const LEAST_RANGE: u8 = 16;
/// Least area of an ellipse in pixels, and least ratio of the axes.
const LEAST_AREA_PX2: f32 = 10.0;
const NARROWEST: f32 = 0.12;
/// Ratio of a shape's area to the area of the ellipse with the same moments.
const FILLED: std::ops::Range<f32> = 0.86..1.1;

/// Kinds of pixels.
const UNCLEAR: u8 = 0;
const DARK: u8 = 1;
const LIGHT: u8 = 2;

/// Dark or light ellipse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blob {
    pub(super) at: [f32; 2],
    /// Matrix of the ellipse `vᵀ shape⁻¹ v = 1`: `xx`, `xy`, `yy`.
    pub(super) shape: [f32; 3],
    pub(super) is_dark: bool,
}

impl Blob {
    /// Squared product of the half axes.
    pub(super) fn determinant(&self) -> f32 {
        self.shape[0] * self.shape[2] - self.shape[1] * self.shape[1]
    }

    /// Map in which the ellipse is a circle of radius 1: `[a, b, c]` for `x' = a x`,
    /// `y' = b x + c y`.
    pub(super) fn to_circle(self) -> [f32; 3] {
        // The inverse of the Cholesky factor.
        let first = self.shape[0].sqrt();
        let across = self.shape[1] / first;
        let second = (self.shape[2] - across * across).sqrt();
        [1.0 / first, -across / (first * second), 1.0 / second]
    }

    /// Offset to `other`, in radii of this circle.
    pub(super) fn radii_to(&self, other: [f32; 2]) -> [f32; 2] {
        let [a, b, c] = self.to_circle();
        let (dx, dy) = (other[0] - self.at[0], other[1] - self.at[1]);
        [a * dx, b * dx + c * dy]
    }
}

/// Connected pixels of a row.
#[derive(Clone, Copy, Debug)]
struct Run {
    row: u32,
    begin: u32,
    end: u32,
    is_dark: bool,
    /// Index of another run of the same shape, or own index.
    parent: u32,
}

/// Number of pixels and sums of places, squares and products.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    touches_edge: bool,
    is_dark: bool,
}

/// Finds blobs. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct BlobFinder {
    /// Darkest and lightest pixel of each single tile.
    tiles: [Vec<u8>; 2],
    /// Darkest and lightest pixel of each tile and neighbours.
    darkest: Vec<u8>,
    lightest: Vec<u8>,
    /// Kind of each pixel of a row.
    kinds: Vec<u8>,
    runs: Vec<Run>,
    /// Index of each run's shape, and the sums of each.
    shapes: Vec<u32>,
    sums: Vec<Sums>,
}

impl BlobFinder {
    /// Writes the blobs of `picture` to `into`, by tiles with the side `tile_px`.
    pub(super) fn find(&mut self, picture: &GrayImage, tile_px: usize, into: &mut Vec<Blob>) {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        into.clear();
        let (across, down) = (width / tile_px, height / tile_px);
        if across < 3 || down < 3 {
            return;
        }
        self.measure_tiles(picture, tile_px, [across, down]);
        self.runs.clear();
        let mut above = 0..0;
        for y in 0..height {
            let begin = self.runs.len();
            let tiles = (y / tile_px).min(down - 1) * across;
            let row = &picture.as_raw()[y * width..][..width];
            self.split_row(row, y as u32, tiles, (tile_px, across));
            self.connect(above, begin);
            above = begin..self.runs.len();
        }
        self.sum_up(width as u32, height as u32);
        into.extend(self.sums.iter().filter_map(Sums::blob));
    }

    /// Measures the darkest and lightest pixel of each tile and neighbours.
    fn measure_tiles(&mut self, picture: &GrayImage, tile_px: usize, [across, down]: [usize; 2]) {
        let width = picture.width() as usize;
        for (tiles, start) in self.tiles.iter_mut().zip([u8::MAX, 0]) {
            tiles.clear();
            tiles.resize(across * down, start);
        }
        let [darkest, lightest] = &mut self.tiles;
        for (y, row) in picture.as_raw().chunks_exact(width).enumerate() {
            let tiles = (y / tile_px).min(down - 1) * across;
            for (x, pixels) in row.chunks(tile_px).enumerate() {
                let tile = tiles + x.min(across - 1);
                let (low, high) = pixels.iter().fold((u8::MAX, 0), |(low, high), pixel| {
                    (u8::min(low, *pixel), u8::max(high, *pixel))
                });
                darkest[tile] = darkest[tile].min(low);
                lightest[tile] = lightest[tile].max(high);
            }
        }
        let around = |tile: usize| {
            let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
            let (column, row) = (tile % across, tile / across);
            near(row, down)
                .flat_map(move |row| near(column, across).map(move |at| row * across + at))
        };
        let [low, high] = &self.tiles;
        let tiles = || 0..across * down;
        self.darkest.clear();
        self.darkest.extend(tiles().map(|tile| around(tile).map(|at| low[at]).min().unwrap_or(0)));
        self.lightest.clear();
        self.lightest
            .extend(tiles().map(|tile| around(tile).map(|at| high[at]).max().unwrap_or(0)));
    }

    /// Adds the dark and light runs of a row.
    fn split_row(&mut self, row: &[u8], y: u32, tiles: usize, (tile_px, across): (usize, usize)) {
        self.kinds.resize(row.len(), UNCLEAR);
        let both = row.chunks(tile_px).zip(self.kinds.chunks_mut(tile_px));
        for (column, (pixels, kinds)) in both.enumerate() {
            let tile = tiles + column.min(across - 1);
            let (low, high) = (self.darkest[tile], self.lightest[tile]);
            if high - low < LEAST_RANGE {
                kinds.fill(UNCLEAR);
                continue;
            }
            let middle = low.midpoint(high);
            for (kind, pixel) in kinds.iter_mut().zip(pixels) {
                *kind = if *pixel <= middle { DARK } else { LIGHT };
            }
        }
        let mut begin = 0;
        while let Some(kind) = self.kinds.get(begin) {
            let end = begin + equal(&self.kinds[begin..]);
            if *kind != UNCLEAR {
                let parent = self.runs.len() as u32;
                let (begin, end) = (begin as u32, end as u32);
                self.runs.push(Run { row: y, begin, end, is_dark: *kind == DARK, parent });
            }
            begin = end;
        }
    }

    fn root(&mut self, mut run: u32) -> u32 {
        while self.runs[run as usize].parent != run {
            let parent = self.runs[run as usize].parent;
            self.runs[run as usize].parent = self.runs[parent as usize].parent;
            run = parent;
        }
        run
    }

    /// Connects the runs from `begin` on with adjacent runs of the row above.
    fn connect(&mut self, above: std::ops::Range<usize>, begin: usize) {
        let mut first = above.start;
        for here in begin..self.runs.len() {
            let run = self.runs[here];
            while first < above.end && self.runs[first].end <= run.begin {
                first += 1;
            }
            let mut other = first;
            while other < above.end && self.runs[other].begin < run.end {
                if self.runs[other].is_dark == run.is_dark {
                    let (a, b) = (self.root(other as u32), self.root(here as u32));
                    self.runs[a.max(b) as usize].parent = a.min(b);
                }
                other += 1;
            }
        }
    }

    /// Sums up the runs of each shape.
    fn sum_up(&mut self, width: u32, height: u32) {
        self.sums.clear();
        self.shapes.clear();
        for index in 0..self.runs.len() {
            let run = self.runs[index];
            // A parent comes before its run, so its own shape is known.
            let shape = if run.parent as usize == index {
                self.sums.push(Sums { is_dark: run.is_dark, ..Sums::default() });
                self.sums.len() as u32 - 1
            } else {
                self.shapes[run.parent as usize]
            };
            self.shapes.push(shape);
            let sums = &mut self.sums[shape as usize];
            let count = f64::from(run.end - run.begin);
            let middle = f64::from(run.begin + run.end - 1) / 2.0;
            let y = f64::from(run.row);
            sums.count += count;
            sums.x += count * middle;
            sums.y += count * y;
            sums.xx += count * (middle * middle + (count * count - 1.0) / 12.0);
            sums.xy += count * middle * y;
            sums.yy += count * y * y;
            sums.touches_edge |=
                run.row == 0 || run.row + 1 == height || run.begin == 0 || run.end == width;
        }
    }
}

/// Number of first kinds that are equal.
fn equal(kinds: &[u8]) -> usize {
    let (Some(first), (eights, _)) = (kinds.first(), kinds.as_chunks::<8>()) else { return 0 };
    let whole = 8 * eights.iter().take_while(|eight| **eight == [*first; 8]).count();
    whole + kinds[whole..].iter().take_while(|kind| *kind == first).count()
}

impl Sums {
    /// Ellipse with the same moments, if the shape is an ellipse.
    fn blob(&self) -> Option<Blob> {
        if self.touches_edge || self.count < f64::from(LEAST_AREA_PX2) {
            return None;
        }
        let (x, y) = (self.x / self.count, self.y / self.count);
        // A disc's variance is a quarter of its squared radius.
        let of = |sum: f64, mean2: f64| 4.0 * (sum / self.count - mean2) as f32;
        let shape = [of(self.xx, x * x), of(self.xy, x * y), of(self.yy, y * y)];
        let blob = Blob { at: [x as f32, y as f32], shape, is_dark: self.is_dark };
        let area = PI * blob.determinant().max(0.0).sqrt();
        let half = (shape[0] + shape[2]) / 2.0;
        let apart = libm::hypotf((shape[0] - shape[2]) / 2.0, shape[1]);
        let is_wide = half - apart > NARROWEST * NARROWEST * (half + apart) && half > apart;
        (is_wide && FILLED.contains(&(self.count as f32 / area.max(1.0)))).then_some(blob)
    }
}
