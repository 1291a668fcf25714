//! Pushing a camera back: one step at a time, with a check after tightening.

use std::collections::VecDeque;

use nalgebra::Vector4;

use crate::{no_answer::NoAnswer, slot::median4};
use boresight_scene::{COARSE, COARSE_SEARCH};

/// Range of the coarse search in a single step, px: the tone starts here.
const FAR_PX: f64 = (COARSE * COARSE_SEARCH as u32) as f64;
/// Time of alignment before tightening, and time before the check afterwards.
const HOLD_SECS: f64 = 3.0;
const TIGHTEN_SECS: f64 = 60.0;

/// Axis of rotation of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Left or right.
    Pan,
    /// Up or down.
    Tilt,
    /// Clockwise or anticlockwise.
    Roll,
}

/// Next action.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advice {
    /// Unknown pointing of the camera.
    Lost(NoAnswer),
    /// Turn the camera back by `off_px` px of the picture; the sign is that of
    /// [`crate::Turn::in_px`].
    Push {
        /// Axis of rotation.
        axis: Axis,
        /// Offset, px.
        off_px: f64,
    },
    /// Aligned: hold the camera.
    Hold {
        /// Remaining time, seconds.
        left_secs: f64,
    },
    /// Tighten the mount.
    Tighten {
        /// Time until the check, seconds.
        left_secs: f64,
        /// Current offset, px.
        off_px: f64,
    },
    /// Tight and aligned.
    Right,
}

/// Way back of a camera, as a fold over estimates.
#[derive(Clone, Debug)]
pub struct Adjust {
    limits_px: Vector4<f64>,
    /// Start time of the alignment, and the last estimates: a mast trembles while held.
    within_since: Option<f64>,
    held: VecDeque<(f64, Vector4<f64>)>,
    tighten_since: Option<f64>,
}

impl Adjust {
    /// Fold for a camera with permitted offsets `limits_px`: [`crate::Watch::may_be_left_px`].
    pub fn new(limits_px: Vector4<f64>) -> Self {
        Self { limits_px, within_since: None, held: VecDeque::new(), tighten_since: None }
    }

    /// Closeness of the camera, for a tone: 1 when aligned, falling with the logarithm of the
    /// distance to 0 at the limit of the patch search. `None` if unknown.
    pub fn closeness(&self, advice: &Advice) -> Option<f64> {
        match *advice {
            Advice::Lost(_) => None,
            Advice::Hold { .. } | Advice::Right => Some(1.0),
            Advice::Push { axis, off_px } => {
                Some(Self::near(self.limits_px[axis as usize], off_px))
            }
            Advice::Tighten { off_px, .. } => {
                Some(Self::near(self.limits_px.fixed_rows::<3>(0).amax(), off_px))
            }
        }
    }

    fn near(limit_px: f64, off_px: f64) -> f64 {
        let times = off_px.abs() / limit_px;
        (1.0 - libm::log(times.max(1.0)) / libm::log(FAR_PX / limit_px)).max(0.0)
    }

