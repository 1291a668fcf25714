//! Simulated person who reads the guidance and moves the board, with a person's delay, error and
//! unsteady hands.
//!
//! | file | models |
//! |---|---|
//! | `params`, `people` | speed, precision and steadiness |
//! | `cue` | cues shown and told |
//! | `attention` | attention, and tiredness of the arms |
//! | `ghost` | the pose that matches the ghost |
//! | `reach` | movements to a pose |
//! | `sway` | involuntary movements |
//! | `habits`, `hand` | acts against the guidance |
//!
//! `time` adds seconds to a capture time.

mod attention;
mod cue;
mod ghost;
mod habits;
mod hand;
pub(crate) mod params;
mod people;
mod reach;
mod sway;
mod time;

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector2, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::UnitSphere;

use attention::{Attention, Stamina};
pub(super) use ghost::matching_pose;
use habits::{Act, Habits};
use hand::Covers;
use reach::{Reach, tipped};
use sway::Sway;
use time::after;

pub use cue::{Cue, CueKind, Instruction};
pub use hand::Hand;
pub use params::{Support, TechnicianParams};
pub use people::Person;

use super::{rng_stream::RngStream, scene::Scene};
use boresight_geometry::{
    Camera,
    frame::{CaptureTime, ImageSize},
};

/// Longest time for reading a sentence.
const LONGEST_READING_SECS: f64 = 2.0;
/// Factor on the waiting time before correcting the pose, after a request to hold still.
const PATIENCE_WHEN_HOLDING: f64 = 4.0;
/// Range of the actual correction, relative to the requested correction.
const RESPONSE: std::ops::Range<f64> = 0.7..1.2;
/// Range of ratios of distances in a correction.
const DISTANCE_RATIOS: (f64, f64) = (0.6, 1.7);
/// Largest shift in a correction, relative to the picture's width.
const LARGEST_SHIFT: f64 = 0.5;

/// Simulated person. See [`Self::pose_at`].
#[derive(Clone, Debug)]
pub struct Technician {
    params: TechnicianParams,
    camera: Camera,
    image_size: ImageSize,
    corners_in_board_m: Vec<Point2<f64>>,
    /// Downward distance at which the board is out of view: a part relative to its distance, and a
    /// part from its size.
    out_of_view: (f64, f64),
    /// Pose of the board before any guidance.
    start: Isometry3<f64>,
    rng: ChaCha8Rng,
    /// Random numbers for reaction times and hand paths.
    manner: ChaCha8Rng,
    attention: Attention,
    stamina: Stamina,
    sway: Sway,
    habits: Habits,
    covers: Covers,
    now: CaptureTime,
    /// Cues seen, each with the time of acting on the cue.
    pending: VecDeque<(CaptureTime, CueKind)>,
    sentence: Option<Sentence>,
    /// Number of the last target seen, acted on or not.
    target: Option<u64>,
    wanted: Option<Isometry3<f64>>,
    /// Size of the next attempt's error relative to the first error.
    error_scale: f64,
    /// Next act, unless something happens before.
    next: Option<(CaptureTime, Next)>,
    reach: Reach,
}

/// Sentence on the screen.
#[derive(Clone, Copy, Debug)]
struct Sentence {
    instruction: Instruction,
    /// Time of acting on the sentence; `None` afterwards.
    due: Option<CaptureTime>,
}

/// Act without a further cue.
#[derive(Clone, Copy, Debug)]
enum Next {
    /// Correct a pose after no view was taken.
    Correct,
    /// Raise the board after a rest.
    Resume,
}

