//! Station of a camera: measures pictures and learns from them. Pictures in, inputs of the fold
//! out.

use std::{collections::BTreeMap, sync::OnceLock};

use image::GrayImage;

use crate::{
    compare::agreeing,
    gallery::{Gallery, Glance, SIZE, Track},
    glass::Glass,
    input::{Answer, Input, LearnedSample, Picture, line_turn},
    level::View,
    measure::{Measured, NoAnswer},
    overlay::Mask,
    reference::Reference,
    slot::{DAY_SECS, lived_secs},
    state::{Decision, State},
    turn::{Lens, Turn},
    watch::{SETTLED_SECS, Watch},
};

/// Maximum number of learning pictures kept. When exceeded, every second one is dropped, and from
/// then on only every second one is taken, so they stay evenly spread.
const POOL: usize = 160;
/// Number of pictures for first learning references; learning repeats whenever the number has
/// doubled.
const FIRST_POOL: usize = 6;
/// Maximum number of references adopted per day, and maximum number of references kept.
const ADOPTED_A_DAY: usize = 4;
const MOST: usize = SIZE + 2 * ADOPTED_A_DAY;
/// Minimum share of the patches that usually agree, for an adopted reference: what covers half of
/// the glass isn't the scene.
const ADOPTED_SEEN: f64 = 0.7;
/// Number of first references kept as anchors: without them, the errors of new references would add
/// up.
const ANCHORS: usize = 10;
/// Number of comparisons before judging an adopted reference's patches.
const JUDGED: usize = 12;
/// Minimum move for asking the cause, px at the picture's middle.
const ASKED_PX: f64 = 1.0;

/// Store of learning pictures.
pub trait Shelf {
    /// Keeps a picture, taken at `at_secs`, under a number.
    fn put(&mut self, number: u64, at_secs: f64, grey: &GrayImage);
    /// Kept picture; `None` if lost.
    fn take(&mut self, number: u64) -> Option<GrayImage>;
    /// Forgets a picture.
    fn drop(&mut self, number: u64);
}

/// Store in memory.
impl Shelf for BTreeMap<u64, GrayImage> {
    fn put(&mut self, number: u64, _at_secs: f64, grey: &GrayImage) {
        self.insert(number, grey.clone());
    }

    fn take(&mut self, number: u64) -> Option<GrayImage> {
        self.get(&number).cloned()
    }

    fn drop(&mut self, number: u64) {
        self.remove(&number);
    }
}

/// Outcome of a picture.
#[derive(Clone, Debug)]
pub struct Looked {
    /// Inputs to record and to hand to [`Watch`], in order.
    pub inputs: Vec<Input>,
    /// True if references were learned, adopted or retired, and need storing.
    pub references_changed: bool,
}

/// Camera with references.
#[derive(Clone, Debug)]
pub struct Station {
    /// The lens.
    pub lens: Lens,
    /// The references.
    pub gallery: Gallery,
    /// Text and logos.
    pub mask: Mask,
    /// Learning pictures by number on the shelf.
    pool: Vec<(u64, Glance)>,
    stride: u64,
    seen: u64,
    next_learning: usize,
    /// True once the three days are over.
    pub is_learned: bool,
    /// True if the first references are a pin, to which all others are tied.
    pub is_pinned: bool,
    tracks: Vec<(usize, Track)>,
    uses: Vec<f64>,
    candidates: Vec<Candidate>,
    day: Option<i64>,
    was_ok_all_day: bool,
    /// Newest picture during learning.
    newest: Option<Newest>,
}

/// Picture that may be adopted at the end of the day.
#[derive(Clone, Debug)]
struct Candidate {
    /// Likeness to the nearest reference.
    likeness: f64,
    at_secs: f64,
    turn: Turn,
    grey: GrayImage,
}

/// Newest picture, and its patches once they are asked for.
#[derive(Clone, Debug)]
struct Newest(GrayImage, OnceLock<Reference>);

