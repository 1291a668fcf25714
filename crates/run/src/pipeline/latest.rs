//! A slot for a single value, replaced by newer values. The only lossy link in the program.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

/// Makes a connected pair.
pub fn latest<T>() -> (LatestSender<T>, LatestReceiver<T>) {
    let shared = Arc::new(Shared { slot: Mutex::new(Slot::default()), changed: Condvar::new() });
    (LatestSender { shared: Arc::clone(&shared) }, LatestReceiver { shared })
}

/// Sender of values; closes the slot on drop.
#[derive(Debug)]
pub struct LatestSender<T> {
    shared: Arc<Shared<T>>,
}

/// Receiver of values; closes the slot on drop.
#[derive(Debug)]
pub struct LatestReceiver<T> {
    shared: Arc<Shared<T>>,
}

/// The other side is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the receiving thread has ended")]
pub struct Closed;

#[derive(Debug)]
struct Shared<T> {
    slot: Mutex<Slot<T>>,
    changed: Condvar,
}

#[derive(Debug)]
struct Slot<T> {
    value: Option<T>,
    closed: bool,
    replaced: u64,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self { value: None, closed: false, replaced: 0 }
    }
}

impl<T> LatestSender<T> {
    /// Stores `value`, replacing an untaken one. Never waits.
    pub fn publish(&self, value: T) -> Result<(), Closed> {
        let mut slot = self.shared.lock();
        if slot.closed {
            return Err(Closed);
        }
        let untaken = slot.value.replace(value);
        slot.replaced += u64::from(untaken.is_some());
        drop(slot);
        drop(untaken); // Frees a frame outside the lock.
        self.shared.changed.notify_one();
        Ok(())
    }
}

impl<T> LatestReceiver<T> {
    /// Waits for a value. `None` once the sender is gone and the slot is empty.
    pub fn recv(&self) -> Option<T> {
        let mut slot = self.shared.lock();
        loop {
            if let Some(value) = slot.value.take() {
                return Some(value);
            }
            if slot.closed {
                return None;
            }
            slot = self.shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits at most `patience` for a value. `Ok(None)` if none came.
    ///
    /// # Errors
    ///
    /// [`Closed`] once the sender is gone and the slot is empty.
    pub fn recv_within(&self, patience: Duration) -> Result<Option<T>, Closed> {
        let slot = self.shared.lock();
        let wait = |slot: &mut Slot<T>| slot.value.is_none() && !slot.closed;
        let (mut slot, _) = self
            .shared
            .changed
            .wait_timeout_while(slot, patience, wait)
            .unwrap_or_else(PoisonError::into_inner);
        match slot.value.take() {
            None if slot.closed => Err(Closed),
            value => Ok(value),
        }
    }

    /// Takes the value, if any. For the UI, which must not wait.
    pub fn try_recv(&self) -> Option<T> {
        self.shared.lock().value.take()
    }

    /// True if a value waits, or no more will come.
    pub fn has_news(&self) -> bool {
        let slot = self.shared.lock();
        slot.closed || slot.value.is_some()
    }

    /// True if the sender is gone and the slot is empty.
    pub fn is_closed(&self) -> bool {
        let slot = self.shared.lock();
        slot.closed && slot.value.is_none()
    }

    /// Number of values replaced before being taken.
    pub fn replaced(&self) -> u64 {
        self.shared.lock().replaced
    }
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, Slot<T>> {
        // No code that can panic runs under this lock, so a poisoned slot is still whole.
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }
}

impl<T> Drop for LatestSender<T> {
    fn drop(&mut self) {
        self.shared.close();
    }
}

impl<T> Drop for LatestReceiver<T> {
    fn drop(&mut self) {
        self.shared.close();
    }
}
