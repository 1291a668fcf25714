//! Sentences around the demonstration.

/// Sentence before the demonstration.
pub const BEGINNING: &str = "SIMULATED: a simulated person follows the guidance in front of a simulated webcam. What you read is what a person reads and hears with a real one.";

/// Sentence before the demonstration of several cameras.
pub const BEGINNING_RIG: &str = "\
SIMULATED: a board on a tripod in front of two simulated cameras, 120 mm apart. What you read is \
what a person reads and hears with real ones.";

/// Sentence after the result.
pub const WHAT_NOW: &str = "\
That was a simulation. With your own camera:
  boresight target --paper a4     print a board
  boresight                       start a session";
