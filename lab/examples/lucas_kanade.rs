//! Patch searches compared: normalised correlation, correlation with Lucas-Kanade steps from its
//! peak, and Lucas-Kanade alone, all with the same references, patches, learned weights, prediction
//! and fit.
//!
//! ```text
//! lucas_kanade FOLDER fx,fy,cx,cy[,k1…] LEARN [EVERY]
//! ```

mod watched;

use boresight_geometry::frame::ImageSize;
use boresight_watch::{FINE_HALF, Fit, Gallery, Landmark, Lens, Sighting, Turn, View, fit};
use image::GrayImage;
use nalgebra::{Matrix2, Point2, Vector2, Vector4};
use watched::{Failed, learned, lens, middle, pictures, read, spent_secs, turn_by, units};

/// Lucas-Kanade steps from the correlation's peak, and alone; the latter may go as far as the
/// correlation searches.
const FROM_PEAK: usize = 3;
const ALONE: usize = 20;
const FARTHEST_PX: f64 = 5.0;
/// The product's limits: fewest and least share of agreeing patches, least correlation.
const FEWEST: usize = 20;
const LEAST_AGREEING: f64 = 0.4;
const LEAST_CORRELATION: f64 = 0.6;

#[derive(Clone, Copy, PartialEq)]
enum Way {
    Correlation,
    Both,
    LucasKanade,
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, numbers, learn, every @ ..] = arguments.as_slice() else {
        return Err("FOLDER fx,fy,cx,cy[,k1…] LEARN [EVERY]".into());
    };
    let every: usize = every.first().map_or(Ok(1), |text| text.parse())?;
    let files = pictures(folder)?;
    let learn: usize = learn.parse()?;
    let lens = lens(numbers, ImageSize::of(&read(&files[0])?))?;
    let (gallery, _) = learned(&lens, &files[..learn], usize::MAX)?;
    let tested: Vec<GrayImage> =
        files[learn..].iter().step_by(every).map(read).collect::<Result<_, _>>()?;
    let f = lens.camera.f_px.x;
    let planted = Turn {
        pan_rad: -1.0 / f,
        tilt_rad: 1.0 / f,
        roll_rad: 0.1_f64.to_radians(),
        log_focal: 0.003,
    };
    for (name, way) in [
        ("correlation", Way::Correlation),
        ("correlation, then Lucas-Kanade", Way::Both),
        ("Lucas-Kanade alone", Way::LucasKanade),
    ] {
        let (mut turns, mut spent, mut found, mut agree) = (Vec::new(), 0.0, 0, 0);
        for grey in &tested {
            let view = View::of(grey.clone());
            let began = spent_secs();
            let fitted = measured(&gallery, &view, &lens, way);
            spent += spent_secs() - began;
            if let Some((fit, count)) = &fitted {
                (found, agree) = (found + count, agree + fit.inliers());
            }
            turns.push(fitted.map(|(fit, _)| fit.turn));
        }
        let answers = turns.iter().flatten().count();
        let steps: Vec<Vector4<f64>> = turns
            .windows(2)
            .filter_map(|w| Some((w[1]?.vector() - w[0]?.vector()).component_mul(&units(&lens))))
            .collect();
        let scatter: Vec<String> = (0..4)
            .map(|i| {
                let mut all: Vec<f64> = steps.iter().map(|s| s[i]).collect();
                let centre = middle(&mut all);
                let mut away: Vec<f64> = all.iter().map(|v| (v - centre).abs()).collect();
                format!("{:.4}", 1.4826 * middle(&mut away) / 2_f64.sqrt())
            })
            .collect();
        // Planted move against the picture's own estimate.
        let mut largest = Vector4::zeros();
        let mut missed = 0;
        for (grey, own) in tested.iter().zip(&turns).step_by(12) {
            let Some(own) = own else { continue };
            let view = View::of(turn_by(grey, &lens, &planted));
            let Some((fit, _)) = measured(&gallery, &view, &lens, way) else {
                missed += 1;
                continue;
            };
            let off = fit.turn.vector() - own.then(&planted).vector();
            largest = largest.sup(&off.component_mul(&units(&lens)).abs());
        }
        let each = |sum: usize| sum as f64 / answers.max(1) as f64;
        println!(
            "{name}: {answers} of {} answered, {:.0} patches found, {:.0} agree; scatter px px deg % {}; planted: {missed} missed, largest error {:.3?}; {:.1} ms",
            tested.len(),
            each(found),
            each(agree),
            scatter.join(" "),
            largest.as_slice(),
            1e3 * spent / tested.len() as f64
        );
    }
    Ok(())
}

