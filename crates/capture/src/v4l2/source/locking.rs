//! Locked controls, and changes to locked controls.

use super::{
    super::{controls::Readings, kernel::Kernel},
    LiveCamera, Phase, READ_BACK_NANOS, State,
    task::Task,
};
use boresight_geometry::{
    device::{CameraEvent, Control, ControlChange, Fault, Lock},
    frame::CaptureTime,
};

impl<K: Kernel> LiveCamera<K> {
    /// Begins to deliver after the controls were set twice and read.
    pub(super) fn locked(&mut self, readings: &Readings, blurred: bool, now: u64) {
        let State::Running(running) = &mut self.state else { return };
        let returning = std::mem::take(&mut running.returning);
        let good_from = CaptureTime { nanos: now };
        let mut changed = Vec::new();
        if returning {
            self.events.push_back(CameraEvent::Returned { mode: self.mode, good_from });
        }
        match self.locks {
            // Report the controls of a returning camera with other values than before.
            Some(locks) if returning => {
                for deviation in self.keeper.deviations(readings, &locks) {
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
                let read = self.keeper.locks(readings);
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
        running.phase = Phase::Steady {
            next_read_nanos: now + READ_BACK_NANOS,
            good_until: good_from,
            changed,
        };
    }

    /// Reports changes in readings taken from `began_nanos` on, and reverts the controls.
    pub(super) fn read_back(&mut self, readings: &Readings, began_nanos: u64, now: u64) {
        let State::Running(running) = &mut self.state else { return };
        let (Phase::Steady { next_read_nanos, good_until, changed }, Some(locks)) =
            (&mut running.phase, self.locks)
        else {
            return;
        };
        *next_read_nanos = now + READ_BACK_NANOS;
        let deviations = self.keeper.deviations(readings, &locks);
        for (control, from, to) in self.keeper.moved_freely(readings, &locks) {
            // A control without a lock can't be reverted either: tell the person, and continue.
            let detail = format!("{control:?} can't be locked: {from}, now {to}");
            self.events.push_back(CameraEvent::Doubtful { fault: Fault::GeometryMoved, detail });
        }
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
            *good_until = CaptureTime { nanos: began_nanos };
            return;
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
        *next_read_nanos = u64::MAX;
        self.work(Task::Lock);
    }
}
