//! A live camera as a frame source: settles, locks, watches, loses and finds its camera.
//!
//! ```text
//!            open                 10 to 60 frames           0.5 s, read back
//!  (closed) ──────▶ settling ───────────────────▶ locking ───────────────────▶ steady
//!                      ▲                             ▲                           │
//!            not locked yet                    locked before            error, stall, sleep
//!                      └─────────── lost ────────────┘◀──────────────────────────┘
//!                            looks for the same camera
//! ```
//!
//! Frames are delivered only when steady: before, exposure and focus may still move. A preview
//! delivers all frames, and sets no control.

mod control_work;
mod locking;
mod loss;
mod recognition;
mod setting;
mod task;

use std::{collections::VecDeque, sync::Arc, time::Duration};

pub use recognition::found_again;
use recognition::other_than_asked;
use task::{ControlWork, Task};

use super::{
    controls::{ControlLock, Survey},
    discovery::{Camera, Identity},
    kernel::{Errno, Kernel},
    stream::{Loss, Picture, Stream},
};
use crate::{
    Arrival, CameraMode, CaptureError, FrameSource, SourceIdentity, choose,
    health::{light, sharpness},
    not_offered,
};
use boresight_geometry::{
    device::{
        Adjustable, CameraEvent, CameraInfo, Control, ControlBefore, Fault, Locks, Mode, Wanted,
    },
    frame::{CaptureTime, Frame, FrameId, FrameKind},
};

/// Least and most frames, and most time, until exposure and focus count as settled.
const LEAST_SETTLING: u32 = 10;
const MOST_SETTLING: u32 = 60;
const MOST_SETTLING_NANOS: u64 = 3_000_000_000;
/// Largest relative change of brightness over the last frames of a settled picture, and the number
/// of frames.
const SETTLED_CHANGE: f64 = 0.02;
const SETTLED_FRAMES: usize = 5;
/// Time for a control change to take effect.
const LOCKING_NANOS: u64 = 500_000_000;
/// Time between two readings of the controls, in nanoseconds.
const READ_BACK_NANOS: u64 = 1_000_000_000;
/// Least share of sharpness to keep; below, locking has moved the focus.
const SHARPNESS_KEPT: f64 = 0.4;
/// Shortest and longest pause between looks for a lost camera.
const SHORTEST_PAUSE_NANOS: u64 = 200_000_000;
const LONGEST_PAUSE_NANOS: u64 = 1_500_000_000;

/// A live camera.
pub struct LiveCamera<K: Kernel> {
    kernel: K,
    camera: Camera,
    identity: Identity,
    offer: CameraMode,
    mode: Mode,
    keeper: ControlLock,
    controls_before: Vec<ControlBefore>,
    /// Adjustable controls, as found on opening the camera.
    adjustables: Vec<Adjustable>,
    locks: Option<Locks>,
    state: State,
    events: VecDeque<CameraEvent>,
    next_id: u64,
    /// Counts of the earlier streams.
    dropped_before: u64,
    rejected_before: u64,
    told: (u64, u64),
    /// True if the camera's controls are left alone.
    only_looks: bool,
}

#[derive(Debug)]
enum State {
    Running(Box<Running>),
    Lost { loss: Loss, next_look_nanos: u64, pause_nanos: u64 },
}

#[derive(Debug)]
struct Running {
    stream: Stream,
    phase: Phase,
    returning: bool,
    /// Task in progress on the controls.
    work: Option<ControlWork>,
    /// Time until which the controls rest.
    rest_until_nanos: u64,
}

#[derive(Debug)]
enum Phase {
    /// Pictures for looking only: exposure and focus may move.
    Looking,
    Settling {
        means: VecDeque<f64>,
        count: u32,
        until_nanos: u64,
    },
    Locking {
        /// Some cameras obey only the second time.
        again: bool,
        done_nanos: u64,
        sharp_before: f64,
        sharp_now: f64,
    },
    /// Controls were set by the person; the picture settles.
    Setting {
        controls: Vec<Control>,
        again: bool,
        done_nanos: u64,
        changed: Vec<(Control, i64)>,
    },
    Steady {
        next_read_nanos: u64,
        good_until: CaptureTime,
        changed: Vec<(Control, i64)>,
    },
}

