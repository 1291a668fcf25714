//! Guidance: the gain of a view, and the next pose.
//!
//! Pure functions of numbers: equal views, lens estimate and parameters give equal answers, live or
//! replayed. One file a stage; each uses only files above it:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | [`params`], [`slots`], [`refusal`], [`rules`] | settings, directions, reasons, version? | |
//! | [`view`] | measurements from a picture? | [`Refusal::NoLine`], [`Refusal::OutsideLens`] |
//! | [`independence`] | new principal line, or missing partner? | an opposed pair counts as one |
//! | [`information`], [`gain`] | how much new information, and enough? | no pose fits: nothing |
//! | [`hand_motion`], [`motion`] | motion of the board? | nothing to compare: none |
//! | [`readout`] | readout time, corners at one instant? | no motion yet: a prior |
//! | [`hold`] | when to take a pose, and which frame? | a photograph at once |
//! | [`stop`] | are we done? | never before two opposed pairs |
//! | [`wanted_pose`] | pose of a given direction and tilt? | doesn't fit: no pose |
//! | `poses` | the reflected pair of most gain? | directions used up: no pair |
//! | [`target`] | next pose, and its place on the screen? | no calibration yet: a guess |
//! | [`mod@reach`] | precision with a small board? | fits nowhere: not known |
//! | [`advice`] | the one action to ask for now? | |

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
pub use gain::{Knowledge, UsualError, wanted_share};
pub(crate) use gain::{is_enough, newness};
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
pub use stop::{Lack, Precision, Progress, forecast, progress, views_by_noise};
pub(crate) use stop::{final_progress, lack};
pub(crate) use target::target_at;
pub use target::{Purpose, Target, next_target};
pub use view::{LensEstimate, View, measure};
pub(crate) use wanted_pose::posed_board;
