//! Comparison of ways to guide a person.
//!
//! Person, cameras, corner noise, visible margin and hold are the same for every strategy. After
//! each counted view, the lens is fitted and compared with the truth; after four and eight views
//! it's also calibrated as in the program. There are three lenses: one within the fitted model, and
//! two beyond it.
//!
//! | file | holds |
//! |---|---|
//! | `course` | the lenses, and the goals |
//! | `situation`, `strategy` | knowledge of a strategy, and the strategies |
//! | `hand`, `accept` | pose and time of a person's movement; acceptance of the view |
//! | `estimate`, `race` | the lens after each view; one run |
//! | `limit` | the best poses of all, a limit for every strategy |
//! | `summary`, `claims`, `comparison` | all runs: medians and intervals; words; tables |

mod accept;
mod claims;
mod comparison;
mod course;
mod estimate;
mod hand;
mod limit;
mod race;
mod situation;
mod strategy;
mod summary;

pub use accept::Accept;
pub use comparison::outcome;
pub use course::{Course, TrueLens};
pub use estimate::Errors;
pub use race::{Mark, run};
pub use situation::Situation;
pub use strategy::{STRATEGIES, Strategy};
pub use summary::Runs;

use super::{
    parallel,
    params::{Hand, Params},
};

/// Part of the comparison: all runs of a strategy, by index, with one lens and one hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    strategy: usize,
    course: usize,
    hand: Hand,
}

impl Part {
    /// Stable name, also used for the file.
    pub fn name(&self) -> String {
        let Self { strategy, course, hand } = self;
        let code = STRATEGIES.get(*strategy).map_or("unknown", |strategy| strategy.code);
        let lens = Course::CODES.get(*course).copied().unwrap_or("unknown");
        format!("guidance-{code}-{lens}-{}", hand.code())
    }
}

/// All parts of the comparison.
pub fn parts(params: &Params) -> Vec<Part> {
    let mut parts = Vec::new();
    for hand in &params.guidance_hands {
        for course in 0..Course::CODES.len() {
            for strategy in 0..STRATEGIES.len() {
                parts.push(Part { strategy, course, hand: *hand });
            }
        }
    }
    parts
}

/// Runs of a part; `done` is called after each finished run, from any thread. `None` for an invalid
/// part.
pub fn runs(params: &Params, part: Part, done: &(dyn Fn() + Sync)) -> Option<Runs> {
    let strategy = STRATEGIES.get(part.strategy)?;
    let code = Course::CODES.get(part.course)?;
    let runs = parallel::map(params.guidance_runs, |index| {
        let course = Course::random(part.course, params, index as u64);
        let marks = run(&course, strategy, part.hand, params, index as u64);
        done();
        marks
    });
    Some(Runs { strategy: strategy.code.into(), course: (*code).into(), hand: part.hand, runs })
}
