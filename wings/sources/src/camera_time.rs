//! A camera's timestamps on this computer's clock.

/// Largest drift between the two clocks, as a share of the elapsed time: far above that of
/// crystals.
const DRIFT: f64 = 200e-6;

/// Estimates the offset between the clocks from delayed pictures: none comes before it was taken,
/// so the smallest difference seen is nearest to the offset. The remainder is the shortest delay of
/// a picture, a few milliseconds and constant. After a camera's clock jumps back, the offset is
/// estimated again.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CameraTime {
    /// This computer's time less the camera's, and the camera's time at that moment, in
    /// nanoseconds.
    found: Option<(f64, u64)>,
}

impl CameraTime {
    /// The camera's time `camera_nanos` on this computer's clock, for a picture received by
    /// `now_nanos`.
    pub(super) fn here(&mut self, camera_nanos: u64, now_nanos: u64) -> u64 {
        let difference = now_nanos as f64 - camera_nanos as f64;
        let known = self.found.filter(|(_, then)| camera_nanos >= *then);
        let found = known.map_or(difference, |(known, then)| {
            difference.min(known + DRIFT * (camera_nanos - then) as f64)
        });
        self.found = Some((found, camera_nanos));
        ((camera_nanos as f64 + found).max(0.0) as u64).min(now_nanos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: u64 = 1_000_000;

    #[test]
    fn pictures_that_come_late_keep_the_times_at_which_they_were_taken() {
        let mut clock = CameraTime::default();
        // 25 pictures a second, some up to 30 ms late; the camera's clock began 1000 s ago and runs
        // 50 ppm fast.
        let late = [12, 4, 9, 30, 5, 4, 18, 6, 4, 25];
        let mut worst = 0;
        for at in 0..500_u64 {
            let taken = 7_000_000 * MILLISECOND + 40 * at * MILLISECOND;
            let by_camera = 1_000_000 * MILLISECOND + 40 * at * MILLISECOND * 1_000_050 / 1_000_000;
            let come = taken + late[at as usize % late.len()] * MILLISECOND;
            let here = clock.here(by_camera, come);
            assert!(here <= come);
            if at > 10 {
                worst = worst.max((taken + 4 * MILLISECOND).abs_diff(here));
            }
        }
        assert!(worst < MILLISECOND / 10, "{worst} ns");
    }

    #[test]
    fn a_clock_that_was_set_back_goes_on() {
        let mut clock = CameraTime::default();
        assert_eq!(clock.here(1000 * MILLISECOND, 50 * MILLISECOND), 50 * MILLISECOND);
        assert_eq!(clock.here(400 * MILLISECOND, 90 * MILLISECOND), 90 * MILLISECOND);
    }
}
