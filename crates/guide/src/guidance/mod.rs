//! Guidance: the gain of a view, and the next pose.
//!
//! Pure functions of numbers: equal views, lens estimate and parameters give equal answers, live or
//! replayed. One file a stage; each uses only files above it:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | `params`, `slots`, `refusal`, `rules` | settings, directions, reasons, version? | |
//! | `view` | measurements from a picture? | [`Refusal::NoLine`], [`Refusal::OutsideLens`] |
//! | `independence` | new principal line, or missing partner? | an opposed pair counts as one |
//! | `information`, `gain` | how much new information, and enough? | no pose fits: nothing |
//! | `hand_motion`, `motion` | motion of the board? | nothing to compare: none |
//! | `readout` | readout time, corners at one instant? | no motion yet: a prior |
//! | `hold` | when to take a pose, and which frame? | a photograph at once |
//! | `stop` | are we done? | never before two opposed pairs |
//! | `wanted_pose` | pose of a given direction and tilt? | doesn't fit: no pose |
//! | `poses` | the reflected pair of most gain? | directions used up: no pair |
//! | `target` | next pose, and its place on the screen? | no calibration yet: a guess |
//! | `reach` | precision with a small board? | fits nowhere: not known |
//! | `advice` | the one action to ask for now? | |

mod advice;
mod gain;
#[doc(hidden)]
pub mod hand_motion;
pub(super) mod hold;
mod independence;
#[doc(hidden)]
pub mod information;
mod motion;
mod params;
mod poses;
mod reach;
mod readout;
mod refusal;
mod rules;
mod slots;
mod stop;
mod target;
#[doc(hidden)]
pub mod view;
#[doc(hidden)]
pub mod wanted_pose;

#[doc(hidden)]
pub use advice::{Advice, Hand};
pub(crate) use advice::{Difference, advise};
#[doc(hidden)]
pub use gain::{Knowledge, UsualError, wanted_share};
pub(crate) use gain::{is_copy, is_enough, newness, pose_of};
#[doc(hidden)]
pub use hand_motion::Velocity;
#[doc(hidden)]
pub use hold::{HeldFrame, Hold};
pub use independence::Role;
pub(crate) use independence::partner_of;
#[doc(hidden)]
pub use independence::role_of;
#[doc(hidden)]
pub use motion::{HOLD_WIDTHS_PER_SEC, Motion, MotionWindow, Scatter};
pub(crate) use params::FAR_SPAN_FRACTION;
#[doc(hidden)]
pub use params::PAIRS_BEYOND_EDGE;
pub use params::{BoardRoll, GuidanceParams, Plan};
#[doc(hidden)]
pub use reach::{Reach, reach};
#[doc(hidden)]
pub use readout::Readout;
pub use refusal::Refusal;
#[doc(hidden)]
pub use rules::RULES;
#[doc(hidden)]
pub use slots::direction_difference_rad;
pub use stop::{Lack, Precision, Progress};
pub(crate) use stop::{final_progress, lack};
#[doc(hidden)]
pub use stop::{forecast, progress, views_by_noise};
#[doc(hidden)]
pub use target::next_target;
pub(crate) use target::target_at;
pub use target::{Purpose, Target};
#[doc(hidden)]
pub use view::{LensEstimate, View, measure};
pub(crate) use wanted_pose::posed_board;
