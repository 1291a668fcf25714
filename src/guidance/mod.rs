//! What is this view worth, and which pose should come next?
//!
//! Pure functions of numbers: equal views, lens estimate and parameters give equal answers, live or replayed.
//! One file a stage; each uses only files above it:
//!
//! | stage | question | degenerate case |
//! |---|---|---|
//! | [`params`], [`slots`], [`refusal`] | which limits, which directions, which reasons? | |
//! | [`view`] | what does this picture of the board measure? | too frontal for a principal line: [`Refusal::NoLine`]; beyond the lens model's fold: [`Refusal::OutsideLens`] |
//! | [`mod@gate`] | is it good enough to be used at all? | every refusal carries what was measured and what is wanted |
//! | [`independence`] | does its principal line add anything? | an opposed pair is parallel by design and counts as one |
//! | [`stillness`] | is the board held still? | photographs are still by definition |
//! | [`stop`] | are we done? | never before every view has its partner |
//! | [`wanted_pose`] | where must the board stand to show a wanted direction, tilt and size? | it doesn't fit into the picture: no pose |
//! | [`information`] | which reflected pair is most informative? | directions used up: no pair |
//! | [`target`] | which pose next, and where on the screen? | no calibration yet: the picture's centre and a usual focal length |
//! | [`advice`] | which one thing should the person do now? | |

pub mod advice;
pub mod gate;
pub mod independence;
pub mod information;
pub mod params;
pub mod refusal;
pub mod slots;
pub mod stillness;
pub mod stop;
pub mod target;
pub mod view;
pub mod wanted_pose;

pub use advice::{Advice, advise};
pub use gate::gate;
pub use independence::{Role, partner_of, role_of};
pub use params::{BoardRoll, GuidanceParams, Plan};
pub use refusal::Refusal;
pub use slots::{SLOTS_DEG, direction_difference_rad};
pub use stillness::{Hold, MotionWindow};
pub use stop::{Precision, Progress, final_progress, forecast, progress};
pub use target::{Purpose, Target, next_target};
pub use view::{LensEstimate, View, measure};
