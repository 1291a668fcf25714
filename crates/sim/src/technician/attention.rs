//! Attention to the screen, and stamina of the arms.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};

use super::{TechnicianParams, time::after};
use boresight_geometry::frame::CaptureTime;

/// Duration range of a glance away, in seconds.
const AWAY_SECS: std::ops::Range<f64> = 1.0..2.0;
/// Duration of a rest, in seconds.
const REST_SECS: f64 = 4.0;
/// Time after which tiredness stops growing.
const TIRING_SECS: f64 = 90.0;

/// Glances away from the screen: a Poisson process.
#[derive(Clone, Debug)]
pub(super) struct Attention {
    rng: ChaCha8Rng,
    every_secs: f64,
    /// Begin and end of each glance generated so far.
    glances: Vec<(CaptureTime, CaptureTime)>,
}

impl Attention {
    pub(super) fn new(rng: ChaCha8Rng, params: &TechnicianParams) -> Self {
        Self { rng, every_secs: params.look_away_every_secs, glances: Vec::new() }
    }

    /// Time of seeing the screen's content of `time`: at once, or at the end of a glance away.
    pub(super) fn looks_at(&mut self, time: CaptureTime) -> CaptureTime {
        if self.every_secs <= 0.0 {
            return time;
        }
        let mut last = self.glances.last().copied();
        while last.is_none_or(|(start, _)| start <= time) {
            let free = last.map_or(CaptureTime { nanos: 0 }, |(_, end)| end);
            let wait: f64 = Exp1.sample(&mut self.rng);
            let start = after(free, self.every_secs * wait);
            let glance = (start, after(start, self.rng.random_range(AWAY_SECS)));
            self.glances.push(glance);
            last = Some(glance);
        }
        let begun = self.glances.partition_point(|(start, _)| *start <= time);
        begun.checked_sub(1).map_or(time, |newest| self.glances[newest].1.max(time))
    }
}

/// Strength of the arms.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stamina {
    tiring_per_sec: f64,
    rest_after_secs: f64,
    /// End of the last rest.
    rested: CaptureTime,
    /// Start of the last rest, and the gain then.
    rest: Option<(CaptureTime, f64)>,
}

impl Stamina {
    pub(super) fn new(params: &TechnicianParams) -> Self {
        Self {
            tiring_per_sec: params.tiring_per_sec,
            rest_after_secs: params.rest_after_secs,
            rested: CaptureTime { nanos: 0 },
            rest: None,
        }
    }

    /// Factor on the board's movement in a rested person's hands.
    pub(super) fn gain_at(&self, time: CaptureTime) -> f64 {
        let tired_secs = time.secs_since(self.rested);
        match self.rest {
            Some((start, gain)) if tired_secs < 0.0 => {
                let share = time.secs_since(start) / self.rested.secs_since(start);
                gain + share * (1.0 - gain)
            }
            _ => 1.0 + self.tiring_per_sec * tired_secs.clamp(0.0, TIRING_SECS),
        }
    }

    /// End of the last or current rest.
    pub(super) fn rested(&self) -> CaptureTime {
        self.rested
    }

    /// True if the last rest was more than `times` the person's limit ago.
    pub(super) fn needs_rest(&self, now: CaptureTime, times: f64) -> bool {
        self.rest_after_secs > 0.0 && now.secs_since(self.rested) > times * self.rest_after_secs
    }

    /// Rests from now on, at least until the board is down at `lowered`. Returns the end.
    pub(super) fn rest(&mut self, now: CaptureTime, lowered: CaptureTime) -> CaptureTime {
        self.rest = Some((now, self.gain_at(now)));
        self.rested = after(now, REST_SECS).max(lowered);
        self.rested
    }
}
