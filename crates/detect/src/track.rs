//! Follows the board from frame to frame.
//!
//! Hands move boards by many pixels between frames but change speed slowly, so each corner is
//! predicted at constant speed. (Predicting it at rest fails on every frame of a moving board.) The
//! saddle point nearest to the prediction must lie within half a square of it, and the colours of
//! all squares must alternate as on the board. After a sudden move this fails, and the whole
//! picture is searched.

use image::GrayImage;

use super::{
    colours::all_colours_alternate,
    lattice::Lattice,
    outcome::{Detection, Miss, OtherBoard},
    reduce::{Halved, Part, halve, halve_part},
    saddle::settle,
};
use boresight_geometry::{
    Corner,
    boards::Board,
    frame::{CaptureTime, FrameKind},
};

/// Size of squares down to which pictures are halved, enough to follow corners.
const FOLLOWED_SQUARE_PX: f32 = 12.0;
/// Number of frames between searches of the whole picture, even if the board can be followed.
const FULL_SEARCH_EVERY: u32 = 10;
/// Gap between frames after which a prediction is useless.
const LONGEST_GAP_SECS: f64 = 0.25;
/// Seconds between searches for other boards; one that's seen is forgotten after twice as long.
const OTHERS_EVERY_SECS: f64 = 1.0;
/// Standard deviation of the change of a hand-held board's speed from frame to frame, in squares
/// per second.
const SPEED_CHANGE: f64 = 7.5;
/// Standard deviation of a corner in a blurred or noisy picture, in squares.
const ROUGHLY_SQUARES: f64 = 0.1;

/// Predicted positions of the board's corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Every inner corner in the board's numbering, in pixels `[x, y]`.
    pub corners_px: Vec<[f64; 2]>,
    /// True for each corner seen when the board was last found.
    pub seen: Vec<bool>,
    /// Standard deviation of the corners, in squares.
    pub spread_squares: f64,
    /// True if the whole picture should be searched nevertheless.
    pub everywhere: bool,
}

/// Recent detections, the only source of [`Prediction`]s.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Last two detections. They outlast a miss: the worth of a prediction from them depends on
    /// their age.
    newest: Option<(CaptureTime, Vec<[f64; 2]>)>,
    /// True for each corner seen in the newest detection.
    seen: Vec<bool>,
    before: Option<(CaptureTime, Vec<[f64; 2]>)>,
    followed: u32,
    /// Time of the last detection or search for other boards, and the other board seen.
    sought: Option<(CaptureTime, Option<OtherBoard>)>,
}

impl Track {
    /// Adds the result for the next frame; a miss adds nothing. A photograph clears the track:
    /// photographs aren't a sequence.
    pub fn add(&mut self, kind: FrameKind, at: CaptureTime, seen: &Result<Detection, Miss>) {
        if seen.is_ok() {
            self.sought = Some((at, None));
        }
        match seen {
            Ok(detection) if kind == FrameKind::Video => {
                self.followed += 1;
                let oldest = std::mem::replace(&mut self.before, self.newest.take());
                let mut corners = oldest.map_or_else(Vec::new, |(_, corners)| corners);
                corners.clear();
                corners.extend(detection.corners.iter().map(|corner| [corner.px.x, corner.px.y]));
                self.newest = Some((at, corners));
                self.seen.clear();
                self.seen.extend(detection.corners.iter().map(Corner::is_seen));
            }
            Err(_) if kind == FrameKind::Video => {}
            _ => *self = Self { sought: self.sought, ..Self::default() },
        }
    }

    /// Adds the result of a search for other boards in a frame.
    pub fn add_other(&mut self, at: CaptureTime, other: Option<OtherBoard>) {
        self.sought = Some((at, other));
    }

    /// Another board seen shortly before `now`, if any.
    pub fn other(&self, now: CaptureTime) -> Option<OtherBoard> {
        let (then, other) = self.sought?;
        (0.0..2.0 * OTHERS_EVERY_SECS).contains(&now.secs_since(then)).then_some(other)?
    }

    /// `seen` in a frame, or the other board in its place; calls `recognise` for it if a search is
    /// due. What another photograph shows says nothing of this one.
    pub fn or_other(
        &mut self,
        kind: FrameKind,
        at: CaptureTime,
        seen: Result<Detection, Miss>,
        recognise: impl FnOnce() -> Option<OtherBoard>,
    ) -> Result<Detection, Miss> {
        if !matches!(&seen, Err(miss) if miss.leaves_open()) {
            return seen;
        }
        let seeks = self.seeks_others(kind, at);
        if seeks {
            self.add_other(at, recognise());
        }
        let other = self.other(at).filter(|_| seeks || kind == FrameKind::Video);
        other.map_or(seen, |other| Err(Miss::OtherBoard(other)))
    }

    /// True if another board should be searched in a frame without the named one: once a second,
    /// and in the first of many photographs.
    pub fn seeks_others(&self, kind: FrameKind, now: CaptureTime) -> bool {
        let is_due = |then| !(0.0..OTHERS_EVERY_SECS).contains(&now.secs_since(then));
        self.sought.is_none_or(|(then, _)| kind == FrameKind::Video && is_due(then))
    }

    /// True if a prediction that far ahead can identify the corners of a part of the board with
    /// white at an end.
    pub fn names_corners_after(gap_secs: f64) -> bool {
        gap_secs < LONGEST_GAP_SECS
    }

