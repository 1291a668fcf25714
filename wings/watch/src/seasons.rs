//! References that follow the seasons: adopted day by day, judged, and retired.

use std::collections::BTreeSet;

use image::GrayImage;

use crate::{
    gallery::{Gallery, SIZE, Track},
    overlay::Mask,
    slot::DAY_SECS,
};
use boresight_scene::{Lens, Measured, Reference, Turn, View, cell_of};

/// Maximum number of references adopted per day, and maximum number of references kept.
const ADOPTED_A_DAY: usize = 4;
const MOST: usize = SIZE + 2 * ADOPTED_A_DAY;
/// Number of first references kept as anchors: without them, the errors of new references would add
/// up.
const ANCHORS: usize = 10;
/// Number of comparisons before judging an adopted reference's patches.
const JUDGED: usize = 12;

/// Use of the references, and candidates for new ones.
#[derive(Clone, Debug)]
pub(crate) struct Seasons {
    /// Adopted references not yet judged, by index.
    tracks: Vec<(usize, Track)>,
    uses: Vec<f64>,
    candidates: Vec<Candidate>,
    day: Option<i64>,
    was_ok_all_day: bool,
}

/// Picture that may be adopted at the end of the day.
#[derive(Clone, Debug)]
struct Candidate {
    /// Likeness to the nearest reference.
    likeness: f64,
    at_secs: f64,
    turn: Turn,
    grey: GrayImage,
    /// Cells with an agreeing patch.
    agreeing: BTreeSet<[usize; 2]>,
}

impl Seasons {
    pub(crate) fn new() -> Self {
        let (tracks, uses, candidates) = (Vec::new(), Vec::new(), Vec::new());
        Self { tracks, uses, candidates, day: None, was_ok_all_day: true }
    }

    /// Follows an answered picture, taken at `at_secs` in a state that is OK or not; true if the
    /// references changed.
    pub(crate) fn follow(
        &mut self,
        gallery: &mut Gallery,
        (lens, mask): (&Lens, &Mask),
        (view, measured): (&View, &Measured),
        at_secs: f64,
        is_ok: bool,
    ) -> bool {
        self.was_ok_all_day &= is_ok;
        self.uses.resize(gallery.references.len(), 0.0);
        for (reference, _) in &measured.tags {
            self.uses[*reference] += 1.0;
        }
        let mut changed = self.judge(gallery, lens, measured);
        if is_ok && measured.turned_back.is_none() {
            self.consider(gallery, lens, (view, measured), at_secs);
        }
        let day = (at_secs / DAY_SECS).floor() as i64;
        if self.day.replace(day).is_some_and(|before| before != day) {
            if self.was_ok_all_day && !self.candidates.is_empty() {
                self.adopt(gallery, lens, mask);
                changed = true;
            }
            self.candidates.clear();
            self.was_ok_all_day = is_ok;
            for uses in &mut self.uses {
                // A week's memory.
                *uses *= 0.87;
            }
        }
        changed
    }

    /// Restarts the records of patches, after some of the patches were removed.
    pub(crate) fn restart(&mut self, gallery: &Gallery) {
        for (index, track) in &mut self.tracks {
            *track = Track::of(&gallery.references[*index]);
        }
    }

    /// Keeps the day's pictures that are least like a reference.
    fn consider(
        &mut self,
        gallery: &Gallery,
        lens: &Lens,
        (view, measured): (&View, &Measured),
        at_secs: f64,
    ) {
        let alike = gallery.references.iter().map(|r| r.thumb.likeness(&view.thumb));
        let likeness = alike.fold(-1.0, f64::max);
        let is_candidate = self.candidates.len() < ADOPTED_A_DAY
            || self.candidates.iter().any(|other| other.likeness > likeness);
        if !is_candidate {
            return;
        }
        let agreeing = measured.agreeing_cells(lens.image_size);
        let (turn, grey) = (measured.turn, view.grey.clone());
        self.candidates.push(Candidate { likeness, at_secs, turn, grey, agreeing });
        self.candidates.sort_by(|a, b| a.likeness.total_cmp(&b.likeness));
        self.candidates.truncate(ADOPTED_A_DAY);
    }

    /// Adopts the day's candidates, each with its patches in or beside a cell in which a known
    /// patch agreed: what covers part of the glass isn't the scene.
    fn adopt(&mut self, gallery: &mut Gallery, lens: &Lens, mask: &Mask) {
        for candidate in std::mem::take(&mut self.candidates) {
            let Candidate { at_secs, turn, grey, agreeing, .. } = candidate;
            let mut reference = Reference {
                turn,
                ..Reference::of(&View::of(grey), at_secs, lens, |x, y| mask.covers(x, y))
            };
            reference.landmarks.retain(|landmark| {
                let [i, j] = cell_of(&landmark.point_px(), lens.image_size);
                agreeing.iter().any(|[k, l]| i.abs_diff(*k) <= 1 && j.abs_diff(*l) <= 1)
            });
            self.tracks.push((gallery.references.len(), Track::of(&reference)));
            gallery.references.push(reference);
        }
        self.uses.resize(gallery.references.len(), f64::INFINITY);
        while gallery.references.len() > MOST {
            let anchors = gallery.references.iter().filter(|r| r.is_first).count();
            let may_go = |i: &usize| !gallery.references[*i].is_first || anchors > ANCHORS;
            let least = (0..gallery.references.len())
                .filter(may_go)
                .min_by(|a, b| self.uses[*a].total_cmp(&self.uses[*b]));
            let Some(least) = least else { break };
            gallery.references.remove(least);
            self.uses.remove(least);
            self.tracks.retain(|(index, _)| *index != least);
            for (index, _) in &mut self.tracks {
                *index -= usize::from(*index > least);
            }
        }
        for uses in &mut self.uses {
            *uses = uses.min(1e6);
        }
    }

    /// Records the found patches of adopted references; judges the patches after a while.
    fn judge(&mut self, gallery: &mut Gallery, lens: &Lens, measured: &Measured) -> bool {
        let mut judged = false;
        self.tracks.retain_mut(|(index, track)| {
            track.note(*index, measured, lens);
            let is_known = track.tries() >= JUDGED;
            if is_known {
                track.weigh(&mut gallery.references[*index]);
                judged = true;
            }
            !is_known
        });
        judged
    }
}
