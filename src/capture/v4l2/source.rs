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
//! Frames are delivered only when steady: before, exposure and focus may still move.

mod setting;

use std::{collections::VecDeque, sync::Arc, time::Duration};

use super::{
    controls::{Keeper, Standing, standings},
    discovery::{Camera, Found, Identity, discover_those},
    kernel::{Errno, Kernel},
    stream::{Loss, Picture, Stream},
};
use crate::{
    capture::{
        Arrival, CaptureError, FrameSource, Offer, SourceIdentity, choose,
        health::{light, sharpness},
        layout,
    },
    device::{
        Adjustable, CameraEvent, CameraFacts, Control, ControlBefore, ControlChange, Fault, Lock,
        Locks, Mode, Wanted,
    },
    frame::{CaptureTime, Frame, FrameId, FrameKind},
};

/// Frames and time until exposure and focus count as settled.
const LEAST_SETTLING: u32 = 10;
const MOST_SETTLING: u32 = 60;
const MOST_SETTLING_NANOS: u64 = 3_000_000_000;
/// Largest change of brightness between the last frames of a settled picture, as a share.
const SETTLED_CHANGE: f64 = 0.02;
const SETTLED_FRAMES: usize = 5;
/// A camera takes this long to obey.
const LOCKING_NANOS: u64 = 500_000_000;
/// How often controls are read back.
const READ_BACK_NANOS: u64 = 1_000_000_000;
/// A picture that loses so much of its sharpness while focus is locked was moved by it.
const SHARPNESS_KEPT: f64 = 0.4;
/// Pauses between looks for a lost camera.
const SHORTEST_PAUSE_NANOS: u64 = 200_000_000;
const LONGEST_PAUSE_NANOS: u64 = 1_500_000_000;

/// A live camera.
pub struct LiveCamera<K: Kernel> {
    kernel: K,
    camera: Camera,
    identity: Identity,
    offer: Offer,
    mode: Mode,
    keeper: Keeper,
    controls_before: Vec<ControlBefore>,
    locks: Option<Locks>,
    state: State,
    events: VecDeque<CameraEvent>,
    next_id: u64,
    /// Counts of the streams before this one.
    dropped_before: u64,
    rejected_before: u64,
    told: (u64, u64),
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
}

