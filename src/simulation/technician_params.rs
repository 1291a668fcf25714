//! What the simulated person is like.

/// How quick, exact and steady the person is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TechnicianParams {
    /// From seeing a new cue to acting on it.
    pub reaction_secs: f64,
    /// Largest angle by which a pose is missed at first.
    pub rotation_error_rad: f64,
    /// Largest distance in the picture by which a pose is missed at first.
    pub lateral_error_px: f64,
    /// Largest relative error of the distance at first.
    pub distance_error: f64,
    /// Top speed of the board's centre.
    pub max_speed_m_per_s: f64,
    /// Top speed of turning.
    pub max_turn_rad_per_s: f64,
    /// Amplitude of the hand's tremor along each axis.
    pub tremor_m: f64,
    /// Amplitude of the hand's tremor about each axis.
    pub tremor_rad: f64,
    /// How long to hold a pose that is not taken before correcting it.
    pub patience_secs: f64,
    /// The next attempt's error relative to the last one's.
    pub correction: f64,
    /// Width of the squares' grid in the picture at the start, relative to the picture's.
    pub start_width: f64,
}

impl Default for TechnicianParams {
    fn default() -> Self {
        Self {
            reaction_secs: 0.4,
            rotation_error_rad: 4.0_f64.to_radians(),
            lateral_error_px: 20.0,
            distance_error: 0.04,
            max_speed_m_per_s: 0.5,
            max_turn_rad_per_s: 60.0_f64.to_radians(),
            tremor_m: 0.000_15,
            tremor_rad: 0.000_4,
            patience_secs: 2.0,
            correction: 0.6,
            start_width: 0.4,
        }
    }
}
