//! Simulated fixed camera over a street, for the watch: moving sun, lamps, people, text, noise,
//! JPEG, a swaying mount, and planted moves.
//!
//! Everything follows from the [`Street`], its seed, and the time. The scene is far away, without
//! parallax.

mod panorama;
mod script;

use std::sync::OnceLock;

use image::{GrayImage, codecs::jpeg::JpegEncoder};
use nalgebra::{Point2, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{DAY_SECS, HOUR_SECS};
use panorama::Panorama;
pub use script::{NoStreet, Planted, What};

/// Target level of the automatic exposure by day, and maximum gain at night.
const EXPOSED: f64 = 105.0;
const LARGEST_GAIN: f64 = 900.0;
/// Gain of a sunny noon, levels per unit of light, and the noise at that gain, levels.
const NOON_GAIN: f64 = 200.0;
const NOISE: f64 = 1.2;
const JPEG_QUALITY: u8 = 85;
/// Daily sway of a mast, px of the middle of the picture, as measured on the webcam: pan, tilt; and
/// roll in degrees.
const SWAY_PX: [f64; 2] = [0.2, 0.5];
const SWAY_ROLL_DEG: f64 = 0.04;
/// Non-repeating movement, px, changing over six hours.
const RESTLESS_PX: f64 = 0.08;

/// Pan of the outermost presets: the panorama ends a little beyond.
const WIDEST_PRESET_RAD: f64 = 0.4;

/// Fixed camera over a street.
#[derive(Clone, Debug)]
pub struct Street {
    /// Lens of the camera.
    pub camera: Camera,
    /// Size of the pictures.
    pub image_size: ImageSize,
    /// Time of the first picture, seconds since 1970 (UTC).
    pub began_secs: f64,
    /// Duration in days.
    pub days: f64,
    /// True for a text with the time in the upper left corner.
    pub has_text: bool,
    /// Factor on an ordinary mast's sway.
    pub sway: f64,
    /// Number of directions, taken in turn from picture to picture.
    pub presets: u32,
    /// Moves and changes of the glass.
    pub planted: Vec<Planted>,
    seed: u64,
    /// Panorama, drawn for the first picture: it's large, and a street that is only named needs
    /// none.
    panorama: OnceLock<Panorama>,
}

/// Stance of the camera at a time: tilt, pan, roll as a rotation vector (rad), and the log focal
/// ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Rotation from the rays of the first day's mean to the current rays.
    pub rotation_rad: Vector3<f64>,
    /// Logarithm of the ratio of focal lengths.
    pub log_focal: f64,
}

impl Street {
    /// Street of a seed, seen through a lens of 75° with some distortion.
    pub fn new(seed: u64) -> Self {
        let image_size = ImageSize { width_px: 640, height_px: 480 };
        let mut camera = Camera::pinhole(417.0, Point2::new(326.0, 236.0));
        camera.distortion.k1 = -0.05;
        Self {
            camera,
            image_size,
            // 21 March 2026: days and nights are equally long.
            began_secs: 1_774_051_200.0,
            days: 10.0,
            has_text: false,
            sway: 1.0,
            presets: 1,
            planted: Vec::new(),
            seed,
            panorama: OnceLock::new(),
        }
    }

    /// Stance of the camera.
    pub fn stand(&self, at_secs: f64) -> Stand {
        let (f, day) = (self.camera.f_px.x, std::f64::consts::TAU * at_secs / DAY_SECS);
        let slow = |of: u64| self.sway * RESTLESS_PX * self.restless(at_secs, of);
        let mut pan_px = self.sway * SWAY_PX[0] * libm::cos(day) + slow(1);
        let mut tilt_px = self.sway * SWAY_PX[1] * libm::sin(day + 0.7) + slow(2);
        let mut roll_rad = self.sway * SWAY_ROLL_DEG.to_radians() * libm::cos(day + 2.0);
        let mut log_focal = 5e-5 * libm::sin(day);
        for planted in &self.planted {
            let amount = planted.amount_at(self.day_of(at_secs));
            match planted.what {
                What::Pan => pan_px += amount,
                What::Tilt => tilt_px += amount,
                What::Roll => roll_rad += amount.to_radians(),
                What::Focal => log_focal += libm::log1p(amount / 100.0),
                What::Infrared if Panorama::is_dark(self.hour_of(at_secs)) => {
                    log_focal += libm::log1p(amount / 100.0);
                }
                What::Blur | What::Dirt | What::Fog | What::Cover | What::Infrared => {}
            }
        }
        let pan_rad = pan_px / f + self.preset_rad(at_secs);
        Stand { rotation_rad: Vector3::new(tilt_px / f, pan_rad, roll_rad), log_focal }
    }

