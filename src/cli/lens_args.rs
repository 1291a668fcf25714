//! Arguments for prior knowledge of the lens.

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};

use boresight_calibrate::LensFamily;
use boresight_run::config::{Config, LensName};

/// What is known about the lens.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Result")]
pub(super) struct LensArguments {
    /// Family of lens models to choose from. Wide lenses are recognised without it.
    #[arg(long, value_name = "FAMILY", value_parser = lens_names())]
    lens: Option<LensName>,
    /// The principal point is far from the middle of the picture by design, as with a shift lens or
    /// a cropped picture: don't warn about it.
    #[arg(long)]
    shifted_sensor: bool,
}

/// Names of families of lens models, each with purpose.
fn lens_names() -> impl TypedValueParser<Value = LensName> {
    let value = |name: LensName| PossibleValue::new(name.code()).help(help(name));
    PossibleValuesParser::new(LensName::all().map(value)).try_map(|code| code.parse::<LensName>())
}

fn help(name: LensName) -> &'static str {
    match name.family() {
        None => "The one that the corners support",
        Some(LensFamily::Brown) => "OpenCV's polynomial: k1, k2, p1, p2, k3",
        Some(LensFamily::Rational) => "OpenCV's rational model, with k4, k5, k6: for wide lenses",
        Some(LensFamily::Fisheye) => "OpenCV's fisheye model (Kannala-Brandt): up to 220 degrees",
    }
}

impl LensArguments {
    /// Merges the arguments into `config`.
    pub(super) fn apply(self, config: &mut Config) {
        config.calibration.shifted_sensor |= self.shifted_sensor;
        if let Some(lens) = self.lens {
            config.calibration.lens = lens;
        }
    }

    /// True if any argument is given.
    #[cfg(feature = "window")]
    pub(super) fn says_something(self) -> bool {
        self.lens.is_some() || self.shifted_sensor
    }
}
