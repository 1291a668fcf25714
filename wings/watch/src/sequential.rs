//! Sequential test: do estimates stay about the cycle, or since when have they left it?

use nalgebra::Vector4;

use crate::slot::{DAY_SECS, SEVERAL, SLOT_SECS, median4};

/// Relevant change as a share of the picture's width, at the worst place in the picture, as in a
/// check with a board.
pub const RELEVANT: f64 = 0.0008;
/// Allowance of a six-hour mean, in standard deviations, and the alarm threshold of the sum.
const ALLOWANCE: f64 = 2.0;
const LIMIT: f64 = 5.0;
/// Maximum count of a single estimate, in standard deviations, and maximum sum, so that a camera
/// that comes back is soon OK again. Several estimates in a row that far from the camera's
/// pointing, on one side and within a slot, are a jump.
const CLIP: f64 = 6.0;
/// Time limit for seeing a promised change.
pub(crate) const SEEN_WITHIN_SECS: f64 = 2.0 * DAY_SECS;
/// Persistent change seen within the time limit, in standard deviations, with half of one to spare.
pub(crate) const VISIBLE: f64 = ALLOWANCE + LIMIT * SLOT_SECS / SEEN_WITHIN_SECS + 0.5;

/// Sum for each parameter and direction (CUSUM, Page 1954), and the last hours.
#[derive(Clone, Debug)]
pub struct Sequential {
    sums: [Vector4<f64>; 2],
    /// Start of each sum's latest growth, seconds.
    grown_since: [[f64; 4]; 2],
    last_secs: Option<f64>,
    recent: Vec<(f64, Vector4<f64>)>,
    /// Pointing of the camera since the last jump, px from the cycle.
    pointing_px: Vector4<f64>,
    width_px: f64,
    /// True for a pinned camera: its newest answers alone tell, and the smallest visible change is
    /// a jump.
    is_pinned: bool,
}

/// Factor on a camera's behaviour so far that still counts as usual.
pub(crate) const MARGIN: f64 = 2.0;

/// Minimum scatter with which known quiet days stay well clear of an alarm: distances from the
/// cycle, px, by time. No distribution is assumed: a mount with rare but large jerks gets the
/// limits it needs, and an evenly swaying mount keeps the narrow limits of its scatter.
pub(crate) fn quiet_scatter(known: &[(f64, Vector4<f64>)]) -> Vector4<f64> {
    Vector4::from_fn(|i, _| {
        let largest = known.iter().map(|(_, off)| off[i].abs()).fold(0.0, f64::max);
        let (mut loud, mut quiet) = (0.0, largest / ALLOWANCE);
        for _ in 0..10 {
            let middle = 0.5 * (loud + quiet);
            if highest_sum(known, i, middle) * MARGIN > LIMIT {
                loud = middle;
            } else {
                quiet = middle;
            }
        }
        let jumps = known.windows(SEVERAL).filter(|w| w[SEVERAL - 1].0 - w[0].0 < SLOT_SECS);
        let jump = jumps.map(|w| {
            let side = w[0].1[i].signum();
            w.iter().map(|(_, off)| side * off[i]).fold(f64::INFINITY, f64::min)
        });
        quiet.max(jump.fold(0.0, f64::max) * MARGIN / CLIP)
    })
}

/// Higher of the two sums of a parameter, uncapped, over known days.
fn highest_sum(known: &[(f64, Vector4<f64>)], i: usize, scatter_px: f64) -> f64 {
    let (mut sums, mut highest, mut last) = ([0.0_f64; 2], 0.0_f64, None);
    for (at_secs, off) in known {
        let share = last.map_or(0.0, |last: f64| share_of(at_secs - last));
        last = Some(*at_secs);
        let z = (off[i] / scatter_px.max(1e-9)).clamp(-CLIP, CLIP);
        sums = [
            (sums[0] + share * (z - ALLOWANCE)).max(0.0),
            (sums[1] - share * (z + ALLOWANCE)).max(0.0),
        ];
        highest = highest.max(sums[0]).max(sums[1]);
    }
    highest
}

/// Share of a slot represented by a picture taken `secs` after the previous one.
fn share_of(secs: f64) -> f64 {
    (secs / SLOT_SECS).clamp(0.0, 1.0)
}

/// Verdict of the test after an estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Parameters outside the cycle: pan, tilt, roll, focal length.
    pub alarms: [bool; 4],
    /// Median distance from the cycle over the last six hours, or since a jump, px.
    pub level_px: Vector4<f64>,
    /// Start of the earliest alarming sum, seconds.
    pub since_secs: Option<f64>,
}

