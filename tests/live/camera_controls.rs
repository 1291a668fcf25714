//! Controls set by a person while pictures come: the camera obeys, nothing is delivered until it
//! has settled, the session keeps to one lens, and the recording holds it.

use boresight::{
    capture::FrameSource,
    device::{Adjustable, CameraEvent, Control, Lock, Locks, Mode, PixelLayout},
    frame::CaptureTime,
    session::{Input, Session},
    text,
};

use boresight::simulation::kernel::SimKernel;

use crate::cameras::{EXPOSURE, EXPOSURE_AUTOMATIC, FOCUS, grey, open, preview, run};
use crate::world::{SIZE, World, guided, setup};

fn kernel() -> SimKernel {
    SimKernel::new(vec![grey(0)])
}

fn set(run: &crate::cameras::Run) -> Vec<(Control, Lock, CaptureTime)> {
    let set = |event: &CameraEvent| match event {
        CameraEvent::ControlSet { control, lock, good_from } => Some((*control, *lock, *good_from)),
        _ => None,
    };
    run.events.iter().filter_map(set).collect()
}

#[test]
fn a_camera_lists_what_can_be_set() {
    let kernel = kernel();
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    let all = source.adjustables();
    let exposure = Adjustable { control: Control::Exposure, min: 0, max: 255, step: 1 };
    assert!(all.contains(&exposure), "{all:?}");
    assert!(all.iter().any(|adjustable| adjustable.control == Control::Focus));
    assert!(all.iter().all(|adjustable| adjustable.control != Control::Gain), "it has none");
}

#[test]
fn what_is_set_is_read_back_and_nothing_comes_until_it_has_settled() {
    let kernel = kernel();
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    let before = run(&mut source, &kernel, 5.0);
    assert!(before.frames.len() > 50, "{}", before.frames.len());
    let asked_nanos = kernel.world().now_nanos;
    source.adjust(Control::Exposure, 80);
    source.adjust(Control::Focus, 999);
    let after = run(&mut source, &kernel, 8.0);
    let set = set(&after);
    let [(first, exposure, good_from), (second, focus, _)] = set.as_slice() else {
        unreachable!("{set:?}")
    };
    assert_eq!((*first, *exposure), (Control::Exposure, Lock::Locked { value: 80 }));
    assert_eq!((*second, *focus), (Control::Focus, Lock::Locked { value: 255 }), "the most it can");
    let world = kernel.world();
    assert_eq!(world.cameras[0].controls[&EXPOSURE].value, 80);
    assert_eq!(world.cameras[0].controls[&EXPOSURE_AUTOMATIC].value, 1, "manual");
    assert_eq!(world.cameras[0].controls[&FOCUS].value, 255);
    drop(world);
    let unsettled = |time: CaptureTime| time.nanos > asked_nanos && time < *good_from;
    assert!(after.frames.iter().all(|(_, time, _)| !unsettled(*time)));
    assert!(after.frames.len() > 30, "it goes on");
    let changed = |event: &CameraEvent| matches!(event, CameraEvent::ControlChanged(_));
    assert!(!after.events.iter().any(changed), "what was asked for is no deviation");
}

#[test]
fn a_camera_that_makes_something_else_of_it_is_taken_at_its_word() {
    let mut camera = grey(0);
    camera.controls.get_mut(&EXPOSURE).expect("there").obeys = false;
    let kernel = SimKernel::new(vec![camera]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 5.0);
    source.adjust(Control::Exposure, 80);
    let after = run(&mut source, &kernel, 8.0);
    let is = set(&after).into_iter().map(|(control, lock, _)| (control, lock)).collect::<Vec<_>>();
    assert_eq!(is, [(Control::Exposure, Lock::Locked { value: 156 })]);
}

#[test]
fn an_unplugged_camera_is_not_asked() {
    let kernel = kernel();
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 5.0);
    kernel.world().cameras[0].present = false;
    run(&mut source, &kernel, 6.0);
    source.adjust(Control::Exposure, 80);
    assert_eq!(set(&run(&mut source, &kernel, 8.0)), []);
}