    /// Pan of the current preset; it changes every hour.
    fn preset_rad(&self, at_secs: f64) -> f64 {
        let number = (at_secs / HOUR_SECS).rem_euclid(f64::from(self.presets)).floor();
        let last = f64::from(self.presets - 1);
        WIDEST_PRESET_RAD * (2.0 * number - last) / last.max(1.0)
    }

    /// Days since the first picture.
    pub fn day_of(&self, at_secs: f64) -> f64 {
        (at_secs - self.began_secs) / DAY_SECS
    }

    /// Smooth curve of unit scatter that changes over six hours.
    fn restless(&self, at_secs: f64, of: u64) -> f64 {
        let slot = at_secs / (6.0 * HOUR_SECS);
        let knot = |slot: f64| -> f64 {
            let seed = self.seed.wrapping_mul(0x9E37_79B9).wrapping_add(of << 40)
                ^ (slot as i64).cast_unsigned();
            ChaCha8Rng::seed_from_u64(seed).sample(StandardNormal)
        };
        let (from, part) = (slot.floor(), slot.fract());
        let smooth = part * part * (3.0 - 2.0 * part);
        knot(from) * (1.0 - smooth) + knot(from + 1.0) * smooth
    }

    /// Picture at a time.
    pub fn picture(&self, at_secs: f64) -> GrayImage {
        let (width, height) =
            (self.image_size.width_px as usize, self.image_size.height_px as usize);
        let seed = self.seed.wrapping_mul(31).wrapping_add(at_secs.round() as u64);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let panorama = self.panorama.get_or_init(|| Panorama::new(self.seed));
        let mut light = panorama.light(self.hour_of(at_secs), &mut rng);
        if self.planted.iter().any(|p| p.what == What::Infrared) {
            light.switch_to_infrared();
        }
        let mut levels =
            self.seen(at_secs, |azimuth, elevation| panorama.level(&light, azimuth, elevation));
        let amount = |what: What| -> f64 {
            let own = self.planted.iter().filter(|p| p.what == what);
            own.map(|p| p.amount_at(self.day_of(at_secs))).sum()
        };
        if amount(What::Blur) > 0.0 {
            blur(&mut levels, width, height, amount(What::Blur));
        }
        let mean = levels.iter().sum::<f64>() / levels.len() as f64;
        let gain = (EXPOSED / mean.max(1e-6)).min(LARGEST_GAIN);
        let fog = amount(What::Fog).clamp(0.0, 1.0);
        let (dirt, is_covered) = (amount(What::Dirt), amount(What::Cover) > 0.0);
        // Dirt on the glass, at the lower left, out of focus.
        let spot = [0.22 * width as f64, 0.72 * height as f64, 0.09 * width as f64];
        let noise = NOISE * (gain / NOON_GAIN).sqrt();
        let mut bytes = Vec::with_capacity(levels.len());
        for (i, level) in levels.into_iter().enumerate() {
            let mut level = level * gain;
            level = (1.0 - fog) * level + fog * mean * gain;
            if dirt > 0.0 {
                let away = libm::hypot((i % width) as f64 - spot[0], (i / width) as f64 - spot[1])
                    / spot[2];
                let opacity = dirt * (1.0 - (away - 0.75).max(0.0) * 2.0).clamp(0.0, 1.0);
                level = (1.0 - opacity) * level + opacity * 0.5 * mean * gain;
            }
            if is_covered {
                level = 12.0;
            }
            let noisy: f64 = level + noise * rng.sample::<f64, _>(StandardNormal);
            bytes.push(noisy.round().clamp(0.0, 255.0) as u8);
        }
        let mut grey = GrayImage::from_raw(width as u32, height as u32, bytes).unwrap_or_default();
        if self.has_text {
            write_time(&mut grey, at_secs);
        }
        through_jpeg(grey)
    }

