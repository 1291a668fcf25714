//! Moments of a session, as seen by a window.

use std::sync::Arc;

use boresight::{
    calibration::{Calibration, Finding, FindingCode, FocusMotion, Severity, Verdict},
    detection::{Miss, Side},
    device::{CameraEvent, Control, ControlChange, Fault, Lock, Locks, Mode, PixelLayout},
    frame::CaptureTime,
    guidance::{Advice, Purpose, Refusal},
    session::{Command, Edge, Input, Outcome, Prompt, Session, Shown, Snapshot},
    text,
};

use crate::world::{SIZE, guided, setup};

/// A moment, and the expected sentence.
pub(crate) struct Moment {
    pub(crate) name: String,
    pub(crate) snapshot: Snapshot,
    pub(crate) sentence: String,
    /// True if a view was taken just now.
    pub(crate) taken: bool,
}

/// Every kind of moment there is.
pub(crate) fn moments() -> Vec<Moment> {
    let mut moments = Vec::new();
    let mut add = |name: &str, snapshot: &Snapshot, sentence: &str| {
        moments.push(Moment {
            name: name.into(),
            snapshot: snapshot.clone(),
            sentence: sentence.into(),
            taken: name == "accepted",
        });
    };
    let story = story();
    add("fresh", &fresh(), "Show the whole board");
    add("searching", &missed(Miss::NoBoard), "Show the whole board");
    let cut =
        Miss::PartialBoard { found: 40, wanted: 54, size: [0; 2], cut_off_by: Some(Side::Left) };
    add("cut off", &missed(cut), "Move right. It's cut off");
    let first = |is: &dyn Fn(&Snapshot) -> bool| {
        story.iter().find(|snapshot| is(snapshot)).expect("a session has this moment")
    };
    let holding =
        first(&|s| matches!(s.decision.advice, Advice::Holding { progress } if progress > 0.4));
    add("holding", holding, "Hold still");
    let accepted = first(&|s| matches!(s.decision.outcome, Outcome::Accepted { .. }));
    add("accepted", accepted, "Got it!");
    let mut approach = accepted.clone();
    let away = approach.target.as_ref().map_or(0.0, |target| target.tilt_azimuth_rad);
    approach.shown = asking(Prompt::TipInstead(Edge::towards(away)));
    add("approach", &approach, &text::prompt(approach.shown.prompt));
    let partner = first(&|s| {
        matches!(s.target.as_ref().map(|t| t.purpose), Some(Purpose::Partner { .. }))
            && matches!(s.decision.advice, Advice::TipTowards { .. } | Advice::Holding { .. })
    });
    let mut partner = partner.clone();
    partner.shown = asking(Prompt::of_advice(&partner.decision.advice, None));
    add("partner wanted", &partner, &text::prompt(partner.shown.prompt));
    let mut near = partner.clone();
    near.shown = asking(Prompt::FollowTheOutline);
    add("match", &near, "Match the outline");
    let beyond = first(&|s| {
        let is_beyond = s.target.as_ref().is_some_and(|target| target.leaves_picture);
        is_beyond && matches!(s.decision.outcome, Outcome::Refused { .. }) && s.live.is_some()
    });
    let mut beyond = beyond.clone();
    beyond.shown = asking(Prompt::ShowWholeFirst);
    add("beyond the edge", &beyond, "Start with the whole board");
    let done = story.last().expect("a session has an end");
    add("done good", done, "Finished!");
    add("done care", &judged(done, Verdict::Care, Severity::Care), "Finished!");
    add("done untrustworthy", &judged(done, Verdict::Untrustworthy, Severity::Bad), "Finished!");
    let middle = first(&|s| s.views.len() == 2 && s.live.is_some());
    for refusal in refusals() {
        let mut snapshot = middle.clone();
        snapshot.decision.outcome = Outcome::Refused { refusal };
        snapshot.decision.advice = Advice::Mend { refusal };
        snapshot.shown = asking(Prompt::of_advice(&snapshot.decision.advice, None));
        let words = text::prompt(snapshot.shown.prompt);
        add(&format!("refused: {refusal:?}"), &snapshot, &words);
    }
    let detail = "VIDIOC_DQBUF: no such device (19)".into();
    let lost = CameraEvent::Lost { fault: Fault::Unplugged, detail };
    add("camera lost", &after(vec![started(), lost]), "Camera lost. Reconnecting…");
    let change = ControlChange {
        control: Control::Focus,
        from: 30,
        to: 45,
        good_until: CaptureTime { nanos: 0 },
    };
    add(
        "focus moved",
        &after(vec![started(), locked(), CameraEvent::ControlChanged(change)]),
        "Focus changed. Set it back",
    );
    let set = CameraEvent::ControlSet {
        control: Control::Focus,
        lock: Lock::Locked { value: 45 },
        good_from: CaptureTime { nanos: 0 },
    };
    add("focus set by hand", &with_views(&set), "Focus changed. Set it back");
    add("camera with controls", &after(vec![started(), locked()]), "Show the whole board");
    let doubt = CameraEvent::Doubtful { fault: Fault::Unwatched, detail: String::new() };
    add("camera in doubt", &after(vec![started(), doubt]), "Show the whole board");
    let mut paused = middle.clone();
    paused.paused = true;
    paused.shown = asking(Prompt::Paused);
    add("paused", &paused, "Paused");
    let mut failed = middle.clone();
    failed.failures = vec![("detector".into(), "out of memory".into())];
    failed.shown = asking(Prompt::Failed);
    add("worker failed", &failed, "The session has stopped");
    moments
}

