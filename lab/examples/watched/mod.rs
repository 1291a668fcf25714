//! Code shared by the examples: reading pictures and lenses, planting turns and glass, and robust
//! statistics.
#![allow(dead_code, reason = "each example uses its part")]

use std::path::PathBuf;

use boresight_geometry::{Camera, frame::ImageSize};
use boresight_watch::{
    Gallery, Glance, Lens, Mask, Measured, NoAnswer, SIZE, Turn, View, px_per_turn,
};
use image::{GrayImage, imageops};
use nalgebra::{Point2, Vector2, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(crate) type Failed = Box<dyn std::error::Error>;

/// Processor time of this thread, seconds; independent of the machine's load.
pub(crate) fn spent_secs() -> f64 {
    let status = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanos = status.split(' ').next().and_then(|n| n.parse::<f64>().ok());
    nanos.map_or(f64::NAN, |nanos| nanos * 1e-9)
}

pub(crate) fn read(file: &PathBuf) -> Result<GrayImage, Failed> {
    Ok(image::open(file)?.into_luma8())
}

pub(crate) fn lens(numbers: &str, image_size: ImageSize) -> Result<Lens, Failed> {
    let mut given = numbers.split(',').map(str::parse::<f64>);
    let mut next = || given.next().unwrap_or(Ok(0.0));
    let mut camera = Camera::pinhole(1.0, Point2::origin());
    camera.f_px = Vector2::new(next()?, next()?);
    camera.pp_px = Point2::new(next()?, next()?);
    let d = &mut camera.distortion;
    (d.k1, d.k2, d.p1, d.p2, d.k3) = (next()?, next()?, next()?, next()?, next()?);
    Ok(Lens::new(camera, None, image_size))
}

/// Mask from 24 pictures from dark to bright.
pub(crate) fn masks(files: &[PathBuf]) -> Result<Mask, Failed> {
    let mut by_light = Vec::new();
    for file in files {
        let grey = read(file)?;
        let sum: u64 = grey.as_raw().iter().map(|&v| u64::from(v)).sum();
        by_light.push((sum, file));
    }
    by_light.sort();
    let step = by_light.len().div_ceil(24).max(1);
    let pictures: Vec<GrayImage> =
        by_light.iter().step_by(step).map(|(_, file)| read(file)).collect::<Result<_, _>>()?;
    Ok(Mask::of(&pictures))
}

/// Units: px, px, deg, %.
pub(crate) fn units(lens: &Lens) -> Vector4<f64> {
    let px = px_per_turn(lens);
    Vector4::new(px[0], px[1], 180.0 / std::f64::consts::PI, 100.0)
}

pub(crate) fn middle(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

pub(crate) fn answer(gallery: &Gallery, view: &View, lens: &Lens) -> Result<Measured, NoAnswer> {
    gallery.measure(view, lens).or_else(|_| gallery.measure_far(view, lens))
}

/// Picture after the turn, by cubic interpolation.
pub(crate) fn turn_by(grey: &GrayImage, lens: &Lens, turn: &Turn) -> GrayImage {
    let (back, c) = (turn.inverse(), lens.camera.pp_px);
    let rotation = back.rotation();
    GrayImage::from_fn(grey.width(), grey.height(), |x, y| {
        let px = Point2::new(f64::from(x), f64::from(y));
        let scaled = c + (px - c) / turn.log_focal.exp();
        let from = lens.ray(&scaled).and_then(|ray| lens.camera.project(&(rotation * ray).into()));
        image::Luma([from.map_or(0, |from| cubic(grey, from))])
    })
}

/// Catmull-Rom interpolation with the picture's edge repeated.
pub(crate) fn cubic(grey: &GrayImage, at: Point2<f64>) -> u8 {
    let weights = |t: f64| {
        let (a, b) = (t * t, t * t * t);
        [
            -0.5 * t + a - 0.5 * b,
            1.0 - 2.5 * a + 1.5 * b,
            0.5 * t + 2.0 * a - 1.5 * b,
            -0.5 * a + 0.5 * b,
        ]
    };
    let (x0, y0) = (at.x.floor(), at.y.floor());
    let (wx, wy) = (weights(at.x - x0), weights(at.y - y0));
    let pixel = |x: f64, y: f64| {
        let clamp = |v: f64, length: u32| v.clamp(0.0, f64::from(length) - 1.0) as u32;
        f64::from(grey.get_pixel(clamp(x, grey.width()), clamp(y, grey.height())).0[0])
    };
    let mut sum = 0.0;
    for (j, wy) in wy.iter().enumerate() {
        for (i, wx) in wx.iter().enumerate() {
            sum += wx * wy * pixel(x0 + i as f64 - 1.0, y0 + j as f64 - 1.0);
        }
    }
    sum.round().clamp(0.0, 255.0) as u8
}

/// Pictures of a folder, sorted by name.
pub(crate) fn pictures(folder: &str) -> Result<Vec<PathBuf>, Failed> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.sort();
    Ok(files)
}

/// Learns references from files, and masks text.
pub(crate) fn learned(
    lens: &Lens,
    files: &[PathBuf],
    references: usize,
) -> Result<(Gallery, Mask), Failed> {
    let mut glances = Vec::new();
    for (i, file) in files.iter().enumerate() {
        glances.push(Glance::of(&View::of(read(file)?), i as f64 * 900.0));
    }
    let mask = masks(files)?;
    let load = |i: usize| read(&files[i]).ok().map(View::of);
    Ok((Gallery::learn(lens, &glances, references.min(SIZE), &mask, load), mask))
}

pub(crate) fn blurred(grey: &GrayImage) -> GrayImage {
    imageops::blur(grey, 1.0)
}

pub(crate) fn foggy(grey: &GrayImage) -> GrayImage {
    let mean = mean(grey).max(40.0);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut out = blurred(grey);
    for level in out.iter_mut() {
        *level = (0.3 * f64::from(*level) + 0.7 * mean + rng.random_range(-2.6..2.6)).round() as u8;
    }
    out
}

pub(crate) fn dirty(grey: &GrayImage) -> GrayImage {
    let (x0, y0, radius) = (
        0.63 * f64::from(grey.width()),
        0.5 * f64::from(grey.height()),
        0.08 * f64::from(grey.width()),
    );
    let light = 60.0 / 128.0 * mean(grey).max(20.0);
    GrayImage::from_fn(grey.width(), grey.height(), |x, y| {
        let away = (f64::from(x) - x0).hypot(f64::from(y) - y0) / radius;
        let opacity = 0.9 * (1.0 - (away - 0.75) / 0.5).clamp(0.0, 1.0);
        let level = f64::from(grey.get_pixel(x, y).0[0]);
        image::Luma([((1.0 - opacity) * level + opacity * light) as u8])
    })
}

pub(crate) fn veiled(grey: &GrayImage) -> GrayImage {
    let mean = mean(grey);
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut out = grey.clone();
    for level in out.iter_mut() {
        *level = (0.03 * f64::from(*level) + 0.97 * mean + rng.random_range(-2.0..2.0))
            .clamp(0.0, 255.0) as u8;
    }
    out
}

pub(crate) fn noisy(grey: &GrayImage, gain: f64) -> GrayImage {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut out = grey.clone();
    for level in out.iter_mut() {
        *level = (gain * f64::from(*level) + rng.random_range(0.0..2.0)) as u8;
    }
    out
}

pub(crate) fn mean(grey: &GrayImage) -> f64 {
    grey.iter().map(|v| f64::from(*v)).sum::<f64>() / grey.len() as f64
}
