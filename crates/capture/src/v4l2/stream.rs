//! A run of a camera, from opening to closing a node: newest frames, decoded and timed.

use std::{path::PathBuf, time::Duration};

use image::GrayImage;

use super::{
    discovery::{Camera, detail_of, fault_of, open},
    kernel::{Errno, Filled, Handle, Kernel, TIMESTAMP_MASK, TIMESTAMP_MONOTONIC},
    mode::{Granted, grant},
    queue::{Broken, Queue, again},
};
use crate::{CameraMode, health::Health, integrity::Flaw, pixel_format::Unpacker};
use boresight_geometry::{device::Fault, frame::CaptureTime};

/// Longest wait for the first picture: some cameras take seconds to wake.
const START_NANOS: u64 = 5_000_000_000;
/// Longest wait for a later picture, except at very low rates.
const STEADY_NANOS: u64 = 1_500_000_000;
/// Most missing pictures in a row, and the longest wait for them.
const MISSING: u64 = 4;
const LONGEST_STEADY_NANOS: u64 = 10_000_000_000;
/// Time without a whole frame before restarting the stream.
const DAMAGED_NANOS: u64 = 4_000_000_000;
/// Time asleep that ends a stream.
const SLEPT_NANOS: u64 = 1_000_000_000;
/// Age beyond which a driver's timestamp is a mistake.
const BELIEVABLE_NANOS: u64 = 5_000_000_000;
/// Retries while the device is busy, and the pause between them.
const BUSY_TRIES: u32 = 10;
const BUSY_PAUSE: Duration = Duration::from_millis(100);
/// Number of consecutive waits without a frame or a reason, from which the device counts as broken,
/// and the pause between them.
const MOST_EMPTY_ERRORS: u32 = 20;
const EMPTY_PAUSE: Duration = Duration::from_millis(10);

/// Reason for the loss of a camera, with details.
pub(super) type Loss = (Fault, String);

/// A streaming camera.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) device: Handle,
    pub(super) granted: Granted,
    pub(super) health: Health,
    path: PathBuf,
    queue: Option<Queue>,
    unpacker: Unpacker,
    bytes: Vec<u8>,
    began_nanos: u64,
    last_came_nanos: Option<u64>,
    last_good_nanos: u64,
    slept_nanos: u64,
    last_time: CaptureTime,
    /// The driver's newest timestamp; `None` once they jumped back: from then on pictures have the
    /// time of arrival.
    driver_nanos: Option<u64>,
    /// Longest time between the last pictures: in the dark, exposure lengthens it.
    slowest_nanos: u64,
    empty_errors: u32,
    /// Frames lost by the driver, skipped, or repeated.
    pub(super) dropped: u64,
    /// Incomplete frames.
    pub(super) rejected: u64,
}

/// A good picture.
#[derive(Debug)]
pub(super) struct Picture {
    pub(super) image: GrayImage,
    pub(super) captured_at: CaptureTime,
}

impl Stream {
    /// Opens the node, sets the mode, and starts streaming. Leaves nothing behind if it fails.
    pub(super) fn start(
        kernel: &mut dyn Kernel,
        camera: &Camera,
        offer: &CameraMode,
    ) -> Result<Self, Loss> {
        let path = camera.node.path.clone();
        let device = open(kernel, &path)?;
        match Self::start_on(kernel, device, path, offer) {
            Ok(stream) => Ok(stream),
            Err(loss) => {
                kernel.close(device);
                Err(loss)
            }
        }
    }