#[derive(Debug)]
enum Phase {
    Settling {
        means: VecDeque<f64>,
        count: u32,
        until_nanos: u64,
    },
    Locking {
        done_nanos: u64,
        sharp_before: f64,
        sharp_now: f64,
    },
    /// The person set controls; the picture settles.
    Setting {
        controls: Vec<Control>,
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
    /// Opens `camera` in the best mode of those `wanted`, and starts it.
    ///
    /// # Errors
    ///
    /// [`CaptureError::Camera`] if it cannot be opened or started.
    pub fn open(mut kernel: K, camera: Camera, wanted: &Wanted) -> Result<Self, CaptureError> {
        let failed = |(fault, detail): Loss| CaptureError::Camera { fault, detail };
        let offer = choose(&camera.offers, wanted)
            .ok_or_else(|| failed((Fault::NoFormat, camera.stable_name())))?;
        let stream = Stream::start(&mut kernel, &camera, &offer).map_err(failed)?;
        let keeper = Keeper::remember(&mut kernel, stream.device);
        let controls_before = standings(&mut kernel, stream.device)
            .into_iter()
            .map(|Standing { control, value, automatic, .. }| ControlBefore {
                control,
                value,
                automatic,
            })
            .collect();
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
        let phase = settling(&mut kernel);
        let state = State::Running(Box::new(Running { stream, phase, returning: false }));
        Ok(Self {
            identity: camera.identity(),
            kernel,
            camera,
            offer,
            mode,
            keeper,
            controls_before,
            locks: None,
            state,
            events,
            next_id: 0,
            dropped_before: 0,
            rejected_before: 0,
            told: (0, 0),
        })
    }

    /// The camera as it was found.
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

    /// One look at the stream.
    fn step(&mut self, patience: Duration) -> Result<Option<Picture>, Loss> {
        let State::Running(running) = &mut self.state else { return Ok(None) };
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let picture = running.stream.next(kernel, patience)?;
        let changes = running.stream.health.changes();
        self.events.extend(changes.into_iter().map(|(fault, detail)| match detail {
            Some(detail) => CameraEvent::Doubtful { fault, detail },
            None => CameraEvent::Dispelled { fault },
        }));
        // The picture on which a control counts as settled was taken before that was known.
        let was_setting = matches!(running.phase, Phase::Setting { .. });
        let now = self.kernel.clock().monotonic_nanos;
        self.go_on(picture.as_ref(), now).map_err(|errno| (Fault::Unplugged, errno.words()))?;
        let steady =
            matches!(&self.state, State::Running(r) if matches!(r.phase, Phase::Steady { .. }));
        Ok(picture.filter(|_| steady && !was_setting))
    }

    /// Moves on between the phases.
    fn go_on(&mut self, picture: Option<&Picture>, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let device = running.stream.device;
        match &mut running.phase {
            Phase::Settling { means, count, until_nanos } => {
                let Some(picture) = picture else { return Ok(()) };
                *count += 1;
                means.push_back(light(&picture.image).0);
                if means.len() > SETTLED_FRAMES {
                    means.pop_front();
                }
                if settled(means, *count) || now > *until_nanos {
                    let sharp_before = sharpness(&picture.image);
                    self.keeper.lock(kernel, device)?;
                    let done_nanos = now + LOCKING_NANOS;
                    running.phase =
                        Phase::Locking { done_nanos, sharp_before, sharp_now: sharp_before };
                }
            }
            Phase::Locking { done_nanos, sharp_before, sharp_now } => {
                if let Some(picture) = picture {
                    *sharp_now = sharpness(&picture.image);
                }
                if now < *done_nanos || picture.is_none() {
                    return Ok(());
                }
                let blurred = *sharp_now < SHARPNESS_KEPT * *sharp_before;
                let returning = running.returning;
                // Some cameras obey only the second time.
                self.keeper.lock(kernel, device)?;
                self.locked(returning, blurred, now)?;
            }
            Phase::Setting { done_nanos, .. } if now >= *done_nanos && picture.is_some() => {
                self.set(now)?;
            }
            Phase::Steady { next_read_nanos, .. } if now >= *next_read_nanos => {
                self.read_back(now)?;
                self.tell_counts();
            }
            Phase::Setting { .. } | Phase::Steady { .. } => {}
        }
        Ok(())
    }

    /// The controls were set twice: reads how they stand and begins to deliver.
    fn locked(&mut self, returning: bool, blurred: bool, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let device = running.stream.device;
        let read = self.keeper.locks(&mut self.kernel, device)?;
        let good_from = CaptureTime { nanos: now };
        let mut changed = Vec::new();
        if returning {
            self.events.push_back(CameraEvent::Returned { mode: self.mode, good_from });
        }
        match self.locks {
            // A camera that returns must stand as it stood.
            Some(locks) if returning => {
                for deviation in self.keeper.deviations(&mut self.kernel, device, &locks)? {
                    changed.push((deviation.control, deviation.to));
                    self.events.push_back(CameraEvent::ControlChanged(ControlChange {
                        control: deviation.control,
                        from: deviation.from,
                        to: deviation.to,
                        good_until: good_from,
                    }));
                }
            }
            _ => {
                self.locks = Some(read);
                self.events.push_back(CameraEvent::Locked { locks: read });
                let ignored =
                    Control::ALL.iter().any(|c| matches!(read.of(*c), Lock::Ignored { .. }));
                if ignored || blurred {
                    let detail = if blurred { "the picture lost its sharpness" } else { "" };
                    self.events.push_back(CameraEvent::Doubtful {
                        fault: Fault::ControlIgnored,
                        detail: detail.into(),
                    });
                }
            }
        }
        if let State::Running(running) = &mut self.state {
            running.returning = false;
            running.phase = Phase::Steady {
                next_read_nanos: now + READ_BACK_NANOS,
                good_until: good_from,
                changed,
            };
        }
        Ok(())
    }

    /// Reads the controls back, says what changed, and puts it right.
    fn read_back(&mut self, now: u64) -> Result<(), Errno> {
        let State::Running(running) = &mut self.state else { return Ok(()) };
        let (Phase::Steady { next_read_nanos, good_until, changed }, Some(locks)) =
            (&mut running.phase, self.locks)
        else {
            return Ok(());
        };
        let device = running.stream.device;
        *next_read_nanos = now + READ_BACK_NANOS;
        let kernel: &mut dyn Kernel = &mut self.kernel;
        let deviations = self.keeper.deviations(kernel, device, &locks)?;
        let time = CaptureTime { nanos: now };
        changed.retain(|(control, _)| {
            let still = deviations.iter().any(|deviation| deviation.control == *control);
            if !still {
                let control = *control;
                self.events.push_back(CameraEvent::ControlRestored { control, good_from: time });
            }
            still
        });
        if deviations.is_empty() {
            *good_until = time;
            return Ok(());
        }
        for deviation in &deviations {
            let (control, from, to) = (deviation.control, deviation.from, deviation.to);
            let known = changed.iter_mut().find(|(known, _)| *known == control);
            if known.as_ref().is_some_and(|(_, value)| *value == to) {
                continue;
            }
            match known {
                Some((_, value)) => *value = to,
                None => changed.push((control, to)),
            }
            let good_until = *good_until;
            let change = ControlChange { control, from, to, good_until };
            self.events.push_back(CameraEvent::ControlChanged(change));
        }
        self.keeper.lock(kernel, device)?;
        // A lens takes its time; then it is read again.
        *next_read_nanos = now + LOCKING_NANOS;
        Ok(())
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

    fn lose(&mut self, loss: Loss) {
        let now = self.now_nanos();
        (self.dropped_before, self.rejected_before) = self.counts();
        if let State::Running(running) = &mut self.state {
            // What was asked for and not granted is not held on to: it returns as it was known.
            if let Phase::Setting { controls, .. } = &running.phase {
                for control in controls {
                    let known = self.locks.and_then(|locks| locks.of(*control).value());
                    known.into_iter().for_each(|value| self.keeper.want(*control, value));
                }
            }
            running.stream.end(&mut self.kernel);
        }
        let (fault, detail) = loss.clone();
        self.events.push_back(CameraEvent::Lost { fault, detail });
        self.state = State::Lost { loss, next_look_nanos: now, pause_nanos: SHORTEST_PAUSE_NANOS };
        self.tell_counts();
    }

    /// Looks for the lost camera and starts it.
    fn look_for_it(&mut self) {
        match self.come_back() {
            Ok(stream) => {
                self.keeper = self.keeper.again_for(&mut self.kernel, stream.device);
                let now = self.now_nanos();
                let phase = if self.locks.is_some() {
                    // What it forgot is set at once.
                    self.keeper.lock(&mut self.kernel, stream.device).ok();
                    let done_nanos = now + LOCKING_NANOS;
                    Phase::Locking { done_nanos, sharp_before: 0.0, sharp_now: 0.0 }
                } else {
                    settling(&mut self.kernel)
                };
                self.state = State::Running(Box::new(Running { stream, phase, returning: true }));
            }
            Err(now_lost) => {
                let now = self.now_nanos();
                let State::Lost { loss, next_look_nanos, pause_nanos } = &mut self.state else {
                    return;
                };
                *next_look_nanos = now + *pause_nanos;
                // Starting a camera again and again wears out weak ones; looking for it costs nothing.
                if now_lost.0 != Fault::NotFound {
                    *pause_nanos = (2 * *pause_nanos).min(LONGEST_PAUSE_NANOS);
                }
                let still_away = now_lost.0 == Fault::NotFound;
                if !still_away && now_lost != *loss {
                    loss.clone_from(&now_lost);
                    let (fault, detail) = now_lost;
                    self.events.push_back(CameraEvent::Lost { fault, detail });
                }
            }
        }
    }

    fn come_back(&mut self) -> Result<Stream, Loss> {
        let camera = found_again(&mut self.kernel, &self.identity)?;
        let mut stream = Stream::start(&mut self.kernel, &camera, &self.offer)?;
        let mode = stream.granted.mode;
        if (mode.size, mode.layout) != (self.mode.size, self.mode.layout) {
            stream.end(&mut self.kernel);
            let detail = other_than_asked(&self.offer, &mode).unwrap_or_default();
            return Err((Fault::OtherMode, detail));
        }
        self.camera = camera;
        Ok(stream)
    }
}

/// The camera of that identity, if it is there.
pub(in crate::capture) fn found_again(
    kernel: &mut dyn Kernel,
    identity: &Identity,
) -> Result<Camera, Loss> {
    let found = discover_those(kernel, |node| identity.may_be(node));
    same(&found, identity)
}

/// The camera of that identity among those that are there.
fn same(found: &Found, identity: &Identity) -> Result<Camera, Loss> {
    let mut fitting: Vec<_> =
        found.cameras.iter().filter_map(|c| identity.fit(c).map(|fit| (fit, c))).collect();
    fitting.sort_by_key(|(fit, _)| std::cmp::Reverse(*fit));
    match fitting.as_slice() {
        [(_, one)] => Ok((*one).clone()),
        [(best, one), (next, _), ..] if best > next => Ok((*one).clone()),
        [(_, one), ..] => Err((Fault::Twin, one.stable_name())),
        [] => {
            let other = found.cameras.iter().find(|camera| identity.is_place_of(camera));
            match (other, found.others.first()) {
                (Some(other), _) => {
                    Err((Fault::OtherCamera, format!("{}, {}", other.name, other.stable_name())))
                }
                // The node is there again, but may not be opened yet, or is another program's.
                (None, Some(other)) if matches!(other.why, Fault::Busy | Fault::NotPermitted) => {
                    Err((other.why, other.detail.clone()))
                }
                (None, _) => Err((Fault::NotFound, String::new())),
            }
        }
    }
}

/// In what the granted mode is another than the one asked for.
fn other_than_asked(offer: &Offer, mode: &Mode) -> Option<String> {
    let asked =
        Mode { size: offer.size, layout: layout(offer.fourcc)?, interval_secs: offer.interval };
    let rates = asked.rate_hz().zip(mode.rate_hz());
    let other_rate = rates.is_some_and(|(a, b)| (a - b).abs() > 0.02 * a);
    let named = |mode: &Mode| {
        let rate = mode.rate_hz().map_or(String::new(), |hz| format!(" at {hz:.0} fps"));
        format!("{}x{} {}{rate}", mode.size.width_px, mode.size.height_px, mode.layout.name())
    };
    ((asked.size, asked.layout) != (mode.size, mode.layout) || other_rate)
        .then(|| format!("asked for {}, granted {}", named(&asked), named(mode)))
}

fn settling(kernel: &mut dyn Kernel) -> Phase {
    let until_nanos = kernel.clock().monotonic_nanos + MOST_SETTLING_NANOS;
    Phase::Settling { means: VecDeque::new(), count: 0, until_nanos }
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

    fn camera_facts(&self) -> Option<CameraFacts> {
        Some(self.camera.facts("v4l", self.mode, self.controls_before.clone()))
    }

    fn adjustables(&mut self) -> Vec<Adjustable> {
        self.what_can_be_set()
    }

    fn adjust(&mut self, control: Control, value: i64) {
        if let Err(errno) = self.ask_for(control, value) {
            self.lose((Fault::Unplugged, errno.words()));
        }
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
                        // Damage is told with the next good frame, for the person may do something about it.
                        if self.counts().1 != self.told.1 {
                            self.tell_counts();
                        }
                        // A gap in the numbers is what was lost.
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