    /// Predicts the board at time `now`; `None` after a gap. On every tenth frame, the whole
    /// picture should be searched.
    pub fn predict(&self, kind: FrameKind, now: CaptureTime) -> Option<Prediction> {
        let (then, newest) = self.newest.as_ref().filter(|_| kind == FrameKind::Video)?;
        let ahead_secs = now.secs_since(*then);
        if !(0.0..LONGEST_GAP_SECS).contains(&ahead_secs) {
            return None;
        }
        let steps = self.before.as_ref().and_then(|(earlier, before)| {
            let passed_secs = then.secs_since(*earlier);
            let near = passed_secs > 0.0 && passed_secs < LONGEST_GAP_SECS;
            (near && before.len() == newest.len()).then(|| (before, ahead_secs / passed_secs))
        });
        let corners_px = match steps {
            Some((before, steps)) => newest
                .iter()
                .zip(before)
                .map(|(new, old)| std::array::from_fn(|k| new[k] + steps * (new[k] - old[k])))
                .collect(),
            None => newest.clone(),
        };
        Some(Prediction {
            seen: self.seen.clone(),
            spread_squares: ROUGHLY_SQUARES + SPEED_CHANGE * ahead_secs,
            everywhere: self.followed.is_multiple_of(FULL_SEARCH_EVERY),
            corners_px,
        })
    }
}

/// [`Prediction`] at search size.
#[derive(Clone, Debug, Default)]
pub(super) struct Expected {
    /// Corners of the board; empty without a prediction.
    pub(super) corners: Vec<[f32; 2]>,
    pub(super) seen: Vec<bool>,
    pub(super) spread_squares: f32,
}

impl Expected {
    /// Sets the expected corners to the prediction's, mapped by `at`.
    pub(super) fn set(&mut self, near: Option<&Prediction>, at: impl Fn([f64; 2]) -> [f32; 2]) {
        self.corners.clear();
        self.seen.clear();
        if let Some(near) = near {
            self.corners.extend(near.corners_px.iter().map(|corner| at(*corner)));
            self.seen.extend(&near.seen);
            self.spread_squares = near.spread_squares as f32;
        }
    }
}

/// Finds the corners near a [`Prediction`]. Reuses its buffers.
#[derive(Clone, Debug, Default)]
pub(super) struct Tracker {
    levels: Vec<GrayImage>,
    lattice: Lattice,
}

impl Tracker {
    /// Writes the corners to `into`, accurate to about half a pixel; returns `false` if the board
    /// isn't there.
    pub(super) fn follow(
        &mut self,
        image: &GrayImage,
        board: &Board,
        near: &Prediction,
        into: &mut Vec<Option<[f64; 2]>>,
    ) -> bool {
        let corners = &near.corners_px;
        let (columns, rows) = (board.columns(), board.rows());
        if corners.len() != columns * rows {
            return false;
        }
        let side_px = shortest_side_px(board, |index| corners[index]);
        if !(4.0..1e4).contains(&side_px) {
            return false;
        }
        let mut level = 0;
        while side_px / f64::from(2_u32 << level) >= f64::from(FOLLOWED_SQUARE_PX) {
            level += 1;
        }
        let scale = 1_u32 << level;
        let Some(part) = Part::around(corners, side_px, scale, image) else { return false };
        self.levels.resize_with(level.max(self.levels.len()), GrayImage::default);
        for k in 0..level {
            let (finer, coarser) = self.levels.split_at_mut(k);
            match finer.last() {
                None => halve_part(image, &part, &mut coarser[0]),
                Some(finer) => halve(finer, &mut coarser[0]),
            }
        }
        let whole = Halved::whole(level);
        let (picture, halved) = match level {
            0 => (image, whole),
            _ => {
                let origin_px = [f64::from(part.left), f64::from(part.top)];
                (&self.levels[level - 1], Halved { origin_px, ..whole })
            }
        };
        let side = (side_px / halved.scale) as f32;
        self.lattice.clear(columns.max(rows));
        for (index, corner) in corners.iter().enumerate() {
            let guess = halved.at(*corner);
            let node = ((index % columns) as i32, (index / columns) as i32);
            let found = settle(picture, guess, 1.4 * side, 0.5 * side);
            if !found.is_some_and(|found| self.lattice.insert(node, found)) {
                return false;
            }
        }
        if !all_colours_alternate(picture, &self.lattice, board) {
            return false;
        }
        into.clear();
        let found = self.lattice.nodes().iter().filter_map(|node| self.lattice.get(*node));
        into.extend(found.map(|at| Some(halved.full_px(at))));
        into.len() == corners.len()
    }
}

/// Shortest distance between neighbours in the rows and columns of a whole board with corners at
/// `px`. Distances that aren't finite are left out.
pub(super) fn shortest_side_px(board: &Board, px: impl Fn(usize) -> [f64; 2]) -> f64 {
    let apart = |one: usize, other: usize| {
        let ([x, y], [to_x, to_y]) = (px(one), px(other));
        libm::hypot(to_x - x, to_y - y)
    };
    let mut shortest_px = f64::MAX;
    board.target().each_three_in_line(&mut |[a, b, c], _| {
        shortest_px = shortest_px.min(apart(a, b)).min(apart(b, c));
    });
    shortest_px
}