    /// Takes the camera's offset from the hour's target, px, or the reason for having none.
    pub fn handle(&mut self, at_secs: f64, off: Result<Vector4<f64>, NoAnswer>) -> Advice {
        let off = match off {
            Ok(off) => off,
            Err(reason) => {
                self.within_since = None;
                return Advice::Lost(reason);
            }
        };
        if self.within_since.is_none() {
            self.held.clear();
        }
        self.held.retain(|(at, _)| at_secs - at <= HOLD_SECS);
        self.held.push_back((at_secs, off));
        let held: Vec<Vector4<f64>> = self.held.iter().map(|(_, off)| *off).collect();
        let off = median4(&held);
        let times = off.component_div(&self.limits_px).abs();
        let is_within = |i: usize| times[i] <= 1.0;
        let largest_px = off.fixed_rows::<3>(0).amax();
        let within_secs = if is_within(0) && is_within(1) && is_within(2) {
            at_secs - *self.within_since.get_or_insert(at_secs)
        } else {
            self.within_since = None;
            -1.0
        };
        if let Some(since) = self.tighten_since {
            let left_secs = TIGHTEN_SECS - (at_secs - since);
            if left_secs > 0.0 {
                return Advice::Tighten { left_secs, off_px: largest_px };
            }
            if within_secs >= HOLD_SECS {
                return Advice::Right;
            }
            if within_secs < 0.0 {
                self.tighten_since = None;
            }
        }
        if within_secs >= HOLD_SECS {
            self.tighten_since = Some(at_secs);
            return Advice::Tighten { left_secs: TIGHTEN_SECS, off_px: largest_px };
        }
        if within_secs >= 0.0 {
            return Advice::Hold { left_secs: HOLD_SECS - within_secs };
        }
        // A roll offset would show the directions of pan and tilt wrongly.
        if !is_within(2) {
            return Advice::Push { axis: Axis::Roll, off_px: off[2] };
        }
        if times[0] >= times[1] {
            Advice::Push { axis: Axis::Pan, off_px: off[0] }
        } else {
            Advice::Push { axis: Axis::Tilt, off_px: off[1] }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roll_first_then_the_larger_one_then_hold_tighten_and_look_again() {
        let mut adjust = Adjust::new(Vector4::repeat(0.5));
        let mut at = 0.0;
        let mut see = |off: [f64; 3], secs: f64| {
            at += secs;
            adjust.handle(at, Ok(Vector4::new(off[0], off[1], off[2], 9.0)))
        };
        assert_eq!(see([40.0, 0.0, -3.0], 0.1), Advice::Push { axis: Axis::Roll, off_px: -3.0 });
        assert_eq!(see([40.0, 50.0, 0.2], 0.1), Advice::Push { axis: Axis::Tilt, off_px: 50.0 });
        assert_eq!(see([-4.0, 0.1, 0.2], 0.1), Advice::Push { axis: Axis::Pan, off_px: -4.0 });
        assert_eq!(see([0.1, 0.1, 0.1], 0.1), Advice::Hold { left_secs: 3.0 });
        assert!(matches!(see([0.1, 0.1, 0.1], 3.1), Advice::Tighten { .. }));
        assert!(matches!(see([2.0, 0.0, 0.0], 30.0), Advice::Tighten { off_px: 2.0, .. }));
        assert_eq!(see([2.0, 0.0, 0.0], 31.0), Advice::Push { axis: Axis::Pan, off_px: 2.0 });
        see([0.0; 3], 0.1);
        see([0.0; 3], 3.1);
        see([0.0; 3], 61.0);
        assert_eq!(see([0.0; 3], 4.0), Advice::Right);
    }

    #[test]
    fn the_tone_rises_as_it_comes_nearer() {
        let adjust = Adjust::new(Vector4::repeat(0.5));
        let near = |off_px| adjust.closeness(&Advice::Push { axis: Axis::Pan, off_px });
        let heard = [-90.0, 40.0, -12.0, 3.0, 0.6, 0.5].map(|off_px| near(off_px).expect("known"));
        assert!(heard.is_sorted(), "{heard:?}");
        assert_eq!((heard[0], heard[5]), (0.0, 1.0));
        assert_eq!(adjust.closeness(&Advice::Lost(NoAnswer::TooDark)), None);
        assert_eq!(adjust.closeness(&Advice::Right), Some(1.0));
    }

    #[test]
    fn a_mast_that_trembles_is_right_by_its_median() {
        let mut adjust = Adjust::new(Vector4::repeat(0.3));
        let mut told = (0..660).map(|i| {
            let trembles_px = [0.0, -0.2, 0.9, 0.1, -0.8][i % 5];
            adjust.handle(0.1 * i as f64, Ok(Vector4::new(trembles_px, 0.1, 0.0, 0.0)))
        });
        assert!(told.all(|advice| !matches!(advice, Advice::Push { .. })));
        assert_eq!(adjust.handle(66.0, Ok(Vector4::zeros())), Advice::Right);
        // Pushing it away shows as soon as most recent estimates are off.
        let mut adjust = Adjust::new(Vector4::repeat(0.3));
        let seen = (0..60).map(|i| {
            let pushed_px = if i < 10 { 0.0 } else { 5.0 };
            adjust.handle(0.1 * f64::from(i), Ok(Vector4::new(pushed_px, 0.0, 0.0, 0.0)))
        });
        let told = seen.enumerate().find(|(_, advice)| matches!(advice, Advice::Push { .. }));
        assert!((11..=21).contains(&told.expect("told").0), "{told:?}");
    }

    #[test]
    fn a_camera_that_is_lost_starts_over() {
        let mut adjust = Adjust::new(Vector4::repeat(0.9));
        assert!(matches!(adjust.handle(0.0, Ok(Vector4::repeat(0.8))), Advice::Hold { .. }));
        assert_eq!(adjust.handle(1.0, Err(NoAnswer::TooDark)), Advice::Lost(NoAnswer::TooDark));
        assert_eq!(adjust.handle(9.0, Ok(Vector4::zeros())), Advice::Hold { left_secs: 3.0 });
    }
}
