//! Parameters of the simulated person.

/// Quickness, precision and steadiness of the person. [`Person`](super::Person) has several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TechnicianParams {
    /// Mean time from seeing a new cue to acting on it.
    pub reaction_secs: f64,
    /// Largest relative change of the reaction time from one cue to the next.
    pub reaction_spread: f64,
    /// Time to read a word of the advice; 0 for a person who only looks at the ghost.
    pub reading_secs_per_word: f64,
    /// Average time between two glances away from the screen; 0 for a person who never looks away.
    pub look_away_every_secs: f64,
    /// Largest angle by which a pose is missed at first.
    pub rotation_error_rad: f64,
    /// Largest error of a pose in the picture at the first attempt.
    pub lateral_error_px: f64,
    /// Largest relative error of the distance at first.
    pub distance_error: f64,
    /// Mean overshoot of the board on arrival, relative to the way.
    pub overshoot: f64,
    /// Top speed of the board's centre.
    pub max_speed_m_per_s: f64,
    /// Top speed of turning.
    pub max_turn_rad_per_s: f64,
    /// Support of the board; decides the meaning of `tremor_m` and `tremor_rad`.
    pub support: Support,
    /// Rms sway along each axis.
    pub sway_m: f64,
    /// Rms sway about each axis.
    pub sway_rad: f64,
    /// Hands: rms tremor along each axis at 8–12 Hz. Tripod: amplitude of its shaking at 0.3–3 Hz.
    pub tremor_m: f64,
    /// Tremor or shaking about each axis, as `tremor_m` along it.
    pub tremor_rad: f64,
    /// Distance that the board sinks while it is held in place.
    pub sink_m: f64,
    /// Growth of sway, tremor and sinking per second since the last rest, relative to a rested person's.
    pub tiring_per_sec: f64,
    /// The person lowers the board and rests if a view is taken this long after the last rest, and at
    /// twice this time without one; 0 for a person who never rests.
    pub rest_after_secs: f64,
    /// Time for which a pose that is not taken is held before it's corrected.
    pub patience_secs: f64,
    /// The next attempt's error relative to the last one's.
    pub correction: f64,
    /// Width of the squares' grid in the picture at the start, relative to the picture's.
    pub start_width: f64,
    /// The person doesn't look at the screen, and shows the board in another way every 1.5 to 3 s: tilted by 0 to 40°, the
    /// grid 0.3 to 0.7 of the picture wide, near its middle.
    pub wanders: bool,
    /// The person hears the sentences, but doesn't see the ghost.
    pub hears_only: bool,
    /// Time for which the person walks away with the board, once, after 3 to 12 s; 0 for a person who stays.
    pub leaves_for_secs: f64,
    /// Mean time until a hand covers a part of the board for 1 to 2 s; 0 for a person who never does that.
    pub covers_every_secs: f64,
}

/// Support of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Two hands: they sway and tremble.
    Hands,
    /// A tripod: it shakes a little and slowly.
    Tripod,
}
