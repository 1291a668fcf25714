//! References of a camera: selection, weights, and turns relative to each other.

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

use crate::{overlay::Mask, slot::SEVERAL};
use boresight_scene::{
    Lens, Measured, Reference, SIGMA_OF_MEDIAN, Thumb, Turn, UNKNOWN_SIGMA_PX, View, credible,
    median, offsets_px,
};

/// Number of references compared with a picture.
pub(crate) const NEAREST: usize = 3;
/// Number of references learned at first.
pub const SIZE: usize = 24;
/// Minimum share of pictures similar to the reference in which a patch must be found.
const LEAST_FOUND: f64 = 0.35;
/// Bounds on the standard deviations of patches, px: none is better, and a worse patch is on
/// something that moves.
const BEST_SIGMA_PX: f64 = 0.1;
const WORST_SIGMA_PX: f64 = 1.5;

/// References, unordered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gallery {
    /// References, each with a turn in the common frame.
    pub references: Vec<Reference>,
}

/// Summary of a learning picture, which saves loading the picture again.
#[derive(Clone, Debug)]
pub struct Glance {
    /// Capture time, seconds since 1970.
    pub taken_secs: f64,
    /// Thumbnail.
    pub thumb: Thumb,
    /// Amount of detail: [`View::texture`].
    pub texture: f64,
}

impl Glance {
    /// Summary of a picture.
    pub fn of(view: &View, taken_secs: f64) -> Self {
        Self { taken_secs, thumb: view.thumb.clone(), texture: view.texture() }
    }
}

/// Chooses the most representative pictures: each raises the summed likeness of all to their
/// nearest one most, and sharper ones count more.
pub fn choose(glances: &[Glance], size: usize) -> Vec<usize> {
    let sharpest = glances.iter().map(|g| g.texture).fold(1e-9, f64::max);
    let likeness: Vec<Vec<f64>> = glances
        .iter()
        .map(|a| glances.iter().map(|b| a.thumb.likeness(&b.thumb)).collect())
        .collect();
    let mut best = vec![-1.0_f64; glances.len()];
    let mut chosen: Vec<usize> = Vec::new();
    for _ in 0..size.min(glances.len()) {
        let gain = |k: usize| {
            let raised: f64 = likeness[k].iter().zip(&best).map(|(l, b)| (l - b).max(0.0)).sum();
            raised * (0.5 + glances[k].texture / sharpest)
        };
        let open = (0..glances.len()).filter(|k| !chosen.contains(k));
        let Some(next) =
            open.map(|k| (k, gain(k))).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
        else {
            break;
        };
        chosen.push(next.0);
        for (best, like) in best.iter_mut().zip(&likeness[next.0]) {
            *best = best.max(*like);
        }
    }
    chosen
}

/// Pair of reference and picture: the picture's turn since the reference.
struct Tie {
    reference: usize,
    picture: usize,
    turn: Turn,
    covariance: Matrix4<f64>,
}

impl Gallery {
    /// Learns `size` references from pictures of a camera that stays. `load` prepares the picture
    /// of an index; it's called several times, for one picture at a time, so the pictures needn't
    /// fit into memory. Pictures that can no longer be loaded are left out.
    pub fn learn(
        lens: &Lens,
        glances: &[Glance],
        size: usize,
        mask: &Mask,
        load: impl FnMut(usize) -> Option<View>,
    ) -> Self {
        /// Minimum number of agreeing patches of a camera that stays.
        const FEWEST_TYING: usize = 15;
        Self::with_ties(lens, glances, size, mask, load, |tie| tie.inliers >= FEWEST_TYING).0
    }

    /// Learns as [`Self::learn`], but keeps only references tied to the first picture: of others,
    /// nobody knows whether the camera stood as it had. A tie is then as credible as an answer.
    pub fn learn_tied(
        lens: &Lens,
        glances: &[Glance],
        size: usize,
        mask: &Mask,
        load: impl FnMut(usize) -> Option<View>,
    ) -> Self {
        let is_sure = |tie: &Measured| {
            credible(Some(tie.clone()), tie.sought).is_ok() && tie.second_motion(lens).is_none()
        };
        let (mut gallery, ties) = Self::with_ties(lens, glances, size, mask, load, is_sure);
        let mut tied: Vec<bool> = (0..glances.len()).map(|picture| picture == 0).collect();
        let mut is_tied = vec![false; gallery.references.len()];
        let mut pairs: Vec<_> = ties.iter().map(|tie| (tie.reference, tie.picture)).collect();
        for (k, reference) in gallery.references.iter().enumerate() {
            let own = glances.iter().position(|g| g.taken_secs == reference.taken_secs);
            pairs.extend(own.map(|picture| (k, picture)));
        }
        while let Some((k, picture)) = pairs.iter().find(|(k, p)| is_tied[*k] != tied[*p]) {
            (is_tied[*k], tied[*picture]) = (true, true);
        }
        let mut is_tied = is_tied.into_iter();
        gallery.references.retain(|_| is_tied.next().unwrap_or_default());
        gallery
    }