    /// Local hour: the street is at 0° of longitude.
    fn hour_of(&self, at_secs: f64) -> f64 {
        (at_secs / HOUR_SECS).rem_euclid(24.0)
    }

    /// Light seen by each pixel, four samples each. The map from pixels to directions is smooth:
    /// every eighth is computed.
    fn seen(&self, at_secs: f64, level: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        const STEP: usize = 8;
        let (width, height) =
            (self.image_size.width_px as usize, self.image_size.height_px as usize);
        let stand = self.stand(at_secs);
        let back = UnitQuaternion::from_scaled_axis(stand.rotation_rad).inverse();
        let (columns, rows) = (width.div_ceil(STEP) + 1, height.div_ceil(STEP) + 1);
        let (scale, pp) = (libm::exp(stand.log_focal), self.camera.pp_px);
        let mut directions = Vec::with_capacity(columns * rows);
        for j in 0..rows {
            for i in 0..columns {
                let px = Point2::new((i * STEP) as f64, (j * STEP) as f64);
                let ray =
                    self.camera.ray_from_px(&(pp + (px - pp) / scale)).unwrap_or_else(Vector3::z);
                let ray = back * ray;
                directions.push([libm::atan2(ray.x, ray.z), libm::atan2(ray.y, ray.xz().norm())]);
            }
        }
        let mut out = Vec::with_capacity(width * height);
        for y in 0..height {
            let j = y / STEP;
            for x in 0..width {
                let i = x / STEP;
                let mut sum = 0.0;
                for (du, dv) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                    let u = ((x % STEP) as f64 + du) / STEP as f64;
                    let v = ((y % STEP) as f64 + dv) / STEP as f64;
                    let at = |k: usize| {
                        let of = |i: usize, j: usize| directions[j * columns + i][k];
                        (of(i, j) * (1.0 - u) + of(i + 1, j) * u) * (1.0 - v)
                            + (of(i, j + 1) * (1.0 - u) + of(i + 1, j + 1) * u) * v
                    };
                    sum += level(at(0), at(1));
                }
                out.push(sum / 4.0);
            }
        }
        out
    }
}

impl Street {
    /// Parses the text after `sim:street:`: parts separated by commas.
    ///
    /// # Errors
    ///
    /// [`NoStreet`] names the invalid part.
    pub fn parse(text: &str) -> Result<Self, NoStreet> {
        let parts: Vec<&str> =
            text.split(',').map(str::trim).filter(|part| !part.is_empty()).collect();
        let seed = parts.iter().find_map(|part| part.parse::<u64>().ok()).unwrap_or(1);
        let mut street = Self::new(seed);
        for part in parts {
            let wrong = || NoStreet(part.into());
            let number = |text: &str, most: f64| {
                text.parse::<f64>().ok().filter(|v| *v >= 0.0 && *v <= most).ok_or_else(wrong)
            };
            if part.parse::<u64>().is_ok() {
                continue;
            } else if part == "text" {
                street.has_text = true;
            } else if let Some(days) = part.strip_prefix("days=") {
                street.days = number(days, 4000.0)?;
            } else if let Some(sway) = part.strip_prefix("sway=") {
                street.sway = number(sway, 100.0)?;
            } else if let Some(presets) = part.strip_prefix("presets=") {
                street.presets = number(presets, 4.0)?.max(1.0) as u32;
            } else {
                let mut planted = Planted::parse(part)?;
                if planted.what == What::Tilt {
                    // Down in the picture; a turn about x has it up.
                    planted.amount = -planted.amount;
                }
                street.planted.push(planted);
            }
        }
        Ok(street)
    }
}

