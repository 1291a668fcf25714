//! Simulated cameras with identifiable pictures, and the result of a run.

#![allow(dead_code, unused_imports, reason = "each test program uses its part")]

use std::time::Duration;

use boresight::{
    capture::{
        Arrival, CaptureError, FrameSource,
        v4l2::{Camera, Found, LiveCamera, discover, find},
    },
    device::{CameraEvent, Fault, Wanted},
    frame::{CaptureTime, FrameId, ImageSize},
    session::{Input, Session},
    simulation::kernel::{SimCamera, SimControl, SimKernel},
};
use image::GrayImage;

pub(crate) use boresight_testkit::numbered::{SIZE, jpeg, jpeg_picture, number, picture};

pub(crate) const FOCUS: u32 = 0x009a_090a;
pub(crate) const FOCUS_AUTOMATIC: u32 = 0x009a_090c;
pub(crate) const ZOOM: u32 = 0x009a_090d;
pub(crate) const EXPOSURE: u32 = 0x009a_0902;
pub(crate) const EXPOSURE_AUTOMATIC: u32 = 0x009a_0901;

/// A grey camera with all lockable controls.
pub(crate) fn grey(node: u32) -> SimCamera {
    let mut camera =
        SimCamera::new(node, "A1", (*b"GREY", SIZE.0, SIZE.1), |n| picture(n).into_raw());
    camera.controls.insert(FOCUS, SimControl::at(30));
    camera.controls.insert(FOCUS_AUTOMATIC, SimControl::at(1));
    camera.controls.insert(ZOOM, SimControl::at(100));
    camera.controls.insert(EXPOSURE, SimControl::at(156));
    camera.controls.insert(EXPOSURE_AUTOMATIC, SimControl::at(3));
    camera
}

/// A motion-JPEG camera.
pub(crate) fn motion_jpeg(node: u32) -> SimCamera {
    SimCamera::new(node, "A1", (*b"MJPG", SIZE.0, SIZE.1), |n| jpeg(n, SIZE))
}

/// Result of a run.
#[derive(Debug, Default)]
pub(crate) struct Run {
    pub(crate) events: Vec<CameraEvent>,
    /// Number, time and content of every delivered picture.
    pub(crate) frames: Vec<(FrameId, CaptureTime, GrayImage)>,
    /// Pictures delivered while the session would take views.
    pub(crate) takeable: usize,
    /// Longest time of a call, of the simulated clock.
    pub(crate) longest: Duration,
    pub(crate) counted: (u64, u64),
}

impl Run {
    pub(crate) fn lost(&self) -> Vec<Fault> {
        let fault = |event: &CameraEvent| match event {
            CameraEvent::Lost { fault, .. } => Some(*fault),
            _ => None,
        };
        self.events.iter().filter_map(fault).collect()
    }

    pub(crate) fn doubts(&self) -> Vec<Fault> {
        let fault = |event: &CameraEvent| match event {
            CameraEvent::Doubtful { fault, .. } => Some(*fault),
            _ => None,
        };
        self.events.iter().filter_map(fault).collect()
    }

    pub(crate) fn returned(&self) -> bool {
        self.events.iter().any(|event| matches!(event, CameraEvent::Returned { .. }))
    }
}

/// Finds and opens the camera called `name`.
pub(crate) fn open(kernel: &SimKernel, name: &str) -> Result<LiveCamera<SimKernel>, Fault> {
    started(kernel, name, LiveCamera::open)
}

/// Opens the named camera for a preview.
pub(crate) fn preview(kernel: &SimKernel, name: &str) -> Result<LiveCamera<SimKernel>, Fault> {
    started(kernel, name, LiveCamera::preview)
}

type Start = fn(SimKernel, Camera, &Wanted) -> Result<LiveCamera<SimKernel>, CaptureError>;

fn started(kernel: &SimKernel, name: &str, start: Start) -> Result<LiveCamera<SimKernel>, Fault> {
    let found: Found = discover(&mut kernel.clone());
    let camera = find(&found, name).map_err(|(fault, _)| fault)?;
    start(kernel.clone(), camera, &Wanted::default()).map_err(|err| match err {
        CaptureError::Camera { fault, .. } => fault,
        other => unreachable!("{other}"),
    })
}

/// Runs a camera until `secs` of the simulated clock.
pub(crate) fn run(source: &mut LiveCamera<SimKernel>, kernel: &SimKernel, secs: f64) -> Run {
    const PATIENCE: Duration = Duration::from_millis(100);
    let mut run = Run::default();
    let size = ImageSize { width_px: SIZE.0, height_px: SIZE.1 };
    let config = boresight::config::Config::load(None, &[]).expect("defaults");
    let mut session = Session::new(config.session(size).expect("a board"));
    let now = || kernel.world().now_nanos;
    while now() < (secs * 1e9) as u64 {
        let before = now();
        match source.next_frame(PATIENCE).expect("a camera never breaks") {
            Arrival::Frame(frame) => {
                run.takeable += usize::from(session.camera().may_take());
                run.frames.push((frame.id, frame.captured_at, frame.image.clone()));
            }
            Arrival::Event(event) => {
                if let CameraEvent::Counted { dropped, rejected } = event {
                    run.counted = (dropped, rejected);
                }
                session.handle(&Input::Camera(event.clone()));
                run.events.push(event);
            }
            Arrival::NothingYet => {}
            Arrival::End => unreachable!("a camera never ends"),
        }
        run.longest = run.longest.max(Duration::from_nanos(now() - before));
    }
    run
}