    fn with_ties(
        lens: &Lens,
        glances: &[Glance],
        size: usize,
        mask: &Mask,
        mut load: impl FnMut(usize) -> Option<View>,
        is_sure: impl Fn(&Measured) -> bool,
    ) -> (Self, Vec<Tie>) {
        let chosen: Vec<(usize, Reference)> = choose(glances, size)
            .into_iter()
            .filter_map(|k| {
                let glance = &glances[k];
                let is_masked = |x, y| mask.covers(x, y);
                Some((k, Reference::of(&load(k)?, glance.taken_secs, lens, is_masked)))
            })
            .collect();
        let (indices, references): (Vec<usize>, Vec<Reference>) = chosen.into_iter().unzip();
        let mut gallery = Self { references };
        for reference in &mut gallery.references {
            reference.is_first = true;
        }
        let mut tracks: Vec<Track> = gallery.references.iter().map(Track::of).collect();
        let mut ties = Vec::new();
        for (picture, glance) in glances.iter().enumerate() {
            let Some(view) = load(picture) else { continue };
            let mut order: Vec<(usize, f64)> = gallery
                .references
                .iter()
                .map(|r| r.thumb.likeness(&glance.thumb))
                .enumerate()
                .collect();
            order.sort_by(|a, b| b.1.total_cmp(&a.1));
            for (k, _) in
                order.into_iter().take(NEAREST + 1).filter(|(k, _)| indices[*k] != picture)
            {
                let measured = tracks[k].compare(&gallery.references[k], &view, lens);
                let sure = measured.filter(&is_sure);
                ties.extend(sure.map(|Measured { turn, covariance, .. }| Tie {
                    reference: k,
                    picture,
                    turn,
                    covariance,
                }));
            }
        }
        for (reference, track) in gallery.references.iter_mut().zip(&mut tracks) {
            track.weigh(reference);
        }
        gallery.set_offsets(&ties, glances.len());
        gallery.set_modes();
        (gallery, ties)
    }

    /// Least squares of the turns of references and pictures from the turns between them, one
    /// parameter at a time, robust. The references' mean is the frame.
    fn set_offsets(&mut self, ties: &[Tie], pictures: usize) {
        let (g, n) = (self.references.len(), self.references.len() + pictures);
        let mut turns = vec![Vector4::zeros(); g];
        for p in 0..4 {
            let mut x: Option<DVector<f64>> = None;
            for _ in 0..4 {
                let mut a = DMatrix::zeros(n, n);
                let mut b = DVector::zeros(n);
                for tie in ties {
                    let (k, m, t) = (tie.reference, g + tie.picture, tie.turn.vector()[p]);
                    let weight = 1.0 / tie.covariance[(p, p)].max(1e-12);
                    let off = x.as_ref().map_or(0.0, |x| t - (x[m] - x[k]));
                    let weight = weight / (1.0 + off * off * weight / 25.0);
                    a[(k, k)] += weight;
                    a[(m, m)] += weight;
                    a[(k, m)] -= weight;
                    a[(m, k)] -= weight;
                    b[k] -= weight * t;
                    b[m] += weight * t;
                }
                let largest: f64 = a.diagonal().amax();
                for i in 0..n {
                    a[(i, i)] += 1e-9 * largest;
                }
                a.view_mut((0, 0), (g, g)).add_scalar_mut(1e-3 * largest);
                x = a.cholesky().map(|c| c.solve(&b));
            }
            for (turn, value) in turns.iter_mut().zip(x.iter().flat_map(|x| x.iter())) {
                turn[p] = *value;
            }
        }
        for (reference, turn) in self.references.iter_mut().zip(turns) {
            reference.turn = Turn::from_vector(&turn);
        }
    }

