//! The buffers of a stream, and the owner of each.
//!
//! ```text
//!            queue ▶                    ▶ picture arrives
//!   ours ───────────────▶ driver's ─────────────────────▶ driver's, full
//!    ▲                                                        │
//!    └───────────────────────── dequeue ◀────────────────────┘
//! ```
//!
//! Only a successful dequeue makes a buffer ours, and only a buffer of ours is queued: an invented
//! number from the driver ends the stream instead of the program.

use super::kernel::{Errno, FLAG_ERROR, Filled, Handle, Kernel};

/// Number of buffers. More would only hold older pictures.
pub const BUFFERS: u32 = 4;
/// Number of consecutive signals after which a call is given up.
const MOST_INTERRUPTIONS: u32 = 64;
/// Consecutive EIO results tolerated before the stream is given up.
const MOST_TRANSFER_ERRORS: u32 = 3;

/// A running stream.
#[derive(Debug)]
pub(super) struct Queue {
    device: Handle,
    buffers: Vec<Buffer>,
    transfer_errors: u32,
    last_sequence: Option<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Buffer {
    len: usize,
    ours: bool,
}

/// Reason for the end of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Broken {
    /// An error of the system.
    System(Errno),
    /// The driver broke the rules.
    Driver(&'static str),
}

impl From<Errno> for Broken {
    fn from(errno: Errno) -> Self {
        Self::System(errno)
    }
}

/// Result of a look at the stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Round {
    /// Newest frame not marked bad by the driver; its bytes have been copied.
    pub(super) newest: Option<Filled>,
    /// Number of frames received at all.
    pub(super) came: u32,
    /// Number of good frames skipped for a newer frame, and of missing frame numbers.
    pub(super) dropped: u64,
    /// Number of frames marked bad by the driver, empty, or too long.
    pub(super) bad: u64,
}

impl Queue {
    /// Gets and maps buffers, hands all to the driver and starts the stream. Leaves nothing behind
    /// on failure.
    pub(super) fn start(kernel: &mut dyn Kernel, device: Handle) -> Result<Self, Broken> {
        let mut queue =
            Self { device, buffers: Vec::new(), transfer_errors: 0, last_sequence: None };
        match queue.prepare(kernel) {
            Ok(()) => Ok(queue),
            Err(broken) => {
                queue.stop(kernel);
                Err(broken)
            }
        }
    }

    fn prepare(&mut self, kernel: &mut dyn Kernel) -> Result<(), Broken> {
        let device = self.device;
        let granted = again(|| kernel.request_buffers(device, BUFFERS))?;
        if granted == 0 {
            return Err(Broken::Driver("it gives no buffers"));
        }
        for index in 0..granted.min(2 * BUFFERS) {
            let len = again(|| kernel.map(device, index))?;
            self.buffers.push(Buffer { len, ours: true });
        }
        self.hand_over(kernel)?;
        Ok(again(|| kernel.stream_on(device))?)
    }

    /// Hands every buffer of ours to the driver. Fails if the driver then has none.
    fn hand_over(&mut self, kernel: &mut dyn Kernel) -> Result<(), Errno> {
        let mut refused = None;
        for (index, buffer) in self.buffers.iter_mut().enumerate().filter(|(_, b)| b.ours) {
            match again(|| kernel.queue(self.device, index as u32)) {
                Ok(()) => buffer.ours = false,
                Err(errno) => refused = Some(errno),
            }
        }
        // A refused buffer is offered again at the next look.
        match refused {
            Some(errno) if self.buffers.iter().all(|buffer| buffer.ours) => Err(errno),
            Some(errno) if gone(errno) => Err(errno),
            _ => Ok(()),
        }
    }

    /// Takes every ready frame, copies the newest good frame into `bytes`, and hands the buffers
    /// back.
    pub(super) fn newest(
        &mut self,
        kernel: &mut dyn Kernel,
        bytes: &mut Vec<u8>,
    ) -> Result<Round, Broken> {
        let mut round = Round::default();
        // Bounded, because a driver may never run empty.
        for _ in 0..2 * self.buffers.len() {
            let filled = match again(|| kernel.dequeue(self.device)) {
                Ok(filled) => filled,
                Err(errno) if errno.0 == libc::EAGAIN => break,
                Err(errno) if errno.0 == libc::EIO => {
                    self.transfer_errors += 1;
                    if self.transfer_errors > MOST_TRANSFER_ERRORS {
                        return Err(errno.into());
                    }
                    break;
                }
                Err(errno) => return Err(errno.into()),
            };
            self.transfer_errors = 0;
            let buffer = self
                .buffers
                .get_mut(filled.index as usize)
                .filter(|buffer| !buffer.ours)
                .ok_or(Broken::Driver("it hands back a buffer that it does not have"))?;
            buffer.ours = true;
            let len = buffer.len;
            round.came += 1;
            round.dropped += self.missing_before(filled.sequence);
            let used = filled.bytes_used as usize;
            if filled.flags & FLAG_ERROR != 0 || used == 0 || used > len {
                round.bad += 1;
            } else if let Some(source) = kernel.bytes(self.device, filled.index, used) {
                bytes.clear();
                bytes.extend_from_slice(source);
                round.dropped += u64::from(round.newest.is_some());
                round.newest = Some(filled);
            } else {
                return Err(Broken::Driver("its memory is not there"));
            }
            self.hand_over(kernel)?;
        }
        self.hand_over(kernel)?;
        Ok(round)
    }

    /// Number of frames lost before frame `sequence`. Numbers wrap, and some drivers restart them.
    fn missing_before(&mut self, sequence: u32) -> u64 {
        /// Largest gap in the frame numbers counted as a loss; a larger gap is a new count.
        const LARGEST_GAP: u32 = 1000;
        let last = self.last_sequence.replace(sequence);
        let gap = last.map_or(1, |last| sequence.wrapping_sub(last));
        if (2..=LARGEST_GAP).contains(&gap) { u64::from(gap - 1) } else { 0 }
    }

    /// Ends the stream. Never fails: closing the device ends the rest.
    pub(super) fn stop(self, kernel: &mut dyn Kernel) {
        again(|| kernel.stream_off(self.device)).ok();
        kernel.unmap_all(self.device);
        again(|| kernel.request_buffers(self.device, 0)).ok();
    }
}

/// Repeats a call interrupted by a signal.
pub(super) fn again<T>(mut call: impl FnMut() -> Result<T, Errno>) -> Result<T, Errno> {
    let mut result = call();
    for _ in 0..MOST_INTERRUPTIONS {
        match result {
            Err(Errno(libc::EINTR)) => result = call(),
            _ => break,
        }
    }
    result
}

/// True if the errno means an unplugged device.
pub(super) fn gone(errno: Errno) -> bool {
    matches!(errno.0, libc::ENODEV | libc::ENXIO | libc::ENOENT | libc::EBADF | libc::ESHUTDOWN)
}
