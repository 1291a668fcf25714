//! The system calls themselves. The only module with unsafe code.

#![allow(unsafe_code, reason = "system calls take pointers; each block says why it is sound")]

use std::{
    collections::BTreeMap,
    ffi::{c_int, c_void},
    fs,
    os::unix::{ffi::OsStrExt, fs::FileTypeExt},
    path::Path,
    ptr::{self, NonNull},
    time::Duration,
};

use v4l::{
    v4l_sys as sys,
    v4l2::{self, vidioc},
};

use super::{
    kernel::{
        Capability, Clock, ControlRange, Errno, Filled, Format, FourCc, Fraction, FrameSizes,
        Handle, Kernel, Node, Readiness,
    },
    system_files::{holders, nodes, text},
};

const CAPTURE: u32 = sys::v4l2_buf_type_V4L2_BUF_TYPE_VIDEO_CAPTURE;
const MMAP: u32 = sys::v4l2_memory_V4L2_MEMORY_MMAP;
/// The node reports capabilities separate from the device's.
const CAP_DEVICE_CAPS: u32 = 0x8000_0000;
const CONTROL_DISABLED: u32 = 0x0001;
const CONTROL_READ_ONLY: u32 = 0x0004;
/// Largest believable buffer, far more than any picture: a larger length is a driver's mistake.
const LARGEST_BUFFER: usize = 256 << 20;

/// The kernel of a running Linux.
#[derive(Debug, Default)]
pub struct Linux {
    open: BTreeMap<Handle, Vec<Option<Mapping>>>,
}

/// Memory shared with the driver.
#[derive(Debug)]
struct Mapping {
    start: NonNull<c_void>,
    len: usize,
    ours: bool,
}

// SAFETY: the mapping belongs to the owner of the value; nothing in it is tied to a thread.
unsafe impl Send for Mapping {}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: `start` and `len` are those of a mapping made by `map`, without other users:
        // `bytes` borrows from the same value. A failure leaves the memory mapped, which is
        // harmless.
        unsafe { libc::munmap(self.start.as_ptr(), self.len) };
    }
}

fn errno(err: &std::io::Error) -> Errno {
    Errno(err.raw_os_error().unwrap_or(libc::EIO))
}

fn last_errno() -> Errno {
    errno(&std::io::Error::last_os_error())
}

/// A structure of all zeros.
///
/// # Safety
///
/// Zeros must be a value of `T`: so for the kernel's structures, which are integers, and unions and
/// arrays of them.
unsafe fn zeroed<T>() -> T {
    // SAFETY: as the caller promises.
    unsafe { std::mem::zeroed() }
}

/// Makes an ioctl, again after a signal.
fn ioctl<T>(device: Handle, request: vidioc::_IOC_TYPE, argument: &mut T) -> Result<(), Errno> {
    loop {
        let pointer = ptr::from_mut(argument).cast();
        // SAFETY: every `request` in this file is used with the structure named by its definition
        // in `vidioc`, so the kernel reads and writes within `argument`; for these requests, the
        // kernel follows no pointers in the structures.
        match unsafe { v4l2::ioctl(device.0, request, pointer) } {
            Ok(()) => return Ok(()),
            Err(err) if err.raw_os_error() == Some(libc::EINTR) => {}
            Err(err) => return Err(errno(&err)),
        }
    }
}

fn time_nanos(clock: libc::clockid_t) -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a timespec alive through the call.
    unsafe { libc::clock_gettime(clock, &raw mut time) };
    u64::try_from(time.tv_sec).unwrap_or(0) * 1_000_000_000
        + u64::try_from(time.tv_nsec).unwrap_or(0)
}

impl Kernel for Linux {
    fn nodes(&mut self) -> Vec<Node> {
        nodes(Path::new("/sys/class/video4linux"), Path::new("/dev"))
    }

    fn open(&mut self, path: &Path) -> Result<Handle, Errno> {
        // The library's `open` panics on a zero byte.
        if path.as_os_str().as_bytes().contains(&0) {
            return Err(Errno(libc::ENOENT));
        }
        let is_device = fs::metadata(path).map_err(|err| errno(&err))?.file_type().is_char_device();
        if !is_device {
            return Err(Errno(libc::ENOTTY));
        }
        let flags = libc::O_RDWR | libc::O_NONBLOCK | libc::O_CLOEXEC;
        let handle = Handle(v4l2::open(path, flags).map_err(|err| errno(&err))?);
        self.open.insert(handle, Vec::new());
        Ok(handle)
    }