/// Fit against the three nearest references, and the number of patches found; `None` unless
/// credible.
fn measured(gallery: &Gallery, view: &View, lens: &Lens, way: Way) -> Option<(Fit, usize)> {
    let order = gallery.nearest(view);
    let first = &gallery.references[*order.first()?];
    let guess = first.turn.then(&first.locate(view, lens));
    let mut sightings = Vec::new();
    for index in order {
        let reference = &gallery.references[index];
        let turn = guess.since(&reference.turn);
        if way == Way::LucasKanade {
            let own = reference.turn.rotation().inverse();
            for landmark in &reference.landmarks {
                let Some(start) = turn.project(lens, &landmark.ray) else { continue };
                let Some(px) = tracked(landmark, &view.fine, start, ALONE) else { continue };
                if (px - start).norm() < FARTHEST_PX {
                    sightings.push(Sighting {
                        ray: own * landmark.ray,
                        reference_px: Point2::new(landmark.px[0] as f64, landmark.px[1] as f64),
                        log_focal: reference.turn.log_focal,
                        px,
                        sigma_px: landmark.sigma_px,
                    });
                }
            }
            continue;
        }
        for (index, mut sighting) in reference.find(view, lens, &turn) {
            if way == Way::Both {
                let landmark = &reference.landmarks[index];
                match tracked(landmark, &view.fine, sighting.px, FROM_PEAK) {
                    Some(px) if (px - sighting.px).norm() < 1.0 => sighting.px = px,
                    _ => continue,
                }
            }
            sightings.push(sighting);
        }
    }
    let count = sightings.len();
    let fit = fit(lens, &sightings, None)?;
    let enough = fit.inliers() >= FEWEST && fit.inliers() as f64 >= LEAST_AGREEING * count as f64;
    enough.then_some((fit, count))
}

/// Lucas-Kanade of a patch with gain and offset (inverse compositional), from `start`.
fn tracked(
    landmark: &Landmark,
    image: &GrayImage,
    start: Point2<f64>,
    steps: usize,
) -> Option<Point2<f64>> {
    const SIDE: usize = 2 * FINE_HALF + 1;
    let bytes = landmark.fine.bytes();
    let template: Vec<f64> = bytes.iter().map(|v| f64::from(*v)).collect();
    let at = |x: usize, y: usize| template[y * SIDE + x];
    let inner = SIDE - 2;
    let (mut slopes, mut own) =
        (Vec::with_capacity(inner * inner), Vec::with_capacity(inner * inner));
    let mut normal = Matrix2::zeros();
    for y in 1..SIDE - 1 {
        for x in 1..SIDE - 1 {
            let slope = Vector2::new(
                (at(x + 1, y) - at(x - 1, y)) / 2.0,
                (at(x, y + 1) - at(x, y - 1)) / 2.0,
            );
            normal += slope * slope.transpose();
            slopes.push(slope);
            own.push(at(x, y));
        }
    }
    let solve = normal.try_inverse()?;
    let (own_mean, own_sd) = mean_sd(&own);
    let mut px = start;
    let mut seen = vec![0.0; own.len()];
    for _ in 0..steps {
        sample(image, px, inner, &mut seen)?;
        let (mean, sd) = mean_sd(&seen);
        let gain = own_sd / sd.max(1e-6);
        let right: Vector2<f64> = slopes
            .iter()
            .zip(own.iter().zip(&seen))
            .map(|(slope, (own, seen))| slope * ((seen - mean) * gain - (own - own_mean)))
            .sum();
        let step = solve * right;
        px -= step;
        if step.norm() < 0.003 {
            break;
        }
    }
    sample(image, px, inner, &mut seen)?;
    let (mean, sd) = mean_sd(&seen);
    let cross: f64 = own.iter().zip(&seen).map(|(a, b)| (a - own_mean) * (b - mean)).sum();
    let correlation = cross / (own.len() as f64 * own_sd * sd).max(1e-9);
    (correlation > LEAST_CORRELATION).then_some(px)
}

fn mean_sd(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
}

/// Square of `side` px around a point, by bilinear interpolation.
fn sample(image: &GrayImage, px: Point2<f64>, side: usize, to: &mut [f64]) -> Option<()> {
    let half = (side / 2) as f64;
    let (left, top) = (px.x - half, px.y - half);
    let fits = left >= 0.0
        && top >= 0.0
        && left + side as f64 + 1.0 < f64::from(image.width())
        && top + side as f64 + 1.0 < f64::from(image.height());
    if !fits {
        return None;
    }
    let (x0, y0) = (left as usize, top as usize);
    let (u, v) = (left.fract(), top.fract());
    let width = image.width() as usize;
    let raw = image.as_raw();
    let at = |x: usize, y: usize| f64::from(raw[y * width + x]);
    for y in 0..side {
        for x in 0..side {
            let (x1, y1) = (x0 + x, y0 + y);
            to[y * side + x] = (at(x1, y1) * (1.0 - u) + at(x1 + 1, y1) * u) * (1.0 - v)
                + (at(x1, y1 + 1) * (1.0 - u) + at(x1 + 1, y1 + 1) * u) * v;
        }
    }
    Some(())
}