impl Station {
    /// Camera without references.
    pub fn new(lens: Lens) -> Self {
        Self {
            lens,
            gallery: Gallery::default(),
            mask: Mask::default(),
            pool: Vec::new(),
            stride: 1,
            seen: 0,
            next_learning: FIRST_POOL,
            is_learned: false,
            is_pinned: false,
            tracks: Vec::new(),
            uses: Vec::new(),
            candidates: Vec::new(),
            day: None,
            was_ok_all_day: true,
            newest: None,
        }
    }

    /// Camera as stored: references, and, while still learning, the numbers and times of the
    /// learning pictures on the shelf, in order.
    pub fn resumed(
        lens: Lens,
        (gallery, mask): (Gallery, Mask),
        is_learned: bool,
        kept: &[(u64, f64)],
        shelf: &mut dyn Shelf,
    ) -> Self {
        let mut pool = Vec::new();
        for (number, at_secs) in kept {
            if let Some(grey) = shelf.take(*number) {
                pool.push((*number, Glance::of(&View::of(grey), *at_secs)));
            }
        }
        // Numbers are multiples of the stride; a single one isn't conclusive.
        let is_multiple =
            |stride: u64| pool.iter().all(|(number, _)| number.is_multiple_of(stride));
        let stride = if pool.len() < 2 {
            1
        } else {
            (0..16).map(|n| 1 << n).filter(|s| is_multiple(*s)).max().unwrap_or(1)
        };
        let mut next_learning = FIRST_POOL;
        while !gallery.references.is_empty() && next_learning <= pool.len() {
            next_learning *= 2;
        }
        Self {
            seen: kept.last().map_or(0, |(number, _)| number + 1),
            next_learning: if stride > 1 { usize::MAX } else { next_learning },
            pool,
            stride,
            is_learned,
            gallery,
            mask,
            ..Self::new(lens)
        }
    }

    /// Forgets all references, as after accepting the camera.
    pub fn forget(&mut self, shelf: &mut dyn Shelf) {
        for (number, _) in &self.pool {
            shelf.drop(*number);
        }
        let (seen, is_pinned) = (self.seen, self.is_pinned);
        *self = Self { seen, is_pinned, ..Self::new(self.lens.clone()) };
    }

    /// Measures a picture, with the far search if needed.
    ///
    /// # Errors
    ///
    /// Reason for having no answer.
    pub fn measure(&self, view: &View) -> Result<Measured, NoAnswer> {
        match self.gallery.measure(view, &self.lens) {
            Err(NoAnswer::NoReferences) => Err(NoAnswer::NoReferences),
            Err(NoAnswer::OtherSize) => Err(NoAnswer::OtherSize),
            Err(NoAnswer::TooDark) => Err(NoAnswer::TooDark),
            Err(reason @ NoAnswer::TwoMotions { .. }) => Err(reason),
            Err(reason) if self.is_learned || self.is_pinned => {
                self.gallery.measure_far(view, &self.lens).map_err(|_| reason)
            }
            answer => answer,
        }
    }

    /// Number of patches of a picture in agreement with this camera's references, or with its
    /// newest picture during learning, if credible. A camera that points elsewhere isn't searched
    /// for.
    pub fn agreeing(&self, view: &View) -> Option<usize> {
        let by_newest = self.newest.as_ref().and_then(|Newest(grey, patches)| {
            let of = || self.reference(grey.clone(), 0.0);
            agreeing(patches.get_or_init(of), view, &self.lens)
        });
        by_newest.max(self.gallery.measure(view, &self.lens).ok().map(|measured| measured.inliers))
    }

    /// Record of a measured picture.
    pub fn answer(&self, view: &View, measured: &Measured) -> Answer {
        let glass = Glass::of(measured, &self.gallery, view);
        let px = measured.turn.in_px(&self.lens);
        let has_moved = libm::hypot(px[0], px[1]) > ASKED_PX && measured.turned_back.is_none();
        let causes = has_moved.then(|| measured.causes(&self.lens)).flatten();
        Answer::of(measured, glass.as_ref(), causes)
    }

