//! Comparison of one picture with a gallery: an answer, or the reason for having none.

use std::collections::BTreeSet;

use boresight_geometry::frame::ImageSize;
use nalgebra::{Matrix4, Vector2};

use crate::{
    fit::{self, AGREES, Fit, Sighting, fit, offsets_px},
    patches::cell_of,
    turn::{Lens, Turn},
};

/// Minimum number of agreeing patches: an on-screen text gives about eight.
const FEWEST_INLIERS: usize = 20;
/// Minimum share of agreeing patches among those found.
pub const LEAST_AGREEING: f64 = 0.4;
/// Minimum spread of the agreeing patches, as a share of an even spread over the picture.
const LEAST_SPREAD: f64 = 0.35;
/// Minimum distance between two motions in one picture, px.
pub const APART_PX: f64 = 1.0;
/// Minimum number of patches for a fit.
pub const FEWEST_FOUND: usize = 8;

/// Measurement of a picture.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Turn since the gallery's frame.
    pub turn: Turn,
    /// Covariance of pan, tilt, roll (rad) and log focal ratio, with the lens's own error.
    pub covariance: Matrix4<f64>,
    /// Number of patches looked for.
    pub sought: usize,
    /// Number of patches found.
    pub found: usize,
    /// Number of agreeing patches.
    pub inliers: usize,
    /// Coverage of the picture by the agreeing patches: 1 if even, 0 if in one place.
    pub spread: f64,
    /// Reference and patch of each sighting.
    pub tags: Vec<(usize, usize)>,
    /// Sightings, in the same order.
    pub sightings: Vec<Sighting>,
    /// Weights of the sightings, 0 to 1.
    pub weights: Vec<f64>,
    /// Turn by which the compared picture had been turned back, if far off.
    pub turned_back: Option<Turn>,
}

/// Why a measurement is no evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    /// Too few patches of the references are in the picture.
    FewFound {
        /// Patches that were found.
        found: u32,
        /// Patches that were looked for.
        of: u32,
    },
    /// Patches were found, but they disagree about where the camera points.
    Disagree {
        /// Patches that agree.
        agree: u32,
        /// Patches that were found.
        found: u32,
    },
    /// What agrees lies in one corner of the picture only.
    OneCorner,
}

/// Judges a fit.
pub fn credible(measured: Option<Measured>, sought: usize) -> Result<Measured, Weak> {
    let found = measured.as_ref().map_or(0, |m| m.found);
    let agree = measured.as_ref().map_or(0, |m| m.inliers);
    match measured {
        Some(m) if agree >= FEWEST_INLIERS && agree as f64 >= LEAST_AGREEING * found as f64 => {
            if m.spread > LEAST_SPREAD { Ok(m) } else { Err(Weak::OneCorner) }
        }
        Some(_) if found >= FEWEST_INLIERS => {
            Err(Weak::Disagree { agree: agree as u32, found: found as u32 })
        }
        _ => Err(Weak::FewFound { found: found as u32, of: sought as u32 }),
    }
}

/// Number of sightings that agree about a motion at least `apart_px` from `turn`, if they are at
/// least `fewest` and spread.
pub fn motion_besides(
    (turn, lens): (&Turn, &Lens),
    sightings: &[Sighting],
    fewest: usize,
    apart_px: f64,
) -> Option<u32> {
    if sightings.len() < fewest {
        return None;
    }
    let fitted = fit(lens, sightings, None)?;
    let off = offsets_px(lens, turn, sightings).into_iter().zip(&fitted.weights);
    let agreeing = off.filter(|(_, weight)| **weight > AGREES);
    let mut off_px: Vec<f64> = agreeing.filter_map(|(off, _)| Some(off?.norm())).collect();
    let count = off_px.len();
    let is_apart = fit::median(&mut off_px).is_some_and(|px| px > apart_px);
    let is_wide = spread(sightings, &fitted.weights, lens) > LEAST_SPREAD;
    (is_apart && is_wide && count >= fewest).then_some(count as u32)
}