impl<K: Kernel> LiveCamera<K> {
    /// Opens and starts `camera` in the best `wanted` mode.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it cannot be opened or started.
    pub fn open(kernel: K, camera: Camera, wanted: &Wanted) -> Result<Self, CaptureError> {
        Self::start(kernel, camera, wanted, false)
    }

    /// Opens a camera for a preview: no control is set, now or at the end, and pictures come at
    /// once.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn preview(kernel: K, camera: Camera, wanted: &Wanted) -> Result<Self, CaptureError> {
        Self::start(kernel, camera, wanted, true)
    }

    fn start(
        mut kernel: K,
        camera: Camera,
        wanted: &Wanted,
        only_looks: bool,
    ) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let offer = choose(&camera.offers, wanted).ok_or_else(|| {
            let name = camera.stable_name();
            failed((Fault::NoFormat, not_offered(&name, &camera.offers, wanted)))
        })?;
        let stream = Stream::start(&mut kernel, &camera, &offer).map_err(failed)?;
        let survey =
            if only_looks { Survey::default() } else { Survey::of(&mut kernel, stream.device) };
        let keeper = ControlLock::remember(&survey);
        let controls_before = survey.before();
        let adjustables = survey.adjustables();
        let mode = stream.granted.mode;
        let mut events = VecDeque::from([CameraEvent::Started { mode }]);
        if let Some(detail) = other_than_asked(&offer, &mode) {
            events.push_back(CameraEvent::Doubtful { fault: Fault::OtherMode, detail });
        }
        for (applies, fault) in [
            (camera.has_twin, Fault::Twin),
            (camera.is_virtual, Fault::Virtual),
            (camera.is_infrared, Fault::Infrared),
        ] {
            if applies {
                events.push_back(CameraEvent::Doubtful { fault, detail: camera.stable_name() });
            }
        }
        let phase = if only_looks { Phase::Looking } else { settling(&mut kernel) };
        let running = Running { stream, phase, returning: false, work: None, rest_until_nanos: 0 };
        let state = State::Running(Box::new(running));
        Ok(Self {
            identity: camera.identity(),
            kernel,
            camera,
            offer,
            mode,
            keeper,
            controls_before,
            adjustables,
            locks: None,
            state,
            events,
            next_id: 0,
            dropped_before: 0,
            rejected_before: 0,
            told: (0, 0),
            only_looks,
        })
    }

    /// The discovered camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The mode of the session.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    fn now_nanos(&mut self) -> u64 {
        self.kernel.clock().monotonic_nanos
    }

    /// Takes a look at the stream.
    fn step(&mut self, patience: Duration) -> Result<Option<Picture>, Loss> {
        let State::Running(running) = &mut self.state else { return Ok(None) };
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let picture = running.stream.next(kernel, patience)?;
        self.events.extend(running.stream.health.changes());
        // The last picture of settling was taken before its end, so isn't delivered.
        let was_setting = matches!(running.phase, Phase::Setting { .. });
        let now = self.kernel.clock().monotonic_nanos;
        self.go_on(picture.as_ref(), now).map_err(|errno| (Fault::Unplugged, errno.words()))?;
        let delivers = matches!(
            &self.state,
            State::Running(r) if matches!(r.phase, Phase::Steady { .. } | Phase::Looking)
        );
        Ok(picture.filter(|_| delivers && !was_setting))
    }

    /// Advances the phase.
    fn go_on(&mut self, picture: Option<&Picture>, now: u64) -> Result<(), Errno> {
        if !self.work_on()? {
            return Ok(());
        }
        let State::Running(running) = &mut self.state else { return Ok(()) };
        match &mut running.phase {
            Phase::Looking => {}
            Phase::Settling { means, count, until_nanos } => {
                let Some(picture) = picture else { return Ok(()) };
                *count += 1;
                means.push_back(light(&picture.image).0);
                if means.len() > SETTLED_FRAMES {
                    means.pop_front();
                }
                if settled(means, *count) || now > *until_nanos {
                    let sharp_before = sharpness(&picture.image);
                    running.phase = locking(sharp_before);
                    self.work(Task::Lock);
                }
            }
            Phase::Locking { again, done_nanos, sharp_now, .. } => {
                if let Some(picture) = picture {
                    *sharp_now = sharpness(&picture.image);
                }
                if *again && now >= *done_nanos && picture.is_some() {
                    self.work(Task::Lock);
                }
            }
            Phase::Setting { again, done_nanos, .. } => {
                if *again && now >= *done_nanos && picture.is_some() {
                    self.work(Task::Lock);
                }
            }
            Phase::Steady { next_read_nanos, .. } => {
                if now >= *next_read_nanos {
                    *next_read_nanos = u64::MAX;
                    self.work(Task::Read);
                    self.tell_counts();
                }
            }
        }
        self.work_on().map(drop)
    }

    fn counts(&self) -> (u64, u64) {
        let (dropped, rejected) = match &self.state {
            State::Running(running) => (running.stream.dropped, running.stream.rejected),
            State::Lost { .. } => (0, 0),
        };
        (self.dropped_before + dropped, self.rejected_before + rejected)
    }

    fn tell_counts(&mut self) {
        let counts = self.counts();
        if counts != self.told {
            self.told = counts;
            let (dropped, rejected) = counts;
            self.events.push_back(CameraEvent::Counted { dropped, rejected });
        }
    }
}

