//! Tasks that visit all controls, one after the other.

use super::super::{
    controls::{ControlLock, Readings},
    kernel::{Errno, Handle, Kernel},
};
use boresight_geometry::device::Control;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// Set it to what it's kept at.
    Lock,
    /// Read its present value.
    Read,
}

/// A task on its way through the controls.
#[derive(Clone, Debug)]
pub(super) struct ControlWork {
    pub(super) task: Task,
    pub(super) readings: Readings,
    /// Time at which the task began: every reading is later.
    pub(super) began_nanos: u64,
    next: usize,
}

impl ControlWork {
    pub(super) fn new(task: Task, now: u64) -> Self {
        Self { task, readings: Readings::default(), began_nanos: now, next: 0 }
    }

    /// The next control, or `None` after the last.
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
