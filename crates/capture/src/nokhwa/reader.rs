//! Thread of a camera, for opening and reading.
//!
//! A call into the library may never return, and can't be interrupted. Then the thread is left
//! behind, without waiting: it ends with the call, or with the program.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread::Builder,
    time::{Duration, Instant},
};

use super::device::{Blocking, Loss, caught};
use boresight_geometry::device::{Fault, Mode};

/// Opens a camera; called on the thread.
pub(super) type Opener = Arc<dyn Fn() -> Result<Box<dyn Blocking>, Loss> + Send + Sync>;

/// Longest wait for the end of the reader, to free the camera for the next program.
const ENDING: Duration = Duration::from_secs(1);

/// A run of a camera.
pub(super) struct Reader {
    shared: Arc<Shared>,
}

/// News of a run.
#[derive(Debug)]
pub(super) enum Said {
    /// The camera streams, in this mode.
    Started(Mode),
    /// The newest frame, and the number of replaced frames.
    Frame { bytes: Vec<u8>, came_at: Instant, replaced: u64 },
    /// The run is over, and the camera closed.
    Ended(Loss),
    /// Nothing in time.
    Nothing,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    started: Option<Mode>,
    newest: Option<(Vec<u8>, Instant)>,
    replaced: u64,
    ended: Option<Loss>,
    is_over: bool,
    stop: bool,
}

impl Reader {
    /// Starts the thread.
    pub(super) fn start(open: &Opener) -> Result<Self, Loss> {
        let shared = Arc::new(Shared::default());
        let (open, of_thread) = (Arc::clone(open), Arc::clone(&shared));
        Builder::new()
            .name("nokhwa".into())
            .spawn(move || {
                let ended = of_thread.read(&open).err();
                let mut state = of_thread.lock();
                (state.ended, state.is_over) = (ended, true);
                of_thread.changed.notify_all();
            })
            .map_err(|err| (Fault::DriverBroken, err.to_string()))?;
        Ok(Self { shared })
    }

    /// Waits at most `patience` for news.
    pub(super) fn next(&self, patience: Duration) -> Said {
        let quiet = |state: &mut State| {
            state.started.is_none() && state.newest.is_none() && state.ended.is_none()
        };
        let (mut state, _) = self
            .shared
            .changed
            .wait_timeout_while(self.shared.lock(), patience, quiet)
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(mode) = state.started.take() {
            return Said::Started(mode);
        }
        if let Some((bytes, came_at)) = state.newest.take() {
            return Said::Frame { bytes, came_at, replaced: std::mem::take(&mut state.replaced) };
        }
        state.ended.take().map_or(Said::Nothing, Said::Ended)
    }
}

impl Shared {
    /// Opens the camera and reads until an error or a stop.
    fn read(&self, open: &Opener) -> Result<(), Loss> {
        let mut camera = caught(|| open())?;
        self.tell(|state| state.started = Some(camera.mode()));
        let result = loop {
            match caught(|| camera.frame()) {
                Ok(bytes) => {
                    let came_at = Instant::now();
                    self.tell(|state| {
                        let untaken = state.newest.replace((bytes, came_at));
                        state.replaced += u64::from(untaken.is_some());
                    });
                }
                Err(loss) => break Err(loss),
            }
            if self.lock().stop {
                break Ok(());
            }
        };
        // Closed outside the reading call: a second panic while the first one unwinds would end the
        // program.
        let closed = caught(move || {
            drop(camera);
            Ok(())
        });
        result.and(closed)
    }

    fn tell(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code that can panic runs under this lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let mut state = self.shared.lock();
        state.stop = true;
        let running = |state: &mut State| !state.is_over;
        drop(self.shared.changed.wait_timeout_while(state, ENDING, running));
    }
}
