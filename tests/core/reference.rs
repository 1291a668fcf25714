//! Independently computed numbers, as in the fixtures.

use nalgebra::Point2;
use serde_json::Value;

/// The file `name` of the reference vectors.
pub(crate) fn vectors(name: &str) -> Value {
    let path = format!("{}/fixtures/reference/{name}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).expect("fixture")).expect("JSON")
}

pub(crate) fn list(value: &Value) -> &[Value] {
    value.as_array().expect("list")
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().expect("number")
}

pub(crate) fn point(value: &Value) -> Point2<f64> {
    Point2::new(number(&value[0]), number(&value[1]))
}
