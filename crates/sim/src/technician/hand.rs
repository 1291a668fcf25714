//! Hand that covers a part of the board from time to time.

use nalgebra::{Point2, Vector2};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::time::after;
use boresight_geometry::{boards::Board, frame::CaptureTime};

/// Range of durations of a cover, in seconds.
const STAYS_SECS: std::ops::Range<f64> = 1.0..2.0;
/// Range of the time between two covers, relative to the mean.
const PAUSES: std::ops::Range<f64> = 0.5..1.5;
/// Time in which the hand comes or leaves, in seconds.
const SLIDE_SECS: f64 = 0.2;
/// Range of half a hand's width, in metres.
const RADIUS_M: std::ops::Range<f64> = 0.025..0.04;
/// Range of the hand's reach over the board, in metres.
const REACH_M: std::ops::Range<f64> = 0.06..0.12;
/// Largest half width of a hand, and largest reach, relative to the board's shorter side.
const LARGEST: (f64, f64) = (0.2, 0.6);

/// Hand on the board: a rounded bar across the board's edge. In metres of the board's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// End beyond the edge of the paper.
    pub from_m: Point2<f64>,
    /// End of the bar's middle line over the board.
    pub to_m: Point2<f64>,
    /// Half width.
    pub radius_m: f64,
}

impl Hand {
    /// Distance of a point of the board from the hand's outline, in metres; negative below the
    /// hand.
    pub fn distance_m(&self, point_m: &Point2<f64>) -> f64 {
        let (along, off) = (self.to_m - self.from_m, point_m - self.from_m);
        let share = (off.dot(&along) / along.norm_squared().max(1e-12)).clamp(0.0, 1.0);
        (off - share * along).norm() - self.radius_m
    }
}

/// Times and places of covers.
#[derive(Clone, Debug)]
pub(super) struct Covers {
    rng: ChaCha8Rng,
    every_secs: f64,
    /// Half size of the paper, in metres.
    half_m: Vector2<f64>,
    /// Begin, end and place of the last cover.
    last: Option<(CaptureTime, CaptureTime, Hand)>,
}

impl Covers {
    pub(super) fn new(rng: ChaCha8Rng, board: &Board, every_secs: f64) -> Self {
        // The paper reaches almost two squares beyond the corners.
        let half = |corners: usize| 0.5 * (corners as f64 + 2.6) * board.square_m();
        let half_m = Vector2::new(half(board.columns()), half(board.rows()));
        Self { rng, every_secs, half_m, last: None }
    }

    /// Hand at `time`, which must not go back.
    pub(super) fn at(&mut self, time: CaptureTime) -> Option<Hand> {
        if self.every_secs <= 0.0 {
            return None;
        }
        while self.last.is_none_or(|(_, end, _)| end <= time) {
            let free = self.last.map_or(CaptureTime { nanos: 0 }, |(_, end, _)| end);
            let start = after(free, self.every_secs * self.rng.random_range(PAUSES));
            let end = after(start, self.rng.random_range(STAYS_SECS));
            self.last = Some((start, end, self.hand()));
        }
        let (start, end, hand) = self.last.filter(|(start, ..)| *start <= time)?;
        let share = (time.secs_since(start).min(end.secs_since(time)) / SLIDE_SECS).min(1.0);
        Some(Hand { to_m: hand.from_m + share * (hand.to_m - hand.from_m), ..hand })
    }

    /// Random hand over any of the four sides.
    fn hand(&mut self) -> Hand {
        let shorter_m = 2.0 * self.half_m.min();
        let radius_m = self.rng.random_range(RADIUS_M).min(LARGEST.0 * shorter_m);
        let reach_m = self.rng.random_range(REACH_M).min(LARGEST.1 * shorter_m);
        let along = self.rng.random_range(-0.7..0.7_f64);
        let lean = self.rng.random_range(-0.4..0.4_f64);
        let side = if self.rng.random_range(0..2) == 0 { 1.0 } else { -1.0 };
        let (from, inwards) = if self.rng.random_range(0..2) == 0 {
            let from = Vector2::new(side * (self.half_m.x + radius_m), along * self.half_m.y);
            (from, Vector2::new(-side, lean))
        } else {
            let from = Vector2::new(along * self.half_m.x, side * (self.half_m.y + radius_m));
            (from, Vector2::new(lean, -side))
        };
        let from_m = Point2::from(from);
        Hand { from_m, to_m: from_m + reach_m * inwards.normalize(), radius_m }
    }
}