    fn close(&mut self, device: Handle) {
        if self.open.remove(&device).is_some() {
            // Even if closing fails, the number is free afterwards.
            v4l2::close(device.0).ok();
        }
    }

    fn capability(&mut self, device: Handle) -> Result<Capability, Errno> {
        // SAFETY: integers only.
        let mut answer: sys::v4l2_capability = unsafe { zeroed() };
        ioctl(device, vidioc::VIDIOC_QUERYCAP, &mut answer)?;
        let node_caps = if answer.capabilities & CAP_DEVICE_CAPS == 0 {
            answer.capabilities
        } else {
            answer.device_caps
        };
        Ok(Capability { driver: text(&answer.driver), card: text(&answer.card), node_caps })
    }

    fn pixel_format(&mut self, device: Handle, index: u32) -> Result<FourCc, Errno> {
        // SAFETY: integers only.
        let mut answer: sys::v4l2_fmtdesc = unsafe { zeroed() };
        (answer.index, answer.type_) = (index, CAPTURE);
        ioctl(device, vidioc::VIDIOC_ENUM_FMT, &mut answer)?;
        Ok(answer.pixelformat.to_le_bytes())
    }

    fn frame_sizes(&mut self, device: Handle, of: FourCc, index: u32) -> Result<FrameSizes, Errno> {
        // SAFETY: integers and unions of integers only.
        let mut answer: sys::v4l2_frmsizeenum = unsafe { zeroed() };
        (answer.index, answer.pixel_format) = (index, u32::from_le_bytes(of));
        ioctl(device, vidioc::VIDIOC_ENUM_FRAMESIZES, &mut answer)?;
        if answer.type_ == sys::v4l2_frmsizetypes_V4L2_FRMSIZE_TYPE_DISCRETE {
            // SAFETY: all members are integers, so any bytes are a value.
            let size = unsafe { answer.__bindgen_anon_1.discrete };
            return Ok(FrameSizes::Discrete(size.width, size.height));
        }
        // SAFETY: all members are integers, so any bytes are a value.
        let range = unsafe { answer.__bindgen_anon_1.stepwise };
        Ok(FrameSizes::Stepwise {
            width: (range.min_width, range.max_width, range.step_width),
            height: (range.min_height, range.max_height, range.step_height),
        })
    }

    fn frame_interval(
        &mut self,
        device: Handle,
        (fourcc, width, height): (FourCc, u32, u32),
        index: u32,
    ) -> Result<Fraction, Errno> {
        // SAFETY: integers and unions of integers only.
        let mut answer: sys::v4l2_frmivalenum = unsafe { zeroed() };
        (answer.index, answer.pixel_format) = (index, u32::from_le_bytes(fourcc));
        (answer.width, answer.height) = (width, height);
        ioctl(device, vidioc::VIDIOC_ENUM_FRAMEINTERVALS, &mut answer)?;
        let interval = if answer.type_ == sys::v4l2_frmivaltypes_V4L2_FRMIVAL_TYPE_DISCRETE {
            // SAFETY: all members are integers, so any bytes are a value.
            unsafe { answer.__bindgen_anon_1.discrete }
        } else if index == 0 {
            // SAFETY: all members are integers, so any bytes are a value.
            unsafe { answer.__bindgen_anon_1.stepwise }.min
        } else {
            return Err(Errno(libc::EINVAL));
        };
        Ok((interval.numerator, interval.denominator))
    }

    fn set_format(&mut self, device: Handle, wanted: Format) -> Result<Format, Errno> {
        // SAFETY: integers and unions of integers only.
        let mut answer: sys::v4l2_format = unsafe { zeroed() };
        answer.type_ = CAPTURE;
        // SAFETY: as above.
        let mut pix: sys::v4l2_pix_format = unsafe { zeroed() };
        (pix.width, pix.height) = (wanted.width, wanted.height);
        pix.pixelformat = u32::from_le_bytes(wanted.fourcc);
        pix.field = sys::v4l2_field_V4L2_FIELD_ANY;
        answer.fmt.pix = pix;
        ioctl(device, vidioc::VIDIOC_S_FMT, &mut answer)?;
        // SAFETY: all members are integers, so any bytes are a value.
        let pix = unsafe { answer.fmt.pix };
        Ok(Format {
            width: pix.width,
            height: pix.height,
            fourcc: pix.pixelformat.to_le_bytes(),
            bytes_per_line: pix.bytesperline,
            size_image: pix.sizeimage,
        })
    }