impl Sequential {
    /// Fresh test, for pictures of width `width_px`.
    pub fn new(width_px: f64) -> Self {
        Self {
            sums: [Vector4::zeros(); 2],
            grown_since: [[0.0; 4]; 2],
            last_secs: None,
            recent: Vec::new(),
            pointing_px: Vector4::zeros(),
            width_px,
            is_pinned: false,
        }
    }

    /// Fresh test of a pinned camera.
    pub(crate) fn pinned(width_px: f64) -> Self {
        Self { is_pinned: true, ..Self::new(width_px) }
    }

    /// Scatter for judging a distance from the cycle, px: the camera's own, but at least a third of
    /// a relevant change.
    pub fn scale_px(&self, scatter_px: &Vector4<f64>) -> Vector4<f64> {
        scatter_px.map(|s| s.max(RELEVANT * self.width_px / 3.0))
    }

    /// Smallest persistent change found within two days, px.
    pub fn smallest_visible_px(&self, scatter_px: &Vector4<f64>) -> Vector4<f64> {
        self.scale_px(scatter_px) * VISIBLE
    }

    /// Maximum permitted offset, px: with the camera's own movements added, the offset still isn't
    /// counted.
    pub fn may_be_left_px(&self, scatter_px: &Vector4<f64>) -> Vector4<f64> {
        self.scale_px(scatter_px) * ALLOWANCE - scatter_px
    }

