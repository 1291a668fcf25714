//! Tasks on all controls, in order.

use super::super::{
    controls::{ControlLock, Readings},
    kernel::{Errno, Handle, Kernel},
};
use boresight_geometry::device::Control;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// Set the control to the kept value.
    Lock,
    /// Read the present value.
    Read,
}

/// A task in progress.
#[derive(Clone, Debug)]
pub(super) struct ControlWork {
    pub(super) task: Task,
    pub(super) readings: Readings,
    /// Start of the task: every reading is later.
    pub(super) began_nanos: u64,
    next: usize,
}

impl ControlWork {
    pub(super) fn new(task: Task, now: u64) -> Self {
        Self { task, readings: Readings::default(), began_nanos: now, next: 0 }
    }

    /// Handles the next control; `None` after the last.
    pub(super) fn step(
        &mut self,
        kernel: &mut dyn Kernel,
        device: Handle,
        keeper: &mut ControlLock,
    ) -> Result<Option<()>, Errno> {
        let Some(control) = Control::ALL.get(self.next).copied() else { return Ok(None) };
        self.next += 1;
        match self.task {
            Task::Lock => keeper.lock(kernel, device, control)?,
            Task::Read => {
                let reading = keeper.read(kernel, device, control)?;
                self.readings.extend(reading.map(|reading| (control, reading)));
            }
        }
        Ok(Some(()))
    }
}
