//! The requests of a camera, answered over the network.

use std::{collections::BTreeMap, net::Ipv4Addr, path::Path, time::Duration};

use telegenic::{
    GenICamera,
    gige::{GigeConfig, proto::bootstrap},
};

use super::{
    device::{Chosen, Device, Stream},
    discovery,
    features::{self, Exact, errno},
};
use boresight_capture::v4l2::{
    BUFFERS, Camera, Linux,
    kernel::{
        CAP_STREAMING, CAP_VIDEO_CAPTURE, Capability, Clock, ControlRange, Errno, FLAG_ERROR,
        Filled, Format, FourCc, Fraction, FrameSizes, Handle, Kernel, Node, Readiness,
        TIMESTAMP_MONOTONIC,
    },
};

/// Time for an answer, and the number of repeats: a missing camera is detected within a second.
const ANSWER: Duration = Duration::from_millis(200);
const REPEATS: u8 = 3;
/// Time without a word from this computer after which the camera is free for others.
const HEARTBEAT_MILLIS: u32 = 3000;
/// Tries while another program has the camera, to outlast the heartbeat of a program that ended
/// silently.
const BUSY_TRIES: u32 = 8;
const BUSY_PAUSE: Duration = Duration::from_millis(500);
/// Time without pictures before asking the camera if still there.
const SILENCE_NANOS: u64 = 700_000_000;
/// Rates offered up to the camera's fastest, beside that fastest one.
const USUAL_RATES_HZ: [u32; 8] = [60, 50, 30, 25, 20, 15, 10, 5];

const GONE: Errno = Errno(libc::ENODEV);
const NONE: Errno = Errno(libc::EINVAL);

/// Machine-vision cameras on the network, or a single one by name.
#[derive(Debug, Default)]
pub struct Network {
    /// The clock, and pauses.
    system: Linux,
    /// Names of the requested camera; none for all cameras.
    names: Vec<String>,
    address: Option<Ipv4Addr>,
    open: BTreeMap<Handle, Device>,
    last_handle: i32,
    exact: Exact,
}

impl Network {
    /// Cameras called `name`, with the prefix `gige:`.
    pub fn of(name: &str) -> Self {
        let address = discovery::address(name);
        Self { names: vec![name.into()], address, ..Self::default() }
    }

    /// A camera found before: by its permanent name, at any address.
    pub fn of_camera(camera: &Camera) -> Self {
        let path = camera.node.path.to_string_lossy();
        let address = discovery::address(&path);
        Self { names: vec![camera.node.known_as.clone()], address, ..Self::default() }
    }

    fn device(&mut self, device: Handle) -> Result<&mut Device, Errno> {
        self.open.get_mut(&device).ok_or(Errno(libc::EBADF))
    }

    fn camera(&mut self, device: Handle) -> Result<&mut GenICamera, Errno> {
        self.device(device).map(|device| &mut device.camera)
    }

    fn stream(&mut self, device: Handle) -> Result<&mut Stream, Errno> {
        self.device(device)?.stream.as_mut().ok_or(NONE)
    }

    fn connect(&mut self, address: Ipv4Addr) -> Result<GenICamera, Errno> {
        let mut asked = GigeConfig::new(address);
        (asked.gvcp_timeout, asked.retries) = (ANSWER, REPEATS);
        asked.heartbeat_timeout_ms = HEARTBEAT_MILLIS;
        let mut camera = GenICamera::with_config(asked);
        // For a list of all cameras, it's enough to know that one is in use.
        let tries = if self.names.is_empty() { 1 } else { BUSY_TRIES };
        for _ in 0..tries {
            match camera.connect().map_err(|err| errno(&err)) {
                Err(Errno(libc::EBUSY)) => self.system.pause(BUSY_PAUSE),
                Err(other) => return Err(other),
                Ok(()) => return Ok(camera),
            }
        }
        Err(Errno(libc::EBUSY))
    }
}

