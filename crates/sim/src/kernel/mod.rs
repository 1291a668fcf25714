//! Kernel model with a clock, strict rules of buffer ownership, and faults on demand.
//!
//! Time passes only in calls, so a test of five seconds takes none. Every broken rule is recorded
//! in [`World::violations`]; the program must never break any rule, whatever the cameras do.

mod camera;

pub use camera::{SimCamera, SimControl, SimFrame};

use std::{
    collections::BTreeMap,
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use boresight_capture::v4l2::kernel::{
    Capability, Clock, ControlRange, Errno, FLAG_ERROR, Filled, Format, FourCc, Fraction,
    FrameSizes, Handle, Kernel, Node, Readiness, TIMESTAMP_MONOTONIC,
};

/// Duration of any call.
const CALL_NANOS: u64 = 10_000;
/// Longest step of time.
const TICK_NANOS: u64 = 1_000_000;

/// Kernel model. Clones share a world.
#[derive(Clone, Default)]
pub struct SimKernel {
    world: Arc<Mutex<World>>,
    /// Bytes of the last request, returned by reference.
    lent: Vec<u8>,
}

/// Scheduled event.
type Happening = Box<dyn FnOnce(&mut World) + Send>;

/// World of the model.
#[derive(Default)]
pub struct World {
    /// Monotonic clock.
    pub now_nanos: u64,
    /// Time that waits have slept, in nanoseconds.
    pub slept_nanos: u64,
    /// Cameras, plugged in or not.
    pub cameras: Vec<SimCamera>,
    /// Broken rules.
    pub violations: Vec<String>,
    /// Calls made so far.
    pub calls: u64,
    /// Number of the call that fails once, and the error.
    pub fails: Option<(u64, i32)>,
    /// Programs holding a node, as in `/proc`.
    pub holders: Vec<String>,
    script: Vec<(u64, Happening)>,
    open: BTreeMap<Handle, Open>,
    opened: i32,
}

struct Open {
    camera: usize,
    /// True after unplugging: this handle is dead for ever.
    dead: bool,
    format: Option<Format>,
    interval: Fraction,
    buffers: Vec<Buffer>,
    queue: Vec<u32>,
    done: Vec<Filled>,
    next_frame_nanos: Option<u64>,
    sequence: u32,
}

#[derive(Clone, Debug, Default)]
struct Buffer {
    data: Vec<u8>,
    mapped: bool,
    owner: Owner,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Owner {
    #[default]
    Program,
    Driver,
}

impl SimKernel {
    /// World with the given cameras.
    pub fn new(cameras: Vec<SimCamera>) -> Self {
        let kernel = Self::default();
        kernel.world().cameras = cameras;
        kernel
    }

    /// World, to inspect or change.
    pub fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Schedules `happening` at `secs` of the monotonic clock.
    pub fn at(&self, secs: f64, happening: impl FnOnce(&mut World) + Send + 'static) {
        let mut world = self.world();
        world.script.push(((secs * 1e9) as u64, Box::new(happening)));
        world.script.sort_by_key(|(nanos, _)| *nanos);
    }

    /// Number of open devices.
    pub fn open_devices(&self) -> usize {
        self.world().open.len()
    }

    /// Lets the time of a control transfer pass; the device streams meanwhile.
    fn transfer(&self, device: Handle) {
        let mut world = self.world();
        let Some(open) = world.open.get(&device) else { return };
        let nanos = world.cameras[open.camera].control_nanos;
        world.pass(nanos);
    }

    /// Makes a call on a live open device.
    fn call<T>(
        &self,
        device: Handle,
        work: impl FnOnce(&mut World, &mut Open) -> Result<T, Errno>,
    ) -> Result<T, Errno> {
        let mut world = self.world();
        world.count()?;
        let Some(mut open) = world.open.remove(&device) else {
            world.violations.push(format!("{device:?} is not open"));
            return Err(Errno(libc::EBADF));
        };
        let result = if open.dead { Err(Errno(libc::ENODEV)) } else { work(&mut world, &mut open) };
        world.open.insert(device, open);
        result
    }
}

impl World {
    /// Counts a call, and fails the call meant to fail.
    fn count(&mut self) -> Result<(), Errno> {
        self.calls += 1;
        self.pass(CALL_NANOS);
        match self.fails {
            Some((number, errno)) if number == self.calls => Err(Errno(errno)),
            _ => Ok(()),
        }
    }

    /// Advances the time.
    fn pass(&mut self, nanos: u64) {
        let until = self.now_nanos + nanos;
        while self.now_nanos < until {
            self.now_nanos = until.min(self.now_nanos + TICK_NANOS);
            while self.script.first().is_some_and(|(at, _)| *at <= self.now_nanos) {
                let (_, happening) = self.script.remove(0);
                happening(self);
            }
            let now = self.now_nanos;
            let mut all = std::mem::take(&mut self.open);
            for open in all.values_mut() {
                self.frames(open, now);
            }
            self.open.append(&mut all);
        }
    }

    /// Lets the camera of `open` take the due pictures.
    fn frames(&mut self, open: &mut Open, now: u64) {
        let camera = &mut self.cameras[open.camera];
        if !camera.present {
            open.dead = true;
        }
        let Some(due) = open.next_frame_nanos.filter(|due| *due <= now && !open.dead) else {
            return;
        };
        let (n, d) = open.interval;
        let interval =
            if n == 0 || d == 0 { 33_333_333 } else { u64::from(n) * 1_000_000_000 / u64::from(d) };
        open.next_frame_nanos = Some(due + (interval as f64 * camera.slowness) as u64);
        let sequence = open.sequence;
        open.sequence = open.sequence.wrapping_add(1);
        let number = camera.taken;
        camera.taken += 1;
        let bytes = (camera.picture)(number);
        let mut frame = SimFrame {
            bytes_used: bytes.len() as u32,
            bytes,
            error: false,
            sequence,
            nanos: due,
            delivered: true,
            index: None,
        };
        for fault in &mut camera.frame_faults {
            fault(number, &mut frame);
        }
        if !frame.delivered || camera.poll_error || open.queue.is_empty() {
            return;
        }
        let index = open.queue.remove(0);
        let buffer = &mut open.buffers[index as usize];
        let length = frame.bytes.len().min(buffer.data.len());
        // Remainders of the last frame stay in the buffer.
        buffer.data[..length].copy_from_slice(&frame.bytes[..length]);
        open.done.push(Filled {
            index: frame.index.unwrap_or(index),
            bytes_used: frame.bytes_used,
            flags: TIMESTAMP_MONOTONIC | if frame.error { FLAG_ERROR } else { 0 },
            sequence: frame.sequence,
            nanos: frame.nanos,
        });
    }
}

fn refused(errno: Option<i32>) -> Result<(), Errno> {
    errno.map_or(Ok(()), |errno| Err(Errno(errno)))
}

impl Kernel for SimKernel {
    fn nodes(&mut self) -> Vec<Node> {
        let world = self.world();
        world.cameras.iter().filter(|c| c.present).map(|c| c.node.clone()).collect()
    }

    fn open(&mut self, path: &Path) -> Result<Handle, Errno> {
        let mut world = self.world();
        world.count()?;
        let present = |camera: &SimCamera| camera.present && camera.node.path == path;
        let camera = world.cameras.iter().position(present).ok_or(Errno(libc::ENOENT))?;
        refused(world.cameras[camera].open_fails)?;
        world.opened += 1;
        let handle = Handle(world.opened);
        let open = Open {
            camera,
            dead: false,
            format: None,
            interval: (1, 30),
            buffers: Vec::new(),
            queue: Vec::new(),
            done: Vec::new(),
            next_frame_nanos: None,
            sequence: 0,
        };
        world.open.insert(handle, open);
        Ok(handle)
    }

    fn close(&mut self, device: Handle) {
        let mut world = self.world();
        match world.open.remove(&device) {
            None => world.violations.push(format!("{device:?} is closed twice")),
            Some(open) if open.buffers.iter().any(|buffer| buffer.mapped) => {
                world.violations.push(format!("{device:?} is closed with mapped buffers"));
            }
            Some(_) => {}
        }
    }

    fn capability(&mut self, device: Handle) -> Result<Capability, Errno> {
        self.call(device, |world, open| Ok(world.cameras[open.camera].capability.clone()))
    }

    fn pixel_format(&mut self, device: Handle, index: u32) -> Result<FourCc, Errno> {
        self.call(device, |world, open| {
            let offers = &world.cameras[open.camera].formats;
            offers.get(index as usize).map(|(fourcc, ..)| *fourcc).ok_or(Errno(libc::EINVAL))
        })
    }

    fn frame_sizes(&mut self, device: Handle, of: FourCc, index: u32) -> Result<FrameSizes, Errno> {
        self.call(device, |world, open| {
            let formats = &world.cameras[open.camera].formats;
            let format = formats.iter().find(|(fourcc, ..)| *fourcc == of);
            let sizes = format.map_or(&[][..], |(_, sizes, _)| sizes.as_slice());
            sizes.get(index as usize).copied().ok_or(Errno(libc::EINVAL))
        })
    }

    fn frame_interval(
        &mut self,
        device: Handle,
        (of, ..): (FourCc, u32, u32),
        index: u32,
    ) -> Result<Fraction, Errno> {
        self.call(device, |world, open| {
            let formats = &world.cameras[open.camera].formats;
            let format = formats.iter().find(|(fourcc, ..)| *fourcc == of);
            let intervals = format.map_or(&[][..], |(_, _, intervals)| intervals.as_slice());
            intervals.get(index as usize).copied().ok_or(Errno(libc::EINVAL))
        })
    }

    fn set_format(&mut self, device: Handle, wanted: Format) -> Result<Format, Errno> {
        self.call(device, |world, open| {
            let camera = &mut world.cameras[open.camera];
            refused(camera.set_format_fails)?;
            let granted = (camera.grants)(wanted);
            open.format = Some(granted);
            Ok(granted)
        })
    }

    fn set_interval(&mut self, device: Handle, wanted: Fraction) -> Result<Fraction, Errno> {
        self.call(device, |world, open| {
            let camera = &world.cameras[open.camera];
            open.interval = camera.grants_interval.unwrap_or(wanted);
            Ok(open.interval)
        })
    }

    fn request_buffers(&mut self, device: Handle, count: u32) -> Result<u32, Errno> {
        self.call(device, |world, open| {
            if open.next_frame_nanos.is_some() || open.buffers.iter().any(|buffer| buffer.mapped) {
                return Err(Errno(libc::EBUSY));
            }
            let camera = &world.cameras[open.camera];
            refused(camera.request_fails)?;
            let size = camera.buffer_size;
            let granted = count.min(camera.most_buffers);
            let buffer = Buffer { data: vec![0; size], ..Buffer::default() };
            open.buffers = vec![buffer; granted as usize];
            Ok(granted)
        })
    }

    fn map(&mut self, device: Handle, index: u32) -> Result<usize, Errno> {
        self.call(device, |_, open| {
            let buffer = open.buffers.get_mut(index as usize).ok_or(Errno(libc::EINVAL))?;
            buffer.mapped = true;
            Ok(buffer.data.len())
        })
    }

    fn unmap_all(&mut self, device: Handle) {
        if let Some(open) = self.world().open.get_mut(&device) {
            open.buffers.iter_mut().for_each(|buffer| buffer.mapped = false);
        }
    }

    fn queue(&mut self, device: Handle, index: u32) -> Result<(), Errno> {
        self.call(device, |world, open| {
            let camera = &mut world.cameras[open.camera];
            if let Some((errno, times)) = camera.queue_fails.take_if(|(_, times)| *times > 0) {
                camera.queue_fails = Some((errno, times - 1));
                return Err(Errno(errno));
            }
            let buffer = open.buffers.get_mut(index as usize).ok_or(Errno(libc::EINVAL))?;
            if buffer.owner == Owner::Driver || !buffer.mapped {
                world.violations.push(format!("buffer {index} is queued and is not the program's"));
                return Err(Errno(libc::EINVAL));
            }
            buffer.owner = Owner::Driver;
            open.queue.push(index);
            Ok(())
        })
    }

    fn dequeue(&mut self, device: Handle) -> Result<Filled, Errno> {
        self.call(device, |world, open| {
            let camera = &mut world.cameras[open.camera];
            if let Some((errno, times)) = camera.dequeue_fails.take_if(|(_, times)| *times > 0) {
                camera.dequeue_fails = Some((errno, times - 1));
                return Err(Errno(errno));
            }
            if open.done.is_empty() {
                return Err(Errno(libc::EAGAIN));
            }
            let filled = open.done.remove(0);
            if let Some(buffer) = open.buffers.get_mut(filled.index as usize) {
                buffer.owner = Owner::Program;
            }
            Ok(filled)
        })
    }

    fn stream_on(&mut self, device: Handle) -> Result<(), Errno> {
        self.call(device, |world, open| {
            let camera = &world.cameras[open.camera];
            refused(camera.stream_on_fails)?;
            open.sequence = camera.first_sequence;
            open.next_frame_nanos = Some(world.now_nanos + camera.start_nanos);
            Ok(())
        })
    }

    fn stream_off(&mut self, device: Handle) -> Result<(), Errno> {
        self.call(device, |world, open| {
            refused(world.cameras[open.camera].stream_off_fails)?;
            open.next_frame_nanos = None;
            open.queue.clear();
            open.done.clear();
            open.buffers.iter_mut().for_each(|buffer| buffer.owner = Owner::Program);
            Ok(())
        })
    }

    fn wait(&mut self, device: Handle, patience: Duration) -> Result<Readiness, Errno> {
        let until = self.world().now_nanos + patience.as_nanos() as u64;
        self.call(device, |_, _| Ok(()))?;
        loop {
            let mut world = self.world();
            let Some(open) = world.open.get(&device) else { return Err(Errno(libc::EBADF)) };
            let camera = &world.cameras[open.camera];
            let error = open.dead || camera.poll_error;
            let storm = camera.dequeue_fails.is_some_and(|(_, times)| times > 0);
            let readable = (!open.done.is_empty() && !camera.poll_error) || open.dead || storm;
            if readable || error {
                return Ok(Readiness { readable, error });
            }
            if let Some(times) = camera.interruptions.checked_sub(1) {
                let camera = open.camera;
                world.cameras[camera].interruptions = times;
                return Err(Errno(libc::EINTR));
            }
            if world.now_nanos >= until {
                return Ok(Readiness::default());
            }
            let tick = TICK_NANOS.min(until - world.now_nanos);
            world.pass(tick);
        }
    }

    fn bytes(&mut self, device: Handle, index: u32, len: usize) -> Option<&[u8]> {
        let mut world = self.world();
        let buffer = world.open.get(&device)?.buffers.get(index as usize)?;
        if buffer.owner == Owner::Driver || !buffer.mapped {
            world.violations.push(format!("buffer {index} is read and is not the program's"));
            return None;
        }
        let bytes = buffer.data.get(..len)?.to_vec();
        drop(world);
        self.lent = bytes;
        Some(&self.lent)
    }

    fn control_range(&mut self, device: Handle, id: u32) -> Result<ControlRange, Errno> {
        self.call(device, |world, open| {
            let control = world.cameras[open.camera].controls.get(&id);
            control.map(|control| control.range).ok_or(Errno(libc::EINVAL))
        })
    }

    fn control(&mut self, device: Handle, id: u32) -> Result<i64, Errno> {
        self.transfer(device);
        self.call(device, |world, open| {
            let control = world.cameras[open.camera].controls.get(&id);
            control.map(|control| control.value).ok_or(Errno(libc::EINVAL))
        })
    }

    fn set_control(&mut self, device: Handle, id: u32, value: i64) -> Result<(), Errno> {
        self.transfer(device);
        self.call(device, |world, open| {
            let controls = &mut world.cameras[open.camera].controls;
            let control = controls.get_mut(&id).ok_or(Errno(libc::EINVAL))?;
            if !control.range.writable {
                return Err(Errno(libc::EACCES));
            }
            if control.obeys {
                control.value = value;
            }
            Ok(())
        })
    }

    fn holders(&mut self, _path: &Path) -> Vec<String> {
        self.world().holders.clone()
    }

    fn clock(&mut self) -> Clock {
        let world = self.world();
        Clock { monotonic_nanos: world.now_nanos, slept_nanos: world.slept_nanos }
    }

    fn pause(&mut self, time: Duration) {
        self.world().pass(time.as_nanos() as u64);
    }
}
