//! Names of export formats as arguments.

use boresight_app::session::export::Format;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Reads the name of a format; help lists them all.
pub fn format_name() -> impl TypedValueParser<Value = Format> {
    let names = Format::all().map(|format| PossibleValue::new(format.code()).help(format.about()));
    // The parser before has refused every other name.
    PossibleValuesParser::new(names).try_map(|code| Format::by_code(&code).ok_or("no such format"))
}