    fn start_on(
        kernel: &mut dyn Kernel,
        device: Handle,
        path: PathBuf,
        offer: &CameraMode,
    ) -> Result<Self, Loss> {
        let said = |kernel: &mut dyn Kernel, errno: Errno| {
            let holders = if errno.0 == libc::EBUSY { kernel.holders(&path) } else { Vec::new() };
            (fault_of(errno), detail_of(&path, errno, &holders))
        };
        let granted = patiently(kernel, |kernel| grant(kernel, device, offer))
            .map_err(|errno| said(kernel, errno))?
            .ok_or_else(|| (Fault::NoFormat, path.display().to_string()))?;
        let queue = patiently(kernel, |kernel| match Queue::start(kernel, device) {
            Ok(queue) => Ok(Ok(queue)),
            Err(Broken::System(errno)) => Err(errno),
            Err(Broken::Driver(words)) => Ok(Err(words)),
        })
        .map_err(|errno| said(kernel, errno))?
        .map_err(|words| (Fault::DriverBroken, words.to_owned()))?;
        let clock = kernel.clock();
        let mode = granted.mode;
        Ok(Self {
            device,
            granted,
            health: Health::default(),
            queue: Some(queue),
            unpacker: Unpacker::new(mode.layout, mode.size, granted.bytes_per_line),
            bytes: Vec::new(),
            path,
            began_nanos: clock.monotonic_nanos,
            last_came_nanos: None,
            last_good_nanos: clock.monotonic_nanos,
            slept_nanos: clock.slept_nanos,
            last_time: CaptureTime { nanos: 0 },
            driver_nanos: Some(0),
            slowest_nanos: 0,
            empty_errors: 0,
            dropped: 0,
            rejected: 0,
        })
    }

    /// Waits at most `patience` for a good picture.
    pub(super) fn next(
        &mut self,
        kernel: &mut dyn Kernel,
        patience: Duration,
    ) -> Result<Option<Picture>, Loss> {
        let clock = kernel.clock();
        let now = clock.monotonic_nanos;
        if clock.slept_nanos > self.slept_nanos + SLEPT_NANOS {
            return Err((Fault::Suspended, String::new()));
        }
        let due = self.due_nanos();
        let until_due = Duration::from_nanos(due.saturating_sub(now));
        let wait = patience.min(until_due).max(Duration::from_millis(1));
        let ready = match kernel.wait(self.device, wait) {
            Ok(ready) => ready,
            Err(Errno(libc::EINTR)) => return Ok(None),
            Err(errno) => return Err(self.said(errno)),
        };
        if !ready.readable && !ready.error {
            // Check the time only now: pictures from a busy time of this thread are in the queue.
            if kernel.clock().monotonic_nanos < due {
                return Ok(None);
            }
            return Err(self.overdue());
        }
        let Some(queue) = &mut self.queue else { return Ok(None) };
        // Also after an error: taking a buffer tells the reason.
        let round = match queue.newest(kernel, &mut self.bytes) {
            Ok(round) => round,
            Err(Broken::System(errno)) => return Err(self.said(errno)),
            Err(Broken::Driver(words)) => return Err((Fault::DriverBroken, words.into())),
        };
        let now = kernel.clock().monotonic_nanos;
        self.dropped += round.dropped;
        self.rejected += round.bad;
        if round.came == 0 {
            self.empty_errors += u32::from(ready.error);
            if self.empty_errors > MOST_EMPTY_ERRORS {
                return Err((Fault::Transfer, self.path.display().to_string()));
            }
            if now >= due {
                return Err(self.overdue());
            }
            // A device ready for nothing must not keep a processor busy.
            kernel.pause(EMPTY_PAUSE);
            return Ok(None);
        }
        self.empty_errors = 0;
        if let Some(before) = self.last_came_nanos.replace(now) {
            // Slow decay: one late picture is no new rate.
            let gap = now.saturating_sub(before) / u64::from(round.came.max(1));
            self.slowest_nanos = gap.max(self.slowest_nanos - self.slowest_nanos / 16);
        }
        let picture = round.newest.and_then(|_| self.unpack(now));
        // A complete picture of a different size doesn't point to a damaged cable.
        let is_other_size = matches!(picture, Some(Err(Flaw::OtherSize)));
        let is_flawed = matches!(picture, Some(Err(_))) && !is_other_size;
        let damaged = round.bad as u32 + u32::from(is_flawed);
        let rate_hz = self.granted.mode.rate_hz();
        self.health.count(u64::from(round.came), damaged, rate_hz, now);
        let image = match picture {
            Some(Ok(image)) => image,
            _ if now.saturating_sub(self.last_good_nanos) <= DAMAGED_NANOS => return Ok(None),
            _ if is_other_size => {
                return Err((Fault::OtherMode, "the pictures have another size".into()));
            }
            _ if damaged > 0 => return Err((Fault::DamagedFrames, String::new())),
            _ => return Ok(None),
        };
        self.last_good_nanos = now;
        self.health.look(&image, now);
        let captured_at = round.newest.map_or(self.last_time, |filled| self.time(filled, now));
        Ok(Some(Picture { image, captured_at }))
    }

