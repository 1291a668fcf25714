//! Events of a live camera reach the session as inputs: nothing is taken from a faulty camera, and
//! the recording holds every event.

use boresight_geometry::{
    device::{CameraEvent, Control, ControlChange, Fault, Lock, Locks, Mode, PixelLayout},
    frame::CaptureTime,
};
use boresight_guide::{
    guidance::{Advice, Refusal},
    session::{Input, Outcome, Session, Stream},
};
use boresight_present::{browser::Live, text};
use boresight_run::{
    config::Config,
    recording::{Header, Replayed, SessionFolder, replay},
};
use boresight_testkit::world::{SIZE, World, guided, setup};
use tempfile::TempDir;

const MODE: Mode = Mode { size: SIZE, layout: PixelLayout::Mjpeg, interval_secs: Some((1, 30)) };

const START: CaptureTime = CaptureTime { nanos: 0 };

fn lost(fault: Fault) -> CameraEvent {
    CameraEvent::Lost { fault, detail: "usb 1-2: disconnect".into() }
}

fn moved(control: Control, good_until: CaptureTime) -> CameraEvent {
    CameraEvent::ControlChanged(ControlChange { control, from: 30, to: 45, good_until })
}

fn inputs() -> Vec<Input> {
    let mut inputs = Vec::new();
    guided(3, |input, _| inputs.push(input.clone()));
    inputs
}

fn new_session() -> Session {
    Session::new(setup(World::new(3).board))
}

/// Number of views after `inputs` following `events`.
fn views_after(events: &[CameraEvent], inputs: &[Input]) -> usize {
    let mut session = new_session();
    for event in events {
        session.handle(&Input::Camera(event.clone()));
    }
    for input in inputs {
        session.handle(input);
    }
    session.accepted().len()
}

#[test]
fn nothing_is_taken_while_the_camera_is_not_as_it_should_be() {
    let inputs = inputs();
    let all = views_after(&[], &inputs);
    let started = CameraEvent::Started { mode: MODE };
    let doubtful = |fault| CameraEvent::Doubtful { fault, detail: String::new() };
    let check = |events: &[CameraEvent], wanted| {
        assert_eq!(views_after(events, &inputs), wanted, "{events:?}");
    };
    check(std::slice::from_ref(&started), all);
    check(&[started.clone(), lost(Fault::Unplugged)], 0);
    check(
        &[
            started.clone(),
            lost(Fault::Unplugged),
            CameraEvent::Returned { mode: MODE, good_from: START },
        ],
        all,
    );
    let later = CaptureTime { nanos: u64::MAX };
    let returned = CameraEvent::Returned { mode: MODE, good_from: later };
    check(&[started.clone(), lost(Fault::Unplugged), returned], 0);
    check(&[started.clone(), moved(Control::Focus, START)], 0);
    check(&[started.clone(), moved(Control::Zoom, START)], 0);
    check(&[started.clone(), moved(Control::Exposure, START)], all);
    let restored = CameraEvent::ControlRestored { control: Control::Focus, good_from: START };
    check(&[started.clone(), moved(Control::Focus, START), restored], all);
    check(&[started.clone(), doubtful(Fault::Frozen)], 0);
    check(&[started.clone(), doubtful(Fault::Slow)], all);
    let dispelled = CameraEvent::Dispelled { fault: Fault::Frozen };
    check(&[started, doubtful(Fault::Frozen), dispelled], all);
}

#[test]
fn a_loss_drops_the_hold_and_keeps_the_views() {
    let mut session = new_session();
    session.handle(&Input::Camera(CameraEvent::Started { mode: MODE }));
    let (mut holds, mut taken) = (0, 0);
    for input in inputs() {
        let decision = session.handle(&input);
        let before = session.accepted().len();
        if session.frame_in_hand().is_some() && before > 0 {
            let decision = session.handle(&Input::Camera(lost(Fault::Unplugged)));
            assert_eq!(session.frame_in_hand(), None);
            assert_eq!(decision.advice, Advice::Mend { refusal: Refusal::CameraNotReady });
            assert_eq!(
                session.handle(&input).outcome,
                Outcome::Refused { refusal: Refusal::CameraNotReady }
            );
            session.handle(&Input::Camera(CameraEvent::Returned { mode: MODE, good_from: START }));
            assert_eq!(session.accepted().len(), before, "no view is lost");
            holds += 1;
        }
        taken += usize::from(matches!(decision.outcome, Outcome::Accepted { .. }));
    }
    assert!(holds > 3 && taken >= 1, "{holds} holds, {taken} views");
    assert_eq!(session.camera().losses, holds);
}

#[test]
fn views_that_may_have_another_lens_are_taken_back() {
    let mut session = new_session();
    let mut times = Vec::new();
    for input in inputs() {
        if session.accepted().len() == 3 {
            break;
        }
        let decision = session.handle(&input);
        if let (Outcome::Accepted { .. }, Input::Observed(seen)) = (decision.outcome, &input) {
            times.push(seen.captured_at);
        }
    }
    let before = session.accepted().to_vec();
    // The lens was last seen in its place just after the second view.
    let decision = session.handle(&Input::Camera(moved(Control::Zoom, times[1])));
    assert_eq!(decision.outcome, Outcome::Removed { view: before[2].number });
    let left: Vec<_> = session.accepted().iter().map(|taken| taken.number).collect();
    assert_eq!(left, [before[0].number, before[1].number]);
    let said = text::camera::obstacle(session.camera()).expect("an obstacle");
    assert_eq!(said.0, "Zoom changed (30 to 45). Set it back to continue");
}

