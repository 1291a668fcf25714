//! Sentences around the demonstration.

/// Sentence before the demonstration.
pub const BEGINNING: &str =
    "SIMULATED: person, board and webcam. You read what a person reads and hears.";

/// Sentence before the demonstration of several cameras.
pub const BEGINNING_RIG: &str =
    "SIMULATED: two cameras, 120 mm apart, and a board on a tripod. You read what a person does.";

/// Sentence after the result.
pub const WHAT_NOW: &str = "\
That was a simulation. With your own camera:
  boresight target --paper a4     print a board
  boresight                       start a session";
