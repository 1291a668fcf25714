//! Station of a camera: measures pictures and learns from them. Pictures in, inputs of the fold
//! out.

use std::{collections::BTreeMap, sync::OnceLock};

use image::GrayImage;

use crate::{
    compare::agreeing,
    gallery::{Gallery, Glance, SIZE},
    glass::Glass,
    input::{Answer, Input, LearnedSample, Picture, line_turn},
    no_answer::NoAnswer,
    overlay::Mask,
    seasons::Seasons,
    slot::lived_secs,
    state::{Decision, State},
    watch::{SETTLED_SECS, Watch},
};
use boresight_scene::{Lens, Measured, Reference, View};

/// Maximum number of learning pictures kept. When exceeded, every second one is dropped, and from
/// then on only every second one is taken, so they stay evenly spread.
const POOL: usize = 160;
/// Number of pictures for first learning references; learning repeats whenever the number has
/// doubled.
const FIRST_POOL: usize = 6;
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
    /// What isn't the scene.
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
    seasons: Seasons,
    /// Newest picture during learning.
    newest: Option<Newest>,
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
            seasons: Seasons::new(),
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
        mut picture: Picture,
        decision: &Decision,
        shelf: &mut dyn Shelf,
    ) -> Looked {
        let at_secs = picture.at;
        let has_left_out = match &mut picture.none {
            Some(NoAnswer::TwoMotions { left_out_percent, .. }) if self.is_learned => {
                *left_out_percent = self.leave_out_own(view, decision);
                left_out_percent.is_some()
            }
            _ => false,
        };
        let mut looked =
            Looked { inputs: vec![Input::Picture(Box::new(picture))], references_changed: false };
        if measured.as_ref().err() == Some(&NoAnswer::OtherSize) {
            return looked;
        }
        if self.is_learned {
            looked.references_changed = match measured {
                Ok(measured) => self.seasons.follow(
                    &mut self.gallery,
                    (&self.lens, &self.mask),
                    (view, measured),
                    at_secs,
                    decision.state == State::Ok,
                ),
                Err(_) => has_left_out,
            };
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
        Reference::of(&View::of(grey), taken_secs, &self.lens, |x, y| self.mask.covers(x, y))
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

    /// Leaves out the cells that stay while the scene moves, after "can't tell" for two motions.
    /// The references then show the scene only. Returns the left-out share of the picture in per
    /// cent; `None` if nothing changed.
    fn leave_out_own(&mut self, view: &View, decision: &Decision) -> Option<u32> {
        let State::CannotTell { reason: NoAnswer::TwoMotions { .. }, .. } = decision.state else {
            return None;
        };
        let measured = self.gallery.fit_nearest(view, &self.lens)?;
        let size = self.lens.image_size;
        if !self.mask.add_own(&measured.sightings, size) {
            return None;
        }
        for reference in &mut self.gallery.references {
            let is_scene = |px: [i64; 2]| !self.mask.covers(px[0] as u32, px[1] as u32);
            reference.landmarks.retain(|landmark| is_scene(landmark.px));
        }
        self.seasons.restart(&self.gallery);
        Some((100.0 * self.mask.share(size.width_px, size.height_px)).round() as u32)
    }
}