/// Screen requesting `prompt`.
fn asking(prompt: Prompt) -> Shown {
    Shown { prompt, advice: None }
}

/// The snapshot after every input of a guided session.
pub(crate) fn story() -> Vec<Snapshot> {
    let mut inputs = Vec::new();
    let (world, ..) = guided(3, |input, _| inputs.push(input.clone()));
    let mut session = Session::new(setup(world.board));
    inputs
        .iter()
        .map(|input| {
            let decision = session.handle(input);
            session.snapshot(decision)
        })
        .collect()
}

/// State of a session with views after `event`.
fn with_views(event: &CameraEvent) -> Snapshot {
    let mut session = session();
    for before in [started(), locked()] {
        session.handle(&Input::Camera(before));
    }
    guided(3, |input, _| {
        if session.accepted().is_empty() {
            session.handle(input);
        }
    });
    let decision = session.handle(&Input::Camera(event.clone()));
    session.snapshot(decision)
}

fn session() -> Session {
    let world = crate::world::World::new(1);
    Session::new(setup(world.board))
}

fn fresh() -> Snapshot {
    let mut session = session();
    let decision = session.handle(&Input::Command(Command::Resume));
    session.snapshot(decision)
}

fn missed(miss: Miss) -> Snapshot {
    let mut session = session();
    let observation = boresight::session::Observation {
        frame_id: boresight::frame::FrameId(1),
        captured_at: CaptureTime { nanos: 33_000_000 },
        kind: boresight::frame::FrameKind::Video,
        name: String::new(),
        image_size: SIZE,
        seen: Err(miss),
    };
    let decision = session.handle(&Input::Observed(observation));
    session.snapshot(decision)
}

fn after(events: Vec<CameraEvent>) -> Snapshot {
    let mut session = session();
    let mut last = None;
    for event in events {
        last = Some(session.handle(&Input::Camera(event)));
    }
    session.snapshot(last.expect("an event"))
}

fn started() -> CameraEvent {
    let mode = Mode { size: SIZE, layout: PixelLayout::Mjpeg, interval_secs: Some((1, 30)) };
    CameraEvent::Started { mode }
}

fn locked() -> CameraEvent {
    let locks = Locks {
        focus: Lock::Locked { value: 30 },
        exposure: Lock::Locked { value: 156 },
        ..Locks::default()
    };
    CameraEvent::Locked { locks }
}

fn judged(done: &Snapshot, verdict: Verdict, severity: Severity) -> Snapshot {
    let calibration: &Calibration = done.calibration.as_ref().expect("calibrated");
    let motion = FocusMotion::Scattered;
    let moved =
        FindingCode::FocusMoved { sigmas: 9.0, relative_sd: 0.031, motion, in_scene: false };
    let findings = vec![Finding { code: moved, severity }];
    let calibration = Calibration { findings, verdict, ..calibration.clone() };
    Snapshot { calibration: Some(Arc::new(calibration)), ..done.clone() }
}

/// A refusal of every kind.
fn refusals() -> Vec<Refusal> {
    vec![
        Refusal::NoLine,
        Refusal::OutsideLens { outside: 7, of: 54 },
        Refusal::TooFlat { tilt_rad: 0.4, wanted_rad: 0.52 },
        Refusal::Unclear { sigma_rad: 0.05, wanted_rad: 0.035 },
        Refusal::AlreadyCovered { nearest_rad: 0.1, wanted_rad: 0.35 },
        Refusal::TellsLittle { worth: 0.05, wanted: 0.4 },
        Refusal::Inconsistent { sigmas: 5.1, wanted: 3.5 },
        Refusal::Moving { speed_px_per_s: Some(120.0), wanted_px_per_s: 38.0 },
        Refusal::OtherSize { size_px: (640, 480), wanted_px: (1280, 720) },
        Refusal::NotCollecting,
    ]
}