#[test]
fn each_trouble_is_told_once_with_what_to_do_about_it() {
    let mut session = new_session();
    let mut told = |event: CameraEvent| {
        let decision = session.handle(&Input::Camera(event));
        text::troubles(&session.snapshot(decision))
    };
    assert_eq!(told(CameraEvent::Started { mode: MODE }), []);
    let doubtful = |fault, detail: &str| CameraEvent::Doubtful { fault, detail: detail.into() };
    told(doubtful(Fault::Dark, ""));
    let both = told(doubtful(Fault::Frozen, "for 3 s"));
    assert_eq!(both.len(), 2, "{both:#?}");
    // Obstacles to taking views come first.
    assert_eq!(both[0].what, text::camera::fault(Fault::Frozen).0);
    assert_eq!(both[0].detail, "for 3 s");
    assert_eq!([both[0].is_doubt, both[1].is_doubt], [false, true]);
    let lost = told(lost(Fault::OtherMode));
    assert_eq!(lost[0].what, text::camera::fault(Fault::OtherMode).0);
    assert!(lost[0].action.contains("until the camera grants it"), "{lost:#?}");
}

#[test]
fn a_doubt_is_no_trouble_on_the_pages_of_a_phone() {
    let mut session = new_session();
    let mut shown = |event: CameraEvent| {
        let decision = session.handle(&Input::Camera(event));
        Live::of(&session.snapshot(decision), "guiding", false)
    };
    shown(CameraEvent::Started { mode: MODE });
    let unwatched = CameraEvent::Doubtful { fault: Fault::Unwatched, detail: String::new() };
    let live = shown(unwatched);
    let (what, action) = text::camera::fault(Fault::Unwatched);
    assert_eq!((live.trouble, live.doubt), (None, Some((what.into(), action.into()))));
    let live = shown(lost(Fault::Unplugged));
    assert!(live.trouble.is_some_and(|(what, _)| what.starts_with("The camera is unplugged")));
    assert!(live.doubt.is_some(), "it stays");
}

#[test]
fn what_the_camera_says_is_recorded_and_replayed_alike() {
    let place = TempDir::new().expect("folder");
    let path = place.path().join("session");
    let config = Config::load(None, &[]).expect("defaults");
    let mut folder =
        SessionFolder::create(&path, &Header::new("test", SIZE, config)).expect("created");
    let mut locks = Locks::default();
    locks.note(Control::Focus, Lock::Locked { value: 30 });
    locks.note(Control::Zoom, Lock::Absent);
    locks.note(Control::Exposure, Lock::Ignored { set: 100, read: 250 });
    locks.note(Control::Gain, Lock::Free);
    let no_rate = Mode { interval_secs: None, layout: PixelLayout::Grey, ..MODE };
    let mut events = vec![CameraEvent::Started { mode: MODE }, CameraEvent::Locked { locks }];
    for fault in Fault::ALL {
        events.push(lost(fault));
        events.push(CameraEvent::Returned { mode: no_rate, good_from: START });
        events.push(CameraEvent::Doubtful { fault, detail: String::new() });
        events.push(CameraEvent::Dispelled { fault });
    }
    for control in Control::ALL {
        events.push(moved(control, CaptureTime { nanos: u64::MAX }));
        events.push(CameraEvent::ControlRestored { control, good_from: START });
    }
    events.push(CameraEvent::Counted { dropped: 7, rejected: 2 });
    let mut session = new_session();
    let mut live = Vec::new();
    // Between any two events the person continues.
    let mut frames = inputs().into_iter();
    for event in &events {
        for input in std::iter::once(Input::Camera(event.clone())).chain(frames.by_ref().take(6)) {
            let decision = session.handle(&input);
            folder.journal_mut().append(&input, &decision, None, false).expect("appended");
            live.push(input);
        }
    }
    let lines = SessionFolder::journal(&path).expect("whole").lines;
    let read: Vec<Input> =
        lines.iter().map(|line| Input::from(line.expect("readable").input)).collect();
    assert!(read == live, "the journal holds what happened");
    let mut again = new_session();
    let replayed = replay(&mut again, &lines, |_, _| ()).expect("readable");
    assert_eq!(replayed, Replayed::default());
    assert_eq!(again.camera(), session.camera());
    assert_eq!((session.camera().dropped, session.camera().rejected), (7, 2));
    assert_eq!(session.camera().stream, Stream::Live);
}

#[test]
fn a_new_run_knows_nothing_of_the_old_camera() {
    let mut session = new_session();
    session.handle(&Input::Camera(lost(Fault::Stalled)));
    assert!(!session.camera().may_take());
    session.handle(&Input::Resumed);
    assert_eq!(session.camera().stream, Stream::NotLive);
    assert!(session.camera().may_take());
}
