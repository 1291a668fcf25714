//! Holds back a source able to wait until its last frame has been judged.

use std::sync::{
    Condvar, Mutex, PoisonError,
    atomic::{AtomicBool, Ordering},
};

use super::capture_stage::SOURCE_PATIENCE;

/// Counts judged frames.
#[derive(Debug, Default)]
pub(super) struct JudgedGate {
    judged: Mutex<u64>,
    changed: Condvar,
}

impl JudgedGate {
    /// Counts a judged frame.
    pub(super) fn count_one(&self) {
        *self.judged.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.changed.notify_all();
    }

    /// Waits until `count` frames are judged, or the pipeline stops.
    pub(super) fn wait_for(&self, count: u64, stop: &AtomicBool) {
        let mut judged = self.judged.lock().unwrap_or_else(PoisonError::into_inner);
        while *judged < count && !stop.load(Ordering::Relaxed) {
            judged = self
                .changed
                .wait_timeout(judged, SOURCE_PATIENCE)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
    }
}
