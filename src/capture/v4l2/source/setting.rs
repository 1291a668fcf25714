//! Controls that a person sets while the camera streams.

use super::{
    super::{
        controls::{ControlState, control_states},
        kernel::{Errno, Kernel},
    },
    LOCKING_NANOS, LiveCamera, Phase, READ_BACK_NANOS, State,
};
use crate::{
    device::{Adjustable, CameraEvent, Control},
    frame::CaptureTime,
};

impl<K: Kernel> LiveCamera<K> {
    /// Controls that the camera lets one set, with their values.
    pub(super) fn what_can_be_set(&mut self) -> Vec<Adjustable> {
        let State::Running(running) = &self.state else { return Vec::new() };
        control_states(&mut self.kernel, running.stream.device)
            .into_iter()
            .filter(|standing| standing.range.max > standing.range.min)
            .filter(|standing| standing.range.writable || standing.automatic == Some(true))
            .map(|ControlState { control, range, .. }| Adjustable {
                control,
                min: range.min,
                max: range.max,
                step: range.step.max(1),
            })
            .collect()
    }

    /// Asks the camera for what the person wants of a control.
    pub(super) fn ask_for(&mut self, control: Control, value: i64) -> Result<(), Errno> {
        let now = self.now_nanos();
        let State::Running(running) = &mut self.state else { return Ok(()) };
        // A camera that returns is brought back to how it was before anything is changed.
        if running.returning && self.locks.is_some() {
            return Ok(());
        }
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let device = running.stream.device;
        self.keeper.want(control, value);
        let done = now + LOCKING_NANOS;
        match &mut running.phase {
            // It is set when everything is.
            Phase::Settling { .. } => return Ok(()),
            Phase::Locking { done_nanos, .. } => *done_nanos = done,
            Phase::Setting { controls, done_nanos, .. } => {
                controls.retain(|other| *other != control);
                controls.push(control);
                *done_nanos = done;
            }
            Phase::Steady { changed, .. } => {
                let changed = std::mem::take(changed);
                let controls = vec![control];
                running.phase = Phase::Setting { controls, done_nanos: done, changed };
            }
        }
        self.keeper.lock(kernel, device)
    }

    /// What the person set has settled: reads it back and says how it stands.
    pub(super) fn set(&mut self, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let Phase::Setting { controls, changed, .. } = &mut running.phase else { return Ok(()) };
        let (controls, mut changed) = (std::mem::take(controls), std::mem::take(changed));
        let device = running.stream.device;
        let kernel: &mut dyn Kernel = &mut self.kernel;
        // Some cameras obey only the second time.
        self.keeper.lock(kernel, device)?;
        let good_from = CaptureTime { nanos: now };
        for control in controls {
            let lock = self.keeper.granted(kernel, device, control)?;
            self.locks.get_or_insert_default().note(control, lock);
            changed.retain(|(other, _)| *other != control);
            self.events.push_back(CameraEvent::ControlSet { control, lock, good_from });
        }
        running.phase = Phase::Steady {
            next_read_nanos: now + READ_BACK_NANOS,
            good_until: good_from,
            changed,
        };
        Ok(())
    }
}
