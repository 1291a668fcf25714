//! Shifts of thumbnails: the rough position of a picture.

use nalgebra::Vector2;

use crate::{
    level::{THUMB_HEIGHT, THUMB_WIDTH, Thumb},
    turn::{Lens, Turn},
};

/// Minimum overlap after a shift, as a share of the thumbnail.
const LEAST_OVERLAP: f64 = 0.25;

/// Shift of thumbnails, with agreement.
#[derive(Clone, Copy, Debug)]
pub struct Shift {
    columns: i32,
    rows: i32,
    /// Agreement, at most 1.
    pub score: f64,
}

impl Shift {
    /// Turn of the camera that shifts the picture as much.
    pub fn turn(self, lens: &Lens) -> Turn {
        Turn::by_shift(lens, &self.shift_px(lens))
    }

    /// Shift in pixels of the picture.
    pub fn shift_px(self, lens: &Lens) -> Vector2<f64> {
        let size = lens.image_size;
        Vector2::new(
            f64::from(self.columns) * f64::from(size.width_px) / THUMB_WIDTH as f64,
            f64::from(self.rows) * f64::from(size.height_px) / THUMB_HEIGHT as f64,
        )
    }
}

/// Shift from `from` to `to` with the highest correlation of the overlap, times the root of its
/// share: a small overlap agrees easily.
pub fn best_shift(from: &Thumb, to: &Thumb) -> Shift {
    let (w, h) = (THUMB_WIDTH as i32, THUMB_HEIGHT as i32);
    let (from_squares, to_squares) = (Squares::of(from), Squares::of(to));
    let mut best = Shift { columns: 0, rows: 0, score: f64::NEG_INFINITY };
    for rows in -h / 2..=h / 2 {
        for columns in -w / 2..=w / 2 {
            let (width, height) = ((w - columns.abs()) as usize, (h - rows.abs()) as usize);
            let share = (width * height) as f64 / f64::from(w * h);
            if share < LEAST_OVERLAP {
                continue;
            }
            let start = |at: i32| at.max(0) as usize;
            let a_at = [start(-columns), start(-rows)];
            let b_at = [start(columns), start(rows)];
            let mut sums = [0.0_f32; 8];
            for row in 0..height {
                let a = &from.0[(row + a_at[1]) * THUMB_WIDTH + a_at[0]..][..width];
                let b = &to.0[(row + b_at[1]) * THUMB_WIDTH + b_at[0]..][..width];
                let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
                let rest = a.remainder().iter().zip(b.remainder());
                for (sum, (a, b)) in sums.iter_mut().zip(rest) {
                    *sum += a * b;
                }
                for (a, b) in a.zip(b) {
                    for i in 0..8 {
                        sums[i] += a[i] * b[i];
                    }
                }
            }
            let cross = f64::from(sums.iter().sum::<f32>());
            let squares =
                from_squares.over(a_at, [width, height]) * to_squares.over(b_at, [width, height]);
            let score = cross / squares.max(0.0).sqrt().max(1e-9) * share.sqrt();
            if score > best.score {
                best = Shift { columns, rows, score };
            }
        }
    }
    best
}

/// Sums of squares over rectangles of a thumbnail.
struct Squares(Vec<f64>);

impl Squares {
    const WIDE: usize = THUMB_WIDTH + 1;

    fn of(thumb: &Thumb) -> Self {
        let mut sums = vec![0.0; Self::WIDE * (THUMB_HEIGHT + 1)];
        for y in 0..THUMB_HEIGHT {
            let mut row = 0.0;
            for x in 0..THUMB_WIDTH {
                row += f64::from(thumb.0[y * THUMB_WIDTH + x]).powi(2);
                sums[(y + 1) * Self::WIDE + x + 1] = sums[y * Self::WIDE + x + 1] + row;
            }
        }
        Self(sums)
    }

    fn over(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> f64 {
        let at = |x: usize, y: usize| self.0[y * Self::WIDE + x];
        at(x + width, y + height) - at(x, y + height) - at(x + width, y) + at(x, y)
    }
}

/// Thumbnail turned by `roll_rad` and scaled about the principal point.
pub fn turned(thumb: &Thumb, lens: &Lens, roll_rad: f64, scale: f64) -> Thumb {
    let size = lens.image_size;
    let cell_px = [
        f64::from(size.width_px) / THUMB_WIDTH as f64,
        f64::from(size.height_px) / THUMB_HEIGHT as f64,
    ];
    let centre = lens.camera.pp_px;
    let (sin, cos) = libm::sincos(-roll_rad);
    let mut out = Vec::with_capacity(thumb.0.len());
    for row in 0..THUMB_HEIGHT {
        for column in 0..THUMB_WIDTH {
            let x = ((column as f64 + 0.5) * cell_px[0] - centre.x) / scale;
            let y = ((row as f64 + 0.5) * cell_px[1] - centre.y) / scale;
            let u = (cos * x - sin * y + centre.x) / cell_px[0] - 0.5;
            let v = (sin * x + cos * y + centre.y) / cell_px[1] - 0.5;
            out.push(bilinear(u, v, THUMB_WIDTH, THUMB_HEIGHT, |i| thumb.0[i]).unwrap_or(0.0));
        }
    }
    Thumb::normalized(out)
}

/// Bilinear interpolation; `None` outside.
pub fn bilinear(
    x: f64,
    y: f64,
    width: usize,
    height: usize,
    at: impl Fn(usize) -> f32,
) -> Option<f32> {
    let inside = x >= 0.0 && y >= 0.0 && x <= width as f64 - 1.0 && y <= height as f64 - 1.0;
    if !inside {
        return None;
    }
    let (x0, y0) = ((x as usize).min(width.max(2) - 2), (y as usize).min(height.max(2) - 2));
    let (u, v) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let row =
        |y: usize| at(y * width + x0) * (1.0 - u) + at(y * width + (x0 + 1).min(width - 1)) * u;
    Some(row(y0) * (1.0 - v) + row((y0 + 1).min(height - 1)) * v)
}
