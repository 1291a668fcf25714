//! Reads the message of a caught panic.

use std::any::Any;

/// Message of a caught panic; `None` if the payload is not a string.
pub fn panic_message(payload: &(dyn Any + Send)) -> Option<String> {
    let fixed = payload.downcast_ref::<&str>().map(ToString::to_string);
    fixed.or_else(|| payload.downcast_ref::<String>().cloned())
}
