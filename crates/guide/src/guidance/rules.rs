//! Version of the rules by which views are taken.
//!
//! A recording keeps its decisions and its views under all later rules. Where the rules have changed since, replaying
//! it finds other decisions, and says why.

/// Version of the present rules.
///
/// | version | since |
/// |---|---|
/// | 1 | the first release |
/// | 2 | still is judged by the smear during the exposure, not by speed; a hold fades; size is no gate but a price; any open direction is taken; tilt 10° to 65° |
/// | 3 | a frame is taken for its gain beside that of the pose asked for, the less the longer nothing came: tilt, size, place, blur and motion are prices; principal lines only need to differ significantly; a rolling shutter's shear is corrected; any pose of one grid is asked for, for 7 s |
/// | 4 | the pose asked for counts as this hand would show it; a view that looks like an accepted one tells little; frames of one hold are alike within 2.5 % of the width |
/// | 5 | only in the pose asked for, or a hand that has stopped, is asked to hold still; a hold outlasts the time after which another pose is asked for |
/// | 6 | a board that turns about its middle moves, and a tipping one's corners are corrected by its plane's motion |
/// | 7 | the goals for the principal point and the picture's corners give way to the error of this camera's corners |
pub const RULES: u32 = 7;
