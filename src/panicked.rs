//! What a panic said.

use std::any::Any;

/// The words of a panic that was caught, by its payload; `None` if it said none.
pub(crate) fn words(payload: &(dyn Any + Send)) -> Option<String> {
    let fixed = payload.downcast_ref::<&str>().map(ToString::to_string);
    fixed.or_else(|| payload.downcast_ref::<String>().cloned())
}