    /// The newest frame as a picture; `None` for a repetition, `Err` if not whole.
    fn unpack(&mut self, now: u64) -> Option<Result<GrayImage, Flaw>> {
        if self.health.repeats(crc32fast::hash(&self.bytes), now) {
            self.dropped += 1;
            self.last_good_nanos = now;
            return None;
        }
        Some(self.unpacker.unpack(&self.bytes).inspect_err(|_| self.rejected += 1))
    }

    /// Deadline of the next frame.
    fn due_nanos(&self) -> u64 {
        match self.last_came_nanos {
            None => self.began_nanos + START_NANOS,
            Some(last) => {
                let promised =
                    self.granted.mode.rate_hz().map_or(0, |rate_hz| (1e9 / rate_hz) as u64);
                let missing = MISSING * promised.max(self.slowest_nanos);
                last + missing.clamp(STEADY_NANOS, LONGEST_STEADY_NANOS)
            }
        }
    }

    fn overdue(&self) -> Loss {
        let is_first = self.last_came_nanos.is_none();
        (if is_first { Fault::NoFirstFrame } else { Fault::Stalled }, String::new())
    }

    /// Extends the deadline of the next picture after a busy time of the camera.
    pub(super) fn excuse(&mut self, nanos: u64) {
        match &mut self.last_came_nanos {
            Some(last) => *last += nanos,
            None => self.began_nanos += nanos,
        }
        self.last_good_nanos += nanos;
        self.health.excuse(nanos);
    }

    /// Driver's time of a frame, if believable; in any case later than the previous frame's.
    fn time(&mut self, filled: Filled, now: u64) -> CaptureTime {
        let is_of_clock = filled.flags & TIMESTAMP_MASK == TIMESTAMP_MONOTONIC
            && filled.nanos <= now
            && filled.nanos + BELIEVABLE_NANOS >= now;
        // Speeds would be infinite at a jump back in time.
        self.driver_nanos =
            self.driver_nanos.filter(|before| filled.nanos >= *before).map(|_| filled.nanos);
        let believable = is_of_clock && self.driver_nanos.is_some();
        let nanos = if believable { filled.nanos } else { now };
        self.last_time = CaptureTime { nanos: nanos.max(self.last_time.nanos + 1) };
        self.last_time
    }

    fn said(&self, errno: Errno) -> Loss {
        (fault_of(errno), detail_of(&self.path, errno, &[]))
    }

    /// Ends the stream and closes the node.
    pub(super) fn end(&mut self, kernel: &mut dyn Kernel) {
        if let Some(queue) = self.queue.take() {
            queue.stop(kernel);
            kernel.close(self.device);
        }
    }
}

/// Repeats a call for a while if another program has the device.
fn patiently<T>(
    kernel: &mut dyn Kernel,
    mut call: impl FnMut(&mut dyn Kernel) -> Result<T, Errno>,
) -> Result<T, Errno> {
    for _ in 0..BUSY_TRIES {
        match again(|| call(kernel)) {
            Err(Errno(libc::EBUSY)) => kernel.pause(BUSY_PAUSE),
            result => return result,
        }
    }
    call(kernel)
}
