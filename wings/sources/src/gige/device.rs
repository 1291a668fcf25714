//! An open camera on the network, and its stream.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Duration,
};

use telegenic::{
    Frame, FrameChannel, FrameStatus, GenICamera, GenicamError, PayloadKind, StreamChannel,
    StreamConfig,
};

use super::{
    features::{errno, present},
    pixels::Format as Pixels,
};
use crate::camera_time::CameraTime;
use boresight_capture::v4l2::kernel::{Errno, FourCc};

/// Time for a camera to release the connection.
const LET_GO: Duration = Duration::from_millis(200);
/// Memory for pictures in transfer, or not taken yet.
const PICTURES: usize = 6;
/// Bytes per second of the usual link.
const GIGABIT: f64 = 125e6;
/// Features stating the capacity of a camera's link, and the bytes per second of a unit.
const LINKS: [(&str, f64); 3] =
    [("DeviceLinkThroughputLimit", 1.0), ("DeviceLinkSpeed", 1.0), ("GevLinkSpeed", 125e3)];
/// Most additional bytes sent with a picture.
const LARGEST_ADDITION: usize = 1 << 20;

#[derive(Debug)]
pub(super) struct Device {
    pub(super) camera: GenICamera,
    /// Readable pixel formats, the most compact first.
    pub(super) formats: Vec<Pixels>,
    pub(super) chosen: Option<Chosen>,
    pub(super) stream: Option<Stream>,
    /// True after a missing answer: nothing more is sent.
    pub(super) is_gone: bool,
}

/// Chosen format and size.
#[derive(Clone, Debug)]
pub(super) struct Chosen {
    pub(super) pixels: Pixels,
    /// The camera's number for the format.
    pub(super) code: i64,
    pub(super) width: u32,
    pub(super) height: u32,
}

#[derive(Debug)]
pub(super) struct Stream {
    /// Closes the stream on drop.
    channel: StreamChannel,
    pub(super) frames: FrameChannel,
    pub(super) come: VecDeque<Arc<Frame>>,
    pub(super) last_sign_nanos: u64,
    pub(super) time: CameraTime,
    /// Buffers waiting for a picture, and pictures in buffers.
    pub(super) free: VecDeque<u32>,
    pub(super) taken: BTreeMap<u32, Arc<Frame>>,
    pub(super) read: Vec<u8>,
}

impl Device {
    pub(super) fn new(mut camera: GenICamera) -> Result<Self, Errno> {
        let names = camera.enum_entries("PixelFormat").map_err(|err| errno(&err))?;
        let mut formats: Vec<Pixels> =
            names.iter().filter_map(|name| Pixels::named(name)).collect();
        formats.sort_by_key(Pixels::bits);
        Ok(Self { camera, formats, chosen: None, stream: None, is_gone: false })
    }

    /// Width and height of the sensor, and the present ones.
    pub(super) fn sizes(&mut self) -> Result<Vec<(u32, u32)>, Errno> {
        let mut side = |now: &str, most: &str| {
            let camera = &mut self.camera;
            let now_px = camera.get_integer(now).map_err(|err| errno(&err))?;
            let most_px = camera
                .get_integer(most)
                .or_else(|_| camera.integer_bounds(now).map(|(_, most)| most));
            let px = |px: i64| u32::try_from(px).unwrap_or(0);
            Ok((px(most_px.unwrap_or(now_px).max(now_px)), px(now_px)))
        };
        let ((widest, width), (highest, height)) =
            (side("Width", "WidthMax")?, side("Height", "HeightMax")?);
        let mut sizes = vec![(widest, highest), (width, height)];
        sizes.dedup();
        Ok(sizes)
    }

    /// Name of the rate feature, and the fastest rate.
    pub(super) fn rate(&mut self) -> Option<(&'static str, f64)> {
        let names = ["AcquisitionFrameRate", "AcquisitionFrameRateAbs"];
        let (name, _) = present(&self.camera, &names)?;
        let (_, most) = self.camera.float_bounds(name).ok()?;
        Some((name, most))
    }

    /// Fastest rate of pictures with the given format and size: the camera's own, up to the
    /// capacity of the link.
    pub(super) fn most_hz(&mut self, (fourcc, width, height): (FourCc, u32, u32)) -> Option<f64> {
        let (_, most_hz) = self.rate()?;
        let pixels = self.formats.iter().find(|pixels| pixels.fourcc == fourcc)?;
        let bytes = pixels.bytes_sent(width as usize, height as usize, 0).max(1);
        Some(most_hz.min(self.link_bytes_hz() / bytes as f64))
    }

