//! Rest of the board in the pictures of one camera.

use nalgebra::Point2;

use crate::{guidance::hold::LONGEST_STEP_SECS, session::LiveView};
use boresight_geometry::frame::CaptureTime;

/// Speed of the corners below which a board rests, in picture widths per second. Pictures of two
/// cameras without a trigger are up to a frame apart: at 30 pictures per second, corners in a
/// picture 1280 pixels wide then differ by at most 0.2 px.
const REST_WIDTHS_PER_SEC: f64 = 0.005;

/// Newest board in a camera's pictures, and the time that it has rested.
#[derive(Clone, Debug, Default)]
pub(super) struct Rest {
    newest_at: Option<CaptureTime>,
    /// Corners in the newest frame; `None` without a board.
    pub(super) corners_px: Option<Vec<Point2<f64>>>,
    /// Seconds at rest, up to the newest frame.
    pub(super) secs: f64,
}

impl Rest {
    /// Notes a frame in a picture `width_px` wide. Returns false for a frame already noted.
    pub(super) fn note(&mut self, live: &LiveView, width_px: f64, widths_per_sec: f64) -> bool {
        let before = self.newest_at.replace(live.captured_at);
        if before == Some(live.captured_at) {
            return false;
        }
        let step_secs = before.map_or(0.0, |before| live.captured_at.secs_since(before));
        let rests = live.speed_px_per_s.map(|speed| speed <= widths_per_sec * width_px);
        self.corners_px = live.corners_px.clone().ok();
        self.secs = match (&self.corners_px, rests) {
            (Some(_), Some(true)) => self.secs + step_secs.clamp(0.0, LONGEST_STEP_SECS),
            // Nothing to compare with.
            (Some(_), None) => self.secs,
            _ => 0.0,
        };
        true
    }
}

/// Limit of the speed at rest: cameras with one trigger see a moving board at one moment.
pub(super) fn limit_widths_per_sec(is_synchronised: bool) -> f64 {
    if is_synchronised { crate::guidance::HOLD_WIDTHS_PER_SEC } else { REST_WIDTHS_PER_SEC }
}

/// Root mean square distance of corners, in pixels; infinite for different boards.
pub(super) fn apart_px(one: &[Point2<f64>], other: &[Point2<f64>]) -> f64 {
    if one.len() != other.len() || one.is_empty() {
        return f64::INFINITY;
    }
    let sum: f64 = one.iter().zip(other).map(|(a, b)| (a - b).norm_squared()).sum();
    (sum / one.len() as f64).sqrt()
}