    fn set_interval(&mut self, device: Handle, wanted: Fraction) -> Result<Fraction, Errno> {
        // SAFETY: integers and unions of integers only.
        let mut answer: sys::v4l2_streamparm = unsafe { zeroed() };
        answer.type_ = CAPTURE;
        // SAFETY: as above.
        let mut capture: sys::v4l2_captureparm = unsafe { zeroed() };
        capture.timeperframe = sys::v4l2_fract { numerator: wanted.0, denominator: wanted.1 };
        answer.parm.capture = capture;
        ioctl(device, vidioc::VIDIOC_S_PARM, &mut answer)?;
        // SAFETY: all members are integers, so any bytes are a value.
        let granted = unsafe { answer.parm.capture }.timeperframe;
        Ok((granted.numerator, granted.denominator))
    }

    fn request_buffers(&mut self, device: Handle, count: u32) -> Result<u32, Errno> {
        // SAFETY: integers only.
        let mut answer: sys::v4l2_requestbuffers = unsafe { zeroed() };
        (answer.count, answer.type_, answer.memory) = (count, CAPTURE, MMAP);
        ioctl(device, vidioc::VIDIOC_REQBUFS, &mut answer)?;
        Ok(answer.count)
    }

    fn map(&mut self, device: Handle, index: u32) -> Result<usize, Errno> {
        let mappings = self.open.get_mut(&device).ok_or(Errno(libc::EBADF))?;
        let mut place = buffer(index);
        ioctl(device, vidioc::VIDIOC_QUERYBUF, &mut place)?;
        let len = place.length as usize;
        if len == 0 || len > LARGEST_BUFFER {
            return Err(Errno(libc::EINVAL));
        }
        // SAFETY: for memory-mapped buffers the kernel fills `offset`; all members are integers or
        // pointers not followed.
        let offset = libc::off_t::from(unsafe { place.m.offset });
        let protection = libc::PROT_READ;
        // SAFETY: a new shared mapping at an address chosen by the kernel touches no memory of
        // ours.
        let start = unsafe {
            libc::mmap(ptr::null_mut(), len, protection, libc::MAP_SHARED, device.0, offset)
        };
        if start == libc::MAP_FAILED {
            return Err(last_errno());
        }
        let start = NonNull::new(start).ok_or(Errno(libc::ENOMEM))?;
        let at = index as usize;
        if mappings.len() <= at {
            mappings.resize_with(at + 1, || None);
        }
        mappings[at] = Some(Mapping { start, len, ours: true });
        Ok(len)
    }

    fn unmap_all(&mut self, device: Handle) {
        if let Some(mappings) = self.open.get_mut(&device) {
            mappings.clear();
        }
    }

    fn queue(&mut self, device: Handle, index: u32) -> Result<(), Errno> {
        ioctl(device, vidioc::VIDIOC_QBUF, &mut buffer(index))?;
        self.own(device, index, false);
        Ok(())
    }

    fn dequeue(&mut self, device: Handle) -> Result<Filled, Errno> {
        let mut answer = buffer(0);
        ioctl(device, vidioc::VIDIOC_DQBUF, &mut answer)?;
        self.own(device, answer.index, true);
        let secs = u64::try_from(answer.timestamp.tv_sec).unwrap_or(0);
        let micros = u64::try_from(answer.timestamp.tv_usec).unwrap_or(0);
        Ok(Filled {
            index: answer.index,
            bytes_used: answer.bytesused,
            flags: answer.flags,
            sequence: answer.sequence,
            nanos: secs.saturating_mul(1_000_000_000).saturating_add(micros.saturating_mul(1000)),
        })
    }

    fn stream_on(&mut self, device: Handle) -> Result<(), Errno> {
        ioctl(device, vidioc::VIDIOC_STREAMON, &mut (CAPTURE as c_int))
    }

    fn stream_off(&mut self, device: Handle) -> Result<(), Errno> {
        ioctl(device, vidioc::VIDIOC_STREAMOFF, &mut (CAPTURE as c_int))?;
        // All buffers are the program's again.
        for mapping in self.open.get_mut(&device).into_iter().flatten().flatten() {
            mapping.ours = true;
        }
        Ok(())
    }