    /// Takes an estimate: distance from the cycle, and scatter about the cycle, px.
    pub fn step(
        &mut self,
        at_secs: f64,
        off_px: &Vector4<f64>,
        scatter_px: &Vector4<f64>,
    ) -> Verdict {
        let share = self.last_secs.map_or(0.0, |last| share_of(at_secs - last));
        self.last_secs = Some(at_secs);
        let scale_px = self.scale_px(scatter_px);
        let z = off_px.component_div(&scale_px).map(|z| z.clamp(-CLIP, CLIP));
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            for i in 0..4 {
                let sum = &mut self.sums[side][i];
                if *sum <= 0.0 {
                    self.grown_since[side][i] = at_secs;
                }
                *sum = (*sum + share * (sign * z[i] - ALLOWANCE)).clamp(0.0, CLIP);
            }
        }
        self.recent.retain(|(at, _)| at_secs - at < SLOT_SECS);
        self.recent.push((at_secs, *off_px));
        if self.is_pinned {
            self.recent.drain(..self.recent.len().saturating_sub(SEVERAL));
        }
        self.jump(&scale_px);
        let alarms = std::array::from_fn(|i| self.sums.iter().any(|sum| sum[i] > LIMIT));
        let values: Vec<Vector4<f64>> = self.recent.iter().map(|(_, off)| *off).collect();
        let since = (0..4).filter(|i| alarms[*i]).map(|i| {
            let grown = (0..2).filter(|side| self.sums[*side][i] > 0.0);
            grown.map(|side| self.grown_since[side][i]).fold(f64::INFINITY, f64::min)
        });
        Verdict { alarms, level_px: median4(&values), since_secs: since.reduce(f64::min) }
    }

    /// Detects a jump: the newest answers are all far from the previous pointing, on one side. They
    /// alone then determine the new pointing, and whether it counts.
    fn jump(&mut self, scale_px: &Vector4<f64>) {
        let Some(first) = self.recent.len().checked_sub(SEVERAL) else { return };
        let newest = &self.recent[first..];
        let all = |i: usize, side: f64, from_px: f64, least: f64| {
            newest.iter().all(|(_, off)| side * (off[i] - from_px) > least * scale_px[i])
        };
        let least = if self.is_pinned { VISIBLE } else { CLIP };
        let is_far = |i: usize, side| all(i, side, self.pointing_px[i], least);
        let jumped: Vec<usize> = (0..4).filter(|i| is_far(*i, 1.0) || is_far(*i, -1.0)).collect();
        if jumped.is_empty() {
            return;
        }
        let values: Vec<Vector4<f64>> = newest.iter().map(|(_, off)| *off).collect();
        let level_px = median4(&values);
        for i in jumped {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                self.sums[side][i] = if all(i, sign, 0.0, ALLOWANCE) { CLIP } else { 0.0 };
            }
            self.pointing_px[i] = level_px[i];
        }
        self.recent.drain(..first);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slot::HOUR_SECS;

    const WIDTH_PX: f64 = 1024.0;

    #[test]
    fn a_mount_that_jerks_widens_its_limits_and_an_even_one_keeps_them() {
        let quarter = |n: u32| f64::from(n) * 900.0;
        let even: Vec<_> =
            (0..960).map(|n| (quarter(n), Vector4::repeat(0.3 * f64::from(n).sin()))).collect();
        assert!(quiet_scatter(&even).amax() < 0.15, "{}", quiet_scatter(&even));
        // Off by 2 px for six hours every other day.
        let off = |n: u32| if n % 192 < 24 { 2.0 } else { 0.0 };
        let jerky: Vec<_> = (0..960).map(|n| (quarter(n), Vector4::repeat(off(n)))).collect();
        let scatter_px = quiet_scatter(&jerky);
        let mut test = Sequential::new(WIDTH_PX);
        let alarms = |test: &mut Sequential, scatter_px: &Vector4<f64>| {
            jerky.iter().any(|(at, off)| test.step(*at, off, scatter_px).alarms[0])
        };
        assert!(!alarms(&mut test, &scatter_px));
        assert!(alarms(&mut Sequential::new(WIDTH_PX), &(0.4 * scatter_px)));
        assert_eq!(quiet_scatter(&[]), Vector4::zeros());
    }

    /// Hours until a step is found, with estimates every quarter of an hour.
    fn hours(step_px: f64) -> Option<f64> {
        let mut test = Sequential::new(WIDTH_PX);
        let scatter_px = Vector4::repeat(0.15);
        (0..400).map(f64::from).find_map(|i| {
            let off = Vector4::new(0.0, -step_px, 0.0, 0.0);
            let verdict = test.step(i * 900.0, &off, &scatter_px);
            verdict.alarms[1].then_some(i / 4.0)
        })
    }

    #[test]
    fn larger_steps_are_found_sooner_and_small_ones_never() {
        assert_eq!(hours(0.5), None);
        let one = hours(1.0).expect("found");
        assert!((10.0..24.0).contains(&one), "{one}");
        assert!(hours(2.0).expect("found") <= 0.75);
        let test = Sequential::new(WIDTH_PX);
        let visible_px = test.smallest_visible_px(&Vector4::repeat(0.15))[0];
        assert!(hours(visible_px).expect("found") < 48.0);
    }

    #[test]
    fn a_camera_that_comes_back_is_back_after_a_day() {
        let mut test = Sequential::new(WIDTH_PX);
        let scatter_px = Vector4::repeat(0.15);
        let mut step = |i: u32, off_px: f64| {
            let off = Vector4::new(off_px, 0.0, 0.0, 0.0);
            test.step(f64::from(i) * 900.0, &off, &scatter_px)
        };
        let mut moved = step(0, 3.0);
        for i in 1..192 {
            moved = step(i, 3.0);
        }
        assert!(moved.alarms[0]);
        assert!((moved.level_px[0] - 3.0).abs() < 1e-12);
        // The first estimate represents no time yet.
        assert_eq!(moved.since_secs, Some(900.0));
        let back = (192..320).find(|i| !step(*i, 0.0).alarms[0]).expect("back");
        assert!(f64::from(back - 192) * 900.0 < 30.0 * HOUR_SECS);
    }

    #[test]
    fn a_jump_near_the_cut_stays_told_until_the_camera_is_pushed_back() {
        let mut test = Sequential::new(WIDTH_PX);
        let scatter_px = Vector4::repeat(0.15);
        let cut_px = CLIP * test.scale_px(&scatter_px)[0];
        let mut is_off = |i: u32, pan_px: f64| {
            let chance_px = 0.3 * (f64::from((i * 7919) % 97) / 97.0 - 0.5);
            let off_px = Vector4::new(pan_px + chance_px, 0.0, 0.0, 0.0);
            test.step(f64::from(i) * 900.0, &off_px, &scatter_px).alarms[0]
        };
        assert!((0..96).all(|i| !is_off(i, 0.0)));
        let told = (96..192).find(|i| is_off(*i, 1.05 * cut_px)).expect("told");
        assert!(told < 96 + 12, "{told}");
        assert!((told + 1..288).all(|i| is_off(i, 1.05 * cut_px)));
        let back = (288..400).find(|i| !is_off(*i, 0.0)).expect("back");
        assert!(back <= 288 + 12, "{back}");
    }
}
