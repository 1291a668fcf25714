//! Reasons for not taking a view.

use serde::Serialize;

/// Reason for not taking a view, with the measured and the required value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "why")]
pub enum Refusal {
    /// No whole board was found.
    NotFound,
    /// The board faces the camera, so has no principal line.
    NoLine,
    /// Corners lie where the lens model has no ray: beyond the radius at which it folds back.
    OutsideLens {
        /// Number of corners without a ray.
        outside: usize,
        /// Number of corners of the board.
        of: usize,
    },
    /// The board is not tilted enough.
    TooFlat {
        /// Tilt of the view.
        tilt_rad: f64,
        /// Requested tilt.
        wanted_rad: f64,
    },
    /// The principal line's direction is too uncertain.
    Unclear {
        /// Standard deviation of the direction.
        sigma_rad: f64,
        /// Largest accepted deviation.
        wanted_rad: f64,
    },
    /// The principal line almost equals an accepted view's, and the view is not its missing
    /// partner.
    AlreadyCovered {
        /// Angle to the nearest accepted principal line.
        nearest_rad: f64,
        /// Least accepted angle.
        wanted_rad: f64,
    },
    /// The view would add little information beside the requested pose. It is taken only if nothing
    /// better comes for a while.
    TellsLittle {
        /// Information of the view over the information of the requested pose.
        worth: f64,
        /// Least share accepted now.
        wanted: f64,
    },
    /// The principal line contradicts the accepted views.
    Inconsistent {
        /// Distance of the line from the principal point, in standard deviations.
        sigmas: f64,
        /// Largest accepted distance, in standard deviations.
        wanted: f64,
    },
    /// The board moves, so the frame loses too much of its gain for now.
    Moving {
        /// Root mean square speed of the corners; `None` without an earlier frame to compare with.
        speed_px_per_s: Option<f64>,
        /// Speed of a calm hand.
        wanted_px_per_s: f64,
    },
    /// The view is good and the hold runs. The view is taken when the hold is complete.
    Holding {
        /// Share of the hold passed, 0 to 1.
        progress: f64,
    },
    /// The picture's size is not the session's.
    OtherSize {
        /// Width and height of the picture.
        size_px: (u32, u32),
        /// Width and height of the session's pictures.
        wanted_px: (u32, u32),
    },
    /// The camera is lost or frozen, or focus or zoom has moved.
    CameraNotReady,
    /// The session is paused or over.
    NotCollecting,
}
