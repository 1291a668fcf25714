//! Pushing a camera back: one thing at a time, and whether it stays.

use nalgebra::Vector4;

use crate::{level::COARSE, measure::NoAnswer, patches::COARSE_SEARCH};

/// Nearer than this nobody can push a camera by hand, px.
const NEAREST_PX: f64 = 0.5;
/// Farther than this the coarse search no longer reaches in one step, px: the tone starts here.
const FAR_PX: f64 = (COARSE * COARSE_SEARCH as u32) as f64;
/// Time for which it must stand right before it's tightened, and until it's looked at again after that.
const HOLD_SECS: f64 = 3.0;
const TIGHTEN_SECS: f64 = 60.0;

/// What a camera can be turned about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// To the left or right.
    Pan,
    /// Up or down.
    Tilt,
    /// Clockwise or anticlockwise.
    Roll,
}

/// The one thing to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Advice {
    /// The camera can't be told where it points.
    Lost(NoAnswer),
    /// Turn it back by so many px of the picture; the sign is that of [`crate::Turn::in_px`].
    Push {
        /// About this axis.
        axis: Axis,
        /// How far it is off.
        off_px: f64,
    },
    /// It stands right: hold it.
    Hold {
        /// For so long, seconds.
        left_secs: f64,
    },
    /// Tighten its mount.
    Tighten {
        /// It's looked at again after so long, seconds.
        left_secs: f64,
        /// How far it's off meanwhile, px.
        off_px: f64,
    },
    /// It's tight and stands right.
    Right,
}

/// The way back, as a fold over estimates.
#[derive(Clone, Debug)]
pub struct Adjust {
    limits_px: Vector4<f64>,
    within_since: Option<f64>,
    tighten_since: Option<f64>,
}

impl Adjust {
    /// For a camera whose estimates scatter so much by themselves, px.
    pub fn new(scatter_px: Option<Vector4<f64>>) -> Self {
        let limits_px = scatter_px.unwrap_or_default().map(|s| s.max(NEAREST_PX));
        Self { limits_px, within_since: None, tighten_since: None }
    }

    /// How near the camera is, for a tone: 1 where it stands right, falling with the logarithm of the distance to 0 where
    /// patches are hardly found. `None` if it isn't known.
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
        (1.0 - libm::log(times.max(1.0)) / libm::log(FAR_PX / NEAREST_PX)).max(0.0)
    }

    /// Takes how far the camera is from where it should point at this hour, px, or why that isn't known.
    pub fn handle(&mut self, at_secs: f64, off: Result<Vector4<f64>, NoAnswer>) -> Advice {
        let off = match off {
            Ok(off) => off,
            Err(reason) => {
                self.within_since = None;
                return Advice::Lost(reason);
            }
        };
        let is_within = |i: usize| off[i].abs() <= self.limits_px[i];
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
        // A camera that is turned about its line of sight shows the other two in the wrong direction.
        if !is_within(2) {
            return Advice::Push { axis: Axis::Roll, off_px: off[2] };
        }
        if off[0].abs() >= off[1].abs() {
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
        let mut adjust = Adjust::new(None);
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
        let adjust = Adjust::new(None);
        let near = |off_px| adjust.closeness(&Advice::Push { axis: Axis::Pan, off_px });
        let heard = [-90.0, 40.0, -12.0, 3.0, 0.6, 0.5].map(|off_px| near(off_px).expect("known"));
        assert!(heard.is_sorted(), "{heard:?}");
        assert_eq!((heard[0], heard[5]), (0.0, 1.0));
        assert_eq!(adjust.closeness(&Advice::Lost(NoAnswer::TooDark)), None);
        assert_eq!(adjust.closeness(&Advice::Right), Some(1.0));
    }

    #[test]
    fn a_camera_that_is_lost_starts_over() {
        let mut adjust = Adjust::new(Some(Vector4::repeat(0.9)));
        assert!(matches!(adjust.handle(0.0, Ok(Vector4::repeat(0.8))), Advice::Hold { .. }));
        assert_eq!(adjust.handle(1.0, Err(NoAnswer::TooDark)), Advice::Lost(NoAnswer::TooDark));
        assert_eq!(adjust.handle(9.0, Ok(Vector4::zeros())), Advice::Hold { left_secs: 3.0 });
    }
}
