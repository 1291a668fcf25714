//! Capture times and seconds.

use boresight_geometry::frame::CaptureTime;

/// Time `secs` after `time`; negative `secs` count as 0, and the result is at most the clock's last
/// time.
pub(super) fn after(time: CaptureTime, secs: f64) -> CaptureTime {
    CaptureTime { nanos: time.nanos.saturating_add((secs.max(0.0) * 1e9).round() as u64) }
}
