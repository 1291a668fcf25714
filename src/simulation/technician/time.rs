//! Capture times, some seconds on.

use crate::frame::CaptureTime;

/// `secs` after `time`; no negative times, and at most the clock's last.
pub(super) fn after(time: CaptureTime, secs: f64) -> CaptureTime {
    CaptureTime { nanos: time.nanos.saturating_add((secs.max(0.0) * 1e9).round() as u64) }
}
