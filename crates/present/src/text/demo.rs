//! Sentences around the demonstration.

/// Sentence before the demonstration.
pub const BEGINNING: &str = "SIMULATED: a simulated person follows the guidance in front of a simulated webcam. What you read is what a person reads and hears with a real one.";

/// Sentence after the result.
pub const WHAT_NOW: &str = "\
That was a simulation. With your own camera:
  boresight target --paper a4     print a board
  boresight                       start a session";
