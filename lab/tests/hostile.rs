//! Parameters of a study: what has no problem can be computed.

#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[allow(dead_code, reason = "other targets use the rest")]
#[path = "../../tests/hostile/harness.rs"]
mod harness;
#[allow(dead_code, reason = "other targets use the rest")]
#[path = "../../tests/hostile/mutator.rs"]
mod mutator;

use boresight_lab::Params;

use crate::harness::{only_numbers, run};

#[test]
fn parameters() {
    let seeds = [toml::to_string(&Params::default()).expect("TOML")];
    run(
        "study",
        |mutator| mutator.text(&seeds),
        |input| {
            let Ok(params) = toml::from_str::<Params>(&String::from_utf8_lossy(input)) else {
                return Ok(false);
            };
            if params.problem().is_some() {
                return Ok(false);
            }
            only_numbers(&params)?;
            let steps = params.longest_shift_m / params.shift_step_m;
            if !(0.0..1e4).contains(&steps) || params.directions > 100_000 {
                return Err(format!("{steps} steps, {} directions", params.directions));
            }
            Ok(true)
        },
    );
}
