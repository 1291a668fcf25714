//! Loss of a camera, and its return.

use super::{
    super::{
        kernel::Kernel,
        stream::{Loss, Stream},
    },
    LONGEST_PAUSE_NANOS, LiveCamera, Phase, Running, SHORTEST_PAUSE_NANOS, State, locking,
    recognition::{found_again, other_than_asked},
    settling,
    task::Task,
};
use boresight_geometry::device::{CameraEvent, Fault};

impl<K: Kernel> LiveCamera<K> {
    /// Ends the stream and reports the reason.
    pub(super) fn lose(&mut self, loss: Loss) {
        let now = self.now_nanos();
        (self.dropped_before, self.rejected_before) = self.counts();
        if let State::Running(running) = &mut self.state {
            // A request not granted yet is dropped: the camera returns with its last known values.
            if let Phase::Setting { controls, .. } = &running.phase {
                for control in controls {
                    let known = self.locks.and_then(|locks| locks.of(*control).value());
                    known.into_iter().for_each(|value| self.keeper.want(*control, value));
                }
            }
            running.stream.end(&mut self.kernel);
        }
        let (fault, detail) = loss.clone();
        self.events.push_back(CameraEvent::Lost { fault, detail });
        self.state = State::Lost { loss, next_look_nanos: now, pause_nanos: SHORTEST_PAUSE_NANOS };
        self.tell_counts();
    }

    /// Looks for the lost camera, and starts the camera if found.
    pub(super) fn look_for_it(&mut self) {
        match self.come_back() {
            Ok(stream) => {
                // Restore controls lost by unplugging the camera.
                let is_known = self.locks.is_some();
                let phase = if self.only_looks {
                    Phase::Looking
                } else if is_known {
                    locking(0.0)
                } else {
                    settling(&mut self.kernel)
                };
                self.state = State::Running(Box::new(Running {
                    stream,
                    phase,
                    returning: true,
                    work: None,
                    rest_until_nanos: 0,
                }));
                if is_known {
                    self.work(Task::Lock);
                }
            }
            Err(now_lost) => {
                let now = self.now_nanos();
                let State::Lost { loss, next_look_nanos, pause_nanos } = &mut self.state else {
                    return;
                };
                *next_look_nanos = now + *pause_nanos;
                // Starting a camera again and again wears out weak ones; looking for it costs
                // nothing.
                if now_lost.0 != Fault::NotFound {
                    *pause_nanos = (2 * *pause_nanos).min(LONGEST_PAUSE_NANOS);
                }
                let still_away = now_lost.0 == Fault::NotFound;
                if !still_away && now_lost != *loss {
                    loss.clone_from(&now_lost);
                    let (fault, detail) = now_lost;
                    self.events.push_back(CameraEvent::Lost { fault, detail });
                }
            }
        }
    }

    fn come_back(&mut self) -> Result<Stream, Loss> {
        let camera = found_again(&mut self.kernel, &self.identity)?;
        let mut stream = Stream::start(&mut self.kernel, &camera, &self.offer)?;
        let mode = stream.granted.mode;
        if (mode.size, mode.layout) != (self.mode.size, self.mode.layout) {
            stream.end(&mut self.kernel);
            let detail = other_than_asked(&self.offer, &mode).unwrap_or_default();
            return Err((Fault::OtherMode, detail));
        }
        self.camera = camera;
        Ok(stream)
    }
}