/// Smaller standard deviation of the sightings along x and y, as a share of an even spread's.
/// Pictures are wide and horizons flat, so y counts two and a half times.
pub fn spread(sightings: &[Sighting], weights: &[f64], lens: &Lens) -> f64 {
    const FLAT_HORIZON: f64 = 2.5;
    let total: f64 = weights.iter().sum();
    if total < 1.0 {
        return 0.0;
    }
    let of = |value: fn(&Sighting) -> f64, length: u32| {
        let mean = sightings.iter().zip(weights).map(|(s, w)| value(s) * w).sum::<f64>() / total;
        let square =
            sightings.iter().zip(weights).map(|(s, w)| (value(s) - mean).powi(2) * w).sum::<f64>();
        (square / total).sqrt() / (f64::from(length) / 12_f64.sqrt())
    };
    let x = of(|s| s.px.x, lens.image_size.width_px);
    let y = of(|s| s.px.y, lens.image_size.height_px);
    x.min(FLAT_HORIZON * y)
}

/// How well two explanations of a move fit the same sightings: root mean squares in px over the
/// sightings that agree with either. A camera that turned, and a principal point that moved, look
/// alike through a narrow lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "schemas", derive(schemars::JsonSchema))]
pub struct Causes {
    /// Left over if the camera turned.
    pub turned_px: f64,
    /// Left over if the picture moved as it is.
    pub shifted_px: f64,
    /// Sightings that were compared.
    pub compared: u32,
}

impl Measured {
    /// Fit of tagged sightings, without the lens's own error. `None` for too few.
    pub fn of(
        lens: &Lens,
        sought: usize,
        tagged: impl Iterator<Item = ((usize, usize), Sighting)>,
    ) -> Option<Self> {
        let (tags, sightings): (Vec<_>, Vec<_>) = tagged.unzip();
        if sightings.len() < FEWEST_FOUND {
            return None;
        }
        let Fit { turn, covariance, weights } = fit(lens, &sightings, None)?;
        Some(Self {
            turn,
            covariance,
            sought,
            found: sightings.len(),
            inliers: weights.iter().filter(|w| **w > AGREES).count(),
            spread: spread(&sightings, &weights, lens),
            tags,
            sightings,
            weights,
            turned_back: None,
        })
    }

    /// Tags and sightings of the patches that agree with the turn.
    pub fn agreeing(&self) -> impl Iterator<Item = ((usize, usize), &Sighting)> {
        let seen = self.tags.iter().zip(&self.sightings).zip(&self.weights);
        seen.filter(|(_, weight)| **weight > AGREES).map(|((tag, sighting), _)| (*tag, sighting))
    }

    /// Cells of a picture of `size` with a patch that agrees with the turn.
    pub fn agreeing_cells(&self, size: ImageSize) -> BTreeSet<[usize; 2]> {
        self.agreeing().map(|(_, sighting)| cell_of(&sighting.px, size)).collect()
    }

    /// Number of patches outside the fit that agree about another motion, if they are many: part of
    /// the picture moves with the camera, such as its mount, or part of the scene has moved.
    /// Neither is known to be the scene that stands still.
    pub fn second_motion(&self, lens: &Lens) -> Option<u32> {
        let left = self.sightings.iter().zip(&self.weights).filter(|(_, w)| **w <= AGREES);
        let left: Vec<Sighting> = left.map(|(sighting, _)| *sighting).collect();
        motion_besides((&self.turn, lens), &left, FEWEST_INLIERS, APART_PX)
    }

    /// Fit of a shifted picture, as by a knocked lens, with the shift as a turn in the picture's
    /// middle. Unchanged if most sightings agree with the turn, or no more with the shift.
    pub fn or_shifted(self, lens: &Lens) -> Self {
        let is_majority = 2 * self.inliers > self.found;
        if is_majority {
            return self;
        }
        let Some((shift_px, Fit { turn, covariance, weights })) = self.shift(lens, |_| true) else {
            return self;
        };
        let inliers = weights.iter().filter(|w| **w > AGREES).count();
        if inliers <= self.inliers || shift_px.norm() < APART_PX {
            return self;
        }
        let f = lens.camera.f_px;
        let [pan_rad, tilt_rad] = [shift_px.x / f.x, -shift_px.y / f.y];
        Self {
            turn: Turn { pan_rad, tilt_rad, ..turn },
            covariance,
            inliers,
            spread: spread(&self.sightings, &weights, lens),
            weights,
            ..self
        }
    }

