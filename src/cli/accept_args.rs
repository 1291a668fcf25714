//! Arguments for the goal of a calibration.

use std::str::FromStr;

use clap::Args;

use boresight_calibrate::AcceptanceGoal;
use boresight_run::config::Config;

/// The goal, and how well the board is known.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Result")]
pub(super) struct AcceptArguments {
    /// Largest acceptable error, met 95 % of the time: "0.2px" for projection, or "length 800mm at
    /// 2m <= 0.5mm" for a length measured at a distance.
    #[arg(long, value_name = "GOAL")]
    pub(super) accept: Option<AcceptanceGoal>,
    /// Standard deviation of the board's square size: 0.1% with a ruler, 0.02% with a caliper over
    /// the whole board. Affects the error of lengths [default: 0.1%].
    #[arg(long, value_name = "PERCENT")]
    board_scale_error: Option<Percent>,
}

/// A percentage.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Percent(f64);

impl AcceptArguments {
    /// Merges the arguments into `config`.
    pub(super) fn apply(&self, config: &mut Config) {
        if let Some(goal) = self.accept {
            config.guidance.accept = Some(goal);
        }
        if let Some(Percent(percent)) = self.board_scale_error {
            config.board.scale_error_percent = percent;
        }
    }

    /// True if any argument is given.
    #[cfg(any(feature = "window", feature = "report"))]
    pub(super) fn says_something(&self) -> bool {
        self.accept.is_some() || self.board_scale_error.is_some()
    }

    /// True if the board's error is given.
    #[cfg(feature = "report")]
    pub(super) fn says_scale(&self) -> bool {
        self.board_scale_error.is_some()
    }

    /// The relative standard deviation of the board's square size, or `otherwise`.
    #[cfg(feature = "report")]
    pub(super) fn scale_sd(&self, otherwise: f64) -> f64 {
        self.board_scale_error.map_or(otherwise, |Percent(percent)| percent / 100.0)
    }
}

impl FromStr for Percent {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.trim().strip_suffix('%').and_then(|number| number.trim().parse().ok());
        number
            .filter(|percent: &f64| (0.0..=10.0).contains(percent))
            .map(Self)
            .ok_or_else(|| "expected a percentage from 0% to 10%, for example 0.02%".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_error_is_a_percentage() {
        assert_eq!("0.02%".parse(), Ok(Percent(0.02)));
        assert_eq!(" 0.1 % ".parse(), Ok(Percent(0.1)));
        for wrong in ["0.02", "%", "-1%", "50%", "nan%", "0.1mm"] {
            assert!(wrong.parse::<Percent>().is_err(), "{wrong}");
        }
    }
}