impl Technician {
    /// Person holding the scene's board up, roughly frontal, somewhere near the middle.
    pub fn new(scene: &Scene) -> Self {
        let params = scene.technician;
        let mut rng = RngStream::Technician.rng(scene.seed);
        let board = &scene.board;
        let width_m = 2.0 * board.reach_m()[0];
        let (picture_width_px, picture_height_px) =
            (f64::from(scene.image_size.width_px), f64::from(scene.image_size.height_px));
        let start_px = (params.start_width * picture_width_px).max(1.0);
        let distance_m = scene.camera.f_px.x * width_m / start_px;
        let centre_px = scene.image_size.centre_px()
            + 0.05
                * picture_width_px
                * Vector2::new(rng.random_range(-1.0..1.0), rng.random_range(-0.5..0.5));
        let ray = (centre_px - scene.camera.pp_px).component_div(&scene.camera.f_px);
        let start = Isometry3::from_parts(
            Translation3::new(ray.x * distance_m, ray.y * distance_m, distance_m),
            UnitQuaternion::from_scaled_axis(
                0.1 * Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0_f64)),
            ),
        );
        let size_m = (board.columns() + board.rows() + 4) as f64 * board.square_m();
        Self {
            params,
            camera: scene.camera,
            image_size: scene.image_size,
            corners_in_board_m: board.corners_in_board_m(),
            out_of_view: (1.5 * picture_height_px / scene.camera.f_px.y, size_m),
            start,
            sway: Sway::new(&mut rng, &params),
            rng,
            manner: RngStream::Manner.rng(scene.seed),
            attention: Attention::new(RngStream::Attention.rng(scene.seed), &params),
            stamina: Stamina::new(&params),
            habits: Habits::new(RngStream::Habits.rng(scene.seed), scene),
            covers: Covers::new(RngStream::Covers.rng(scene.seed), board, params.covers_every_secs),
            now: CaptureTime { nanos: 0 },
            pending: VecDeque::new(),
            sentence: None,
            target: None,
            wanted: None,
            error_scale: 1.0,
            next: None,
            reach: Reach::rest(start, CaptureTime { nanos: 0 }, params.sink_m),
        }
    }

    /// Camera whose picture the person looks at.
    pub(super) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Inner corners of the board, in metres.
    pub(super) fn corners_in_board_m(&self) -> &[Point2<f64>] {
        &self.corners_in_board_m
    }

    /// Shows or tells the person a cue. Repetition changes nothing.
    pub fn read(&mut self, cue: Cue) {
        if self.habits.ignore(&cue.kind) {
            return;
        }
        let noticed = match &cue.kind {
            CueKind::Show { target, .. } => {
                if self.target == Some(*target) {
                    return;
                }
                self.target = Some(*target);
                self.attention.looks_at(cue.seen_at)
            }
            CueKind::Sentence { instruction, words } => {
                self.read_sentence(cue.seen_at, *instruction, *words);
                return;
            }
            // Heard cues.
            CueKind::Taken | CueKind::Finished => cue.seen_at,
        };
        let due = after(noticed, self.reaction_secs());
        let due = self.pending.back().map_or(due, |(last, _)| due.max(*last));
        self.pending.push_back((due, cue.kind));
    }

    fn read_sentence(&mut self, shown: CaptureTime, instruction: Instruction, words: usize) {
        if self.params.reading_secs_per_word <= 0.0 {
            return;
        }
        let known = self.sentence.filter(|sentence| {
            std::mem::discriminant(&sentence.instruction) == std::mem::discriminant(&instruction)
        });
        let unread = known.and_then(|sentence| sentence.due);
        let due = unread.unwrap_or_else(|| {
            let reading_secs = if known.is_some() {
                // Only the numbers have changed.
                0.0
            } else {
                (self.params.reading_secs_per_word * words as f64).min(LONGEST_READING_SECS)
            };
            let noticed =
                if self.params.hears_only { shown } else { self.attention.looks_at(shown) };
            after(noticed, self.reaction_secs() + reading_secs)
        });
        self.sentence = Some(Sentence { instruction, due: Some(due) });
    }

    fn reaction_secs(&mut self) -> f64 {
        let spread = self.manner.random_range(-1.0..1.0) * self.params.reaction_spread;
        self.params.reaction_secs * (1.0 + spread)
    }

    /// Pose of the board at `time`, which must not go back; an earlier time counts as the latest.
    pub fn pose_at(&mut self, time: CaptureTime) -> Isometry3<f64> {
        let time = time.max(self.now);
        loop {
            let cue = self.pending.front().map(|(due, _)| (*due).max(self.now));
            let sentence = self.sentence.and_then(|sentence| sentence.due);
            let next = self.next.map(|(due, _)| due);
            let habit = self.habits.due();
            // Away from the camera, nothing is seen or heard until the return.
            let [cue, sentence, next] =
                [cue, sentence, next].map(|due| due.filter(|_| !self.habits.is_away()));
            let earliest = [habit, cue, sentence, next].into_iter().flatten().min();
            let Some(due) = earliest.filter(|due| *due <= time) else { break };
            self.now = due.max(self.now);
            if habit == Some(due) {
                self.act_by_habit();
            } else if cue == Some(due) {
                if let Some((_, cue)) = self.pending.pop_front() {
                    self.act_on(&cue);
                }
            } else if sentence == Some(due) {
                self.act_on_sentence();
            } else if let Some((_, next)) = self.next.take() {
                match next {
                    Next::Correct if self.stamina.needs_rest(self.now, 2.0) => self.rest(),
                    Next::Correct => self.correct(),
                    Next::Resume => self.attempt(),
                }
            }
        }
        self.now = time;
        self.sway.applied(&self.reach.pose_at(time), time, self.stamina.gain_at(time))
    }

    /// Hand on the board at `time`, which must not go back.
    pub fn hand_at(&mut self, time: CaptureTime) -> Option<Hand> {
        self.covers.at(time)
    }

    fn act_by_habit(&mut self) {
        match self.habits.act(self.now) {
            Act::Leave(until) => {
                self.next = None;
                self.move_to(self.lowered());
                self.stamina.rest(self.now, until);
            }
            Act::Return if self.wanted.is_some() => {
                self.error_scale = 1.0;
                self.attempt();
            }
            Act::Return => self.move_to(self.start),
            Act::Show(pose) => self.move_to(pose),
        }
    }

    fn act_on(&mut self, cue: &CueKind) {
        match cue {
            CueKind::Show { ghost_px, .. } => {
                let wanted = matching_pose(
                    &self.camera,
                    self.image_size,
                    &self.corners_in_board_m,
                    ghost_px,
                );
                if let Some(wanted) = wanted {
                    self.wanted = Some(wanted);
                    self.error_scale = 1.0;
                    if self.now < self.stamina.rested() {
                        self.next = Some((self.stamina.rested(), Next::Resume));
                    } else {
                        self.attempt();
                    }
                }
            }
            CueKind::Taken => {
                (self.next, self.sentence) = (None, None);
                if self.stamina.needs_rest(self.now, 1.0) {
                    self.rest();
                }
            }
            CueKind::Finished => {
                self.habits.end();
                self.move_to(self.lowered());
                (self.wanted, self.next, self.sentence) = (None, None, None);
            }
            CueKind::Sentence { .. } => {}
        }
    }

    /// Follows the sentence, once the board has arrived.
    fn act_on_sentence(&mut self) {
        let Some(mut sentence) = self.sentence.take() else { return };
        let free = self.reach.arrival().max(self.stamina.rested());
        if self.now < free {
            let due = after(free, self.reaction_secs());
            self.sentence = Some(Sentence { due: Some(due), ..sentence });
            return;
        }
        sentence.due = None;
        self.sentence = Some(sentence);
        let (from, response) = (*self.reach.to(), self.manner.random_range(RESPONSE));
        let at = from.translation.vector;
        let moved = match sentence.instruction {
            Instruction::HoldStill => {
                let patience_secs = PATIENCE_WHEN_HOLDING * self.params.patience_secs;
                self.next = self.wanted.map(|_| (after(self.now, patience_secs), Next::Correct));
                return;
            }
            Instruction::MatchGhost => return self.correct(),
            Instruction::ShowBoard if self.wanted.is_some() => return self.correct(),
            Instruction::ShowBoard | Instruction::ShowWholeFirst => self.start,
            Instruction::Distance { ratio } => {
                let (least, largest) = DISTANCE_RATIOS;
                let ratio = if ratio > 0.0 { ratio.clamp(least, largest) } else { 1.0 };
                Isometry3::from_parts((at * libm::pow(ratio, response)).into(), from.rotation)
            }
            Instruction::Shift { right_px, down_px } => {
                let limit_px = LARGEST_SHIFT * f64::from(self.image_size.width_px);
                let shift_px = Vector2::new(right_px, down_px).cap_magnitude(limit_px);
                let shift_m = (response * at.z * shift_px).component_div(&self.camera.f_px);
                let moved = at + Vector3::new(shift_m.x, shift_m.y, 0.0);
                Isometry3::from_parts(moved.into(), from.rotation)
            }
            Instruction::Tip { azimuth_rad, tilt_rad } => {
                tipped(&from, azimuth_rad, tilt_rad, response)
            }
        };
        self.move_to(moved);
        self.next = self.wanted.map(|_| (self.patience_ends(), Next::Correct));
    }

    /// Tries again, with a smaller error.
    fn correct(&mut self) {
        self.error_scale *= self.params.correction;
        self.attempt();
    }

    /// Moves to the target pose, with the attempt's error.
    fn attempt(&mut self) {
        let Some(wanted) = self.wanted else {
            self.next = None;
            return;
        };
        let params = self.params;
        let size = |rng: &mut ChaCha8Rng| rng.random_range(0.3..1.0_f64);
        let axis = Vector3::from(self.rng.sample::<[f64; 3], _>(UnitSphere));
        let turn_rad = self.error_scale * params.rotation_error_rad * size(&mut self.rng);
        let direction_rad = self.rng.random_range(0.0..std::f64::consts::TAU);
        let lateral_px = self.error_scale * params.lateral_error_px * size(&mut self.rng);
        let farther =
            self.error_scale * params.distance_error * self.rng.random_range(-1.0..1.0_f64);
        let at = wanted.translation.vector;
        let lateral =
            Vector2::new(libm::cos(direction_rad), libm::sin(direction_rad)) * lateral_px * at.z;
        let lateral_m = lateral.component_div(&self.camera.f_px);
        let missed = Isometry3::from_parts(
            ((at + Vector3::new(lateral_m.x, lateral_m.y, 0.0)) * (1.0 + farther)).into(),
            UnitQuaternion::from_scaled_axis(axis * turn_rad) * wanted.rotation,
        );
        self.move_to(missed);
        self.next = Some((self.patience_ends(), Next::Correct));
    }

    /// Puts the board down for a while.
    fn rest(&mut self) {
        self.move_to(self.lowered());
        let end = self.stamina.rest(self.now, self.reach.arrival());
        self.next = self.wanted.map(|_| (end, Next::Resume));
    }

    /// Pose below the picture's lower edge.
    fn lowered(&self) -> Isometry3<f64> {
        let from = self.reach.pose_at(self.now);
        let (by_distance, by_size) = self.out_of_view;
        let down_m = by_distance * from.translation.z + by_size;
        Translation3::new(0.0, down_m, 0.0) * from
    }

    /// Time of correcting a pose without a view taken.
    fn patience_ends(&self) -> CaptureTime {
        after(self.reach.arrival(), self.params.patience_secs)
    }

    /// Starts moving now.
    fn move_to(&mut self, to: Isometry3<f64>) {
        let overshoot = self.params.overshoot * self.manner.random_range(0.5..1.5);
        let sink_m = self.params.sink_m * self.stamina.gain_at(self.now);
        let from = self.reach.pose_at(self.now);
        self.reach = Reach::new(from, to, self.now, &self.params, overshoot, sink_m);
    }
}
