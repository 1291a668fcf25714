//! Presets of the simulated person.

use serde::{Deserialize, Serialize};

use super::{Support, TechnicianParams};

/// Person by name.
///
/// `Usual` sways by 1.5 mm and 0.5° rms and trembles by 0.14 mm and 0.03° rms, per axis, on an A4
/// board. In windows of 0.3, 0.6, 1 and 2 s the result is 0.5, 0.7, 0.9 and 1.2 mm rms. Public
/// videos show in the quietest twentieth of such windows (larger of the two axes across the line of
/// sight, assuming a board 200 mm wide):
///
/// | video | in the hand | 0.3 s | 0.6 s | 1 s | 2 s |
/// |---|---|---|---|---|---|
/// | live-pose, calibration2.mp4 | board | 0.6 mm | 1.1 mm | 1.3 mm | 2.0 mm |
/// | SimpleAR, chessboard.mp4 | camera | 0.6 mm | 1.4 mm | 2.4 mm | 8.1 mm |
/// | Visual_Impact_Gauge, chessboard.avi | camera | 0.3 mm | 0.7 mm | 1.7 mm | 5.5 mm |
/// | SJ-1011/Camera_Calibration, chessboard.mp4 | camera | 0.2 mm | 0.5 mm | 0.7 mm | 1.8 mm |
/// | soulgpark/CameraCalibration, chessboard.avi | camera | 0.1 mm | 0.2 mm | 0.3 mm | 6.1 mm |
///
/// The last camera is almost at rest. None of these people was asked to hold still, so the longer
/// windows contain intended movements. Errors, overshoot, reaction and glances are estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Person {
    /// Sways half as much as `Usual` and misses by half as much.
    Steady,
    /// An untrained adult with both hands on an A4 board.
    #[default]
    Usual,
    /// Sways almost twice as much as `Usual` and trembles like a nervous or old person.
    Shaky,
    /// Slow, sways more and more, lets the board sink, and rests now and then.
    Tired,
    /// Has the board on a tripod, hardly errs, and looks only at the ghost.
    Tripod,
}

impl Person {
    /// All people.
    pub const ALL: [Self; 5] = [Self::Steady, Self::Usual, Self::Shaky, Self::Tired, Self::Tripod];

    /// Parameters of the person.
    pub fn params(self) -> TechnicianParams {
        let mm = 1e-3;
        let degree = 1_f64.to_radians();
        let usual = TechnicianParams {
            reaction_secs: 0.4,
            reaction_spread: 0.25,
            reading_secs_per_word: 0.25,
            look_away_every_secs: 20.0,
            rotation_error_rad: 10.0 * degree,
            lateral_error_px: 40.0,
            distance_error: 0.15,
            overshoot: 0.1,
            max_speed_m_per_s: 0.5,
            max_turn_rad_per_s: 60.0 * degree,
            support: Support::Hands,
            sway_m: 1.5 * mm,
            sway_rad: 0.5 * degree,
            tremor_m: 0.14 * mm,
            tremor_rad: 0.03 * degree,
            sink_m: 2.0 * mm,
            tiring_per_sec: 0.0,
            rest_after_secs: 0.0,
            patience_secs: 2.0,
            correction: 0.6,
            start_width: 0.4,
            wanders: false,
            hears_only: false,
            leaves_for_secs: 0.0,
            covers_every_secs: 0.0,
        };
        match self {
            Self::Usual => usual,
            Self::Steady => TechnicianParams {
                rotation_error_rad: 5.0 * degree,
                lateral_error_px: 20.0,
                distance_error: 0.08,
                overshoot: 0.05,
                sway_m: 0.75 * mm,
                sway_rad: 0.25 * degree,
                tremor_m: 0.07 * mm,
                tremor_rad: 0.015 * degree,
                sink_m: 1.0 * mm,
                ..usual
            },
            Self::Shaky => TechnicianParams {
                overshoot: 0.15,
                sway_m: 2.5 * mm,
                sway_rad: 1.0 * degree,
                tremor_m: 0.25 * mm,
                tremor_rad: 0.06 * degree,
                sink_m: 4.0 * mm,
                ..usual
            },
            Self::Tired => TechnicianParams {
                reaction_secs: 0.6,
                reading_secs_per_word: 0.35,
                look_away_every_secs: 12.0,
                max_speed_m_per_s: 0.3,
                max_turn_rad_per_s: 40.0 * degree,
                sink_m: 6.0 * mm,
                tiring_per_sec: 0.02,
                rest_after_secs: 45.0,
                ..usual
            },
            Self::Tripod => TechnicianParams {
                reaction_spread: 0.0,
                reading_secs_per_word: 0.0,
                look_away_every_secs: 0.0,
                rotation_error_rad: 4.0 * degree,
                lateral_error_px: 20.0,
                distance_error: 0.04,
                overshoot: 0.0,
                support: Support::Tripod,
                sway_m: 0.0,
                sway_rad: 0.0,
                tremor_m: 0.000_15,
                tremor_rad: 0.000_4,
                sink_m: 0.0,
                ..usual
            },
        }
    }
}

/// The default [`Person`].
impl Default for TechnicianParams {
    fn default() -> Self {
        Person::default().params()
    }
}