#[test]
fn a_camera_that_is_lost_before_it_has_settled_returns_as_it_was() {
    let kernel = kernel();
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 5.0);
    source.adjust(Control::Focus, 99);
    kernel.world().cameras[0].present = false;
    run(&mut source, &kernel, 6.0);
    kernel.world().cameras[0].present = true;
    let after = run(&mut source, &kernel, 12.0);
    assert!(after.returned(), "{:?}", after.events);
    let changed = |event: &CameraEvent| matches!(event, CameraEvent::ControlChanged(_));
    assert!(!after.events.iter().any(changed), "{:?}", after.events);
    assert_eq!(set(&after), []);
    assert_eq!(kernel.world().cameras[0].controls[&FOCUS].value, 30);
    assert!(after.takeable > 30);
}

fn started(session: &mut Session) {
    let mode = Mode { size: SIZE, layout: PixelLayout::Mjpeg, interval_secs: Some((1, 30)) };
    let lock = Lock::Locked { value: 30 };
    let locks = Locks { focus: lock, exposure: lock, ..Locks::default() };
    for event in [CameraEvent::Started { mode }, CameraEvent::Locked { locks }] {
        session.handle(&Input::Camera(event));
    }
}

fn hand(session: &mut Session, control: Control, value: i64) {
    let good_from = CaptureTime { nanos: 0 };
    let lock = Lock::Locked { value };
    session.handle(&Input::Camera(CameraEvent::ControlSet { control, lock, good_from }));
}

#[test]
fn a_session_keeps_to_one_focus() {
    let mut inputs = Vec::new();
    guided(3, |input, _| inputs.push(input.clone()));
    let mut session = Session::new(setup(World::new(3).board));
    started(&mut session);
    // Before the first view it may be anything.
    hand(&mut session, Control::Focus, 60);
    assert!(session.camera().may_take());
    let mut rest = inputs.iter();
    while session.accepted().is_empty() {
        session.handle(rest.next().expect("a view is taken"));
    }
    hand(&mut session, Control::Exposure, 80);
    assert!(session.camera().may_take(), "exposure does not move the lens");
    assert_eq!(session.camera().locks.exposure, Lock::Locked { value: 80 });
    hand(&mut session, Control::Focus, 45);
    assert!(!session.camera().may_take());
    let (what, action) = text::camera::obstacle(session.camera()).expect("told");
    assert_eq!(what, "Focus was set by hand (60 to 45). Capture is paused");
    assert!(action.starts_with("The views were taken at 60. Set it back to 60"), "{action}");
    hand(&mut session, Control::Focus, 50);
    assert!(!session.camera().may_take(), "still another one");
    hand(&mut session, Control::Focus, 60);
    assert!(session.camera().may_take(), "undone");
    assert_eq!(text::camera::obstacle(session.camera()), None);
    for input in rest {
        session.handle(input);
    }
    assert!(session.accepted().len() > 3, "it goes on");
}

#[test]
fn a_preview_sets_no_control() {
    let kernel = kernel();
    let values = || -> Vec<(u32, i64)> {
        let world = kernel.world();
        world.cameras[0].controls.iter().map(|(id, control)| (*id, control.value)).collect()
    };
    let before = values();
    let mut source = preview(&kernel, "/dev/video0").expect("opens");
    // Not even for a moment: looked at ten times a second, through a loss and a return.
    kernel.at(2.0, |world| world.cameras[0].present = false);
    kernel.at(2.5, |world| world.cameras[0].present = true);
    let mut frames = 0;
    for tenth in 1..40 {
        frames += run(&mut source, &kernel, 0.1 * f64::from(tenth)).frames.len();
        source.adjust(Control::Focus, 200);
        assert_eq!(values(), before, "after {tenth} tenths of a second");
    }
    assert!(frames > 60, "{frames}");
    // Another program may set anything meanwhile.
    kernel.world().cameras[0].controls.entry(FOCUS).and_modify(|focus| focus.value = 77);
    drop(source);
    assert_eq!(kernel.world().cameras[0].controls[&FOCUS].value, 77);
}
