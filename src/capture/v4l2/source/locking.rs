//! Controls as they were locked, and what moves them.

use super::{
    super::kernel::{Errno, Kernel},
    LOCKING_NANOS, LiveCamera, Phase, READ_BACK_NANOS, State,
};
use crate::{
    device::{CameraEvent, Control, ControlChange, Fault, Lock},
    frame::CaptureTime,
};

impl<K: Kernel> LiveCamera<K> {
    /// The controls were set twice: reads how they stand and begins to deliver.
    pub(super) fn locked(&mut self, returning: bool, blurred: bool, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let device = running.stream.device;
        let read = self.keeper.locks(&mut self.kernel, device)?;
        let good_from = CaptureTime { nanos: now };
        let mut changed = Vec::new();
        if returning {
            self.events.push_back(CameraEvent::Returned { mode: self.mode, good_from });
        }
        match self.locks {
            // A camera that returns must stand as it stood.
            Some(locks) if returning => {
                for deviation in self.keeper.deviations(&mut self.kernel, device, &locks)? {
                    changed.push((deviation.control, deviation.to));
                    self.events.push_back(CameraEvent::ControlChanged(ControlChange {
                        control: deviation.control,
                        from: deviation.from,
                        to: deviation.to,
                        good_until: good_from,
                    }));
                }
            }
            _ => {
                self.locks = Some(read);
                self.events.push_back(CameraEvent::Locked { locks: read });
                let ignored =
                    Control::ALL.iter().any(|c| matches!(read.of(*c), Lock::Ignored { .. }));
                if ignored || blurred {
                    let detail = if blurred { "the picture lost its sharpness" } else { "" };
                    self.events.push_back(CameraEvent::Doubtful {
                        fault: Fault::ControlIgnored,
                        detail: detail.into(),
                    });
                }
            }
        }
        if let State::Running(running) = &mut self.state {
            running.returning = false;
            running.phase = Phase::Steady {
                next_read_nanos: now + READ_BACK_NANOS,
                good_until: good_from,
                changed,
            };
        }
        Ok(())
    }

    /// Reads the controls back, says what changed, and puts it right.
    pub(super) fn read_back(&mut self, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let (Phase::Steady { next_read_nanos, good_until, changed }, Some(locks)) =
            (&mut running.phase, self.locks)
        else {
            return Ok(());
        };
        let device = running.stream.device;
        *next_read_nanos = now + READ_BACK_NANOS;
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let deviations = self.keeper.deviations(kernel, device, &locks)?;
        let time = CaptureTime { nanos: now };
        changed.retain(|(control, _)| {
            let still = deviations.iter().any(|deviation| deviation.control == *control);
            if !still {
                let control = *control;
                self.events.push_back(CameraEvent::ControlRestored { control, good_from: time });
            }
            still
        });
        if deviations.is_empty() {
            *good_until = time;
            return Ok(());
        }
        for deviation in &deviations {
            let (control, from, to) = (deviation.control, deviation.from, deviation.to);
            let known = changed.iter_mut().find(|(known, _)| *known == control);
            if known.as_ref().is_some_and(|(_, value)| *value == to) {
                continue;
            }
            match known {
                Some((_, value)) => *value = to,
                None => changed.push((control, to)),
            }
            let good_until = *good_until;
            let change = ControlChange { control, from, to, good_until };
            self.events.push_back(CameraEvent::ControlChanged(change));
        }
        self.keeper.lock(kernel, device)?;
        // A lens takes its time; then it is read again.
        *next_read_nanos = now + LOCKING_NANOS;
        Ok(())
    }
}
