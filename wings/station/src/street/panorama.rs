//! The street as seen from the camera, by direction: houses with windows, a road, a sky; and its
//! light by the hour.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Half extent of the panorama, rad: to each side, and up and down.
const HALF_WIDTH: f64 = 1.15;
const HALF_HEIGHT: f64 = 0.95;
/// Texels per radian: finer than a pixel of the lens.
const DENSITY: f64 = 700.0;
/// Elevation of the road's far end; y points down.
const HORIZON: f64 = 0.02;
/// Brightness of the night without lamps, and of a sunny noon.
const NIGHT: f64 = 0.012;
const AMBIENT: f64 = 0.35;
const SUN: f64 = 0.9;
/// Daylight threshold for switching lamps on.
const DARK: f64 = 0.3;
/// Exponent above which a lamp's light is negligible.
const UNLIT: f64 = 20.0;
/// Width and height of a passer-by, rad.
const PERSON: [f64; 2] = [0.02, 0.055];
const PEOPLE: usize = 9;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Sky,
    Wall(u8),
    Window(u8, bool),
    Road,
}

/// Constant part of the street.
#[derive(Clone, Debug)]
pub(super) struct Panorama {
    columns: usize,
    rows: usize,
    albedo: Vec<f32>,
    kinds: Vec<Kind>,
    lamps: Vec<[f64; 2]>,
    /// Depth of the relief's shadows on each wall.
    slant: [f64; 8],
}

/// Light and people of a picture.
#[derive(Clone, Debug)]
pub(super) struct Light {
    ambient: f64,
    sun: f64,
    /// Azimuth of the sun in terms of a day, −1 in the morning to 1 in the evening.
    side: f64,
    lamps: f64,
    /// Brightness of the camera's own light.
    torch: f64,
    people: Vec<[f64; 3]>,
    clouds: [f64; 4],
}

impl Light {
    /// Switches to the camera's own infrared light for the dark, in which street lamps are weak.
    pub(super) fn switch_to_infrared(&mut self) {
        if self.lamps > 0.0 {
            (self.lamps, self.torch) = (0.1 * self.lamps, 0.3);
        }
    }
}

