//! Reading and setting the controls in portions: a camera may take seconds for a transfer, and
//! pictures must not wait for all of them.

use super::{
    super::kernel::{Errno, Kernel},
    LiveCamera, Phase, Running, State,
    task::{ControlWork, Task},
};

/// Time for controls between two pictures before a rest.
const PORTION_NANOS: u64 = 20_000_000;
/// Rest of the controls afterwards, as a multiple of the time used: pictures have most of the time.
const REST: u64 = 3;

impl<K: Kernel> LiveCamera<K> {
    /// Begins `task` with all controls, in place of the present task.
    pub(super) fn work(&mut self, task: Task) {
        let now = self.now_nanos();
        if let State::Running(running) = &mut self.state {
            running.work = Some(ControlWork::new(task, now));
        }
    }

    /// Continues with the controls for a portion of time. Returns true if nothing is left to do.
    pub(super) fn work_on(&mut self) -> Result<bool, Errno> {
        let began = self.now_nanos();
        loop {
            let State::Running(running) = &mut self.state else { return Ok(true) };
            let Running { stream, work, rest_until_nanos, .. } = running.as_mut();
            let Some(under_way) = work else { return Ok(true) };
            if began < *rest_until_nanos {
                return Ok(false);
            }
            let device = stream.device;
            let done = under_way.step(&mut self.kernel, device, &mut self.keeper)?.is_none();
            let now = self.kernel.clock().monotonic_nanos;
            let used = now - began;
            if used > PORTION_NANOS {
                *rest_until_nanos = now + REST * used;
                // The camera was busy answering, so missing pictures are excused.
                stream.excuse(used);
            }
            if done && let Some(work) = work.take() {
                self.worked(work, now)?;
                continue;
            }
            if used > PORTION_NANOS {
                return Ok(false);
            }
        }
    }

    /// Moves on after a task is done.
    fn worked(&mut self, work: ControlWork, now: u64) -> Result<(), Errno> {
        let ControlWork { task, readings, began_nanos, .. } = work;
        let State::Running(running) = &mut self.state else { return Ok(()) };
        match (&mut running.phase, task) {
            (Phase::Settling { .. } | Phase::Looking, _) => {}
            (
                Phase::Locking { again, done_nanos, .. } | Phase::Setting { again, done_nanos, .. },
                Task::Lock,
            ) => {
                if *again {
                    self.work(Task::Read);
                } else {
                    *again = true;
                    *done_nanos = now + super::LOCKING_NANOS;
                }
            }
            (Phase::Locking { sharp_before, sharp_now, .. }, Task::Read) => {
                let blurred = *sharp_now < super::SHARPNESS_KEPT * *sharp_before;
                self.locked(&readings, blurred, now);
            }
            (Phase::Setting { .. }, Task::Read) => self.set(&readings, now),
            // A lens takes its time; the control is read again later.
            (Phase::Steady { next_read_nanos, .. }, Task::Lock) => {
                *next_read_nanos = now + super::LOCKING_NANOS;
            }
            (Phase::Steady { .. }, Task::Read) => self.read_back(&readings, began_nanos, now),
        }
        Ok(())
    }
}