/// Gaussian blur.
fn blur(levels: &mut Vec<f64>, width: usize, height: usize, sigma_px: f64) {
    let reach = (3.0 * sigma_px).ceil() as isize;
    let weights: Vec<f64> =
        (-reach..=reach).map(|i| libm::exp(-0.5 * (i as f64 / sigma_px).powi(2))).collect();
    let total: f64 = weights.iter().sum();
    for (step, line, lines) in [(1, width, height), (width, height, width)] {
        let mut out = vec![0.0; levels.len()];
        let across = if step == 1 { width } else { 1 };
        for n in 0..lines {
            for i in 0..line {
                let at = |k: isize| {
                    let i = (i as isize + k).clamp(0, line as isize - 1) as usize;
                    levels[n * across + i * step]
                };
                let sum: f64 =
                    weights.iter().enumerate().map(|(k, w)| w * at(k as isize - reach)).sum();
                out[n * across + i * step] = sum / total;
            }
        }
        *levels = out;
    }
}

/// Time as bars of white with a dark rim: a code instead of letters, but as sharp and as permanent.
fn write_time(grey: &mut GrayImage, at_secs: f64) {
    let mut code = (at_secs / 60.0) as u64;
    for n in 0..12_u32 {
        let digit = (code % 10) as u32;
        code /= 10;
        let left = 180 - 14 * n;
        for y in 0..18 {
            for x in 0..10 {
                let is_rim = x == 0 || x == 9 || y == 0 || y == 17;
                let is_bar = (y / 3 + digit + x / 3).is_multiple_of(2) || (3..6).contains(&x);
                let level = if is_rim || !is_bar { 0 } else { 255 };
                if left + x < grey.width() && 12 + y < grey.height() {
                    grey.put_pixel(left + x, 12 + y, image::Luma([level]));
                }
            }
        }
    }
}

fn through_jpeg(grey: GrayImage) -> GrayImage {
    let mut bytes = Vec::new();
    let encoded = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(&grey);
    let decoded = encoded
        .and_then(|()| image::load_from_memory_with_format(&bytes, image::ImageFormat::Jpeg));
    decoded.map_or(grey, image::DynamicImage::into_luma8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn day_is_brighter_than_night_and_all_follows_from_the_seed() {
        let street = Street::new(3);
        let noon = street.began_secs + 12.0 * HOUR_SECS;
        let mean = |grey: &GrayImage| {
            grey.as_raw().iter().map(|v| f64::from(*v)).sum::<f64>() / (640.0 * 480.0)
        };
        let (day, night) = (street.picture(noon), street.picture(noon + 12.0 * HOUR_SECS));
        assert!(mean(&day) > 90.0 && mean(&night) < 70.0, "{} {}", mean(&day), mean(&night));
        assert_eq!(day, Street::new(3).picture(noon));
        assert_ne!(day, Street::new(4).picture(noon));
    }

    #[test]
    fn planted_moves_begin_when_they_should() {
        let mut street = Street::new(1);
        street.sway = 0.0;
        street.planted = vec![Planted::parse("pan=5px@2d").expect("a move")];
        let at = |day: f64| {
            street.stand(street.began_secs + day * DAY_SECS).rotation_rad.y * street.camera.f_px.x
        };
        assert!(at(1.9).abs() < 1e-9 && (at(2.1) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn streets_are_read_and_nonsense_is_named() {
        let street =
            Street::parse("7,days=4,text,roll=0.1deg@2d,fog=0.7@3d..3.25d").expect("a street");
        assert_eq!((street.days, street.has_text, street.planted.len()), (4.0, true, 2));
        assert_eq!(street.planted[1].amount_at(3.1), 0.7);
        assert_eq!(street.planted[1].amount_at(3.3), 0.0);
        let around = Street::parse("presets=3").expect("a street");
        let pans =
            [0.0, 1.0, 2.0].map(|hour| around.preset_rad(around.began_secs + hour * HOUR_SECS));
        assert_eq!(pans, [-0.4, 0.0, 0.4]);
        for wrong in ["pan=5px", "pan=x@1d", "zoom=1@1d", "days=-1", "sway=NaN"] {
            assert!(Street::parse(wrong).is_err(), "{wrong}");
        }
    }
}
