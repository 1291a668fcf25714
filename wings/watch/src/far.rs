//! Search for a camera that points elsewhere: find the rough direction, turn the picture back,
//! measure the rest.

use image::GrayImage;
use nalgebra::Point2;

use crate::{gallery::Gallery, gallery::NEAREST, no_answer::NoAnswer};
use boresight_scene::{
    Lens, Measured, Reference, Turn, View, best_shift, bilinear, credible, turned,
};

/// Candidate rolls and scales: with this step, neighbours are within reach of the coarse fit.
const ROLLS_DEG: [f64; 9] = [-12.0, -9.0, -6.0, -3.0, 0.0, 3.0, 6.0, 9.0, 12.0];
const SCALES: [f64; 7] = [0.8, 0.87, 0.93, 1.0, 1.07, 1.15, 1.25];
/// Number of starts followed.
const FOLLOWED: usize = 4;
/// Picture without the turn. Pixels outside the original get the mean level.
pub fn turn_back(grey: &GrayImage, lens: &Lens, turn: &Turn) -> GrayImage {
    /// Step of the pixel grid: the map between pictures is smooth.
    const STEP: usize = 8;
    let (width, height) = (grey.width() as usize, grey.height() as usize);
    let rotation = turn.rotation();
    let (columns, rows) = (width.div_ceil(STEP) + 1, height.div_ceil(STEP) + 1);
    let nowhere = Point2::new(f64::NAN, f64::NAN);
    let mut map = Vec::with_capacity(columns * rows);
    for j in 0..rows {
        for i in 0..columns {
            let px = Point2::new((i * STEP) as f64, (j * STEP) as f64);
            let from = lens.ray(&px).and_then(|ray| turn.project_by(lens, &rotation, &ray));
            map.push(from.unwrap_or(nowhere));
        }
    }
    let pixels = grey.as_raw();
    let mean =
        (pixels.iter().map(|&v| u64::from(v)).sum::<u64>() / pixels.len().max(1) as u64) as u8;
    let mut out = Vec::with_capacity(pixels.len());
    for y in 0..height {
        let (j, v) = (y / STEP, (y % STEP) as f64 / STEP as f64);
        for x in 0..width {
            let (i, u) = (x / STEP, (x % STEP) as f64 / STEP as f64);
            let corner = |i: usize, j: usize| map[j * columns + i].coords;
            let upper = corner(i, j) * (1.0 - u) + corner(i + 1, j) * u;
            let lower = corner(i, j + 1) * (1.0 - u) + corner(i + 1, j + 1) * u;
            let at = upper * (1.0 - v) + lower * v;
            let level = bilinear(at.x, at.y, width, height, |i| f32::from(pixels[i]));
            out.push(level.map_or(mean, |level| (level + 0.5) as u8));
        }
    }
    GrayImage::from_raw(grey.width(), grey.height(), out).unwrap_or_default()
}

/// Turn of the camera since `reference`, among all rolls and scales. `None` if nothing fits.
fn locate_far(reference: &Reference, view: &View, lens: &Lens) -> Option<(Turn, usize)> {
    let f = lens.camera.f_px;
    let mut starts = Vec::new();
    for roll_deg in ROLLS_DEG {
        for scale in SCALES {
            let roll_rad = roll_deg.to_radians();
            let shift = best_shift(&turned(&reference.thumb, lens, roll_rad, scale), &view.thumb);
            let px = shift.shift_px(lens);
            let turn = Turn {
                pan_rad: px.x / f.x,
                tilt_rad: -px.y / f.y,
                roll_rad,
                log_focal: libm::log(scale),
            };
            starts.push((shift.score, turn));
        }
    }
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let fits = starts.iter().take(FOLLOWED).filter_map(|(_, start)| {
        let (fit, _) = reference.coarse_fit(view, lens, start)?;
        Some((fit.turn, fit.inliers()))
    });
    fits.max_by_key(|(_, inliers)| *inliers)
}

impl Gallery {
    /// Measures a picture of a camera with any pointing nearby, slowly (a few tenths of a second):
    /// for pictures without an answer from [`Self::measure`].
    ///
    /// # Errors
    ///
    /// Reason for the answer not being credible.
    pub fn measure_far(&self, view: &View, lens: &Lens) -> Result<Measured, NoAnswer> {
        if !view.shows_something() {
            return Err(NoAnswer::TooDark);
        }
        let mut order: Vec<(usize, f64)> = self
            .references
            .iter()
            .enumerate()
            .map(|(i, r)| (i, best_shift(&r.thumb, &view.thumb).score))
            .collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut best: Option<Measured> = None;
        for (index, _) in order.into_iter().take(NEAREST) {
            let reference = &self.references[index];
            let Some((turn, _)) = locate_far(reference, view, lens) else { continue };
            let Some(measured) = self.refine(view, lens, reference.turn.then(&turn)) else {
                continue;
            };
            let is_better = best.as_ref().is_none_or(|best| measured.inliers > best.inliers);
            let judged = credible(Some(measured.clone()), measured.found);
            if judged.is_ok() {
                return Ok(judged?);
            }
            if is_better {
                best = Some(measured);
            }
        }
        let sought = best.as_ref().map_or(0, |m| m.found);
        Ok(credible(best, sought)?)
    }

    /// Turns the picture back by `turn` and measures the rest, twice.
    fn refine(&self, view: &View, lens: &Lens, turn: Turn) -> Option<Measured> {
        let mut total = turn;
        let mut last = None;
        for _ in 0..2 {
            let back = View::of(turn_back(&view.grey, lens, &total));
            let mut measured = self.fit_nearest(&back, lens)?;
            let rest = measured.turn;
            measured.turned_back = Some(total);
            // The rest is applied first, then the total.
            total = rest.then(&total);
            measured.covariance += boresight_scene::lens_covariance(
                lens,
                &total,
                &measured.sightings,
                &measured.weights,
            );
            measured.turn = total;
            last = Some(measured);
        }
        last
    }
}
