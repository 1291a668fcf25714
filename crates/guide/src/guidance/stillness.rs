//! Stillness: judges if the picture of the board is sharp enough to be taken.
//!
//! Still means that the picture is good: what counts is how far the board moves while the shutter is open. Sensors
//! that read their rows one after the other also bend the picture of a moving board, however short the exposure, so
//! speed is limited too, but loosely.
//!
//! Both limits have a hysteresis, and they relax in steps while a person who holds a good pose doesn't get steadier:
//! [`Patience`]. The sharpest frame of a hold is the one taken; its blur sets the covariances of its corners. Source:
//! `docs/method.md`, section 3.8.

use super::{motion::Motion, params::GuidanceParams, refusal::Refusal};
use boresight_geometry::frame::{CaptureTime, FrameKind, ImageSize};

/// Multiple of the limits up to which a board that was still remains so.
const HYSTERESIS: f64 = 1.25;
/// Time for which a good pose has been held without a view until the limits begin to relax.
const PATIENCE_SECS: f64 = 3.0;
/// Duration of each step, the factor by which it relaxes the limits, and the most steps.
const STEP_SECS: f64 = 1.5;
const STEP: f64 = 1.25;
const MOST_STEPS: f64 = 5.0;
/// Time without steady hands after which the guide says what helps.
const ADVICE_SECS: f64 = 5.0;
/// Longest loss of a pose within one attempt.
const GAP_SECS: f64 = 1.1;

/// Motion of a frame: speed and smear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smear {
    /// Root mean square speed of the corners.
    pub speed_px_per_s: f64,
    /// Displacement of the corners while the shutter is open.
    pub smear_px: f64,
}

impl Smear {
    /// Smear by `motion` during an exposure.
    pub fn of(motion: &Motion, exposure_secs: f64) -> Self {
        // A shutter isn't open for longer than a frame.
        let open_secs = exposure_secs.min(motion.since_secs);
        Self { speed_px_per_s: motion.speed_px_per_s, smear_px: motion.speed_px_per_s * open_secs }
    }
}

/// The limits on a frame's motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillLimits {
    /// Longest smear accepted.
    pub smear_px: f64,
    /// Highest speed accepted.
    pub speed_px_per_s: f64,
}

impl StillLimits {
    /// Limits in pictures of `image_size` for a board that `was_still` in the frame before, relaxed by
    /// [`Patience::factor`].
    pub fn new(
        image_size: ImageSize,
        params: &GuidanceParams,
        relaxed: f64,
        was_still: bool,
    ) -> Self {
        let factor = if was_still { relaxed.max(HYSTERESIS) } else { relaxed };
        let speed_px_per_s = params.still_widths_per_sec * f64::from(image_size.width_px);
        Self { smear_px: factor * params.max_smear_px, speed_px_per_s: factor * speed_px_per_s }
    }
}

/// Checks that the board stands still enough. A [`FrameKind::Photograph`] is still by definition.
///
/// # Errors
///
/// [`Refusal::Moving`] with what was measured, `None` without an earlier frame to compare with.
pub fn still(kind: FrameKind, smear: Option<&Smear>, limits: &StillLimits) -> Result<(), Refusal> {
    let within = |smear: &Smear| {
        smear.smear_px <= limits.smear_px && smear.speed_px_per_s <= limits.speed_px_per_s
    };
    if kind == FrameKind::Photograph || smear.is_some_and(within) {
        return Ok(());
    }
    Err(Refusal::Moving {
        speed_px_per_s: smear.map(|smear| smear.speed_px_per_s),
        wanted_px_per_s: limits.speed_px_per_s,
        smear_px: smear.map(|smear| smear.smear_px),
        wanted_smear_px: Some(limits.smear_px),
    })
}

/// Time for which a person has tried to hold a good pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Patience {
    /// Times at which the pose was first good, and last.
    attempt: Option<(CaptureTime, CaptureTime)>,
}

impl Patience {
    /// Notes whether the pose of a frame is good, its motion aside.
    pub fn note(&mut self, now: CaptureTime, is_good: bool) {
        let same =
            self.attempt.filter(|(_, last)| (0.0..GAP_SECS).contains(&now.secs_since(*last)));
        self.attempt = match (same, is_good) {
            (Some((since, _)), true) => Some((since, now)),
            (None, true) => Some((now, now)),
            (same, false) => same,
        };
    }

    /// Time for which the pose has been good, in seconds.
    pub fn secs(&self, now: CaptureTime) -> f64 {
        self.attempt.map_or(0.0, |(since, _)| now.secs_since(since).max(0.0))
    }

    /// Factor by which the limits on motion are relaxed now: 1 at first.
    pub fn factor(&self, now: CaptureTime) -> f64 {
        let late_secs = self.secs(now) - PATIENCE_SECS;
        if late_secs < 0.0 {
            return 1.0;
        }
        STEP.powf((1.0 + late_secs / STEP_SECS).floor().min(MOST_STEPS))
    }

    /// True if the person needs advice on how to hold the board steadily.
    pub fn needs_advice(&self, now: CaptureTime) -> bool {
        self.secs(now) >= ADVICE_SECS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IMAGE_SIZE: ImageSize = ImageSize { width_px: 1280, height_px: 720 };

    fn at(secs: f64) -> CaptureTime {
        CaptureTime { nanos: (secs * 1e9) as u64 }
    }

    #[test]
    fn smear_counts_and_not_speed() {
        let limits = StillLimits::new(IMAGE_SIZE, &GuidanceParams::default(), 1.0, false);
        let judged = |speed_px_per_s: f64, exposure_secs: f64| {
            let smear = Smear { speed_px_per_s, smear_px: speed_px_per_s * exposure_secs };
            still(FrameKind::Video, Some(&smear), &limits).is_ok()
        };
        assert!(judged(60.0, 0.005), "0.3 px");
        assert!(!judged(50.0, 0.020), "1 px");
        assert!(!judged(200.0, 0.000_1), "a sensor read row by row bends the picture");
        assert!(still(FrameKind::Video, None, &limits).is_err(), "nothing to compare with");
        assert!(still(FrameKind::Photograph, None, &limits).is_ok());
    }

    #[test]
    fn limits_relax_in_steps_while_a_pose_is_held() {
        let mut patience = Patience::default();
        let mut factors = Vec::new();
        for number in 0..=300 {
            let now = at(f64::from(number) / 30.0);
            // The pose is lost for a moment now and then.
            patience.note(now, number % 30 < 20);
            if factors.last() != Some(&patience.factor(now)) {
                factors.push(patience.factor(now));
            }
            assert_eq!(patience.needs_advice(now), number >= 150);
        }
        assert_eq!(factors, [1.0, STEP, STEP.powi(2), STEP.powi(3), STEP.powi(4), STEP.powi(5)]);
        patience.note(at(11.5), false);
        assert_eq!(patience.factor(at(11.5)), 1.0, "the pose is lost");
    }
}
