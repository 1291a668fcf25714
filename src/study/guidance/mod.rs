//! What is each way of guiding a person worth?
//!
//! The same simulated person, camera, corner noise and budget of views for every strategy. After each view
//! that counts the lens is adjusted and compared with the truth. Two lenses: one that the model fits, and one
//! that is more than the model.

mod comparison;
mod race;
mod strategy;

pub use comparison::outcome;
pub use race::{Course, Mark, run};
pub use strategy::{STRATEGIES, Situation, Strategy};

use serde::{Deserialize, Serialize};

use super::{parallel, params::Params};

/// All runs of one strategy on one course.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// [`Strategy::code`].
    pub strategy: String,
    /// [`Course::code_of`].
    pub course: String,
    /// Marks of each run, one a view.
    pub runs: Vec<Vec<Mark>>,
}

/// Parts of the comparison: strategy and course by index.
pub fn parts() -> Vec<(usize, usize)> {
    let strategies = 0..STRATEGIES.len();
    strategies
        .flat_map(|strategy| (0..Course::COUNT).map(move |course| (strategy, course)))
        .collect()
}

/// Runs one part; `done` is called after each finished run, from any thread.
pub fn runs(params: &Params, part: (usize, usize), done: &(dyn Fn() + Sync)) -> Option<Runs> {
    let strategy = STRATEGIES.get(part.0)?;
    let code = Course::code_of(part.1);
    let runs = parallel::map(params.guidance_runs, |index| {
        let course = Course::random(part.1, params, index as u64);
        let marks = run(&course, strategy, params, index as u64);
        done();
        marks
    });
    Some(Runs { strategy: strategy.code.into(), course: code.into(), runs })
}
