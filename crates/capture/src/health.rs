//! Health of a stream: checks if its pictures look like a working camera's.

use image::GrayImage;

use boresight_geometry::device::{CameraEvent, Fault};

/// Pixels sampled in each direction: enough to tell light from dark.
const SAMPLES: u32 = 48;
/// Time of equal bytes to count as frozen: every sensor has noise.
const FROZEN_NANOS: u64 = 2_000_000_000;
/// Largest mean and largest sample of pictures behind a closed shutter, and their duration.
const DARK_MEAN: f64 = 14.0;
const DARK_LARGEST: u8 = 34;
const DARK_NANOS: u64 = 1_500_000_000;
/// Alternation of an infrared camera's lamp: least change of the mean, and least number of changes
/// in a row.
const LAMP_CHANGE: f64 = 18.0;
const LAMP_TIMES: u32 = 16;
/// Time over which rates are measured, and the shares of the promised rate that begin and end a
/// doubt.
const RATE_NANOS: u64 = 3_000_000_000;
const SLOW_BELOW: f64 = 0.8;
const SLOW_UNTIL: f64 = 0.9;
/// Frames over which damage is judged.
const DAMAGE_FRAMES: u32 = 30;

/// Watches a stream.
#[derive(Clone, Debug, Default)]
pub(super) struct Health {
    doubts: std::collections::BTreeSet<Fault>,
    changes: Vec<CameraEvent>,
    last_checksum: Option<u32>,
    same_since: Option<u64>,
    dark_since: Option<u64>,
    last_mean: Option<f64>,
    last_change: f64,
    lamp_times: u32,
    lit_evenly: u32,
    rate_from: Option<u64>,
    came: u64,
    judged: u32,
    damaged: u32,
}

impl Health {
    /// Doubts that began or ended since the last call, in order.
    pub(super) fn changes(&mut self) -> Vec<CameraEvent> {
        std::mem::take(&mut self.changes)
    }

    /// True if the frame with bytes of the given `checksum` repeats the frame before: nothing new
    /// to look at.
    pub(super) fn repeats(&mut self, checksum: u32, now_nanos: u64) -> bool {
        let repeats = self.last_checksum == Some(checksum);
        self.last_checksum = Some(checksum);
        if !repeats {
            self.same_since = None;
            self.doubt(Fault::Frozen, None);
            return false;
        }
        let since = *self.same_since.get_or_insert(now_nanos);
        if now_nanos.saturating_sub(since) >= FROZEN_NANOS {
            self.doubt(Fault::Frozen, Some(String::new()));
        }
        true
    }

    /// Looks at a good picture.
    pub(super) fn look(&mut self, image: &GrayImage, now_nanos: u64) {
        let (mean, largest) = light(image);
        if mean < DARK_MEAN && largest < DARK_LARGEST {
            let since = *self.dark_since.get_or_insert(now_nanos);
            if now_nanos.saturating_sub(since) >= DARK_NANOS {
                self.doubt(Fault::Dark, Some(String::new()));
            }
        } else {
            self.dark_since = None;
            self.doubt(Fault::Dark, None);
        }
        let change = self.last_mean.map_or(0.0, |last| mean - last);
        if change.abs() > LAMP_CHANGE && change * self.last_change < 0.0 {
            self.lamp_times += 1;
            self.lit_evenly = 0;
        } else if change.abs() < LAMP_CHANGE {
            self.lit_evenly += 1;
            if self.lit_evenly > 2 * LAMP_TIMES {
                self.doubt(Fault::Infrared, None);
            }
            if self.lit_evenly > 2 {
                self.lamp_times = 0;
            }
        }
        if self.lamp_times >= LAMP_TIMES {
            self.doubt(Fault::Infrared, Some(String::new()));
        }
        (self.last_mean, self.last_change) = (Some(mean), change);
    }

    /// Counts `came` frames, `damaged` of them unusable; `rate_hz` is the promised rate.
    pub(super) fn count(&mut self, came: u64, damaged: u32, rate_hz: Option<f64>, now_nanos: u64) {
        self.judged += came as u32;
        self.damaged += damaged;
        if self.judged >= DAMAGE_FRAMES {
            let share = f64::from(self.damaged) / f64::from(self.judged);
            let said = format!("{:.0} %", 100.0 * share);
            if share > 0.5 {
                self.doubt(Fault::DamagedFrames, Some(said));
            } else if share < 0.25 {
                self.doubt(Fault::DamagedFrames, None);
            }
            (self.judged, self.damaged) = (0, 0);
        }
        self.came += came;
        let from = *self.rate_from.get_or_insert(now_nanos);
        let span = now_nanos.saturating_sub(from);
        if span < RATE_NANOS {
            return;
        }
        let measured_hz = self.came as f64 / (span as f64 * 1e-9);
        (self.came, self.rate_from) = (0, Some(now_nanos));
        if let Some(rate_hz) = rate_hz {
            if measured_hz < SLOW_BELOW * rate_hz {
                self.doubt(
                    Fault::Slow,
                    Some(format!("{measured_hz:.0} of {rate_hz:.0} per second")),
                );
            } else if measured_hz > SLOW_UNTIL * rate_hz {
                self.doubt(Fault::Slow, None);
            }
        }
    }

    /// Excuses the time of a busy camera: pictures not sent meanwhile are not missing.
    #[cfg(all(target_os = "linux", feature = "live"))]
    pub(super) fn excuse(&mut self, nanos: u64) {
        if let Some(from) = &mut self.rate_from {
            *from += nanos;
        }
    }

    /// Begins a doubt (`Some`, with details) or ends it.
    pub(super) fn doubt(&mut self, fault: Fault, detail: Option<String>) {
        let (changed, event) = match detail {
            Some(detail) => (self.doubts.insert(fault), CameraEvent::Doubtful { fault, detail }),
            None => (self.doubts.remove(&fault), CameraEvent::Dispelled { fault }),
        };
        if changed {
            self.changes.push(event);
        }
    }
}

/// Mean and largest of a picture's samples.
pub(super) fn light(image: &GrayImage) -> (f64, u8) {
    let (width, height) = image.dimensions();
    let (mut sum, mut largest, mut count) = (0_u64, 0, 0_u64);
    for y in (0..height).step_by((height / SAMPLES).max(1) as usize) {
        for x in (0..width).step_by((width / SAMPLES).max(1) as usize) {
            let value = image.get_pixel(x, y).0[0];
            sum += u64::from(value);
            largest = largest.max(value);
            count += 1;
        }
    }
    (sum as f64 / count.max(1) as f64, largest)
}

/// Mean squared difference between neighbouring pixels of a row: smaller out of focus.
#[cfg(all(target_os = "linux", feature = "live"))]
pub(super) fn sharpness(image: &GrayImage) -> f64 {
    let width = image.width() as usize;
    let step = (image.height() / SAMPLES).max(1) as usize;
    let (mut sum, mut count) = (0_u64, 0_u64);
    for row in image.as_raw().chunks_exact(width.max(1)).step_by(step) {
        for pair in row.windows(2) {
            let change = u64::from(pair[0].abs_diff(pair[1]));
            sum += change * change;
            count += 1;
        }
    }
    sum as f64 / count.max(1) as f64
}