    /// A camera that switches to infrared at night changes its focus a little each time: its
    /// references fall into two groups by focal length, and each group has its own zero. There are
    /// two groups if the gap between them is larger than within either, and if the camera went
    /// there and came back: a camera touched during learning doesn't return.
    fn set_modes(&mut self) {
        let mut by_focal: Vec<usize> = (0..self.references.len()).collect();
        let focal = |i: usize| self.references[i].turn.log_focal;
        by_focal.sort_by(|a, b| focal(*a).total_cmp(&focal(*b)));
        let gap = |k: usize| focal(by_focal[k]) - focal(by_focal[k - 1]);
        let Some(split) = (1..by_focal.len()).max_by(|a, b| gap(*a).total_cmp(&gap(*b))) else {
            return;
        };
        let modes = by_focal.split_at(split);
        let range = |mode: &[usize]| focal(mode[mode.len() - 1]) - focal(mode[0]);
        let mut by_time: Vec<usize> = (0..self.references.len()).collect();
        by_time.sort_by(|a, b| {
            self.references[*a].taken_secs.total_cmp(&self.references[*b].taken_secs)
        });
        let switches =
            by_time.windows(2).filter(|w| modes.0.contains(&w[0]) != modes.0.contains(&w[1]));
        let is_apart = gap(split) > range(modes.0).max(range(modes.1));
        if !is_apart || modes.0.len().min(modes.1.len()) < SEVERAL || switches.count() < 2 {
            return;
        }
        for mode in [modes.0, modes.1] {
            let sum: f64 = mode.iter().map(|i| self.references[*i].turn.log_focal).sum();
            for i in mode {
                self.references[*i].turn.log_focal -= sum / mode.len() as f64;
            }
        }
    }
}

/// Statistics of a reference's patches in similar pictures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    tries: usize,
    /// Distances from the fit for each patch, px.
    off_px: Vec<Vec<f64>>,
}

impl Track {
    /// Empty track for the patches of `reference`.
    pub(crate) fn of(reference: &Reference) -> Self {
        Self { tries: 0, off_px: vec![Vec::new(); reference.landmarks.len()] }
    }

    fn compare(&mut self, reference: &Reference, view: &View, lens: &Lens) -> Option<Measured> {
        let found = reference.find(view, lens, &reference.locate(view, lens));
        let tagged = found.into_iter().map(|(patch, sighting)| ((0, patch), sighting));
        let measured = Measured::of(lens, reference.landmarks.len(), tagged);
        match &measured {
            Some(measured) => self.note(0, measured, lens),
            None => self.tries += 1,
        }
        measured
    }

    /// Number of comparisons so far.
    pub(crate) fn tries(&self) -> usize {
        self.tries
    }

    /// Records a picture compared with the reference `index`.
    pub(crate) fn note(&mut self, index: usize, measured: &Measured, lens: &Lens) {
        let mut was_found = false;
        let off = offsets_px(lens, &measured.turn, &measured.sightings);
        // In a picture turned back, sightings are where the camera had seen them before.
        if measured.turned_back.is_some() {
            return;
        }
        for ((reference, patch), off) in measured.tags.iter().zip(off) {
            if *reference == index {
                was_found = true;
                self.off_px[*patch].extend(off.map(|off| off.norm()));
            }
        }
        self.tries += usize::from(was_found);
    }

    /// Sets each patch's standard deviation, and removes patches found too rarely or with too much
    /// scatter: patches on people, clouds or shadows.
    pub(crate) fn weigh(&mut self, reference: &mut Reference) {
        let fewest = (LEAST_FOUND * self.tries as f64).max(2.0);
        let mut off_px = std::mem::take(&mut self.off_px).into_iter();
        reference.landmarks.retain_mut(|landmark| {
            let mut off_px = off_px.next().unwrap_or_default();
            let is_found = self.tries < SEVERAL || off_px.len() as f64 >= fewest;
            let sigma_px = median(&mut off_px).map_or(UNKNOWN_SIGMA_PX, |m| SIGMA_OF_MEDIAN * m);
            landmark.sigma_px = sigma_px.max(BEST_SIGMA_PX);
            is_found && sigma_px < WORST_SIGMA_PX
        });
    }
}

#[cfg(test)]
mod tests {
    use boresight_geometry::{Camera, frame::ImageSize};
    use image::GrayImage;

    use super::*;
    use crate::{Input, NoAnswer, Picture, State};

    /// References an hour apart with these focal lengths, per cent.
    fn with_focals(percent: &[f64]) -> Vec<f64> {
        let grey = GrayImage::new(64, 48);
        let size = ImageSize::of(&grey);
        let lens = Lens::new(Camera::pinhole(60.0, size.centre_px()), None, size);
        let view = View::of(grey);
        let of = |(hour, percent): (usize, &f64)| Reference {
            turn: Turn { log_focal: percent / 100.0, ..Turn::default() },
            ..Reference::of(&view, hour as f64 * 3600.0, &lens, |_, _| false)
        };
        let mut gallery = Gallery { references: percent.iter().enumerate().map(of).collect() };
        gallery.set_modes();
        gallery.references.iter().map(|r| (r.turn.log_focal * 1e6).round() / 1e4).collect()
    }

