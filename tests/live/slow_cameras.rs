//! Slow cameras and clocks with errors: pictures come with right times, and nothing intact is
//! called broken.

use std::time::Duration;

use boresight::{
    capture::FrameSource,
    device::{CameraEvent, Fault},
    session::{CameraState, Stream},
    simulation::kernel::{SimCamera, SimKernel},
    text,
};

use crate::cameras::{
    EXPOSURE_AUTOMATIC, FOCUS, FOCUS_AUTOMATIC, Run, SIZE, grey, jpeg, motion_jpeg, open, run,
};

fn changed(mut camera: SimCamera, change: impl FnOnce(&mut SimCamera)) -> SimKernel {
    change(&mut camera);
    SimKernel::new(vec![camera])
}

/// Runs a camera to `secs`; returns the time to end, with a check of the kernel's rules.
fn run_to(kernel: &SimKernel, secs: f64) -> (Run, Duration) {
    let mut source = open(kernel, "/dev/video0").expect("opens");
    let done = run(&mut source, kernel, secs);
    let before = kernel.world().now_nanos;
    drop(source);
    let ending = Duration::from_nanos(kernel.world().now_nanos - before);
    assert_eq!(kernel.world().violations, Vec::<String>::new());
    (done, ending)
}

#[test]
fn slow_controls_stop_no_pictures() {
    for (control_ms, secs, least_share) in
        [(20, 60.0, 0.7), (60, 60.0, 0.5), (250, 90.0, 0.4), (1000, 180.0, 0.3), (5000, 600.0, 0.1)]
    {
        let kernel = changed(grey(0), |c| c.control_nanos = control_ms * 1_000_000);
        let (run, ending) = run_to(&kernel, secs);
        assert_eq!(run.lost(), [], "{control_ms} ms");
        assert_eq!(run.doubts(), [], "{control_ms} ms");
        let share = run.takeable as f64 / (30.0 * secs);
        // A control has at most three transfers, and Ctrl-C waits for one control.
        assert!(run.longest <= Duration::from_millis(4 * control_ms + 200), "{:?}", run.longest);
        let transfers = ending.as_secs_f64() * 1e3 / control_ms as f64;
        println!("{control_ms} ms: {share:.2} of the pictures, {transfers:.0} transfers to end");
        assert!(share > least_share, "{control_ms} ms: {share}");
        assert!(transfers < 3.5, "only what was changed is put back: {transfers}");
        let world = kernel.world();
        assert_eq!(world.cameras[0].controls[&FOCUS_AUTOMATIC].value, 1, "{control_ms} ms");
        assert_eq!(world.cameras[0].controls[&EXPOSURE_AUTOMATIC].value, 3, "{control_ms} ms");
    }
}

#[test]
fn slow_controls_hide_no_change_of_the_lens() {
    let kernel = changed(grey(0), |c| c.control_nanos = 250_000_000);
    kernel.at(40.0, |world| {
        let focus = world.cameras[0].controls.get_mut(&FOCUS).expect("there");
        (focus.value, focus.obeys) = (77, false);
    });
    let (run, _) = run_to(&kernel, 80.0);
    let change = run.events.iter().find_map(|event| match event {
        CameraEvent::ControlChanged(change) => Some(*change),
        _ => None,
    });
    let change = change.expect("told");
    assert_eq!((change.from, change.to), (30, 77));
    assert!(change.good_until.nanos <= 40_000_000_000, "{:?}", change.good_until);
}

#[test]
fn a_busy_program_blames_no_camera() {
    let kernel = SimKernel::new(vec![grey(0)]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 5.0);
    // The asking thread had to wait, as for a slow disk.
    for _ in 0..5 {
        kernel.at(0.0, |world| world.now_nanos += 1);
        let waited = kernel.world().now_nanos + 4_000_000_000;
        boresight::capture::v4l2::kernel::Kernel::pause(
            &mut kernel.clone(),
            Duration::from_secs(4),
        );
        let after = run(&mut source, &kernel, waited as f64 / 1e9 + 1.0);
        assert_eq!(after.lost(), []);
        assert!(after.takeable > 10);
    }
}

#[test]
fn a_dark_room_slows_a_camera_and_breaks_nothing() {
    // 30 frames per second are promised.
    let kernel = changed(grey(0), |c| c.slowness = 30.0);
    let (run, _) = run_to(&kernel, 120.0);
    assert_eq!(run.lost(), []);
    assert_eq!(run.doubts(), [Fault::Slow]);
    assert!(run.takeable > 70, "{}", run.takeable);
}

