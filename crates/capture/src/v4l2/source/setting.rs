//! Controls set by a person while the camera streams.

use super::{
    super::{controls::Readings, kernel::Kernel},
    LiveCamera, Phase, READ_BACK_NANOS, State,
    task::Task,
};
use boresight_geometry::{
    device::{CameraEvent, Control},
    frame::CaptureTime,
};

impl<K: Kernel> LiveCamera<K> {
    /// Requests a person's value of a control.
    pub(super) fn ask_for(&mut self, control: Control, value: i64) {
        let State::Running(running) = &mut self.state else { return };
        if self.only_looks {
            return;
        }
        // A returning camera is restored to its earlier state before any change.
        if running.returning && self.locks.is_some() {
            return;
        }
        self.keeper.want(control, value);
        match &mut running.phase {
            // Set together with everything else.
            Phase::Settling { .. } | Phase::Looking => return,
            Phase::Locking { again, .. } => *again = false,
            Phase::Setting { controls, again, .. } => {
                controls.retain(|other| *other != control);
                controls.push(control);
                *again = false;
            }
            Phase::Steady { changed, .. } => {
                let changed = std::mem::take(changed);
                let controls = vec![control];
                running.phase =
                    Phase::Setting { controls, again: false, done_nanos: u64::MAX, changed };
            }
        }
        self.work(Task::Lock);
    }

    /// Reports the state of controls set by the person, once settled and read.
    pub(super) fn set(&mut self, readings: &Readings, now: u64) {
        let State::Running(running) = &mut self.state else { return };
        let Phase::Setting { controls, changed, .. } = &mut running.phase else { return };
        let (controls, mut changed) = (std::mem::take(controls), std::mem::take(changed));
        let good_from = CaptureTime { nanos: now };
        for control in controls {
            let lock = self.keeper.granted(readings, control);
            self.locks.get_or_insert_default().note(control, lock);
            changed.retain(|(other, _)| *other != control);
            self.events.push_back(CameraEvent::ControlSet { control, lock, good_from });
        }
        running.phase = Phase::Steady {
            next_read_nanos: now + READ_BACK_NANOS,
            good_until: good_from,
            changed,
        };
    }
}