    #[test]
    fn a_camera_that_switches_to_infrared_and_back_has_two_zeros() {
        let switching = [0.01, -0.01, 0.31, 0.29, 0.30, 0.0];
        assert_eq!(with_focals(&switching), [0.01, -0.01, 0.01, -0.01, 0.0, 0.0]);
        // A camera whose zoom was touched during learning doesn't come back; a drifting camera has
        // no groups.
        for single in [[0.01, -0.01, 0.0, 0.31, 0.29, 0.30], [0.0, 0.3, 0.1, 0.4, 0.2, 0.5]] {
            assert_eq!(with_focals(&single), single);
        }
    }

    /// Blocks of random levels, in five bands that slide along each other.
    fn scene(slid_px: [u32; 5]) -> View {
        View::of(GrayImage::from_fn(480, 360, |x, y| {
            let x = x + slid_px[y as usize / 72];
            let block = (x / 11).wrapping_mul(0x9E37_79B1) ^ (y / 11).wrapping_mul(0x85EB_CA6B);
            image::Luma([(block.wrapping_mul(0xC2B2_AE35) >> 24) as u8])
        }))
    }

    fn pinned_by(slid_px: [[u32; 5]; 6]) -> (Lens, Gallery) {
        let size = ImageSize { width_px: 480, height_px: 360 };
        let lens = Lens::new(Camera::pinhole(400.0, size.centre_px()), None, size);
        let views = slid_px.map(scene);
        let glances: Vec<Glance> =
            views.iter().zip(0..).map(|(view, at)| Glance::of(view, f64::from(at))).collect();
        let load = |i: usize| views.get(i).cloned();
        let gallery = Gallery::learn_tied(&lens, &glances, SIZE, &Mask::default(), load);
        (lens, gallery)
    }

    #[test]
    fn a_pin_is_not_tied_to_pictures_whose_patches_disagree() {
        let (still, slid) = ([20; 5], [24, 18, 20, 16, 22]);
        let (_, pinned) = pinned_by([still, still, still, slid, slid, slid]);
        let taken: Vec<f64> = pinned.references.iter().map(|r| r.taken_secs).collect();
        assert!(!taken.is_empty() && taken.iter().all(|at| *at < 3.0), "{taken:?}");
    }

    #[test]
    fn no_search_answers_a_picture_of_two_motions() {
        let (lens, gallery) = pinned_by([[20; 5]; 6]);
        let mut station = crate::Station::new(lens);
        (station.gallery, station.is_learned) = (gallery, true);
        assert!(station.measure(&scene([24; 5])).is_ok());
        // Most patches stand where they did, as on the camera's own mount; the others are near, or
        // beyond the searches.
        let far = [[60, 60, 20, 20, 20], [90, 90, 20, 20, 20]];
        for slid_px in [[24, 20, 20, 20, 24], [20, 20, 24, 20, 20]].into_iter().chain(far) {
            let answer = station.measure(&scene(slid_px)).map(|measured| measured.turn);
            assert!(matches!(answer, Err(NoAnswer::TwoMotions { .. })), "{answer:?}");
        }
    }

    #[test]
    fn what_stays_while_the_scene_moves_is_left_out_of_the_next_answer() {
        let (lens, gallery) = pinned_by([[20; 5]; 6]);
        let mut station = crate::Station::new(lens.clone());
        (station.gallery, station.is_learned) = (gallery, true);
        let view = scene([24, 20, 20, 20, 24]);
        let measured = station.measure(&view);
        let none = measured.as_ref().err().copied();
        let mut decision = crate::Watch::new(&lens).decision().clone();
        for is_told in [false, true] {
            let picture = Picture { at: 9.0, late: false, answer: None, none };
            let shelf = &mut std::collections::BTreeMap::new();
            let looked = station.learn_and_adopt(&view, &measured, picture, &decision, shelf);
            assert_eq!(looked.references_changed, is_told);
            let Input::Picture(picture) = &looked.inputs[0] else { panic!("{looked:?}") };
            let Some(NoAnswer::TwoMotions { left_out_percent, .. }) = picture.none else {
                panic!("{picture:?}")
            };
            assert!(left_out_percent.map_or(!is_told, |it| (55..65).contains(&it)), "{picture:?}");
            decision.state = State::CannotTell { reason: none.expect("a reason"), before: None };
        }
        let moved_px = station.measure(&view).expect("an answer").turn.in_px(&lens);
        assert!((moved_px[0].abs() - 4.0).abs() < 0.2, "{moved_px}");
    }
}
