//! Ellipses darker or lighter than the surroundings: candidates for circles.
//!
//! A pixel is dark or light by the midpoint between the darkest and the lightest pixel of the tiles
//! around it (as in AprilTag 3: Krogius, Haggenmiller, Olson, "Flexible layouts for fiducial tags",
//! 2019). Connected pixels of one kind are an ellipse if their area is that of the ellipse with
//! their second moments.

use std::f32::consts::PI;

use image::GrayImage;

use super::reduce::{Grow, grow};

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

/// Kinds of pixels, and what follows a row.
const UNCLEAR: u8 = 0;
const DARK: u8 = 1;
const LIGHT: u8 = 2;
const END: u8 = 3;

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

/// Connected pixels of a row, and the index of a shape joined to theirs.
#[derive(Clone, Copy, Debug)]
struct Run {
    begin: usize,
    end: usize,
    kind: u8,
    shape: usize,
}

/// Connected runs.
#[derive(Clone, Copy, Debug)]
struct Shape {
    /// Index of the shape that this one was joined to, or own index.
    parent: usize,
    /// Number of pixels, and sums of `x`, `y`, `x²`, `x y` and `y²`: whole, so in any order.
    sums: [f64; 6],
    touches_edge: bool,
    is_dark: bool,
}

/// Finds blobs. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct BlobFinder {
    /// Darkest and lightest pixel of each column of a row of tiles, and of each tile.
    columns: [Vec<u8>; 2],
    tiles: [GrayImage; 2],
    /// Darkest and lightest pixel of each tile and neighbours.
    around: [GrayImage; 2],
    rows: Vec<u8>,
    /// Darkest light level less one, and mask of the clear pixels, in a row.
    middles: Vec<u8>,
    are_clear: Vec<u8>,
    /// Kind of each pixel of a row, with an unclear one before.
    kinds: Vec<u8>,
    /// Runs of the row above, and of this one.
    runs: [Vec<Run>; 2],
    shapes: Vec<Shape>,
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
        self.runs[1].clear();
        self.shapes.clear();
        self.kinds.clear();
        self.kinds.resize((width + 2).next_multiple_of(8) + 8, END);
        self.kinds[0] = UNCLEAR;
        for (y, row) in picture.as_raw().chunks_exact(width).enumerate() {
            if y % tile_px == 0 && y / tile_px < down {
                self.set_limits(y / tile_px * across, (tile_px, across, width));
            }
            let limits = self.middles.iter().zip(&self.are_clear);
            let kinds = self.kinds[1..].iter_mut().zip(row);
            for ((kind, pixel), (middle, is_clear)) in kinds.zip(limits) {
                *kind = (if pixel <= middle { DARK } else { LIGHT }) & is_clear;
            }
            self.connect(y, [width, height]);
        }
        let shapes = self.shapes.iter().enumerate();
        into.extend(shapes.filter(|(k, it)| it.parent == *k).filter_map(|(_, it)| it.blob()));
    }

    /// Measures the darkest and lightest pixel of each tile and neighbours.
    fn measure_tiles(&mut self, picture: &GrayImage, tile_px: usize, [across, down]: [usize; 2]) {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let mut tiles = self.tiles.each_mut().map(|tiles| std::mem::take(tiles).into_raw());
        tiles.iter_mut().for_each(Vec::clear);
        let ends = |tile: usize, (count, size): (usize, usize)| {
            tile * tile_px..if tile + 1 == count { size } else { (tile + 1) * tile_px }
        };
        let [lows, highs] = &mut self.columns;
        for row in 0..down {
            let rows = ends(row, (down, height));
            for (columns, start) in [(&mut *lows, u8::MAX), (&mut *highs, 0)] {
                columns.clear();
                columns.resize(width, start);
            }
            for row in picture.as_raw()[rows.start * width..rows.end * width].chunks_exact(width) {
                for ((low, high), pixel) in lows.iter_mut().zip(&mut *highs).zip(row) {
                    (*low, *high) = ((*low).min(*pixel), (*high).max(*pixel));
                }
            }
            for column in 0..across {
                let columns = ends(column, (across, width));
                tiles[0].extend(lows[columns.clone()].iter().min());
                tiles[1].extend(highs[columns].iter().max());
            }
        }
        for (k, (tiles, what)) in tiles.into_iter().zip([Grow::Dark, Grow::Light]).enumerate() {
            let tiles = GrayImage::from_raw(across as u32, down as u32, tiles);
            self.tiles[k] = tiles.unwrap_or_default();
            grow(&self.tiles[k], what, &mut self.rows, &mut self.around[k]);
        }
    }

    /// Sets the limits between dark and light by the row of tiles from `first` on.
    fn set_limits(&mut self, first: usize, (tile_px, across, width): (usize, usize, usize)) {
        self.middles.resize(width, 0);
        self.are_clear.resize(width, 0);
        let both = self.middles.chunks_mut(tile_px).zip(self.are_clear.chunks_mut(tile_px));
        for (column, (middles, are_clear)) in both.enumerate() {
            let tile = first + column.min(across - 1);
            let [low, high] = self.around.each_ref().map(|around| around.as_raw()[tile]);
            middles.fill(low.midpoint(high));
            are_clear.fill(if high - low < LEAST_RANGE { UNCLEAR } else { DARK | LIGHT });
        }
    }

    /// Splits a row into runs, and connects them with adjacent runs of the row above.
    fn connect(&mut self, y: usize, [width, height]: [usize; 2]) {
        let Self { kinds, runs: [above, here], shapes, .. } = self;
        std::mem::swap(above, here);
        here.clear();
        let (mut first, mut begin, mut kind) = (0, 0, UNCLEAR);
        let pairs = kinds.as_chunks::<8>().0.iter().zip(kinds[1..].as_chunks::<8>().0);
        for (eight, (before, after)) in pairs.enumerate() {
            let mut changes = u64::from_le_bytes(*before) ^ u64::from_le_bytes(*after);
            while changes != 0 {
                let byte = changes.trailing_zeros() / 8;
                changes &= !(0xff << (8 * byte));
                let end = 8 * eight + byte as usize;
                let run = Run { begin, end, kind, shape: shapes.len() };
                (begin, kind) = (end, kinds[end + 1]);
                if run.kind == UNCLEAR {
                    continue;
                }
                while above.get(first).is_some_and(|other| other.end <= run.begin) {
                    first += 1;
                }
                let others = above[first..].iter().take_while(|other| other.begin < run.end);
                let mut shape = run.shape;
                for other in others.filter(|other| other.kind == run.kind) {
                    let root = root(shapes, other.shape);
                    shape = join(shapes, shape, root);
                }
                if shape == shapes.len() {
                    let (sums, is_dark) = ([0.0; 6], run.kind == DARK);
                    shapes.push(Shape { parent: shape, sums, touches_edge: false, is_dark });
                }
                here.push(Run { shape, ..run });
                let (count, ends) =
                    ((run.end - run.begin) as f64, (run.begin + run.end - 1) as f64);
                let (x, row) = (count * ends / 2.0, y as f64);
                let xx = count * (3.0 * ends * ends + count * count - 1.0) / 12.0;
                let shape = &mut shapes[shape];
                add(&mut shape.sums, [count, x, count * row, xx, x * row, count * row * row]);
                shape.touches_edge |=
                    y == 0 || y + 1 == height || run.begin == 0 || run.end == width;
            }
        }
    }
}

