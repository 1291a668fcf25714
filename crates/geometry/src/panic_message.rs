//! Catches panics of third-party code, with messages.

use std::{
    any::Any,
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook},
};

thread_local! {
    /// True while [`caught`] runs on this thread.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// Message of a caught panic; `None` if the payload is not a string.
pub fn panic_message(payload: &(dyn Any + Send)) -> Option<String> {
    let fixed = payload.downcast_ref::<&str>().map(ToString::to_string);
    fixed.or_else(|| payload.downcast_ref::<String>().cloned())
}

/// Runs `work` and catches panics, for decoders that panic on hostile files. State changed by
/// `work` must be discarded after an error.
///
/// # Errors
///
/// Message of the panic.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let before = IS_CAUGHT.replace(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    IS_CAUGHT.set(before);
    result.map_err(|payload| panic_message(&*payload).unwrap_or_default())
}

/// Silences the messages of panics caught by [`caught`]. A program calls this once, at its start.
pub fn caught_in_silence() {
    let before = take_hook();
    set_hook(Box::new(move |panic| {
        if !IS_CAUGHT.get() {
            before(panic);
        }
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        assert_eq!(caught(|| 7), Ok(7));
        let none: [u8; 0] = [];
        let index = none.len();
        let message = caught(|| none[index]).expect_err("a panic");
        assert!(message.contains("out of bounds"), "{message}");
        assert!(!IS_CAUGHT.get());
    }
}