impl Kernel for Network {
    fn backend(&self) -> &'static str {
        "gige"
    }

    fn nodes(&mut self) -> Vec<Node> {
        let seen = discovery::seen(self.address).into_iter();
        let mut nodes: Vec<Node> = seen.map(|seen| seen.node).collect();
        if !self.names.is_empty() {
            nodes.retain(|node| self.names.iter().any(|name| discovery::is_called(node, name)));
        }
        nodes
    }

    fn open(&mut self, path: &Path) -> Result<Handle, Errno> {
        let address = discovery::address(&path.to_string_lossy()).ok_or(Errno(libc::ENOENT))?;
        let device = Device::new(self.connect(address)?)?;
        self.last_handle += 1;
        let handle = Handle(self.last_handle);
        self.open.insert(handle, device);
        Ok(handle)
    }

    fn close(&mut self, device: Handle) {
        self.open.remove(&device);
    }

    fn capability(&mut self, device: Handle) -> Result<Capability, Errno> {
        let info =
            self.camera(device)?.transport().device_info().map_err(|err| errno(&err.into()))?;
        let card = format!("{} {}", info.manufacturer.trim(), info.model.trim());
        Ok(Capability {
            driver: "GigE Vision".into(),
            card: card.trim().into(),
            node_caps: CAP_VIDEO_CAPTURE | CAP_STREAMING,
        })
    }

    fn pixel_format(&mut self, device: Handle, index: u32) -> Result<FourCc, Errno> {
        let mut codes: Vec<FourCc> = Vec::new();
        for format in &self.device(device)?.formats {
            if !codes.contains(&format.fourcc) {
                codes.push(format.fourcc);
            }
        }
        codes.get(index as usize).copied().ok_or(NONE)
    }

    fn frame_sizes(&mut self, device: Handle, _: FourCc, index: u32) -> Result<FrameSizes, Errno> {
        let sizes = self.device(device)?.sizes()?;
        sizes.get(index as usize).map(|(w, h)| FrameSizes::Discrete(*w, *h)).ok_or(NONE)
    }

    fn frame_interval(
        &mut self,
        device: Handle,
        of: (FourCc, u32, u32),
        index: u32,
    ) -> Result<Fraction, Errno> {
        let most_hz = self.device(device)?.most_hz(of).ok_or(NONE)?;
        let usual = USUAL_RATES_HZ.into_iter().filter(|rate| f64::from(*rate) < most_hz);
        let mut rates = std::iter::once(fraction(most_hz)).chain(usual.map(|rate| (1, rate)));
        rates.nth(index as usize).ok_or(NONE)
    }

    fn set_format(&mut self, device: Handle, wanted: Format) -> Result<Format, Errno> {
        let device = self.device(device)?;
        device.run_freely();
        device.set_size(wanted.width, wanted.height).map_err(|err| errno(&err))?;
        let fitting = device.formats.iter().filter(|format| format.fourcc == wanted.fourcc);
        // A list may name formats the camera lacks, with its present settings or at all.
        let mut refused = NONE;
        for pixels in fitting.cloned().collect::<Vec<_>>() {
            let camera = &mut device.camera;
            let set = camera
                .set_enum("PixelFormat", &pixels.name)
                .and_then(|()| camera.get_enum("PixelFormat"))
                .and_then(|now| Ok((now, camera.get_integer("PixelFormat")?)));
            match set {
                Ok((now, code)) if now == pixels.name => {
                    let side = |name: &str, camera: &mut GenICamera| {
                        let px = camera.get_integer(name).map_err(|err| errno(&err))?;
                        u32::try_from(px).map_err(|_| NONE)
                    };
                    let (width, height) = (side("Width", camera)?, side("Height", camera)?);
                    device.chosen = Some(Chosen { pixels, code, width, height });
                    return Ok(Format { width, height, bytes_per_line: 0, ..wanted });
                }
                Ok(_) => {}
                Err(err) => refused = errno(&err),
            }
        }
        Err(refused)
    }

    fn set_interval(&mut self, device: Handle, wanted: Fraction) -> Result<Fraction, Errno> {
        let device = self.device(device)?;
        let (name, most_hz) = device.rate().ok_or(NONE)?;
        for switch in ["AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"] {
            if device.camera.has_feature(switch) {
                device.camera.set_boolean(switch, true).map_err(|err| errno(&err))?;
            }
        }
        let wanted_hz = f64::from(wanted.1) / f64::from(wanted.0.max(1));
        device.camera.set_float(name, wanted_hz.min(most_hz)).map_err(|err| errno(&err))?;
        device.camera.invalidate_caches().map_err(|err| errno(&err))?;
        device.camera.get_float(name).map(fraction).map_err(|err| errno(&err))
    }

    fn request_buffers(&mut self, device: Handle, count: u32) -> Result<u32, Errno> {
        if count == 0 {
            self.device(device)?.stop();
        }
        Ok(count)
    }

    fn map(&mut self, device: Handle, _: u32) -> Result<usize, Errno> {
        self.device(device)?.chosen.as_ref().map(Chosen::bytes).ok_or(NONE)
    }

    fn unmap_all(&mut self, _: Handle) {}

    fn queue(&mut self, device: Handle, index: u32) -> Result<(), Errno> {
        // Before the stream begins, their number is known.
        if let Some(stream) = &mut self.device(device)?.stream {
            stream.taken.remove(&index);
            if !stream.free.contains(&index) {
                stream.free.push_back(index);
            }
        }
        Ok(())
    }

    fn dequeue(&mut self, device: Handle) -> Result<Filled, Errno> {
        let now = self.clock().monotonic_nanos;
        let Device { chosen, stream, .. } = self.device(device)?;
        let (Some(chosen), Some(stream)) = (chosen, stream) else { return Err(NONE) };
        let empty = Errno(libc::EAGAIN);
        let Some(index) = stream.free.front().copied() else { return Err(empty) };
        let come = stream.come.pop_front().or_else(|| stream.frames.try_recv());
        let Some(frame) = come else { return Err(empty) };
        stream.free.pop_front();
        stream.last_sign_nanos = now;
        let is_whole = chosen.is_whole(&frame);
        let nanos = if is_whole { stream.time.here(frame.timestamp_ns, now) } else { now };
        let flags = TIMESTAMP_MONOTONIC | if is_whole { 0 } else { FLAG_ERROR };
        // Numbers of 64 bits are distinguished by the lower half.
        let sequence = frame.frame_id as u32;
        stream.taken.insert(index, frame);
        Ok(Filled { index, bytes_used: chosen.bytes() as u32, flags, sequence, nanos })
    }

    fn stream_on(&mut self, device: Handle) -> Result<(), Errno> {
        let now = self.clock().monotonic_nanos;
        let device = self.device(device)?;
        device.stream = Some(device.start(BUFFERS, now).map_err(|err| errno(&err))?);
        Ok(())
    }

    fn stream_off(&mut self, device: Handle) -> Result<(), Errno> {
        self.device(device)?.stop();
        Ok(())
    }

    fn wait(&mut self, device: Handle, patience: Duration) -> Result<Readiness, Errno> {
        let stream = self.stream(device)?;
        if stream.come.is_empty() {
            stream.come.extend(stream.frames.wait_for(patience));
        }
        let readable = !stream.come.is_empty();
        let last_sign_nanos = stream.last_sign_nanos;
        let now = self.clock().monotonic_nanos;
        let is_silent = !readable && now > last_sign_nanos + SILENCE_NANOS;
        let device = self.device(device)?;
        if !device.camera.is_connected() || (is_silent && !is_ours(&device.camera)) {
            device.is_gone = true;
            return Err(GONE);
        }
        if is_silent && let Some(stream) = &mut device.stream {
            stream.last_sign_nanos = now;
        }
        Ok(Readiness { readable, error: false })
    }

    fn bytes(&mut self, device: Handle, index: u32, len: usize) -> Option<&[u8]> {
        let Device { chosen, stream, .. } = self.open.get_mut(&device)?;
        let (chosen, stream) = (chosen.as_ref()?, stream.as_mut()?);
        let frame = stream.taken.get(&index)?;
        stream.read.clear();
        let size = (frame.width as usize, frame.height as usize);
        chosen.pixels.read(frame.data(), size, usize::from(frame.x_padding), &mut stream.read);
        stream.read.get(..len)
    }

    fn control_range(&mut self, device: Handle, id: u32) -> Result<ControlRange, Errno> {
        features::range(self.camera(device)?, id)
    }

    fn control(&mut self, device: Handle, id: u32) -> Result<i64, Errno> {
        features::get(self.camera(device)?, id)
    }

    fn set_control(&mut self, device: Handle, id: u32, value: i64) -> Result<(), Errno> {
        let mut exact = std::mem::take(&mut self.exact);
        let set =
            self.camera(device).and_then(|camera| features::set(camera, &mut exact, id, value));
        self.exact = exact;
        set
    }

    fn holders(&mut self, _: &Path) -> Vec<String> {
        Vec::new()
    }

    fn clock(&mut self) -> Clock {
        self.system.clock()
    }

    fn pause(&mut self, time: Duration) {
        self.system.pause(time);
    }
}

/// True if the camera confirms the control by this program. After too quick a restart to be noticed
/// as silence, the camera doesn't: it knows of no stream.
fn is_ours(camera: &GenICamera) -> bool {
    let asked = camera.transport().read_register(bootstrap::CONTROL_CHANNEL_PRIVILEGE);
    let answer = asked.map(|answer| answer.wait_timeout(ANSWER * (u32::from(REPEATS) + 1)));
    let control = bootstrap::CCP_CONTROL | bootstrap::CCP_EXCLUSIVE;
    matches!(answer, Ok(Ok(owned)) if owned & control != 0)
}

/// Time from picture to picture at a rate, in thousandths of a picture per second.
fn fraction(rate_hz: f64) -> Fraction {
    let thousandths = (1000.0 * rate_hz).round().clamp(0.0, f64::from(u32::MAX));
    (1000, thousandths as u32)
}
