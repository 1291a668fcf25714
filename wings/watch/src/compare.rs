//! Comparison of a picture with the nearest references of a gallery.

use std::collections::BTreeSet;

use nalgebra::Point2;

use crate::{gallery::Gallery, gallery::NEAREST, no_answer::NoAnswer};
use boresight_scene::{
    APART_PX, FINE_SEARCH, LEAST_AGREEING, Lens, Measured, Reference, Sighting, Turn, View,
    best_shift, cell_of, credible, lens_covariance, motion_besides,
};

/// Minimum number of agreeing patches for a motion beyond the search around another: so far apart,
/// hardly any agree by chance.
const FEWEST_FAR: usize = 10;

/// Number of patches of `view` in agreement with a single reference picture, if credible: do both
/// show the same place?
pub fn agreeing(reference: &Reference, view: &View, lens: &Lens) -> Option<usize> {
    let gallery = Gallery { references: vec![reference.clone()] };
    gallery.measure(view, lens).ok().map(|measured| measured.inliers)
}

impl Gallery {
    /// Measures a picture of a camera near the former pointing. Slow searches are left to
    /// [`Self::measure_far`].
    ///
    /// # Errors
    ///
    /// Reason for the answer not being credible.
    pub fn measure(&self, view: &View, lens: &Lens) -> Result<Measured, NoAnswer> {
        if self.references.is_empty() {
            return Err(NoAnswer::NoReferences);
        }
        if boresight_geometry::frame::ImageSize::of(&view.grey) != lens.image_size {
            return Err(NoAnswer::OtherSize);
        }
        if !view.shows_something() {
            return Err(NoAnswer::TooDark);
        }
        let measured = self.fit_nearest(view, lens).map(|measured| measured.or_shifted(lens));
        // Of two motions, the one that stays may be that of the camera's own mount.
        let still = measured.as_ref().filter(|m| m.turn.in_px(lens).amax() < APART_PX);
        let other = |m: &Measured| m.second_motion(lens).or_else(|| self.far_motion(view, lens, m));
        if let Some((still, other)) = still.and_then(|m| Some((m, other(m)?))) {
            let agree = still.inliers as u32;
            return Err(NoAnswer::TwoMotions { agree, other, left_out_percent: None });
        }
        Ok(credible(measured, self.sought(view))?)
    }

    /// Number of patches that agree about a motion beyond the search around `still`, if they are
    /// many and spread.
    fn far_motion(&self, view: &View, lens: &Lens, still: &Measured) -> Option<u32> {
        let agreeing: BTreeSet<(usize, usize)> = still.agreeing().map(|(tag, _)| tag).collect();
        let (size, staying) = (lens.image_size, still.agreeing_cells(lens.image_size));
        let order = self.nearest(view);
        let moves = |px: &Point2<f64>| !staying.contains(&cell_of(px, size));
        let [from, to] = [&self.references[*order.first()?].thumb, &view.thumb]
            .map(|thumb| thumb.only(size, moves));
        let shifted = best_shift(&from, &to).turn(lens);
        [Turn::default(), shifted].iter().find_map(|start| {
            let left = order.iter().flat_map(|index| {
                let reference = &self.references[*index];
                let (own, log_focal) =
                    (reference.turn.rotation().inverse(), reference.turn.log_focal);
                let is_left = |patch: usize| !agreeing.contains(&(*index, patch));
                let found = reference.find_coarsely(view, lens, start, is_left);
                found.into_iter().map(move |s| Sighting { ray: own * s.ray, log_focal, ..s })
            });
            let left: Vec<Sighting> = left.collect();
            let fewest = FEWEST_FAR.max((LEAST_AGREEING * left.len() as f64).ceil() as usize);
            motion_besides((&still.turn, lens), &left, fewest, FINE_SEARCH as f64)
        })
    }

    /// Most similar references, the nearest first.
    pub fn nearest(&self, view: &View) -> Vec<usize> {
        let mut order: Vec<(usize, f64)> = self
            .references
            .iter()
            .enumerate()
            .map(|(i, r)| (i, r.thumb.likeness(&view.thumb)))
            .collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        order.into_iter().take(NEAREST).map(|(i, _)| i).collect()
    }

    fn sought(&self, view: &View) -> usize {
        self.nearest(view).into_iter().map(|i| self.references[i].landmarks.len()).sum()
    }

    /// Fit against the nearest references, credible or not.
    pub(crate) fn fit_nearest(&self, view: &View, lens: &Lens) -> Option<Measured> {
        let order = self.nearest(view);
        let first = &self.references[*order.first()?];
        let guess = first.turn.then(&first.locate(view, lens));
        let sought = order.iter().map(|index| self.references[*index].landmarks.len()).sum();
        let tagged = order.into_iter().flat_map(|index| {
            let reference = &self.references[index];
            let found = reference.find(view, lens, &guess.since(&reference.turn));
            found.into_iter().map(move |(patch, sighting)| ((index, patch), sighting))
        });
        let mut measured = Measured::of(lens, sought, tagged)?;
        let Measured { turn, sightings, weights, .. } = &measured;
        measured.covariance += lens_covariance(lens, turn, sightings, weights);
        Some(measured)
    }
}