    /// Bytes per second of the camera's link, as stated.
    fn link_bytes_hz(&mut self) -> f64 {
        let camera = &mut self.camera;
        let stated = LINKS.iter().find_map(|(name, bytes)| {
            let value = match present(camera, &[*name])? {
                (_, true) => camera.get_float(name).ok()?,
                (_, false) => camera.get_integer(name).ok()? as f64,
            };
            (value > 0.0).then_some(value * bytes)
        });
        stated.unwrap_or(GIGABIT)
    }

    pub(super) fn set_size(&mut self, width: u32, height: u32) -> Result<(), GenicamError> {
        let camera = &mut self.camera;
        let standing = (camera.get_integer("Width")?, camera.get_integer("Height")?);
        if standing == (i64::from(width), i64::from(height)) {
            return Ok(());
        }
        for offset in ["OffsetX", "OffsetY"] {
            if camera.has_feature(offset) {
                camera.set_integer(offset, 0)?;
            }
        }
        camera.set_integer("Width", i64::from(width))?;
        camera.set_integer("Height", i64::from(height))
    }

    /// Prepares sending pictures continuously, at the fastest rate.
    pub(super) fn run_freely(&mut self) {
        let camera = &mut self.camera;
        // Missing features needn't be set; the pictures show the result.
        camera.execute("AcquisitionStop").ok();
        camera.set_integer("TLParamsLocked", 0).ok();
        camera.set_enum("AcquisitionMode", "Continuous").ok();
        let selectors = camera.enum_entries("TriggerSelector").unwrap_or_default();
        for selector in selectors.iter().filter(|name| name.ends_with("Start")) {
            if camera.set_enum("TriggerSelector", selector).is_ok() {
                camera.set_enum("TriggerMode", "Off").ok();
            }
        }
        if selectors.is_empty() {
            camera.set_enum("TriggerMode", "Off").ok();
        }
    }

    pub(super) fn start(&mut self, buffers: u32, now_nanos: u64) -> Result<Stream, GenicamError> {
        let payload = usize::try_from(self.camera.get_integer("PayloadSize")?).unwrap_or(0);
        let sent = self.chosen.as_ref().map_or(0, |chosen| {
            chosen.pixels.bytes_sent(chosen.width as usize, chosen.height as usize, 0)
        });
        // Memory for a possible picture, not for the camera's claim.
        let most = sent + sent / 8 + LARGEST_ADDITION;
        let asked = StreamConfig {
            payload_size: Some(payload.min(most)),
            n_buffers: PICTURES,
            ..StreamConfig::new()
        };
        let channel = self.camera.transport().open_stream(asked)?;
        let frames = channel.subscribe(PICTURES);
        self.camera.set_integer("TLParamsLocked", 1).ok();
        self.camera.execute("AcquisitionStart")?;
        Ok(Stream {
            channel,
            frames,
            come: VecDeque::new(),
            last_sign_nanos: now_nanos,
            time: CameraTime::default(),
            free: (0..buffers).collect(),
            taken: BTreeMap::new(),
            read: Vec::new(),
        })
    }

    /// Ends the stream. Sends nothing to a missing camera.
    pub(super) fn stop(&mut self) {
        let Some(stream) = self.stream.take() else { return };
        if self.is_gone {
            // First, so closing the stream doesn't wait for an answer.
            self.camera.disconnect(LET_GO);
        } else {
            self.camera.execute("AcquisitionStop").ok();
            self.camera.set_integer("TLParamsLocked", 0).ok();
        }
        drop(stream.channel);
    }
}

impl Chosen {
    /// True if every packet of the picture came, and the form is as requested.
    pub(super) fn is_whole(&self, frame: &Frame) -> bool {
        let (width, height) = (frame.width as usize, frame.height as usize);
        let padding = usize::from(frame.x_padding);
        frame.status == FrameStatus::Complete
            && matches!(frame.payload, PayloadKind::Image { .. })
            && (frame.width, frame.height) == (self.width, self.height)
            && i64::from(frame.pixel_format.0) == self.code
            && frame.received_size >= self.pixels.bytes_sent(width, height, padding)
            && frame.data().len() == frame.received_size
    }

    pub(super) fn bytes(&self) -> usize {
        self.pixels.bytes_read(self.width as usize, self.height as usize)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop();
        self.camera.disconnect(LET_GO);
    }
}
