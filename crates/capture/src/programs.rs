//! Programs that read or send pictures, each with all its children in a process group, which is
//! ended on every way out.

use std::{
    io,
    os::{fd::AsFd, unix::process::CommandExt},
    process::{Child, Command},
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use rustix::{
    buffer::spare_capacity,
    event::{Timespec, poll},
    process::{
        Pid, Signal, WaitId, WaitIdOptions, WaitIdStatus, kill_process_group,
        test_kill_process_group, waitid,
    },
};

/// Time for a program to end after a request.
const ENDING: Duration = Duration::from_secs(1);
const ENDING_LOOK: Duration = Duration::from_millis(10);
/// Bytes read at once: all that a pipe holds usually.
const CHUNK: usize = 1 << 16;
/// Longest wait between two looks whether the process is ending.
pub(crate) const LOOK: Duration = Duration::from_millis(100);

/// True once the process is ending.
static ENDS: AtomicBool = AtomicBool::new(false);
/// Process groups of the running programs.
static GROUPS: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

/// Ends every wait for a first picture: the process was asked to end.
pub fn stop_opening() {
    ENDS.store(true, Ordering::Relaxed);
}

/// True after [`stop_opening`].
pub(crate) fn is_ending() -> bool {
    ENDS.load(Ordering::Relaxed)
}

/// Ends every running program: the process ends at once, without dropping its sources.
pub fn end_programs() {
    for group in groups().iter() {
        kill_process_group(*group, Signal::KILL).ok();
    }
}

fn groups() -> MutexGuard<'static, Vec<Pid>> {
    GROUPS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Appends bytes of `output` to `bytes`, without clearing the room for them first; returns their
/// number, zero at the end.
pub(crate) fn read_more(output: impl AsFd, bytes: &mut Vec<u8>) -> io::Result<usize> {
    bytes.reserve(CHUNK);
    Ok(rustix::io::read(output, spare_capacity(bytes))?)
}

/// A running program and its children, ended on drop.
pub(crate) struct Program {
    pub(crate) child: Child,
    group: Option<Pid>,
    /// Time to let go of a camera after a request to end.
    grace: Duration,
}

impl Program {
    /// Starts `command`; with `grace`, a request comes before its end.
    pub(crate) fn start(mut command: Command, grace: bool) -> io::Result<Self> {
        let mut groups = groups();
        let child = command.process_group(0).spawn()?;
        let group = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        groups.extend(group);
        Ok(Self { child, group, grace: if grace { ENDING } else { Duration::ZERO } })
    }

    /// Waits a moment for the program to end. Its number isn't free before the drop.
    pub(crate) fn wait(&self) -> Option<WaitIdStatus> {
        let until = Instant::now() + ENDING;
        loop {
            match self.ended() {
                None if Instant::now() < until => pause(),
                ended => return ended,
            }
        }
    }

    /// Asks the group to end; true once nothing of it lives.
    fn has_ended_by_request(&mut self) -> bool {
        if self.grace.is_zero() {
            return false;
        }
        let until = Instant::now() + self.grace;
        // A request first, so it can let go of the camera.
        self.signal(Signal::TERM);
        while self.ended().is_none() {
            if Instant::now() >= until {
                return false;
            }
            pause();
        }
        self.child.wait().ok();
        // The group's number isn't given to others while a child lives.
        while self.group.is_some_and(|group| test_kill_process_group(group).is_ok()) {
            if Instant::now() >= until {
                return false;
            }
            pause();
        }
        true
    }

    fn signal(&self, signal: Signal) {
        self.group.map(|group| kill_process_group(group, signal).ok());
    }

    fn ended(&self) -> Option<WaitIdStatus> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        waitid(WaitId::Pid(self.group?), options).ok()?
    }
}

fn pause() {
    poll(&mut [], Some(&timespec(ENDING_LOOK))).ok();
}

impl Drop for Program {
    fn drop(&mut self) {
        // No reader any more: a writing program ends on its own.
        drop(self.child.stdout.take());
        if !self.has_ended_by_request() {
            self.signal(Signal::KILL);
            self.child.kill().ok();
            self.child.wait().ok();
        }
        if let Some(group) = &self.group {
            groups().retain(|other| other != group);
        }
    }
}

pub(crate) fn timespec(wait: Duration) -> Timespec {
    Timespec {
        tv_sec: wait.as_secs().try_into().unwrap_or(i64::MAX),
        tv_nsec: wait.subsec_nanos().into(),
    }
}