impl Panorama {
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x57_2E_E7);
        let (columns, rows) =
            ((2.0 * HALF_WIDTH * DENSITY) as usize, (2.0 * HALF_HEIGHT * DENSITY) as usize);
        let mut albedo = vec![0.75_f32; columns * rows];
        let mut kinds = vec![Kind::Sky; columns * rows];
        let horizon = ((HORIZON + HALF_HEIGHT) * DENSITY) as usize;
        let grain = |rng: &mut ChaCha8Rng| rng.random_range(-0.10..0.10_f32);
        for y in horizon..rows {
            for x in 0..columns {
                kinds[y * columns + x] = Kind::Road;
                albedo[y * columns + x] = 0.3 + grain(&mut rng);
            }
        }
        // Stones, manholes, markings: structure of the road beyond noise.
        for _ in 0..260 {
            let (x, y) = (rng.random_range(0..columns - 60), rng.random_range(horizon..rows - 30));
            let (w, h) = (rng.random_range(8..60), rng.random_range(4..26));
            let shade = rng.random_range(0.08..0.7_f32);
            fill(&mut albedo, columns, [x, y, w, h], shade);
        }
        let mut left = 0;
        let mut wall = 0_u8;
        while left < columns {
            let width = rng.random_range(120..320_usize).min(columns - left);
            let top = horizon.saturating_sub(rng.random_range(200..560));
            let shade = rng.random_range(0.25..0.75_f32);
            for y in top..horizon + 12 {
                for x in left..left + width {
                    kinds[y * columns + x] = Kind::Wall(wall % 8);
                    // Courses of bricks.
                    let is_joint = y % 14 < 2 || (x + 13 * (y / 14 % 2)) % 31 < 2;
                    let joint = if is_joint { -0.08 } else { 0.0 };
                    albedo[y * columns + x] = (shade + joint + grain(&mut rng)).clamp(0.05, 0.95);
                }
            }
            let (w, h) = (rng.random_range(22..40), rng.random_range(30..56));
            let (dx, dy) = (w + rng.random_range(14..40), h + rng.random_range(18..44));
            for y in (top + 20..horizon.saturating_sub(h)).step_by(dy) {
                for x in (left + 12..(left + width).saturating_sub(w + 6)).step_by(dx) {
                    let is_lit = rng.random_bool(0.3);
                    fill(&mut albedo, columns, [x - 3, y - 3, w + 6, h + 6], 0.85 * shade.max(0.5));
                    fill(&mut albedo, columns, [x, y, w, h], rng.random_range(0.05..0.2));
                    for row in y..y + h {
                        kinds[row * columns + x..row * columns + x + w]
                            .fill(Kind::Window(wall % 8, is_lit));
                    }
                }
            }
            left += width;
            wall = wall.wrapping_add(1);
        }
        let lamps = (0..7)
            .map(|i| [-1.0 + 0.33 * f64::from(i) + rng.random_range(-0.06..0.06), -0.08])
            .collect();
        let slant = std::array::from_fn(|_| rng.random_range(-0.8..0.8));
        Self { columns, rows, albedo, kinds, lamps, slant }
    }

    /// Height of the sun at an hour, and brightness of the day, 0 to 1.
    fn sun(hour: f64) -> (f64, f64) {
        let height = libm::cos((hour - 12.0) * std::f64::consts::PI / 12.0);
        (height, (4.0 * height + 0.5).clamp(0.0, 1.0))
    }

    /// True if the lamps are on.
    pub(super) fn is_dark(hour: f64) -> bool {
        Self::sun(hour).1 < DARK
    }

    /// Light of an hour, with clouds and people.
    pub(super) fn light(&self, hour: f64, rng: &mut ChaCha8Rng) -> Light {
        let (height, day) = Self::sun(hour);
        let cloud: f64 = rng.random_range(0.0..1.0);
        let people = (0..PEOPLE).map(|_| {
            let at = [rng.random_range(-1.0..1.0), rng.random_range(0.10..0.6_f64)];
            [at[0], at[1], rng.random_range(0.03..0.6)]
        });
        Light {
            ambient: NIGHT + AMBIENT * day,
            sun: SUN * height.max(0.0).sqrt() * (1.0 - 0.8 * cloud),
            side: ((hour - 12.0) / 6.0).clamp(-1.0, 1.0),
            lamps: if day < DARK { 0.25 } else { 0.0 },
            torch: 0.0,
            people: people.collect(),
            clouds: std::array::from_fn(|_| rng.random_range(0.0..6.3)),
        }
    }

    /// Brightness in a direction.
    pub(super) fn level(&self, light: &Light, azimuth: f64, elevation: f64) -> f64 {
        for [x, y, shade] in &light.people {
            // Nearer people are lower in the picture and larger.
            let size = 0.5 + 3.0 * y;
            if (azimuth - x).abs() < PERSON[0] * size
                && (0.0..PERSON[1] * size).contains(&(y - elevation))
            {
                return shade * (light.ambient + 0.5 * light.sun);
            }
        }
        let x = ((azimuth + HALF_WIDTH) * DENSITY).clamp(0.0, self.columns as f64 - 1.0) as usize;
        let y = ((elevation + HALF_HEIGHT) * DENSITY).clamp(0.0, self.rows as f64 - 1.0) as usize;
        let at = y * self.columns + x;
        let albedo = f64::from(self.albedo[at]);
        let mut ambient = light.ambient;
        if light.lamps > 0.0 {
            let away = |[a, e]: &[f64; 2]| {
                ((azimuth - a) / 0.16).powi(2) + ((elevation - e) / 0.22).powi(2)
            };
            let near = self.lamps.iter().map(away).filter(|away| *away < UNLIT);
            ambient += light.lamps * near.map(|away| libm::exp(-away)).sum::<f64>();
        }
        if light.torch > 0.0 {
            ambient += light.torch * libm::exp(-(azimuth.powi(2) + elevation.powi(2)) / 0.5);
        }
        match self.kinds[at] {
            Kind::Sky if light.sun <= 0.0 => 2.2 * light.ambient,
            Kind::Sky => {
                let wave = |i: usize, a: f64, b: f64| {
                    libm::sin(a * azimuth + b * elevation + light.clouds[i])
                };
                let clouds = 0.5
                    + 0.2 * wave(0, 5.0, 3.0)
                    + 0.15 * wave(1, 11.0, -7.0)
                    + 0.1 * wave(2, 23.0, 31.0);
                2.2 * light.ambient + 0.5 * light.sun * clouds
            }
            Kind::Wall(wall) => albedo * (ambient + self.sun_on(wall, light, azimuth, elevation)),
            Kind::Window(wall, is_lit) => {
                let inside = if is_lit && light.lamps > 0.0 { 0.22 } else { 0.0 };
                inside + albedo * (ambient + self.sun_on(wall, light, azimuth, elevation))
            }
            Kind::Road => {
                // Shadows of the houses reach farther with a lower sun.
                let reach = 0.08 + 0.35 * light.side.abs();
                let edge =
                    HORIZON + reach * (0.6 + 0.4 * libm::sin(7.0 * azimuth + 3.0 * light.side));
                let sun = if elevation > edge { light.sun } else { 0.0 };
                albedo * (ambient + sun)
            }
        }
    }

    /// Sunlight on a wall: walls face different ways, and a shadow moves up each.
    fn sun_on(&self, wall: u8, light: &Light, azimuth: f64, elevation: f64) -> f64 {
        if light.sun <= 0.0 {
            return 0.0;
        }
        let facing = self.slant[usize::from(wall)];
        let falls = (1.0 - (light.side - facing).abs()).max(0.0);
        let shadow = HORIZON - 0.25
            + 0.3 * light.side * facing
            + 0.15 * libm::sin(4.0 * azimuth + f64::from(wall));
        if elevation > shadow { 0.25 * falls * light.sun } else { falls * light.sun }
    }
}

fn fill(albedo: &mut [f32], columns: usize, [x, y, w, h]: [usize; 4], shade: f32) {
    for row in y..y + h {
        if let Some(line) = albedo.get_mut(row * columns + x..row * columns + (x + w).min(columns))
        {
            line.fill(shade);
        }
    }
}