    /// Shift of the picture in pixels by the median of the sightings that count, and the fit of
    /// roll and focal length about it.
    fn shift(&self, lens: &Lens, counts: impl Fn(usize) -> bool) -> Option<(Vector2<f64>, Fit)> {
        let mut still = Turn { pan_rad: 0.0, tilt_rad: 0.0, ..self.turn };
        let mut found = None;
        // Alternately the median shift, then roll and focal length about it: both are small
        // compared with the move.
        for _ in 0..3 {
            let off = offsets_px(lens, &still, &self.sightings);
            let of = |axis: usize| {
                let kept = off.iter().enumerate().filter(|(i, _)| counts(*i));
                fit::median(&mut kept.filter_map(|(_, o)| o.map(|o| o[axis])).collect::<Vec<_>>())
            };
            let shift_px = Vector2::new(of(0)?, of(1)?);
            let moved: Vec<Sighting> =
                self.sightings.iter().map(|s| Sighting { px: s.px - shift_px, ..*s }).collect();
            let fitted = fit(lens, &moved, Some(still))?;
            still = Turn { pan_rad: 0.0, tilt_rad: 0.0, ..fitted.turn };
            found = Some((shift_px, fitted));
        }
        found
    }

    /// Compares a turn with a shift of the picture as causes of this move. `None` without a move,
    /// when both fit.
    pub fn causes(&self, lens: &Lens) -> Option<Causes> {
        let (shift, fitted) = self.shift(lens, |i| self.weights[i] > AGREES)?;
        let still = Turn { pan_rad: 0.0, tilt_rad: 0.0, ..fitted.turn };
        let by_turn = offsets_px(lens, &self.turn, &self.sightings);
        let by_shift = offsets_px(lens, &still, &self.sightings);
        let (mut squares, mut count) = ([0.0; 2], 0_u32);
        for (turned, shifted) in by_turn.iter().zip(&by_shift) {
            let (Some(turned), Some(shifted)) = (turned, shifted) else { continue };
            let shifted = shifted - shift;
            if turned.norm().min(shifted.norm()) < 1.5 {
                squares = [squares[0] + turned.norm_squared(), squares[1] + shifted.norm_squared()];
                count += 1;
            }
        }
        let rms = squares.map(|s| (s / f64::from(count.max(1))).sqrt());
        (count > 0).then_some(Causes { turned_px: rms[0], shifted_px: rms[1], compared: count })
    }
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Camera, frame::ImageSize};
    use nalgebra::Point2;

    use super::*;

    /// Through a lens of 98°, a turn moves the sides of the picture more than its middle.
    fn lens() -> Lens {
        let size = ImageSize { width_px: 1024, height_px: 768 };
        Lens::new(Camera::pinhole(440.0, size.centre_px()), None, size)
    }

    /// Patches on a grid, moved by `moved`.
    fn seen(lens: &Lens, moved: impl Fn(Point2<f64>) -> Point2<f64>) -> Measured {
        let grid = (0..96)
            .map(|i| Point2::new(40.0 + 85.0 * f64::from(i % 12), 40.0 + 90.0 * f64::from(i / 12)));
        let sighting = |reference_px: Point2<f64>| Sighting {
            ray: lens.ray(&reference_px).expect("a ray"),
            reference_px,
            log_focal: 0.0,
            px: moved(reference_px),
            sigma_px: 0.3,
        };
        let tagged = grid.enumerate().map(|(i, px)| ((0, i), sighting(px)));
        Measured::of(lens, 96, tagged).expect("fitted").or_shifted(lens)
    }

    #[test]
    fn a_picture_that_moved_as_it_is_is_answered_as_a_shift() {
        let lens = lens();
        for shift_px in [Vector2::new(6.0, 0.0), Vector2::new(-3.0, 8.0)] {
            let measured = seen(&lens, |px| px + shift_px);
            let found_px = measured.turn.in_px(&lens);
            let off_px = Vector2::new(found_px[0] - shift_px.x, found_px[1] + shift_px.y);
            assert!(off_px.norm() < 0.1 && found_px[3].abs() < 0.1, "{found_px}");
            assert_eq!(measured.inliers, 96);
            let causes = measured.causes(&lens).expect("moved");
            assert!(causes.shifted_px < 0.1 && causes.turned_px > 1.0, "{causes:?}");
        }
    }

    #[test]
    fn a_turned_camera_is_no_shift() {
        let lens = lens();
        let turn = Turn { pan_rad: 8.0 / 440.0, ..Turn::default() };
        let measured = seen(&lens, |px| {
            turn.project(&lens, &lens.ray(&px).expect("a ray")).expect("in the picture")
        });
        assert!((measured.turn.pan_rad - turn.pan_rad).abs() < 1e-5, "{:?}", measured.turn);
        assert_eq!(measured.inliers, 96);
    }
}
