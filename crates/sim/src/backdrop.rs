//! The room behind the board.

use nalgebra::{Point2, Vector2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::{rng_stream::RngStream, scene::Scene};

/// Picture in floating-point grey levels.
pub(super) struct Canvas {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) levels: Vec<f32>,
}

/// Draws the scene's room, `width` × `height` pixels, before lens blur and light.
pub(super) fn draw(scene: &Scene, width: usize, height: usize) -> Canvas {
    let mut rng = RngStream::Backdrop.rng(scene.seed);
    let (low, high) = (scene.light.dark_level as f32, scene.light.light_level as f32);
    let wall = low + (high - low) * rng.random_range(0.35..0.6);
    let mut canvas = Canvas { width, height, levels: vec![wall; width * height] };
    let things = (40.0 * scene.clutter.clamp(0.0, 1.0)).round() as usize;
    for _ in 0..things {
        let level = low + (high - low) * rng.random_range(0.05..0.95);
        match rng.random_range(0..10) {
            0..5 => canvas.furniture(&mut rng, level),
            5..8 => canvas.cable(&mut rng, level),
            _ => canvas.cloth(&mut rng, level, 0.12 * (high - low)),
        }
    }
    canvas
}

/// Rectangle, rotated in the picture.
struct Plank {
    centre: Point2<f32>,
    half: Vector2<f32>,
    along: Vector2<f32>,
}

impl Canvas {
    /// Boxes, shelves, screens: mostly upright rectangles.
    fn furniture(&mut self, rng: &mut ChaCha8Rng, level: f32) {
        let lean_rad = rng.random_range(-0.15..0.15_f32);
        let plank = self.random_plank(rng, lean_rad, (0.02, 0.16), (0.02, 0.16));
        let shading = rng.random_range(-0.15..0.15_f32);
        self.paint(&plank, |at, _| level * (1.0 + shading * at.x / plank.half.x));
        // A frame, which has a double edge.
        if rng.random_range(0..2) == 0 {
            let inner = Plank { half: plank.half * 0.9, ..plank };
            self.paint(&inner, |at, _| 0.75 * level * (1.0 + shading * at.y / inner.half.y));
        }
    }

    /// Cables, legs, edges: long thin rectangles in any direction.
    fn cable(&mut self, rng: &mut ChaCha8Rng, level: f32) {
        let turn_rad = rng.random_range(0.0..std::f32::consts::PI);
        let plank = self.random_plank(rng, turn_rad, (0.1, 0.4), (0.001, 0.005));
        self.paint(&plank, |_, _| level);
    }

    /// Cloth, keyboards, books: a fine repeated pattern with grain.
    fn cloth(&mut self, rng: &mut ChaCha8Rng, level: f32, contrast: f32) {
        let turn_rad = rng.random_range(-0.3..0.3_f32);
        let plank = self.random_plank(rng, turn_rad, (0.03, 0.12), (0.03, 0.12));
        let pitch = Vector2::new(rng.random_range(5.0..16.0_f32), rng.random_range(5.0..16.0_f32));
        let grain: Vec<f32> = (0..1024).map(|_| rng.random_range(-0.5..0.5_f32)).collect();
        self.paint(&plank, |at, index| {
            let woven = libm::sinf(at.x / pitch.x).signum() * libm::sinf(at.y / pitch.y).signum();
            level + contrast * (0.6 * woven + grain[index.wrapping_mul(40_503) % 1024])
        });
    }

    fn random_plank(
        &self,
        rng: &mut ChaCha8Rng,
        turn_rad: f32,
        length: (f32, f32),
        thickness: (f32, f32),
    ) -> Plank {
        let (width, height) = (self.width as f32, self.height as f32);
        Plank {
            centre: Point2::new(rng.random_range(0.0..width), rng.random_range(0.0..height)),
            half: Vector2::new(
                rng.random_range(length.0..length.1),
                rng.random_range(thickness.0..thickness.1),
            ) * width,
            along: Vector2::new(libm::cosf(turn_rad), libm::sinf(turn_rad)),
        }
    }

    /// Paints `plank` with the level at each position, given in the plank's coordinates.
    fn paint(&mut self, plank: &Plank, level: impl Fn(Vector2<f32>, usize) -> f32) {
        let reach = plank.half.norm() + 1.0;
        let span = |middle: f32, end: usize| {
            ((middle - reach).max(0.0) as usize)..(((middle + reach).max(0.0) as usize).min(end))
        };
        for row in span(plank.centre.y, self.height) {
            for column in span(plank.centre.x, self.width) {
                let off = Point2::new(column as f32, row as f32) - plank.centre;
                let at = Vector2::new(off.dot(&plank.along), plank.along.perp(&off));
                if at.x.abs() < plank.half.x && at.y.abs() < plank.half.y {
                    let index = row * self.width + column;
                    self.levels[index] = level(at, index).clamp(0.0, 255.0);
                }
            }
        }
    }
}