#[test]
fn a_clock_that_jumps_back_is_not_believed() {
    let saw_tooth = grey(0).with_fault(|number, frame| {
        frame.nanos = frame.nanos.saturating_sub(number % 25 * 80_000_000);
    });
    let (run, _) = run_to(&SimKernel::new(vec![saw_tooth]), 20.0);
    let times: Vec<u64> = run.frames.iter().map(|(_, time, _)| time.nanos).collect();
    assert!(times.len() > 300, "{}", times.len());
    for pair in times[30..].windows(2) {
        let gap_ms = (pair[1] - pair[0]) as f64 / 1e6;
        assert!((20.0..200.0).contains(&gap_ms), "{gap_ms} ms");
    }
    // A fast clock is invalid, too: pictures aren't from the future.
    let ahead = grey(0).with_fault(|number, frame| frame.nanos += number % 3 * 1_000_000_000);
    let kernel = SimKernel::new(vec![ahead]);
    let (run, _) = run_to(&kernel, 20.0);
    let gaps = run.frames[30..].windows(2).map(|pair| pair[1].1.nanos - pair[0].1.nanos);
    assert!(gaps.clone().all(|gap| gap > 20_000_000), "{:?}", gaps.min());
}

#[test]
fn autofocus_that_cannot_be_locked_is_told_each_time_it_moves() {
    let kernel = changed(grey(0), |c| {
        c.controls.get_mut(&FOCUS_AUTOMATIC).expect("there").obeys = false;
    });
    for (secs, value) in [(8.0, 60), (12.0, 90)] {
        kernel.at(secs, move |world| {
            world.cameras[0].controls.get_mut(&FOCUS).expect("there").value = value;
        });
    }
    let (run, _) = run_to(&kernel, 16.0);
    let told: Vec<&str> = run
        .events
        .iter()
        .filter_map(|event| match event {
            CameraEvent::Doubtful { fault: Fault::GeometryMoved, detail } => Some(detail.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].contains("30") && told[0].contains("60"), "{told:?}");
    assert!(told[1].contains("60") && told[1].contains("90"), "{told:?}");
}

#[test]
fn a_crash_leaves_no_camera_locked_once_the_session_goes_on() {
    for exact in [true, false] {
        let kernel = SimKernel::new(vec![grey(0)]);
        let mut crashed = open(&kernel, "/dev/video0").expect("opens");
        run(&mut crashed, &kernel, 5.0);
        let mut before = crashed.camera_facts().expect("a camera").controls;
        // As after SIGKILL: the system closes the node, and nothing is restored.
        std::mem::forget(crashed);
        let automatics = || {
            let world = kernel.world();
            [FOCUS_AUTOMATIC, EXPOSURE_AUTOMATIC].map(|id| world.cameras[0].controls[&id].value)
        };
        assert_eq!(automatics(), [0, 1], "locked");
        if !exact {
            before.iter_mut().for_each(|control| control.exact.clear());
        }
        let mut resumed = open(&kernel, "/dev/video0").expect("opens");
        resumed.put_back_at_end(&before);
        run(&mut resumed, &kernel, 12.0);
        assert_eq!(automatics(), [0, 1], "locked");
        drop(resumed);
        assert_eq!(automatics(), [1, 3], "exact: {exact}");
    }
}

#[test]
fn pictures_of_another_size_blame_no_cable() {
    let smaller = motion_jpeg(0).with_fault(|number, frame| {
        if (120..330).contains(&number) {
            frame.bytes = jpeg(number, (SIZE.0 / 2, SIZE.1 / 2));
            frame.bytes_used = frame.bytes.len() as u32;
        }
    });
    let (run, _) = run_to(&SimKernel::new(vec![smaller]), 30.0);
    assert!(run.lost().iter().all(|fault| *fault == Fault::OtherMode), "{:?}", run.lost());
    assert!(!run.lost().is_empty() && run.returned());
    assert_eq!(run.doubts(), []);
}

#[test]
fn a_camera_that_returns_with_another_mode_is_waited_for() {
    let kernel = SimKernel::new(vec![grey(0)]);
    let mut source = open(&kernel, "/dev/video0").expect("opens");
    run(&mut source, &kernel, 5.0);
    {
        let mut world = kernel.world();
        let camera = &mut world.cameras[0];
        camera.grants = Box::new(|wanted| boresight::capture::v4l2::kernel::Format {
            width: wanted.width / 2,
            ..wanted
        });
        camera.present = false;
    }
    run(&mut source, &kernel, 6.0);
    kernel.world().cameras[0].present = true;
    let back = run(&mut source, &kernel, 10.0);
    assert!(back.lost().contains(&Fault::OtherMode) && !back.returned(), "{:?}", back.events);
    let stream = Stream::Lost { fault: Fault::OtherMode, detail: String::new() };
    let camera = CameraState { stream, ..CameraState::default() };
    let (_, action) = text::camera::obstacle(&camera).expect("told");
    assert!(action.contains("until the camera grants it"), "{action}");
}