    /// Measures a picture, and learns from it. `watch` is the state before the picture.
    pub fn look(
        &mut self,
        grey: GrayImage,
        at_secs: f64,
        watch: &Watch,
        shelf: &mut dyn Shelf,
    ) -> Looked {
        let view = View::of(grey);
        let measured = self.measure(&view);
        let answer = measured.as_ref().map(|m| self.answer(&view, m)).map_err(|reason| *reason);
        let picture = Picture {
            at: at_secs,
            late: false,
            none: answer.as_ref().err().copied(),
            answer: answer.ok(),
        };
        self.learn_and_adopt(&view, &measured, picture, watch.decision(), shelf)
    }

    /// Records `picture` and updates the references.
    pub fn learn_and_adopt(
        &mut self,
        view: &View,
        measured: &Result<Measured, NoAnswer>,
        picture: Picture,
        decision: &Decision,
        shelf: &mut dyn Shelf,
    ) -> Looked {
        let at_secs = picture.at;
        let mut looked =
            Looked { inputs: vec![Input::Picture(Box::new(picture))], references_changed: false };
        if measured.as_ref().err() == Some(&NoAnswer::OtherSize) {
            return looked;
        }
        if self.is_learned {
            if let Ok(measured) = measured {
                looked.references_changed = self.follow(view, measured, at_secs, decision);
            }
            return looked;
        }
        let has_moved = matches!(decision.state, State::Moved(_) | State::Zoom | State::Blurred);
        if measured.as_ref().err() != Some(&NoAnswer::TooDark) && !has_moved {
            self.shelve(view, at_secs, shelf);
        }
        let taken = self.pool.iter().map(|(_, glance)| glance.taken_secs);
        let is_long = lived_secs(taken.chain([at_secs])) >= SETTLED_SECS;
        let is_over = is_long && self.pool.len() >= FIRST_POOL && !has_moved;
        if is_over || self.pool.len() >= self.next_learning {
            self.next_learning = 2 * self.next_learning.clamp(FIRST_POOL, usize::MAX / 2);
            let samples = self.learn(shelf);
            let references = self.gallery.references.len() as u32;
            let pinned = self.is_pinned;
            looked.inputs.push(Input::Learned { at: at_secs, references, samples, pinned });
            looked.references_changed = true;
        }
        if is_over {
            self.is_learned = true;
            self.newest = None;
            for (number, _) in std::mem::take(&mut self.pool) {
                shelf.drop(number);
            }
        }
        looked
    }

    fn reference(&self, grey: GrayImage, taken_secs: f64) -> Reference {
        Reference::of(&View::of(grey), taken_secs, &self.lens, &self.mask)
    }

    fn shelve(&mut self, view: &View, at_secs: f64, shelf: &mut dyn Shelf) {
        self.newest = Some(Newest(view.grey.clone(), OnceLock::new()));
        let number = self.seen;
        self.seen += 1;
        if !number.is_multiple_of(self.stride) {
            return;
        }
        shelf.put(number, at_secs, &view.grey);
        self.pool.push((number, Glance::of(view, at_secs)));
        if self.pool.len() > POOL {
            self.stride *= 2;
            let stride = self.stride;
            self.pool.retain(|(number, _)| {
                let stays = number.is_multiple_of(stride);
                if !stays {
                    shelf.drop(*number);
                }
                stays
            });
            self.next_learning = usize::MAX;
        }
    }

