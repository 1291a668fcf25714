//! The name of a camera backend as an argument.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use boresight_app::session::camera::BACKENDS;
use boresight_present::text::camera::capital;
use boresight_run::config::Backend;

/// Names of the backends, with descriptions as help.
pub(super) fn names() -> impl TypedValueParser<Value = Backend> {
    let names = BACKENDS.map(|it| PossibleValue::new(it.name).help(capital(it.is)));
    PossibleValuesParser::new(names).map(|name| Backend::named(&name))
}
