//! A camera that went away, and its return.

use super::{
    super::{
        discovery::{Camera, Found, Identity, discover_those},
        kernel::Kernel,
        mode::other_than_asked,
        stream::{Loss, Stream},
    },
    LOCKING_NANOS, LONGEST_PAUSE_NANOS, LiveCamera, Phase, Running, SHORTEST_PAUSE_NANOS, State,
    settling,
};
use crate::device::{CameraEvent, Fault};

impl<K: Kernel> LiveCamera<K> {
    /// Ends the stream and says why.
    pub(super) fn lose(&mut self, loss: Loss) {
        let now = self.now_nanos();
        (self.dropped_before, self.rejected_before) = self.counts();
        if let State::Running(running) = &mut self.state {
            // What was asked for and not granted is not held on to: it returns as it was known.
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

    /// Looks for the lost camera and starts it.
    pub(super) fn look_for_it(&mut self) {
        match self.come_back() {
            Ok(stream) => {
                self.keeper = self.keeper.again_for(&mut self.kernel, stream.device);
                let now = self.now_nanos();
                let phase = if self.locks.is_some() {
                    // What it forgot is set at once.
                    self.keeper.lock(&mut self.kernel, stream.device).ok();
                    let done_nanos = now + LOCKING_NANOS;
                    Phase::Locking { done_nanos, sharp_before: 0.0, sharp_now: 0.0 }
                } else {
                    settling(&mut self.kernel)
                };
                self.state = State::Running(Box::new(Running { stream, phase, returning: true }));
            }
            Err(now_lost) => {
                let now = self.now_nanos();
                let State::Lost { loss, next_look_nanos, pause_nanos } = &mut self.state else {
                    return;
                };
                *next_look_nanos = now + *pause_nanos;
                // Starting a camera again and again wears out weak ones; looking for it costs nothing.
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

/// The camera of that identity, if it is there.
pub(in crate::capture) fn found_again(
    kernel: &mut dyn Kernel,
    identity: &Identity,
) -> Result<Camera, Loss> {
    let found = discover_those(kernel, |node| identity.may_be(node));
    same(&found, identity)
}

/// The camera of that identity among those that are there.
fn same(found: &Found, identity: &Identity) -> Result<Camera, Loss> {
    let mut fitting: Vec<_> =
        found.cameras.iter().filter_map(|c| identity.fit(c).map(|fit| (fit, c))).collect();
    fitting.sort_by_key(|(fit, _)| std::cmp::Reverse(*fit));
    match fitting.as_slice() {
        [(_, one)] => Ok((*one).clone()),
        [(best, one), (next, _), ..] if best > next => Ok((*one).clone()),
        [(_, one), ..] => Err((Fault::Twin, one.stable_name())),
        [] => {
            let other = found.cameras.iter().find(|camera| identity.is_place_of(camera));
            match (other, found.others.first()) {
                (Some(other), _) => {
                    Err((Fault::OtherCamera, format!("{}, {}", other.name, other.stable_name())))
                }
                // The node is there again, but may not be opened yet, or is another program's.
                (None, Some(other)) if matches!(other.why, Fault::Busy | Fault::NotPermitted) => {
                    Err((other.why, other.detail.clone()))
                }
                (None, _) => Err((Fault::NotFound, String::new())),
            }
        }
    }
}