fn root(shapes: &mut [Shape], mut shape: usize) -> usize {
    while shapes[shape].parent != shape {
        let parent = shapes[shape].parent;
        shapes[shape].parent = shapes[parent].parent;
        shape = parent;
    }
    shape
}

/// First of two shapes, joined with the other, unless that's none yet.
fn join(shapes: &mut [Shape], one: usize, other: usize) -> usize {
    let (first, last) = (one.min(other), one.max(other));
    if first != last && last < shapes.len() {
        let Shape { sums, touches_edge, .. } = shapes[last];
        shapes[last].parent = first;
        shapes[first].touches_edge |= touches_edge;
        add(&mut shapes[first].sums, sums);
    }
    first
}

fn add(sums: &mut [f64; 6], others: [f64; 6]) {
    sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += other);
}

impl Shape {
    /// Ellipse with the same moments, if the shape is an ellipse.
    fn blob(&self) -> Option<Blob> {
        let [count, x, y, xx, xy, yy] = self.sums;
        if self.touches_edge || count < f64::from(LEAST_AREA_PX2) {
            return None;
        }
        let (x, y) = (x / count, y / count);
        // A disc's variance is a quarter of its squared radius.
        let of = |sum: f64, mean2: f64| 4.0 * (sum / count - mean2) as f32;
        let shape = [of(xx, x * x), of(xy, x * y), of(yy, y * y)];
        let blob = Blob { at: [x as f32, y as f32], shape, is_dark: self.is_dark };
        let area = PI * blob.determinant().max(0.0).sqrt();
        let half = (shape[0] + shape[2]) / 2.0;
        let apart = libm::hypotf((shape[0] - shape[2]) / 2.0, shape[1]);
        let is_wide = half - apart > NARROWEST * NARROWEST * (half + apart) && half > apart;
        (is_wide && FILLED.contains(&(count as f32 / area.max(1.0)))).then_some(blob)
    }
}