    fn wait(&mut self, device: Handle, patience: Duration) -> Result<Readiness, Errno> {
        let mut wanted = libc::pollfd { fd: device.0, events: libc::POLLIN, revents: 0 };
        let millis = c_int::try_from(patience.as_millis()).unwrap_or(c_int::MAX);
        // SAFETY: one structure alive through the call.
        if unsafe { libc::poll(&raw mut wanted, 1, millis) } < 0 {
            return Err(last_errno());
        }
        let any = |events: i16| wanted.revents & events != 0;
        Ok(Readiness {
            readable: any(libc::POLLIN),
            error: any(libc::POLLERR | libc::POLLHUP | libc::POLLNVAL),
        })
    }

    fn bytes(&mut self, device: Handle, index: u32, len: usize) -> Option<&[u8]> {
        let mapping = self.open.get(&device)?.get(index as usize)?.as_ref()?;
        if !mapping.ours || len > mapping.len {
            return None;
        }
        // SAFETY: `len` bytes from `start` are mapped readable for as long as the mapping is
        // borrowed from `self`, and the driver does not write to a buffer handed back: `ours` says
        // so, and handing it over again takes `&mut self`.
        Some(unsafe { std::slice::from_raw_parts(mapping.start.as_ptr().cast::<u8>(), len) })
    }

    fn control_range(&mut self, device: Handle, id: u32) -> Result<ControlRange, Errno> {
        // SAFETY: integers only.
        let mut answer: sys::v4l2_queryctrl = unsafe { zeroed() };
        answer.id = id;
        ioctl(device, vidioc::VIDIOC_QUERYCTRL, &mut answer)?;
        if answer.flags & CONTROL_DISABLED != 0 {
            return Err(Errno(libc::EINVAL));
        }
        Ok(ControlRange {
            min: answer.minimum.into(),
            max: answer.maximum.into(),
            step: answer.step.into(),
            default: answer.default_value.into(),
            writable: answer.flags & CONTROL_READ_ONLY == 0,
        })
    }

    fn control(&mut self, device: Handle, id: u32) -> Result<i64, Errno> {
        let mut answer = sys::v4l2_control { id, value: 0 };
        ioctl(device, vidioc::VIDIOC_G_CTRL, &mut answer)?;
        Ok(answer.value.into())
    }

    fn set_control(&mut self, device: Handle, id: u32, value: i64) -> Result<(), Errno> {
        let value = i32::try_from(value).map_err(|_| Errno(libc::ERANGE))?;
        ioctl(device, vidioc::VIDIOC_S_CTRL, &mut sys::v4l2_control { id, value })
    }

    fn holders(&mut self, path: &Path) -> Vec<String> {
        holders(path)
    }

    fn clock(&mut self) -> Clock {
        let monotonic_nanos = time_nanos(libc::CLOCK_MONOTONIC);
        let since_start_nanos = time_nanos(libc::CLOCK_BOOTTIME);
        Clock { monotonic_nanos, slept_nanos: since_start_nanos.saturating_sub(monotonic_nanos) }
    }

    fn pause(&mut self, time: Duration) {
        let millis = c_int::try_from(time.as_millis()).unwrap_or(c_int::MAX);
        // SAFETY: no structures, so nothing is read or written. A signal ends it early, without
        // harm.
        unsafe { libc::poll(ptr::null_mut(), 0, millis) };
    }
}

impl Linux {
    fn own(&mut self, device: Handle, index: u32, ours: bool) {
        let mappings = self.open.get_mut(&device);
        if let Some(Some(mapping)) = mappings.and_then(|all| all.get_mut(index as usize)) {
            mapping.ours = ours;
        }
    }
}

impl Drop for Linux {
    fn drop(&mut self) {
        for (device, mappings) in std::mem::take(&mut self.open) {
            drop(mappings);
            v4l2::close(device.0).ok();
        }
    }
}

fn buffer(index: u32) -> sys::v4l2_buffer {
    // SAFETY: integers, unions of integers, and pointers not followed for mapped buffers.
    let mut buffer: sys::v4l2_buffer = unsafe { zeroed() };
    (buffer.index, buffer.type_, buffer.memory) = (index, CAPTURE, MMAP);
    buffer
}
