//! Parameters of the simulated person.

/// Speed, precision and steadiness of the person; [`Person`](super::Person) has presets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TechnicianParams {
    /// Mean time from seeing a cue to acting.
    pub reaction_secs: f64,
    /// Largest relative change of the reaction time between cues.
    pub reaction_spread: f64,
    /// Time to read a word of the advice; 0 for a person who only looks at the ghost.
    pub reading_secs_per_word: f64,
    /// Average time between two glances away from the screen; 0 for a person who never looks away.
    pub look_away_every_secs: f64,
    /// Largest initial rotation error of a pose.
    pub rotation_error_rad: f64,
    /// Largest initial error of a pose in the picture.
    pub lateral_error_px: f64,
    /// Largest initial relative error of the distance.
    pub distance_error: f64,
    /// Mean overshoot of the board on arrival, relative to the distance moved.
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
    /// Tremor or shaking about each axis, like `tremor_m`.
    pub tremor_rad: f64,
    /// Distance by which a held board sinks.
    pub sink_m: f64,
    /// Growth of sway, tremor and sinking per second since the last rest, relative to a rested
    /// person's.
    pub tiring_per_sec: f64,
    /// Time after the last rest at which a taken view makes the person lower the board and rest; at
    /// twice this time the person rests in any case. 0 for a person who never rests.
    pub rest_after_secs: f64,
    /// Holding time of a pose before a correction, if no view is taken.
    pub patience_secs: f64,
    /// Error of the next attempt relative to the previous attempt.
    pub correction: f64,
    /// Width of the squares' grid in the picture at the start, relative to the picture's width.
    pub start_width: f64,
    /// True for a person who doesn't look at the screen, and changes the board's pose every 1.5 to
    /// 3 s: tilted by 0 to 40°, the grid 0.3 to 0.7 of the picture wide, near its middle.
    pub wanders: bool,
    /// True for a person who hears the sentences, but doesn't see the ghost.
    pub hears_only: bool,
    /// Duration of walking away with the board, once, after 3 to 12 s; 0 for a person who stays.
    pub leaves_for_secs: f64,
    /// Mean time until a hand covers a part of the board for 1 to 2 s; 0 for never.
    pub covers_every_secs: f64,
}

/// Support of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Support {
    /// Two hands, with sway and tremor.
    Hands,
    /// Tripod, with slight and slow shaking.
    Tripod,
}
