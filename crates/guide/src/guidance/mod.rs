//! Guidance: the worth of a view, and the pose that should come next.
//!
//! Pure functions of numbers: equal views, lens estimate and parameters give equal answers, live or replayed.
//! One file a stage; each uses only files above it:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | [`params`], [`slots`], [`refusal`], [`rules`] | which settings, which directions, which reasons, which version of them? | |
//! | [`view`] | what does this picture of the board measure? | too frontal for a principal line: [`Refusal::NoLine`]; beyond the lens model's fold: [`Refusal::OutsideLens`] |
//! | [`independence`] | does its principal line differ from the others', or is it a missing partner? | an opposed pair is parallel by design and counts as one |
//! | [`information`], [`gain`] | how much does it tell that the others don't, and is that enough after this long? | no pose fits the corners: nothing |
//! | [`hand_motion`], [`motion`] | how did the board move between frames, and in them? | nothing to compare with: no motion |
//! | [`readout`] | how long does the sensor read, and where were the corners at one instant? | nothing moved yet: a usual time, with its doubt |
//! | [`hold`] | which frame of a held pose is taken, and when? | a photograph at once |
//! | [`stop`] | are we done? | never before two opposed pairs are there |
//! | [`wanted_pose`] | where must the board stand to show a wanted direction and tilt? | it doesn't fit into the picture: no pose |
//! | `poses` | which of all reflected pairs tells most for its effort? | directions used up: no pair |
//! | [`target`] | which pose next, and where on the screen? | no calibration yet: the picture's centre and a usual focal length |
//! | [`mod@reach`] | how precise can a calibration become if the board stays small? | it fits nowhere: not known |
//! | [`advice`] | which one thing should the person do now? | |

pub mod advice;
pub mod gain;
pub mod hand_motion;
pub mod hold;
pub mod independence;
pub mod information;
pub mod motion;
pub mod params;
mod poses;
pub mod reach;
pub mod readout;
pub mod refusal;
pub mod rules;
pub mod slots;
pub mod stop;
pub mod target;
pub mod view;
pub mod wanted_pose;

pub use advice::{Advice, Hand};
pub(crate) use advice::{Difference, advise};
pub(crate) use gain::newness;
pub use gain::{Knowledge, UsualError, wanted_share};
pub use hand_motion::Velocity;
pub use hold::{HeldFrame, Hold};
pub(crate) use independence::partner_of;
pub use independence::{Role, role_of};
pub use motion::{HOLD_WIDTHS_PER_SEC, Motion, MotionWindow, Scatter};
pub use params::{BoardRoll, GuidanceParams, Plan};
pub use reach::{Reach, reach};
pub use readout::Readout;
pub use refusal::Refusal;
pub use rules::RULES;
pub use slots::direction_difference_rad;
pub use stop::{Lack, Precision, Progress, forecast, progress};
pub(crate) use stop::{final_progress, lack};
pub use target::{Purpose, Target, next_target};
pub use view::{LensEstimate, View, measure};
