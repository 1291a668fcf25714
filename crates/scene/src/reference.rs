//! Reference picture, reduced to a thumbnail and patches.

use nalgebra::{Point2, Vector3};

use crate::{
    fit::{Fit, Sighting, fit},
    level::{Thumb, View},
    measure::FEWEST_FOUND,
    patches::{
        COARSE_HALF, COARSE_SEARCH, FINE_HALF, FINE_SEARCH, FINE_SIDE, Patch, corners, full_px,
        reduced_px,
    },
    shift::best_shift,
    texture::Texture,
    turn::{Lens, Turn},
};

/// Standard deviation of a patch without statistics, px.
pub const UNKNOWN_SIGMA_PX: f64 = 0.3;
/// Standard deviation of a patch of the reduced picture, px of the full-size picture.
const COARSE_SIGMA_PX: f64 = 1.5;

/// Patch of a reference picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// Pixel in the reference picture.
    pub px: [i64; 2],
    /// Unit ray of the pixel, in the frame of the reference.
    pub ray: Vector3<f64>,
    /// Levels in the full-size picture.
    pub fine: Patch,
    /// Levels in the reduced picture; `None` at the very edge.
    pub coarse: Option<Patch>,
    /// Sharpness and contrast in the original picture.
    pub texture: Texture,
    /// Standard deviation of the patch's position, px.
    pub sigma_px: f64,
}

impl Landmark {
    /// Centre of the pixel in the reference picture.
    pub fn point_px(&self) -> Point2<f64> {
        Point2::from(self.px.map(|px| px as f64))
    }
}

/// A reference picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Capture time, seconds since 1970 (UTC).
    pub taken_secs: f64,
    /// Thumbnail for comparing pictures.
    pub thumb: Thumb,
    /// Turn of the reference, in the frame of the gallery.
    pub turn: Turn,
    /// True for references learned together, false for adopted references.
    pub is_first: bool,
    /// Patches.
    pub landmarks: Vec<Landmark>,
}

/// Sightings of a reference's patches in a picture, each with the patch's index.
pub type Found = Vec<(usize, Sighting)>;

impl Reference {
    /// Chooses the patches of a picture, outside the pixels that aren't of the scene.
    pub fn of(
        view: &View,
        taken_secs: f64,
        lens: &Lens,
        is_masked: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let points = corners(&view.fine, is_masked);
        let landmarks = points.into_iter().filter_map(|px| {
            let at = Point2::new(px[0] as f64, px[1] as f64);
            let coarse_px = [at.x, at.y].map(|v| reduced_px(v).round() as i64);
            Some(Landmark {
                px,
                ray: lens.ray(&at)?,
                fine: Patch::at(&view.fine, px, FINE_HALF)?,
                coarse: Patch::at(&view.coarse, coarse_px, COARSE_HALF),
                texture: Texture::at(&view.grey, px)?,
                sigma_px: UNKNOWN_SIGMA_PX,
            })
        });
        Self {
            taken_secs,
            // As read back from a store.
            thumb: Thumb::from_levels(&view.thumb.levels()).unwrap_or_else(|| view.thumb.clone()),
            turn: Turn::default(),
            is_first: false,
            landmarks: landmarks.collect(),
        }
    }

    /// Patch as read from a store: pixel, levels in full size and reduced, row by row, and learned
    /// standard deviation. `None` if they can't belong to a patch of this lens.
    pub fn landmark(
        lens: &Lens,
        px: [i64; 2],
        (fine, coarse): (&[u8], Option<&[u8]>),
        texture: Texture,
        sigma_px: f64,
    ) -> Option<Landmark> {
        let ray = lens.ray(&Point2::new(px[0] as f64, px[1] as f64))?;
        let fine = Patch::from_bytes(fine, FINE_SIDE)?;
        let coarse = match coarse {
            None => None,
            Some(levels) => Some(Patch::from_bytes(levels, 2 * COARSE_HALF + 1)?),
        };
        let is_sound = sigma_px > 0.0 && sigma_px.is_finite();
        is_sound.then_some(Landmark { px, ray, fine, coarse, texture, sigma_px })
    }

    /// Searches the patches at the positions predicted by `turn`.
    pub fn find(&self, view: &View, lens: &Lens, turn: &Turn) -> Found {
        let (rotation, own) = (turn.rotation(), self.turn.rotation().inverse());
        let find = |(index, landmark): (usize, &Landmark)| {
            let guess = turn.project_by(lens, &rotation, &landmark.ray)?;
            let guess = [guess.x, guess.y].map(|v| v.round() as i64);
            let found = landmark.fine.find(&view.fine, guess, FINE_SEARCH)?;
            let reference_px = landmark.point_px();
            let (ray, log_focal) = (own * landmark.ray, self.turn.log_focal);
            Some((
                index,
                Sighting {
                    ray,
                    reference_px,
                    log_focal,
                    px: found.px,
                    sigma_px: landmark.sigma_px,
                },
            ))
        };
        self.landmarks.iter().enumerate().filter_map(find).collect()
    }

    /// Searches the sought patches, by index, in the reduced picture, up to 48 px around `start`.
    pub fn find_coarsely(
        &self,
        view: &View,
        lens: &Lens,
        start: &Turn,
        is_sought: impl Fn(usize) -> bool,
    ) -> Vec<Sighting> {
        let rotation = start.rotation();
        let find = |(_, landmark): (usize, &Landmark)| {
            let guess = start.project_by(lens, &rotation, &landmark.ray)?;
            let guess = [guess.x, guess.y].map(|v| reduced_px(v).round() as i64);
            let found = landmark.coarse.as_ref()?.find(&view.coarse, guess, COARSE_SEARCH)?;
            // The patch is around a pixel of the reduced picture; its landmark may be off that
            // pixel's centre.
            let reference_px = landmark.point_px();
            let beside = reference_px - reference_px.map(|v| full_px(reduced_px(v).round()));
            let px = found.px.map(full_px) + beside;
            Some(Sighting {
                ray: landmark.ray,
                reference_px,
                log_focal: 0.0,
                px,
                sigma_px: COARSE_SIGMA_PX,
            })
        };
        let sought = self.landmarks.iter().enumerate().filter(|(index, _)| is_sought(*index));
        sought.filter_map(find).collect()
    }

    /// Fits the turn since this reference from the reduced picture, up to 48 px around `start`.
    /// `None` with too few patches.
    pub fn coarse_fit(&self, view: &View, lens: &Lens, start: &Turn) -> Option<(Fit, usize)> {
        let sightings = self.find_coarsely(view, lens, start, |_| true);
        if sightings.len() < FEWEST_FOUND {
            return None;
        }
        let fit = fit(lens, &sightings, None)?;
        Some((fit, sightings.len()))
    }

    /// Turn of the camera by the best shift of the whole thumbnail.
    pub fn shifted(&self, view: &View, lens: &Lens) -> Turn {
        best_shift(&self.thumb, &view.thumb).turn(lens)
    }

    /// Rough turn of the camera since this reference: from the reduced picture, or from the best
    /// shift of the whole thumbnail if fewer than half of the patches agree.
    pub fn locate(&self, view: &View, lens: &Lens) -> Turn {
        let first = self.coarse_fit(view, lens, &Turn::default());
        if let Some((fit, found)) = &first
            && fit.inliers() >= FEWEST_FOUND.max(found / 2)
        {
            return fit.turn;
        }
        let second = self.coarse_fit(view, lens, &self.shifted(view, lens));
        let best = first.into_iter().chain(second).max_by_key(|(fit, _)| fit.inliers());
        best.map_or(Turn::default(), |(fit, _)| fit.turn)
    }
}