fn settling(kernel: &mut dyn Kernel) -> Phase {
    let until_nanos = kernel.clock().monotonic_nanos + MOST_SETTLING_NANOS;
    Phase::Settling { means: VecDeque::new(), count: 0, until_nanos }
}

/// Phase before the controls are set for the first time.
fn locking(sharp_before: f64) -> Phase {
    Phase::Locking { again: false, done_nanos: u64::MAX, sharp_before, sharp_now: sharp_before }
}

fn settled(means: &VecDeque<f64>, count: u32) -> bool {
    let (least, most) = means.iter().fold((f64::MAX, 0.0_f64), |(a, b), m| (a.min(*m), b.max(*m)));
    let even = means.len() == SETTLED_FRAMES && most - least <= SETTLED_CHANGE * most.max(1.0);
    (count >= LEAST_SETTLING && even) || count >= MOST_SETTLING
}

impl<K: Kernel> FrameSource for LiveCamera<K> {
    fn identity(&self) -> SourceIdentity {
        SourceIdentity { name: self.camera.stable_name(), image_size: Some(self.mode.size) }
    }

    fn waits(&self) -> bool {
        false
    }

    fn camera_facts(&self) -> Option<CameraInfo> {
        Some(self.camera.facts(self.kernel.backend(), self.mode, self.controls_before.clone()))
    }

    fn adjustables(&mut self) -> Vec<Adjustable> {
        self.adjustables.clone()
    }

    fn put_back_at_end(&mut self, before: &[ControlBefore]) {
        self.keeper.put_back(before);
    }

    fn adjust(&mut self, control: Control, value: i64) {
        self.ask_for(control, value);
    }

    fn next_frame(&mut self, patience: Duration) -> Result<Arrival, CaptureError> {
        let until = self.now_nanos().saturating_add(patience.as_nanos() as u64);
        loop {
            if let Some(event) = self.events.pop_front() {
                return Ok(Arrival::Event(event));
            }
            let now = self.now_nanos();
            let left = Duration::from_nanos(until.saturating_sub(now));
            match &self.state {
                State::Running(_) => match self.step(left) {
                    Ok(Some(Picture { image, captured_at })) => {
                        // Damage is reported with the next good frame, because the person may be
                        // able to act on it.
                        if self.counts().1 != self.told.1 {
                            self.tell_counts();
                        }
                        // The gap in the numbers counts the lost frames.
                        let id = FrameId(self.counts().0 + self.next_id);
                        self.next_id += 1;
                        let kind = FrameKind::Video;
                        let name = String::new();
                        return Ok(Arrival::Frame(Arc::new(Frame {
                            id,
                            captured_at,
                            kind,
                            name,
                            image,
                        })));
                    }
                    Ok(None) => {}
                    Err(loss) => self.lose(loss),
                },
                State::Lost { next_look_nanos, .. } if now >= *next_look_nanos => {
                    self.look_for_it();
                }
                State::Lost { next_look_nanos, .. } => {
                    let pause = left.min(Duration::from_nanos(next_look_nanos - now));
                    self.kernel.pause(pause.max(Duration::from_millis(1)));
                }
            }
            if self.events.is_empty() && self.now_nanos() >= until {
                return Ok(Arrival::NothingYet);
            }
        }
    }
}

impl<K: Kernel> Drop for LiveCamera<K> {
    fn drop(&mut self) {
        if let State::Running(running) = &mut self.state {
            self.keeper.restore(&mut self.kernel, running.stream.device);
            running.stream.end(&mut self.kernel);
        }
    }
}
