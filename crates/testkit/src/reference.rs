//! Independently computed numbers, as in the fixtures.

use nalgebra::Point2;
use serde_json::Value;

use crate::fixture;

/// The file `name` of the reference vectors.
pub fn vectors(name: &str) -> Value {
    let path = fixture(&format!("reference/{name}.json"));
    serde_json::from_str(&std::fs::read_to_string(path).expect("fixture")).expect("JSON")
}

/// Elements of an array.
pub fn list(value: &Value) -> &[Value] {
    value.as_array().expect("list")
}

/// A number as `f64`.
pub fn number(value: &Value) -> f64 {
    value.as_f64().expect("number")
}

/// A point of two numbers.
pub fn point(value: &Value) -> Point2<f64> {
    Point2::new(number(&value[0]), number(&value[1]))
}
