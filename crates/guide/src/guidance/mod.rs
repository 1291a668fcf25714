//! Guidance: the worth of a view, and the pose that should come next.
//!
//! Pure functions of numbers: equal views, lens estimate and parameters give equal answers, live or replayed.
//! One file a stage; each uses only files above it:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | [`params`], [`slots`], [`refusal`], [`rules`] | which limits, which directions, which reasons, which version of them? | |
//! | [`view`] | what does this picture of the board measure? | too frontal for a principal line: [`Refusal::NoLine`]; beyond the lens model's fold: [`Refusal::OutsideLens`] |
//! | [`mod@gate`] | is it good enough to be used at all? | every refusal carries what was measured and what is wanted |
//! | [`independence`] | does its principal line add anything? | an opposed pair is parallel by design and counts as one |
//! | [`information`], [`worth`] | how much does it tell about the lens? | no pose fits the corners: nothing |
//! | [`motion`], [`exposure`] | how did the board move, and how long is the shutter open? | nothing to compare with: no motion; nothing moved yet: a usual exposure |
//! | [`stillness`], [`hold`] | is the picture sharp enough, and when is which frame taken? | photographs are still by definition |
//! | [`stop`] | are we done? | never before every view has its partner |
//! | [`wanted_pose`] | where must the board stand to show a wanted direction and tilt? | it doesn't fit into the picture: no pose |
//! | [`mod@reach`] | how precise can a calibration become if the board stays small? | it fits nowhere: not known |
//! | [`candidates`] | which reflected pair is most informative? | directions used up: no pair |
//! | [`beyond_edge`] | at which poses does a part of the board leave the picture? | no view yet, or boards stay small: none |
//! | [`covering`] | which pair covers most of what no board has covered, or tells most of the picture's corners? | none: no pair |
//! | [`target`] | which pose next, and where on the screen? | no calibration yet: the picture's centre and a usual focal length |
//! | [`advice`] | which one thing should the person do now? | |

pub mod advice;
pub mod beyond_edge;
pub mod candidates;
pub mod covering;
pub mod exposure;
pub mod gate;
pub mod hold;
pub mod independence;
pub mod information;
pub mod motion;
pub mod params;
pub mod reach;
pub mod refusal;
pub mod rules;
pub mod slots;
pub mod stillness;
pub mod stop;
pub mod target;
pub mod view;
pub mod wanted_pose;
pub mod worth;

pub use advice::{Advice, advise};
pub use covering::covering_share;
pub use exposure::ExposureEstimate;
pub use gate::gate;
pub use hold::{HeldFrame, Hold};
pub use independence::{Role, partner_of, role_of};
pub use motion::{Motion, MotionWindow, Scatter};
pub use params::{BoardRoll, GuidanceParams, Plan};
pub use reach::{Reach, reach};
pub use refusal::Refusal;
pub use rules::RULES;
pub use slots::{direction_difference_rad, slots_deg};
pub use stillness::{Patience, Smear, StillLimits, still};
pub use stop::{Precision, Progress, final_progress, forecast, progress};
pub use target::{Purpose, Target, covering_target, next_target};
pub use view::{LensEstimate, View, measure};
pub use worth::Knowledge;
