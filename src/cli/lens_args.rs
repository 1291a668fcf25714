//! The arguments that say what is known about the lens.

use clap::{Args, ValueEnum};

use boresight_run::config::{Config, LensName};

/// What is known about the lens.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(super) struct LensArguments {
    /// Lens models to choose from. Wide lenses are recognised without it.
    #[arg(long, value_name = "MODELS")]
    lens: Option<LensChoice>,
    /// The principal point is far from the middle of the picture by design, as with a shift lens or a cropped
    /// picture: don't warn about it.
    #[arg(long)]
    shifted_sensor: bool,
}

/// Families of lens models.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum LensChoice {
    /// The one that the corners support.
    Auto,
    /// OpenCV's polynomial: k1, k2, p1, p2, k3.
    Brown,
    /// OpenCV's rational model, with k4, k5, k6: for wide lenses.
    Rational,
    /// OpenCV's fisheye model (Kannala-Brandt): up to 220 degrees.
    Fisheye,
}

impl LensArguments {
    /// Lays the arguments over `config`.
    pub(super) fn apply(self, config: &mut Config) {
        config.calibration.shifted_sensor |= self.shifted_sensor;
        if let Some(lens) = self.lens {
            config.calibration.lens = match lens {
                LensChoice::Auto => LensName::Auto,
                LensChoice::Brown => LensName::Brown,
                LensChoice::Rational => LensName::Rational,
                LensChoice::Fisheye => LensName::Fisheye,
            };
        }
    }

    /// Whether any of them is given.
    #[cfg(feature = "window")]
    pub(super) fn says_something(self) -> bool {
        self.lens.is_some() || self.shifted_sensor
    }
}
