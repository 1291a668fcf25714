//! Comparison of ways to guide a person.
//!
//! The same simulated person, cameras, corner noise, visible margin and hold for every strategy. After each view that
//! counts, the lens is fitted and compared with the truth; after four and eight views it's also calibrated as the program
//! does it. Three lenses: one that the fitted model describes, and two that are more than the model.
//!
//! | file | holds |
//! |---|---|
//! | `course` | the lenses, and what is to be reached |
//! | `situation`, `strategy` | what a strategy knows, and the strategies |
//! | `hand`, `accept` | where a person brings the board, how long that takes, and whether the view counts |
//! | `estimate`, `race` | the lens after each view; one run |
//! | `limit` | the best poses of all, which no strategy can beat |
//! | `summary`, `claims`, `comparison` | what all runs say: medians and intervals; in words; as tables and figures |

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
    /// Stable name, also of its file.
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

/// Runs one part; `done` is called after each finished run, from any thread. `None` for a part that isn't one.
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