    /// Learns references from the pool; returns the estimates of the pool's pictures by them.
    fn learn(&mut self, shelf: &mut dyn Shelf) -> Vec<LearnedSample> {
        let glances: Vec<Glance> = self.pool.iter().map(|(_, glance)| glance.clone()).collect();
        let numbers: Vec<u64> = self.pool.iter().map(|(number, _)| *number).collect();
        let mut light: Vec<(u64, u64)> = Vec::new();
        for number in &numbers {
            let sum = |grey: GrayImage| grey.as_raw().iter().map(|v| u64::from(*v)).sum();
            light.extend(shelf.take(*number).map(|grey| (sum(grey), *number)));
        }
        light.sort_unstable();
        let step = light.len().div_ceil(SIZE).max(1);
        let pictures: Vec<GrayImage> =
            light.iter().step_by(step).filter_map(|(_, number)| shelf.take(*number)).collect();
        self.mask = Mask::of(&pictures);
        drop(pictures);
        let size = SIZE.min(numbers.len());
        let load = |i: usize| shelf.take(numbers[i]).map(View::of);
        let learn = if self.is_pinned { Gallery::learn_tied } else { Gallery::learn };
        self.gallery = learn(&self.lens, &glances, size, &self.mask, load);
        let mut samples = Vec::new();
        for (number, glance) in &self.pool {
            let Some(view) = shelf.take(*number).map(View::of) else { continue };
            if let Ok(measured) = self.gallery.measure(&view, &self.lens) {
                samples
                    .push(LearnedSample { at: glance.taken_secs, turn: line_turn(&measured.turn) });
            }
        }
        samples
    }

    /// Lets the references follow the seasons; true if they changed.
    fn follow(
        &mut self,
        view: &View,
        measured: &Measured,
        at_secs: f64,
        decision: &Decision,
    ) -> bool {
        let is_ok = decision.state == State::Ok;
        self.was_ok_all_day &= is_ok;
        self.uses.resize(self.gallery.references.len(), 0.0);
        for (reference, _) in &measured.tags {
            self.uses[*reference] += 1.0;
        }
        let mut changed = self.judge(measured);
        let likeness = self
            .gallery
            .references
            .iter()
            .map(|r| r.thumb.likeness(&view.thumb))
            .fold(-1.0, f64::max);
        let seen = measured.inliers as f64 / measured.sought.max(1) as f64;
        let is_usual = decision.usual_seen.is_some_and(|usual| seen >= ADOPTED_SEEN * usual);
        if is_ok && is_usual && measured.turned_back.is_none() {
            let is_candidate = self.candidates.len() < ADOPTED_A_DAY
                || self.candidates.iter().any(|other| other.likeness > likeness);
            if is_candidate {
                let (turn, grey) = (measured.turn, view.grey.clone());
                self.candidates.push(Candidate { likeness, at_secs, turn, grey });
                self.candidates.sort_by(|a, b| a.likeness.total_cmp(&b.likeness));
                self.candidates.truncate(ADOPTED_A_DAY);
            }
        }
        let day = (at_secs / DAY_SECS).floor() as i64;
        if self.day.replace(day).is_some_and(|before| before != day) {
            if self.was_ok_all_day && !self.candidates.is_empty() {
                self.adopt();
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

    fn adopt(&mut self) {
        for Candidate { at_secs, turn, grey, .. } in std::mem::take(&mut self.candidates) {
            let reference = Reference { turn, ..self.reference(grey, at_secs) };
            self.tracks.push((self.gallery.references.len(), Track::of(&reference)));
            self.gallery.references.push(reference);
        }
        self.uses.resize(self.gallery.references.len(), f64::INFINITY);
        while self.gallery.references.len() > MOST {
            let anchors = self.gallery.references.iter().filter(|r| r.is_first).count();
            let may_go = |i: &usize| !self.gallery.references[*i].is_first || anchors > ANCHORS;
            let least = (0..self.gallery.references.len())
                .filter(may_go)
                .min_by(|a, b| self.uses[*a].total_cmp(&self.uses[*b]));
            let Some(least) = least else { break };
            self.gallery.references.remove(least);
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
    fn judge(&mut self, measured: &Measured) -> bool {
        let mut judged = false;
        let gallery = &mut self.gallery;
        self.tracks.retain_mut(|(index, track)| {
            track.note(*index, measured, &self.lens);
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
