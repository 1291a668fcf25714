//! Lets the detector rest while the person has paused: no result counts then.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// State of the detector's rest.
#[derive(Debug, Default)]
pub(super) struct Rest {
    rests: Mutex<bool>,
    changed: Condvar,
}

impl Rest {
    /// Begins or ends a rest.
    pub(super) fn set(&self, rests: bool) {
        *self.lock() = rests;
        self.changed.notify_all();
    }

    /// True during a rest.
    pub(super) fn is_on(&self) -> bool {
        *self.lock()
    }

    /// Returns at the end of a rest; at once without a rest.
    pub(super) fn wait_for_end(&self) {
        drop(self.changed.wait_while(self.lock(), |rests| *rests));
    }

    fn lock(&self) -> MutexGuard<'_, bool> {
        self.rests.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
